"""Weights of a gearbox: of shafts along their sections, of gears in the middle of their faces.

Planets hang on their carrier. Bodies of carriers are known by the shafts that they stand on alone.
"""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence

import numpy as np

from pmor.body.beam import NODE, Beam
from pmor.case import Case
from pmor.core.arrays import FloatArray
from pmor.gear.inertia import Inertia, disc
from pmor.gear.pair import GearPair
from pmor.machine.mesh_force import MeshFrame
from pmor.machine.set_frame import SetFrame
from pmor.machine.settings import Mesh, Shaft
from pmor.pair.drawn import DrawnGear, drawn_gears
from pmor.pair.model import gear_pair
from pmor.sets.loader import SetFile

# Cubic metres of a cubic millimetre.
M3_OF_MM3 = 1e-9


def shaft_weight(shaft: Shaft, beam: Beam, gravity: Sequence[float]) -> FloatArray:
    """Return the weight of a shaft on the nodes of its beam, shape (6 n,), N and N mm.

    Parameters
    ----------
    gravity : sequence of float, length 3
        Acceleration along the axes of the machine, m/s^2; so below.
    """
    return beam.dead_load(M3_OF_MM3 * shaft.density_kg_m3 * np.asarray(gravity))


def gears_on_shafts(case: Case, pair: GearPair, mesh: Mesh, shafts: Mapping[str, Shaft]) -> tuple[Inertia, Inertia]:
    """Return mass and inertias of pinion and wheel as drawn; what a shaft fills of its gear counts as shaft."""
    pinion, wheel = (
        _outside(drawn, case, 0.5 * shafts[place.shaft].section_at(place.at_mm).outer_mm)
        for place, drawn in zip((mesh.pinion, mesh.wheel), drawn_gears(case, pair), strict=True)
    )
    return pinion, wheel


def _outside(drawn: DrawnGear, case: Case, shaft_mm: float) -> Inertia:
    """Mass and inertias of a gear outside of a radius that its shaft fills."""
    density, inmost = case.dynamics.density_kg_m3, drawn.rings[-1]
    whole, filled = drawn.inertia(density), min(shaft_mm, inmost.outer)
    if filled <= inmost.inner:
        return whole
    middle = 0.5 * (inmost.low + inmost.high)
    return whole + disc(filled, inmost.inner, inmost.high - inmost.low, density, middle).times(-1.0)


def gear_weight(mass_kg: float, face: tuple[float, float], frame: MeshFrame, gravity: Sequence[float]) -> FloatArray:
    """Return the weight of a gear on its hub, in the middle of the common face: shape (6,), N and N mm.

    Parameters
    ----------
    face : (float, float)
        Where the gear begins and ends along z of its pair, mm.
    """
    force, arm = mass_kg * np.asarray(gravity), np.array([frame.along * 0.5 * sum(face), 0.0, 0.0])
    return np.concatenate([force, np.cross(arm, force)])


def set_weights(file: SetFile, frame: SetFrame, sun_shaft_mm: float, gravity: Sequence[float]) -> FloatArray:
    """Return the weights of the gears of a set on the hubs of sun, carrier and ring, in axes of the machine, (3, 6).

    Parameters
    ----------
    sun_shaft_mm : float
        Radius of the shaft of the sun, which fills it; 0 of a sun in the housing.
    """
    along, inertias = frame.turn[:3, :3].T @ np.asarray(gravity), inertias_of_set(file, sun_shaft_mm)
    found = np.zeros((len(inertias), NODE))
    found[:, :3] = np.outer([inertia.mass_kg for inertia in inertias], along)
    return frame.in_machine(found.ravel() @ frame.carried)


def hanging_weights(file: SetFile, on_shafts: Container[str], gravity: Sequence[float]) -> FloatArray:
    """Return the weights of the bodies of a set that no shaft carries, in axes of the machine, (B, 3), N."""
    found = np.zeros((len(file.plan.bodies), 3))
    if any(gravity):
        for number, (body, inertia) in enumerate(zip(file.plan.bodies, inertias_of_set(file, 0.0), strict=True)):
            if body.member not in on_shafts:
                found[number] = inertia.mass_kg * np.asarray(gravity)
    return found


def inertias_of_set(file: SetFile, sun_shaft_mm: float) -> list[Inertia]:
    """Return mass and inertias of all bodies of a set as drawn; what its shaft fills of the sun counts as shaft."""
    bodies, found = file.plan.bodies, dict[int, Inertia]()
    for name, case in file.cases.items():
        gears = drawn_gears(case, gear_pair(case))
        for mesh in (mesh for mesh in file.plan.meshes if mesh.case == name):
            for body, drawn in zip((mesh.pinion, mesh.wheel), gears, strict=True):
                filled = sun_shaft_mm if bodies[body].member == "sun" else 0.0
                found.setdefault(body, _outside(drawn, case, filled))
    return [found[body] for body in range(len(bodies))]
