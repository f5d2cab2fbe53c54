"""The response of a loaded gearbox over its speed: forces of meshes and bearings by source and harmonic."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pmor.body.beam import NODE
from pmor.core.arrays import BoolArray, ComplexArray, FloatArray
from pmor.dynamics.whine.cycle import StandingMesh, standing_meshes
from pmor.dynamics.whine.hill import FURTHER, MeshCycle, hill, mesh_forces, time_invariant
from pmor.dynamics.whine.modal import Modes, Receptance, closed, modes_of, receptance_of, transfer
from pmor.dynamics.whine.moving import KG, MovingMachine, bearing_rows, moving_machine
from pmor.dynamics.whine.orders import Order, along
from pmor.dynamics.whine.ringing import ringing_gears
from pmor.line.hub_law import COORDINATES
from pmor.machine.coupled import SolvedLoad
from pmor.machine.model import ABOUT_AXIS, GearboxModel
from pmor.machine.settings import Motion
from pmor_online.model import ReducedPair

# Modes go up to this times the highest frequency.
FURTHER_MODES = 2.0
RPM = 2.0 * math.pi / 60.0
# Density times speed of sound of air at 20 deg C, N s/mm3.
AIR = 413.3e-9


@dataclass(frozen=True)
class Lines:
    """Motion by the K harmonics of a source at S speeds: complex, half of what is seen from zero to peak.

    Parameters
    ----------
    acting : ndarray, shape (S, K, q)
        Forces of the source on its ports of the machine whose meshes are closed by their mean stiffness.
    mesh_forces : ndarray, shape (S, K, M)
        Of all meshes in the transverse plane beside their means, N.
    parted : ndarray, shape (S, K, M)
        By how much their flanks part at the pitch point, mm.
    readings : ndarray, shape (S, K, o)
        As `Readings` tells them apart.
    """

    acting: ComplexArray
    mesh_forces: ComplexArray
    parted: ComplexArray
    readings: ComplexArray


@dataclass(frozen=True)
class MeshMotion:
    """A mesh about which motion is small: where its hubs stand, its cycle there, its receptance at rest, (2, 2)."""

    standing: StandingMesh
    cycle: MeshCycle
    at_rest: FloatArray


@dataclass(frozen=True)
class Source:
    """A mesh, an unbalanced shaft, or a torque that swings, and what it moves.

    Parameters
    ----------
    rate : float
        Its first harmonic over the speed of the first torque's shaft.
    ports : slice
        On which it acts.
    orders : tuple of Order
        K, or of a mesh a further one.
    constant : Lines
        By meshes of constant stiffness.
    told : ndarray of bool, shape (S, K)
        Lines below the highest frequency.
    mesh : MeshMotion, optional
    """

    name: str
    rate: float
    ports: slice
    orders: tuple[Order, ...]
    lines: Lines
    constant: Lines
    told: BoolArray
    mesh: MeshMotion | None = None

    def frequency_Hz(self, speeds_rpm: FloatArray) -> FloatArray:
        """Frequencies of the lines, (S, K)."""
        return np.asarray(speeds_rpm[:, None] / 60.0 * self.rate * np.arange(1, self.told.shape[1] + 1))


@dataclass(frozen=True)
class LoadResponse:
    """A gearbox in small motion about a load, over S speeds of the first torque's shaft, rpm.

    Parameters
    ----------
    tangent : ndarray, shape (2 M, 2 M)
        Mean stiffness of the meshes on their coordinates.
    sources : tuple of Source
        The M meshes first.
    """

    solved: SolvedLoad
    machine: MovingMachine
    modes: Modes
    receptance: Receptance
    tangent: FloatArray
    speeds_rpm: FloatArray
    sources: tuple[Source, ...]

    @property
    def meshes(self) -> tuple[Source, ...]:
        """Sources that are meshes."""
        return self.sources[: len(self.solved.meshes)]

    def bearing_forces(self, readings: ComplexArray) -> ComplexArray:
        """Return forces and moments on what holds each bearing, (..., bearings, 6), from readings (..., o)."""
        bearings = self.machine.gearbox.bearings
        found = readings[..., : NODE * len(bearings)].reshape(*readings.shape[:-1], len(bearings), NODE).copy()
        place = NODE * len(bearings) + self.machine.housing.stop - self.machine.housing.start
        for number, bearing in enumerate(bearings):
            for direction in bearing.rigid:
                found[..., number, direction] -= readings[..., place]  # a reaction acts on the shaft
                place += 1
        return found

    def power(self, lines: Lines, source: Source) -> FloatArray:
        """Return the equivalent radiated power of the housing by lines, (S, K), mW: 0 where no surface is given."""
        omega = RPM * self.speeds_rpm[:, None] * source.rate * np.arange(1, source.told.shape[1] + 1)
        normal = self.housing(lines.readings) @ self.machine.surface.T
        return np.asarray(2.0 * AIR * omega**2 * (abs(normal) ** 2).sum(axis=-1) * source.told)

    def housing(self, readings: ComplexArray) -> ComplexArray:
        """Return the displacements of the housing's coordinates, (..., H), from readings (..., o), mm."""
        first = NODE * len(self.machine.gearbox.bearings)
        return readings[..., first : first + self.machine.housing.stop - self.machine.housing.start]


@dataclass(frozen=True)
class Swinging:
    """Forces that swing with the turns of a shaft: on displacements of the machine, by rows, (q, n).

    Parameters
    ----------
    by_speed : ndarray of complex, shape (q,)
        At 1 rad/s of the first torque's shaft; with its square, or without where `steady`.
    """

    name: str
    rate: float
    rows: FloatArray
    by_speed: ComplexArray
    steady: bool


def respond(
    model: GearboxModel, solved: SolvedLoad, pairs: Mapping[str, ReducedPair], motion: Motion, speeds_rpm: FloatArray
) -> LoadResponse:
    """Return the response of a loaded gearbox.

    Raises
    ------
    ConvergenceError
        Where a mesh has no law about its load.
    """
    standing = standing_meshes(solved, pairs, motion.harmonics)
    ringing = ringing_gears(model, solved, standing, FURTHER_MODES * motion.highest_frequency_Hz)
    machine = moving_machine(model, solved, motion.highest_frequency_Hz, ringing)
    for gear in ringing:
        before = standing[gear.mesh].taken_out
        compliance = gear.compliance if before is None else gear.compliance + before
        standing[gear.mesh] = standing[gear.mesh].without(compliance)
    cycles = [mesh.cycle() for mesh in standing]
    tangent = np.zeros((COORDINATES * len(cycles), COORDINATES * len(cycles)))
    for number, cycle in enumerate(cycles):
        tangent[of_mesh(number), of_mesh(number)] = cycle.mean
    stiffness = closed(machine, tangent)
    modes = modes_of(machine, stiffness, FURTHER_MODES * motion.highest_frequency_Hz)
    swinging = [*unbalances(model, machine), *ripples(machine)]
    acting = np.concatenate([machine.meshes, *(one.rows for one in swinging)])
    readings = np.concatenate([*bearing_rows(machine, solved), np.eye(len(machine.mass))[machine.housing]])
    receptance = receptance_of(machine, stiffness, modes, acting, readings, motion.damping_ratio)
    sources, first, means = [], len(tangent), np.array([cycle.mean for cycle in cycles])
    for number, (mesh, cycle) in enumerate(zip(standing, cycles, strict=True)):
        own = MeshMotion(mesh, cycle, transfer(receptance, np.zeros(1)).ports[0, of_mesh(number), of_mesh(number)].real)
        sources.append(_of_mesh(machine, receptance, means, number, own, motion, speeds_rpm))
    for one in swinging:
        ports = slice(first, first + len(one.rows))
        sources.append(_of_shaft(machine, receptance, means, one, ports, motion, speeds_rpm))
        first = ports.stop
    return LoadResponse(solved, machine, modes, receptance, tangent, speeds_rpm, tuple(sources))


def of_mesh(number: int) -> slice:
    """Return the coordinates of a mesh among those of all."""
    return slice(COORDINATES * number, COORDINATES * (number + 1))


def unbalances(model: GearboxModel, machine: MovingMachine) -> list[Swinging]:
    """Return the forces of unbalanced masses, all of a shaft together, on y and z of their nodes."""
    found = []
    for shaft, rate in machine.rates.items():
        bodies = [one for one in model.sections.masses if one.shaft == shaft and one.unbalance_kg_mm > 0.0]
        if not bodies:
            continue
        rows, forces, turns = list[FloatArray](), list[complex](), np.sign(rate * machine.sense)
        for body in bodies:
            amount = 0.5 * KG * body.unbalance_kg_mm * rate**2
            along_y = amount * np.exp(1j * turns * math.radians(body.unbalance_deg))
            rows += [machine.row(shaft, body.at_mm, direction) for direction in (1, 2)]
            forces += [along_y, -1j * turns * along_y]
        found.append(Swinging(f"unbalance of {shaft}", abs(rate), np.array(rows), np.array(forces), False))
    return found


def ripples(machine: MovingMachine) -> list[Swinging]:
    """Return the torques that swing about the mean torques of the load."""
    return [
        Swinging(
            f"torque on {torque.shaft}", abs(machine.rates.get(torque.shaft, 0.0)) * ripple.order,
            machine.row(torque.shaft, torque.at_mm, ABOUT_AXIS)[None],
            np.array([0.5e3 * ripple.amplitude_Nm * np.exp(1j * math.radians(ripple.phase_deg))]), True,
        ) for torque in machine.load.torques for ripple in torque.ripple
    ]  # fmt: skip


def _of_mesh(
    machine: MovingMachine, receptance: Receptance, means: FloatArray, number: int, mesh: MeshMotion, motion: Motion,
    speeds_rpm: FloatArray,
) -> Source:  # fmt: skip
    """Return what a mesh excites; `means` are the mean stiffnesses of all meshes, (M, 2, 2)."""
    cycle, own, rate = mesh.cycle, of_mesh(number), machine.mesh_rate(number)
    speeds, harmonics = RPM * speeds_rpm, range(1, motion.harmonics + FURTHER + 1)
    orders = tuple(along(receptance, harmonic * rate, speeds, machine.sense) for harmonic in harmonics)
    still = np.broadcast_to(mesh.at_rest, (len(speeds), 1, *mesh.at_rest.shape))
    moving = np.concatenate([still, np.stack([order.ports(own, own) for order in orders], axis=1)], axis=1)
    constant = np.broadcast_to(time_invariant(cycle), moving.shape[:3])
    varying = constant if motion.mesh_stiffness == "mean" else hill(cycle, moving)
    wanted, found = slice(1, motion.harmonics + 1), list[Lines]()
    for acting in (varying, constant):
        lines = _lines(orders[: motion.harmonics], means, own, acting[:, wanted])
        lines.mesh_forces[..., number] = mesh_forces(cycle.mean, moving, acting)[:, wanted, 0]
        found.append(lines)
    told = _told(rate, motion.harmonics, motion, speeds_rpm)
    return Source(mesh.standing.name, rate, own, orders, found[0], found[1], told, mesh)


def _of_shaft(
    machine: MovingMachine, receptance: Receptance, means: FloatArray, swinging: Swinging, own: slice, motion: Motion,
    speeds_rpm: FloatArray,
) -> Source:  # fmt: skip
    order = along(receptance, swinging.rate, RPM * speeds_rpm, machine.sense)
    growing = np.ones(len(speeds_rpm)) if swinging.steady else (RPM * speeds_rpm) ** 2
    lines = _lines((order,), means, own, (growing[:, None] * swinging.by_speed)[:, None])
    told = _told(swinging.rate, 1, motion, speeds_rpm)
    return Source(swinging.name, swinging.rate, own, (order,), lines, lines, told)


def _lines(orders: Sequence[Order], means: FloatArray, own: slice, acting: ComplexArray) -> Lines:
    """Motion under forces on some ports, (S, K, q), all meshes with their mean stiffness."""
    every = slice(0, COORDINATES * len(means))
    parted = np.stack(
        [np.einsum("sab,sb->sa", order.ports(every, own), acting[:, n]) for n, order in enumerate(orders)], axis=1
    ).reshape(*acting.shape[:2], len(means), COORDINATES)
    readings = np.stack([order.readings(own, acting[:, n]) for n, order in enumerate(orders)], axis=1)
    return Lines(acting, -np.einsum("mb,skmb->skm", means[:, 0], parted), parted[..., 0].copy(), readings)


def _told(rate: float, harmonics: int, motion: Motion, speeds_rpm: FloatArray) -> BoolArray:
    frequency = speeds_rpm[:, None] / 60.0 * rate * np.arange(1, harmonics + 1)
    return np.asarray(frequency <= motion.highest_frequency_Hz)
