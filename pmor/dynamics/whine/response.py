"""The response of a loaded gearbox over its speed: mesh forces and bearing forces by mesh and harmonic."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pmor.core.arrays import BoolArray, ComplexArray, FloatArray
from pmor.dynamics.whine.cycle import mesh_cycles
from pmor.dynamics.whine.hill import FURTHER, MeshCycle, hill, mesh_forces, moved, time_invariant
from pmor.dynamics.whine.modal import Modes, Receptance, closed, modes_of, receptance_of, transfer
from pmor.dynamics.whine.moving import MovingMachine, bearing_rows, moving_machine
from pmor.dynamics.whine.orders import Order, along
from pmor.line.hub_law import COORDINATES
from pmor.machine.coupled import SolvedLoad
from pmor.machine.model import GearboxModel
from pmor.machine.settings import Motion
from pmor_online.model import ReducedPair

# Modes go up to this times the highest frequency.
FURTHER_MODES = 2.0
# Angles of a mesh cycle to each harmonic of its stiffness.
PER_HARMONIC = 8
RPM = 2.0 * np.pi / 60.0


@dataclass(frozen=True)
class Lines:
    """Motion by the harmonics of a mesh, K of them, at S speeds: complex, half of what is seen from zero to peak.

    Parameters
    ----------
    force : ndarray, shape (S, K)
        Of the mesh in the transverse plane beside its mean, N.
    transmission_error : ndarray, shape (S, K)
        By how much its flanks part at the pitch point, mm.
    closing : ndarray, shape (S, K, 2)
        Forces f_n on the closed machine (`pmor.dynamics.whine.hill`).
    readings : ndarray, shape (S, K, o)
    """

    force: ComplexArray
    transmission_error: ComplexArray
    closing: ComplexArray
    readings: ComplexArray


@dataclass(frozen=True)
class MeshResponse:
    """What a mesh excites, its orders, and the same with a mesh of constant stiffness.

    Parameters
    ----------
    told : ndarray of bool, shape (S, K)
        Lines below the highest frequency.
    """

    name: str
    rate: float
    cycle: MeshCycle
    orders: tuple[Order, ...]
    lines: Lines
    time_invariant: Lines
    told: BoolArray

    def frequency_Hz(self, speeds_rpm: FloatArray) -> FloatArray:
        """Frequencies of the lines, (S, K)."""
        harmonics = np.arange(1, self.lines.force.shape[1] + 1)
        return np.asarray(speeds_rpm[:, None] / 60.0 * self.rate * harmonics)


@dataclass(frozen=True)
class LoadResponse:
    """A gearbox in small motion about a load, over S speeds of the first torque's shaft, rpm."""

    solved: SolvedLoad
    machine: MovingMachine
    modes: Modes
    receptance: Receptance
    tangent: FloatArray
    speeds_rpm: FloatArray
    meshes: tuple[MeshResponse, ...]


def respond(
    model: GearboxModel, solved: SolvedLoad, pairs: Mapping[str, ReducedPair], motion: Motion, speeds_rpm: FloatArray
) -> LoadResponse:
    """Return the response of a loaded gearbox.

    Raises
    ------
    ConvergenceError
        Where a mesh has no law about its load.
    """
    machine = moving_machine(model, solved, motion.highest_frequency_Hz)
    angles = PER_HARMONIC * 2 * (motion.harmonics + FURTHER)
    cycles = mesh_cycles(solved, pairs, motion.harmonics, angles)
    tangent = np.zeros((COORDINATES * len(cycles), COORDINATES * len(cycles)))
    for number, cycle in enumerate(cycles):
        tangent[of_mesh(number), of_mesh(number)] = cycle.mean
    stiffness = closed(machine, tangent)
    modes = modes_of(machine, stiffness, FURTHER_MODES * motion.highest_frequency_Hz)
    readings = np.concatenate(bearing_rows(machine, solved))
    receptance = receptance_of(machine, stiffness, modes, readings, motion.damping_ratio)
    meshes = tuple(
        _mesh_response(machine, receptance, number, cycle, motion, speeds_rpm) for number, cycle in enumerate(cycles)
    )
    return LoadResponse(solved, machine, modes, receptance, tangent, speeds_rpm, meshes)


def of_mesh(number: int) -> slice:
    """Return the coordinates of a mesh among those of all."""
    return slice(COORDINATES * number, COORDINATES * (number + 1))


def _mesh_response(
    machine: MovingMachine, receptance: Receptance, number: int, cycle: MeshCycle, motion: Motion,
    speeds_rpm: FloatArray,
) -> MeshResponse:  # fmt: skip
    mesh, own, rate = machine.gearbox.meshes[number], of_mesh(number), machine.mesh_rate(number)
    speeds, harmonics = RPM * speeds_rpm, range(1, motion.harmonics + FURTHER + 1)
    orders = tuple(along(receptance, harmonic * rate, speeds, machine.sense) for harmonic in harmonics)
    at_rest = np.broadcast_to(transfer(receptance, np.zeros(1)).ports[:, own, own], (len(speeds), 1, 2, 2))
    moving = np.concatenate([at_rest, np.stack([order.ports(own) for order in orders], axis=1)], axis=1)
    constant = np.broadcast_to(time_invariant(cycle), moving.shape[:3])
    varying = constant if motion.mesh_stiffness == "mean" else hill(cycle, moving)
    both, told = np.stack([varying, constant]), orders[: motion.harmonics]
    readings = np.stack([order.readings(own, both[:, :, n]) for n, order in enumerate(told, start=1)], axis=2)
    wanted = slice(1, motion.harmonics + 1)
    lines = [
        Lines(
            mesh_forces(cycle, moving, closing)[:, wanted, 0], moved(moving, closing)[:, wanted, 0],
            closing[:, wanted], seen,
        ) for closing, seen in zip(both, readings, strict=True)
    ]  # fmt: skip
    frequency = speeds_rpm[:, None] / 60.0 * rate * np.arange(1, motion.harmonics + 1)
    below = frequency <= motion.highest_frequency_Hz
    return MeshResponse(mesh.settings.name, rate, cycle, orders, lines[0], lines[1], below)
