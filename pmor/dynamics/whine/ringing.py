"""Gears on light blanks that ring, as further displacements of a machine: amplitudes of the modes beside their hubs.

A mode with n nodal diameters turns with its gear; the load stands still. In the fixed frame its amplitudes a and b are

    m (q'' + 2 n W J q' - n^2 W^2 q) + k q,    J = (0, 1; -1, 0), W about z,                                       (1)

so that a mode is met at two frequencies n W / pi apart. Rotation changes the shapes of modes by nothing else here: its
forces across the motion in the plane of the wheel and the stress by it are left out. What these modes give way at rest
is taken out of the compliance of the mesh (`pmor.line.hub_law`); all further modes stay there, at rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pmor.body.blank_modes import BlankModes, blank_modes
from pmor.core.arrays import BoolArray, FloatArray
from pmor.dynamics.whine.cycle import StandingMesh
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
        moving, n = np.flatnonzero(self.moving), np.repeat(self.modes.diameters, 2)
        swap = np.kron(np.diag(2.0 * rate * self.modes.diameters), np.array([[0.0, 1.0], [-1.0, 0.0]]))
        return RingingMatrices(
            MODAL_MASS * np.eye(len(moving)), np.diag(self.stiffness), MODAL_MASS * swap[np.ix_(moving, moving)],
            -MODAL_MASS * np.diag((n[moving] * rate) ** 2),
        )  # fmt: skip


def ringing_gears(
    model: GearboxModel, solved: SolvedLoad, standing: Sequence[StandingMesh], highest_Hz: float
) -> list[RingingGear]:
    """Return the gears of a loaded gearbox on light blanks, with their modes up to a frequency."""
    found = []
    for number, (mesh, loaded) in enumerate(zip(standing, solved.meshes, strict=True)):
        case = loaded.meshing.of_case(model.cases[mesh.name])
        pair = mesh.reduced.meshed.pair
        meshes = None
        for gear, (own, tooth) in enumerate(((case.pair.pinion, pair.pinion), (case.pair.wheel, pair.wheel))):
            if own.light_blank(case.pair.face_width_mm) is None or own.body is not None:
                continue
            meshes = meshes or sector_meshes(case, pair)
            blank = blank_below(case, own, tooth, meshes[gear], gear)
            if blank is None or blank.core or blank.web is not None or blank.lugs is not None:
                continue
            modes = blank_modes(meshes[gear], blank, T_MM3 * case.dynamics.density_kg_m3, case.mesh.element, highest_Hz)
            phi = np.linspace(0.0, pair.pitch, ANGLES, endpoint=False)
            rows = mode_coordinates(mesh.reduced.lines, phi, mesh.condition, mesh.displacement, gear, modes.diameters,
                                    modes.flank)  # fmt: skip
            found.append(RingingGear(number, gear, modes, rows))
    return found
