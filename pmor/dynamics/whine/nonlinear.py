"""Motion of meshes that part, in a flexible machine: its modes, and the meshes as tables over two coordinates each.

Modes are those with all meshes closed by their mean tangents; what a mesh does beside its tangent acts on them. So the
equations have the form of `pmor.dynamics.oscillator`, and harmonic balance, continuation, stability and jumps are those
of a pair. What the modes leave out is part of the law (`pmor.dynamics.kernels.hub_table`): the static limit is exact.
Meshes that are not told stay at their mean tangents. Gyroscopic moments are none, or those of one speed.

The second coordinate counts by half the face width: a displacement of its ends, mm, under a force, N.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from pmor.core.arrays import FloatArray
from pmor.core.errors import ConvergenceError
from pmor.dynamics.kernels.hub_table import ClosedMeshes, HubTable, closed_forces_at
from pmor.dynamics.oscillator import Oscillator
from pmor.dynamics.whine.cycle import StandingMesh
from pmor.dynamics.whine.modal import Receptance
from pmor.line.hub_law import COORDINATES, HubLaw, laws_at, mesh_coordinates
from pmor.line.train import smooth_rows
from pmor_online.model import online_angles

# Of a table: phases that are solved, and those between which it is linear and which harmonic balance takes (with 256 a
# fold where flanks part was 0.3 per mille off); approaches and second coordinates.
SOLVED_PHASES, PHASES, APPROACHES, TILTS = 128, 512, 65, 13
# Steps over time to a sample, of 64 a mesh cycle.
STEPS = 2
# Its range: of the mean deflection, from where flanks touch.
REACH, TILT_REACH = 5.0, 1.0
# Steps in which it is looked for where flanks touch, over the mean approach.
TOUCHING = np.linspace(1.0, -4.0, 51)


@dataclass(frozen=True)
class ClosedLaw:
    """The law of meshes as the modes of their machine feel them (`pmor.dynamics.force_law.MachineLaw`)."""

    meshes: ClosedMeshes
    samples: int = PHASES
    steps: int = STEPS

    @property
    def centre(self) -> FloatArray:
        """Approaches under the mean load, (r,)."""
        return self.meshes.centre

    @property
    def load(self) -> FloatArray:
        """Mean forces, (r,)."""
        return self.meshes.load

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
    arms: FloatArray  # shape (r,): Coordinates of the ports by these, and forces on them by those of the law

    def spun(self, receptance: Receptance, spin: float) -> PartingMachine:
        """Return the machine with gyroscopic moments and centrifugal forces at a speed, rad/s."""
        return replace(self, oscillator=_oscillator(receptance, self.law, self.oscillator.rows, spin))


def parting_machine(
    receptance: Receptance, tangent: FloatArray, standing: Sequence[StandingMesh], parting: Sequence[int],
    cycles: Sequence[float] = (1.0,), reach: float = REACH, backlash: Sequence[float] | None = None,
    ahead: Sequence[float] | None = None,
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
    ahead : sequence of float, optional
        By how much of its own cycle each is ahead at time 0.
    """
    meshes = [standing[number] for number in parting]
    arms = np.concatenate([[1.0, arm_of(mesh)] for mesh in meshes])
    own = np.concatenate([COORDINATES * number + np.arange(COORDINATES) for number in parting])
    rows = -arms[:, None] * receptance.ports[own][:, receptance.modes.square > 0.0]
    centre = np.concatenate([approach_of(mesh) for mesh in meshes])
    load = np.concatenate([mesh.load for mesh in meshes]) / arms
    backs = [np.inf] * len(meshes) if backlash is None else backlash
    # Meshes that pass against their pinions' angles run through their tables backwards.
    passing = np.array([-cycle if mesh.backwards else cycle for mesh, cycle in zip(meshes, cycles, strict=True)])
    law = ClosedLaw(ClosedMeshes(
        tuple(hub_table(mesh, reach, back) for mesh, back in zip(meshes, backs, strict=True)),
        passing, np.array(ahead or np.zeros(len(meshes))), tangent[np.ix_(own, own)] / np.outer(arms, arms),
        receptance.left_ports[np.ix_(own, own)] * np.outer(arms, arms), centre, load,
    ))  # fmt: skip
    return PartingMachine(_oscillator(receptance, law, rows, 0.0), law, arms)


def _oscillator(receptance: Receptance, law: ClosedLaw, rows: FloatArray, spin: float) -> Oscillator:
    """Modes of a machine by themselves, or where it spins, from their place under the mean load of its meshes on."""
    elastic = receptance.modes.square > 0.0
    among, square = np.ix_(elastic, elastic), receptance.modes.square[elastic]
    stiffness = np.diag(square) + spin**2 * receptance.centrifugal[among]
    damping = np.diag(2.0 * receptance.damping_ratio[elastic] * np.sqrt(square)) + spin * receptance.gyroscopic[among]
    return Oscillator(np.eye(len(square)), damping, stiffness, rows, rows.T @ law.load)


def arm_of(mesh: StandingMesh) -> float:
    """Return half the face width, mm."""
    return 0.5 * mesh.reduced.meshed.pair.common_width


def approach_of(mesh: StandingMesh) -> FloatArray:
    """Return the approach of the flanks and the second coordinate under the mean load, (2,), mm."""
    parted = mesh_coordinates(mesh.reduced.meshed.pair).T @ mesh.displacement
    return np.asarray(-parted * [1.0, arm_of(mesh)])


def backlash_at(mesh: StandingMesh, drawn: float) -> float:
    """Return the backlash along the line of action where the hubs stand, mm, by that of the drawing."""
    pair = mesh.reduced.meshed.pair
    return drawn + sum(float(smooth_rows(pair, coast=coast).ravel() @ mesh.displacement) for coast in (False, True))


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
    angles = online_angles(pair.pitch, phases, 1)
    found = laws_at(mesh.reduced.lines, angles, mesh.condition, -places / arms, mesh.taken_out)
    return HubLaw(found.force / arms, found.tangent / np.outer(arms, arms), found.converged)
