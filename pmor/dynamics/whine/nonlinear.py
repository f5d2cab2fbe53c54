"""Motion of meshes that part, in a flexible machine: its modes, and the meshes as tables over two coordinates each.

Modes are those with all meshes closed by their mean tangents; what a mesh does beside its tangent acts on them. So the
equations have the form of `pmor.dynamics.oscillator`, and harmonic balance, continuation, stability and jumps are those
of a pair. What the modes leave out is part of the law (`pmor.dynamics.kernels.hub_table`): the static limit is exact.
Meshes that are not told stay at their mean tangents. Gyroscopic moments are left out.

The second coordinate counts by half the face width: a displacement of its ends, mm, under a force, N.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from pmor.core.arrays import FloatArray
from pmor.core.errors import ConvergenceError
from pmor.dynamics.harmonic_balance import in_Hz
from pmor.dynamics.kernels.hub_table import ClosedMeshes, HubTable, closed_forces_at, march
from pmor.dynamics.oscillator import Oscillator
from pmor.dynamics.whine.cycle import StandingMesh
from pmor.dynamics.whine.modal import Receptance
from pmor.line.hub_law import COORDINATES, HubLaw, laws_at, mesh_coordinates
from pmor_online.model import online_angles

# Of a table: phases that are solved, and those between which it is linear and which harmonic balance takes (with 256 a
# fold where flanks part was 0.3 per mille off); approaches and second coordinates.
SOLVED_PHASES, PHASES, APPROACHES, TILTS = 128, 512, 33, 13
# Its range: of the mean deflection, from where flanks touch.
REACH, TILT_REACH = 6.0, 1.0
# Steps in which it is looked for where flanks touch, over the mean approach.
TOUCHING = np.linspace(1.0, -4.0, 51)
# Steps of a cycle over time, with kicks at phases of the table; splittings. That of fourth order keeps energy better,
# but gains nothing where teeth come into contact and leave it.
STEPS = 128
SECOND_ORDER = np.ones(1)
FOURTH_ORDER = np.array([1.0, -(2.0 ** (1.0 / 3.0)), 1.0]) / (2.0 - 2.0 ** (1.0 / 3.0))


@dataclass(frozen=True)
class ClosedLaw:
    """The law of meshes as the modes of their machine feel them (`pmor.dynamics.force_law.MachineLaw`)."""

    meshes: ClosedMeshes
    samples: int = PHASES

    @property
    def centre(self) -> FloatArray:
        """Approaches under the mean load, (r,)."""
        return self.meshes.centre

    def forces(self, phase: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return forces (r, n) and stiffnesses (r, r, n) at phases (n,) and coordinates (r, n); NaN out of range."""
        return self.all_forces(phase, x)[:2]

    def all_forces(self, phase: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return these and the approaches of the flanks, (r, n)."""
        force, at = np.empty_like(x), np.empty_like(x)
        slope = np.empty((len(x), *x.shape))
        closed_forces_at(self.meshes, phase / (2.0 * np.pi), np.ascontiguousarray(x), force, slope, at)
        return force, slope, at

    def mesh_forces(self, phase: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the forces of the meshes themselves and their approaches, (r, n), where modes move x."""
        force, _, at = self.all_forces(phase, x)
        return force + self.meshes.tangent @ (at - self.centre[:, None]), at


@dataclass(frozen=True)
class PartingMachine:
    """A machine by its modes, some of whose meshes part."""

    oscillator: Oscillator
    law: ClosedLaw
    damping_ratio: FloatArray  # shape (n,)

    def march(
        self, state: FloatArray, speeds: FloatArray, first: float = 0.0, weights: FloatArray = SECOND_ORDER,
        steps: int = STEPS,
    ) -> tuple[FloatArray, FloatArray, FloatArray]:  # fmt: skip
        """Carry modes through cycles of the first mesh, each at its own angular mesh frequency (C,).

        Parameters
        ----------
        state : ndarray, shape (2, n)
            Displacements, as the oscillator counts them, and velocities.
        first : float
            Cycle at the start.
        weights : ndarray
            `SECOND_ORDER` or `FOURTH_ORDER`.

        Returns
        -------
        tuple of (ndarray (2, n), ndarray (C, steps, r), ndarray (C, steps, r))
            State at the end; approaches and forces of the meshes.

        Raises
        ------
        ConvergenceError
            Where motion leaves the range of the tables.
        """
        rows, shift, meshes = self.oscillator.rows, self._shift, self.law.meshes
        moved = np.array([state[0] - shift, state[1]])
        seen, force = np.empty((2, len(speeds) * steps, len(rows)))
        modes = np.column_stack([np.sqrt(np.diag(self.oscillator.stiffness)), self.damping_ratio])
        if not march(meshes, modes, np.ascontiguousarray(rows), speeds, steps, weights, first, moved, seen, force):
            raise ConvergenceError(
                f"between mesh frequencies {in_Hz(speeds[0])} and {in_Hz(speeds[-1])} the motion leaves the range of "
                "the force law"
            )
        shape = len(speeds), steps, len(rows)
        return np.array([moved[0] + shift, moved[1]]), seen.reshape(shape), force.reshape(shape)

    @property
    def _shift(self) -> FloatArray:
        return _held(self.oscillator.rows, np.diag(self.oscillator.stiffness), self.law.centre)

    @property
    def at_rest(self) -> FloatArray:
        """State under the mean load, (2, n)."""
        return np.array([self._shift, np.zeros(len(self._shift))])


def parting_machine(
    receptance: Receptance, tangent: FloatArray, standing: Sequence[StandingMesh], parting: Sequence[int],
    cycles: Sequence[float] = (1.0,), reach: float = REACH, backlash: Sequence[float] | None = None,
) -> PartingMachine:  # fmt: skip
    """Return a machine some of whose meshes part.

    Parameters
    ----------
    receptance : Receptance
        Of which the first ports are the coordinates of all meshes.
    tangent : ndarray, shape (2 M, 2 M)
        By which its meshes are closed.
    standing : sequence of StandingMesh
        All meshes, under their mean load.
    parting : sequence of int
        Numbers of those that part, the one whose cycle counts first.
    cycles : sequence of float
        Of each of these to one of the first.
    reach : float
        Of the tables, in mean deflections.
    backlash : sequence of float, optional
        Of each along the line of action, mm; by default the backs of teeth carry nothing.
    """
    meshes = [standing[number] for number in parting]
    arms = np.concatenate([[1.0, arm_of(mesh)] for mesh in meshes])
    own = np.concatenate([COORDINATES * number + np.arange(COORDINATES) for number in parting])
    elastic = receptance.modes.square > 0.0
    square, ratio = receptance.modes.square[elastic], receptance.damping_ratio[elastic]
    rows = -arms[:, None] * receptance.ports[own][:, elastic]
    centre = np.concatenate([approach_of(mesh) for mesh in meshes])
    load = np.concatenate([mesh.load for mesh in meshes]) / arms
    backs = [np.inf] * len(meshes) if backlash is None else backlash
    law = ClosedLaw(ClosedMeshes(
        tuple(hub_table(mesh, reach, back) for mesh, back in zip(meshes, backs, strict=True)),
        np.array(cycles, dtype=float), np.zeros(len(meshes)), tangent[np.ix_(own, own)] / np.outer(arms, arms),
        receptance.left_ports[np.ix_(own, own)] * np.outer(arms, arms), centre, load,
    ))  # fmt: skip
    steady = rows.T @ load + square * _held(rows, square, centre)
    return PartingMachine(
        Oscillator(np.eye(len(square)), np.diag(2.0 * ratio * np.sqrt(square)), np.diag(square), rows, steady), law,
        ratio,
    )  # fmt: skip


def arm_of(mesh: StandingMesh) -> float:
    """Return half the face width, mm."""
    return 0.5 * mesh.reduced.meshed.pair.common_width


def approach_of(mesh: StandingMesh) -> FloatArray:
    """Return the approach of the flanks and the second coordinate under the mean load, (2,), mm."""
    parted = mesh_coordinates(mesh.reduced.meshed.pair).T @ mesh.displacement
    return np.asarray(-parted * [1.0, arm_of(mesh)])


def hub_table(mesh: StandingMesh, reach: float = REACH, backlash: float = np.inf) -> HubTable:
    """Tabulate a mesh from where it touches to so many mean deflections.

    ConvergenceError where its law has no force in that range.
    """
    centre = approach_of(mesh)
    low, tilt = _range(mesh, centre)
    span = reach * (centre[0] - low)
    tau, tilts = np.linspace(0.0, 1.0, APPROACHES), centre[1] + tilt * np.linspace(-1.0, 1.0, TILTS)
    approaches = low + span * tau**2
    # One tilt after the other, the load rising in each.
    places = np.array([(x, u) for u in tilts for x in approaches])
    found = _law(mesh, places, SOLVED_PHASES)
    if not found.converged.all():
        raise ConvergenceError(
            f"mesh {mesh.name}: no contact was found up to {reach:g} mean deflections: lower the torque"
        )
    # To phases, approaches, tilts, forces.
    force, slope = (
        part.reshape(TILTS, APPROACHES, SOLVED_PHASES, COORDINATES, -1).transpose(2, 1, 0, 3, 4)
        for part in (found.force, found.tangent)
    )
    by_step = slope[..., 0] * (2.0 * span * tau / (APPROACHES - 1))[:, None, None]
    by_tilt = slope[..., 1] * (2.0 * tilt / (TILTS - 1))
    values = np.stack([force[..., 0], by_step, by_tilt, np.gradient(by_tilt, axis=1)], axis=-1)
    periodic = CubicSpline(np.arange(SOLVED_PHASES + 1), np.concatenate([values, values[:1]]), bc_type="periodic")
    every = np.ascontiguousarray(periodic(np.arange(PHASES) * (SOLVED_PHASES / PHASES)))
    return HubTable(low, span, float(centre[1]), tilt, every, backlash)


def _range(mesh: StandingMesh, centre: FloatArray) -> tuple[float, float]:
    """Approach at which flanks touch at no phase nor tilt of the table, and how far that tilts."""
    tilt = 0.0
    for _ in range(2):
        ends = [np.column_stack([centre[0] * TOUCHING[::-1], np.full(len(TOUCHING), centre[1] + side * tilt)])
                for side in (-1.0, 1.0)]  # fmt: skip
        free = np.all([(_law(mesh, end, 16).force[..., 0] == 0.0).all(axis=1) for end in ends], axis=0)
        if not free.any():
            raise ConvergenceError(f"mesh {mesh.name}: flanks touch however far they are apart: lower the torque")
        low = float(centre[0] * TOUCHING[::-1][np.flatnonzero(free)[-1]])
        tilt = tilt or TILT_REACH * (centre[0] - low)
    return low, tilt


def _law(mesh: StandingMesh, places: FloatArray, phases: int) -> HubLaw:
    """Forces (D, A, 2) and slopes by approaches (D, A, 2, 2), by half the face width, at places (D, 2)."""
    pair, arms = mesh.reduced.meshed.pair, np.array([1.0, arm_of(mesh)])
    found = laws_at(mesh.reduced.lines, online_angles(pair.pitch, phases, 1), mesh.condition, -places / arms)
    return HubLaw(found.force / arms, found.tangent / np.outer(arms, arms), found.converged)


def _held(rows: FloatArray, square: FloatArray, approach: FloatArray) -> FloatArray:
    """Displacements of modes under forces on the meshes that make an approach."""
    compliance = rows / square @ rows.T
    return np.asarray(np.linalg.solve(compliance, approach) @ rows / square)
