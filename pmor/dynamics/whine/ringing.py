"""Gears on light blanks that ring, and rings on a bedding: amplitudes of modes, as displacements beside their hubs.

A mode with n nodal diameters turns with its gear; the load stands still. In the fixed frame its amplitudes a and b are

    m (q'' + 2 (n + c) W J q' - (n^2 + 2 n c) W^2 q) + k q,    J = (0, 1; -1, 0), W about z,                       (1)

c of the Coriolis forces, 0 of motion along the axis, so that a mode is met at two frequencies (n + c) W / pi apart.
The stress by rotation is left out, and Coriolis forces between modes and with the hub. What these modes give way at
rest is taken out of the compliance of the mesh (`pmor.line.hub_law`); all further modes stay there, at rest.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pmor.body.blank_modes import BlankModes, blank_modes
from pmor.case import Case, GearCase
from pmor.core.arrays import BoolArray, FloatArray
from pmor.dynamics.whine.cycle import StandingMesh
from pmor.gear.pair import GearPair
from pmor.line.hub_law import mode_coordinates
from pmor.machine.coupled import SolvedLoad
from pmor.machine.model import GearboxModel
from pmor.pair.blank import blank_below
from pmor.pair.model import sector_meshes

# Modal mass, t; t/mm^3 of a kg/m^3.
MODAL_MASS, T_MM3 = 1e-3, 1e-12
# Angles of a pitch over which loads are means.
ANGLES = 16


class RingingMatrices(NamedTuple):
    """Over the amplitudes of all modes: t, N/mm; gyroscopic, and stiffness by speed, at 1 rad/s of the machine."""

    mass: FloatArray
    stiffness: FloatArray
    gyroscopic: FloatArray
    spun: FloatArray


@dataclass(frozen=True)
class RingingGear:
    """A gear that rings: R amplitudes of its modes.

    Parameters
    ----------
    mesh, gear : int
        Number of its mesh; 0 the pinion, 1 the wheel.
    modes : BlankModes
    """

    mesh: int
    gear: int
    modes: BlankModes
    every_coordinate: FloatArray

    @property
    def moving(self) -> BoolArray:
        """Amplitudes that there are, of a and b of all modes: without b of those of no nodal diameter, (2 m,)."""
        return np.asarray((self.modes.diameters[:, None] > np.array([-1, 0])).ravel())

    @property
    def coordinates(self) -> FloatArray:
        """Coordinates of the mesh by the amplitudes, (2, R)."""
        return np.sqrt(MODAL_MASS) * self.every_coordinate.reshape(2, -1)[:, self.moving]

    @property
    def inertia(self) -> FloatArray:
        """Mass shared with motions of the hub, in axes of the pair, (R, 6)."""
        return np.sqrt(MODAL_MASS) * self.modes.inertia.reshape(-1, self.modes.inertia.shape[-1])[self.moving]

    @property
    def stiffness(self) -> FloatArray:
        """Of the amplitudes, (R,)."""
        return np.asarray(MODAL_MASS * np.repeat(self.modes.square, 2)[self.moving])

    @property
    def compliance(self) -> FloatArray:
        """What the modes give way at the coordinates of the mesh at rest, (2, 2)."""
        return np.asarray(self.coordinates / self.stiffness @ self.coordinates.T)

    def matrices(self, rate: float) -> RingingMatrices:
        """Return the matrices of (1) of a gear that turns about z at a rate to the machine's speed."""
        moving, n, c = np.flatnonzero(self.moving), self.modes.diameters, self.modes.coriolis
        swap = np.kron(np.diag(2.0 * rate * (n + c)), np.array([[0.0, 1.0], [-1.0, 0.0]]))
        spun = np.repeat(-(rate**2) * (n**2 + 2.0 * n * c), 2)
        return RingingMatrices(
            MODAL_MASS * np.eye(len(moving)), np.diag(self.stiffness), MODAL_MASS * swap[np.ix_(moving, moving)],
            MODAL_MASS * np.diag(spun[moving]),
        )  # fmt: skip


# Modes of gears by the flanks of their mesh that carry, and 0 or 1: pinion or wheel.
KeptModes = dict[tuple[str, int], BlankModes]


def ringing_gears(
    model: GearboxModel, solved: SolvedLoad, standing: Iterable[StandingMesh], highest_Hz: float, kept: KeptModes
) -> list[RingingGear]:
    """Return the gears of a loaded gearbox that ring, with their modes up to a frequency.

    Parameters
    ----------
    standing : iterable of StandingMesh
        Meshes whose gears have no other one.
    kept : dict
        Modes that are found already, to which others are added: they are those of all loads.
    """
    found = []
    for mesh in standing:
        meshing = solved.meshes[mesh.number].meshing
        case = meshing.of_case(model.cases[mesh.name])
        pair = mesh.reduced.meshed.pair
        for gear, own in enumerate((case.pair.pinion, case.pair.wheel)):
            if own.solid(case.pair.face_width_mm) or why_rigid(own):
                continue
            key = meshing.key, gear
            if key not in kept:
                kept[key] = modes_of_gear(case, pair, gear, highest_Hz)
            phi = np.linspace(0.0, pair.pitch, ANGLES, endpoint=False)
            rows = mode_coordinates(mesh.reduced.lines, phi, mesh.condition, mesh.displacement, gear,
                                    kept[key].diameters, kept[key].flank)  # fmt: skip
            found.append(RingingGear(mesh.number, gear, kept[key], rows))
    return found


def modes_of_gear(case: Case, pair: GearPair, gear: int, highest_Hz: float) -> BlankModes:
    """Return the modes of the pinion, 0, or the wheel of a pair that rings."""
    mesh, own = sector_meshes(case, pair)[gear], (case.pair.pinion, case.pair.wheel)[gear]
    blank = blank_below(case, own, (pair.pinion, pair.wheel)[gear], mesh, gear)
    assert blank is not None, "it is not solid"
    return blank_modes(mesh, blank, T_MM3 * case.dynamics.density_kg_m3, case.mesh.element, highest_Hz)


def why_rigid(gear: GearCase) -> str:
    """Return why a gear that is not solid is a rigid body in motion; empty of one that rings."""
    if gear.body is not None:
        return "a mesh or a matrix of a body has no mass"
    if gear.one_piece:
        return "a gear of one piece with its shaft has no bore to be held at"
    if gear.blank is not None and gear.blank.holes is not None:
        return "holes couple modes of all nodal diameters"
    if gear.lugs is not None:
        return "lugs couple modes of all nodal diameters"
    return ""
