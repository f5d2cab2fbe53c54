"""Where a solved gearbox leaves what its equations, or its parts, stand for: loads lifted off, overloads, large angles.

Sentences with load, part, value and rule; the numbers themselves are results as they are.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np

from pmor.case import Case
from pmor.machine.coupled import SolvedLoad, SolvedMesh
from pmor.machine.model import ABOUT_AXIS
from pmor.machine.readings import Data
from pmor.pair.limits import PRESSURE_OVER_MODULUS, hertz_pressure

# Share of the mean transmission error that displacements of second order in the tilt of a hub may have.
SECOND_ORDER = 0.01
# Change of the transverse contact ratio by the moved axes: contact points stay where those of the drawing are.
MOVED_PATH = 0.02


def named_bounds(cases: Mapping[str, Case], solved: SolvedLoad, entry: Data) -> list[str]:
    """Return what leaves its bounds under a load; `entry` is that of the load in `gearbox.json`."""
    bearings = [f"bearing {one['name']}: {text}" for one in entry["bearings"] for text in _bearing(one)]
    meshes = [
        f"mesh {one['name']}: {text}"
        for mesh, one in zip(solved.meshes, entry["meshes"], strict=True)
        for text in (*_mesh(mesh, one), *_flank(cases[one["name"]], mesh, one))
    ]
    return [f"load {solved.load.name}, {text}" for text in (*bearings, *meshes)]


def _bearing(entry: Data) -> Iterator[str]:
    if entry.get("loaded_elements") == 0:
        yield "carries nothing: its shaft stands within the clearance"
    safety = entry.get("static_safety")
    if safety is not None and safety < 1.0:
        yield (
            f"overloaded, contact pressure {entry['contact_pressure_max_MPa']:.4g} MPa, static safety {safety:.2g} by "
            "ISO 76, below 1"
        )


def _mesh(mesh: SolvedMesh, entry: Data) -> Iterator[str]:
    pair, carrying = mesh.meshing.pair, entry["carrying_face_percent"]
    if carrying is not None and carrying < 100.0:
        yield f"flanks lift off, {carrying:.3g} % of the face carries"
    relative = mesh.displacement[1] - mesh.displacement[0]
    coast = _coast_gap_um(mesh)
    if coast < 0.0:
        yield f"coast flanks would overlap by {-coast:.3g} um, and their contact is left out: widen the backlash"
    tilt = float(np.abs(mesh.displacement[:, ABOUT_AXIS : ABOUT_AXIS + 2]).max())
    second = 0.5e3 * max(pair.pinion.tip_radius, pair.wheel.tip_radius) * tilt**2
    mean = entry["ste_mean_um"]
    if mean is not None and second > SECOND_ORDER * abs(mean):
        yield (
            f"small angles: a hub tilts by {1e3 * tilt:.3g} mrad, at the tips {second:.2g} um of second order, more "
            f"than {100.0 * SECOND_ORDER:g} % of the mean transmission error"
        )
    change = -float(relative[1]) / math.sin(pair.working_pressure_angle) / pair.pinion.base_pitch
    if abs(change) > MOVED_PATH:
        yield (
            f"the centre distance changes by {1e3 * float(relative[1]):.3g} um and the contact ratio by {change:.2g}, "
            f"more than {MOVED_PATH:g}: the path of contact is that of the drawing"
        )


def _flank(case: Case, mesh: SolvedMesh, entry: Data) -> Iterator[str]:
    pressure, (_, modulus) = entry["flank_pressure_max_MPa"], hertz_pressure(case, mesh.meshing.pair)
    if pressure is not None and pressure > PRESSURE_OVER_MODULUS * modulus:
        yield (
            f"flank pressure {pressure:.4g} MPa is {100.0 * pressure / modulus:.2g} % of the modulus, above "
            f"{100.0 * PRESSURE_OVER_MODULUS:g} %: real flanks yield"
        )


def _coast_gap_um(mesh: SolvedMesh) -> float:
    """Gap of the coast flanks along their line of action at mid width, um, their own deflection left out.

    It opens with the rotation of the pinion, and by the moved hubs as that of the drive flanks does, mirrored.
    """
    pair, angle = mesh.meshing.pair, mesh.meshing.pair.working_pressure_angle
    direction = np.array([math.cos(angle), math.sin(angle), math.tan(pair.base_helix_angle)])
    moved = float(direction @ (mesh.displacement[1, :ABOUT_AXIS] - mesh.displacement[0, :ABOUT_AXIS]))
    return 1e3 * (pair.backlash + moved) + float(np.nanmin(mesh.sweep.ste_um))
