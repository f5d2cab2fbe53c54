"""The response of a loaded gearbox over its speed: forces of meshes and bearings by source and harmonic."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from pmor.body.beam import NODE
from pmor.case.motion import Motion
from pmor.core.arrays import BoolArray, ComplexArray, FloatArray
from pmor.dynamics.whine.blades import SIDEBANDS
from pmor.dynamics.whine.coherent import CoherentMeshes, coherent_meshes
from pmor.dynamics.whine.cycle import StandingMesh, StandingTrain, standing_meshes, standing_trains
from pmor.dynamics.whine.hill import MeshCycle, mesh_forces
from pmor.dynamics.whine.modal import Modes, Receptance, closed, modes_of, receptance_of, transfer
from pmor.dynamics.whine.moving import MovingMachine, bearing_rows, moving_machine
from pmor.dynamics.whine.moving_sets import machine_of_set, with_sets
from pmor.dynamics.whine.orders import Order, Ports, along
from pmor.dynamics.whine.pitches import over_pitches, time_invariant
from pmor.dynamics.whine.planets import HUBS, MovingSet
from pmor.dynamics.whine.ringing import KeptModes, ringing_gears
from pmor.dynamics.whine.set_cycle import SetCycle, set_cycle
from pmor.dynamics.whine.set_response import over_planets, set_excitation
from pmor.dynamics.whine.swinging import Swinging, ripples, unbalances
from pmor.line.hub_law import COORDINATES
from pmor.machine.coupled import SolvedLoad
from pmor.machine.model import GearboxModel
from pmor.machine.settings import LoadCase
from pmor.machine.system import Equilibrium
from pmor.sets.loader import SetFile
from pmor.sets.solution import SetSolution
from pmor_online.model import ReducedPair

if TYPE_CHECKING:
    from pmor.dynamics.whine.parting import Parting

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
        Of all meshes in the transverse plane beside their means, N; of the sun's and the ring's meshes of a set the
        root mean square of all planets.
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
    """Meshes about which motion is small: where their hubs stand, their cycle there, the receptance at rest, (q, q)."""

    standing: CoherentMeshes
    cycle: MeshCycle
    at_rest: FloatArray

    def moving(self, orders: Sequence[Order]) -> ComplexArray:
        """Return the receptance of the closed machine at the harmonics that are solved, 0 first, (S, K + 1, q, q)."""
        own, speeds = self.standing.ports, len(orders[0].speeds)
        still = np.broadcast_to(self.at_rest, (speeds, 1, *self.at_rest.shape))
        return np.concatenate([still, np.stack([order.ports(own, own) for order in orders], axis=1)], axis=1)

    def forces(self, moving: ComplexArray, acting: ComplexArray) -> ComplexArray:
        """Return the forces of the meshes beside their means, (S, K + 1, M), by those on the closed machine."""
        return mesh_forces(self.cycle.mean, moving, acting)[..., ::COORDINATES]


@dataclass(frozen=True)
class MeanMeshes:
    """All meshes with their mean stiffness: of pairs (2 M, 2 M), and of sets."""

    pairs: FloatArray
    sets: tuple[tuple[MovingSet, SetCycle], ...]

    def moved(self, ports: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Return forces of all meshes, and by how much they part, (..., M) each, by all coordinates (..., P)."""
        own = ports[..., : len(self.pairs)]
        forces, parted = [-(own @ self.pairs[::COORDINATES].T)], [own[..., ::COORDINATES]]
        for one, cycle in self.sets:
            there = ports[..., one.own]
            force, apart = over_planets(cycle, there @ cycle.tangent.T, there)
            forces.append(force.astype(complex))
            parted.append(apart.astype(complex))
        return np.concatenate(forces, axis=-1), np.concatenate(parted, axis=-1)


@dataclass(frozen=True)
class Source:
    """Meshes that keep step, a set, an unbalanced shaft, or a torque that swings, and what it moves.

    Parameters
    ----------
    rate : float
        Its first harmonic over the speed of the first torque's shaft.
    ports : slice or ndarray of int
        On which it acts.
    orders : tuple of Order
        K, or of meshes further ones.
    constant : Lines
        By meshes of constant stiffness.
    told : ndarray of bool, shape (S, K)
        Lines below the highest frequency.
    mesh : MeshMotion, optional
    sidebands : tuple of (float, int)
        Of a set: harmonic of the sun's mesh, and order of the carrier's turn beside it, of each line.
    why_constant : str
        Why stiffness that varies is not found, so that `lines` are `constant`; else empty.
    """

    name: str
    rate: float
    ports: Ports
    orders: tuple[Order, ...]
    lines: Lines
    constant: Lines
    told: BoolArray
    mesh: MeshMotion | None = None
    sidebands: tuple[tuple[float, int], ...] = ()
    why_constant: str = ""

    @property
    def places(self) -> tuple[tuple[float, int], ...]:
        """Harmonic, and order of a carrier's turn beside it, of each line; of meshes in step of the first."""
        if self.mesh is not None:
            told, first = self.mesh.standing.told, self.mesh.standing.own_passes[0]
            return tuple((n / first if n % first else n // first, 0) for n in told)
        return self.sidebands or ((1, 0),)

    def maker(self, line: int) -> tuple[str, float]:
        """Return the names of what makes a line, and its harmonic there; of the first mesh where these differ."""
        if self.mesh is None:
            return self.name, self.places[line][0]
        standing, harmonic = self.mesh.standing, self.mesh.standing.told[line]
        if standing.unlike:
            return self.name, self.places[line][0]
        makers = [
            (name, harmonic // count) for name, count in zip(standing.names, standing.own_passes, strict=True)
            if harmonic in standing.of_mesh(count)
        ]  # fmt: skip
        first = makers[0][1]
        names = (name if own == first else f"{name} (its harmonic {own})" for name, own in makers)
        return " and ".join(names), first

    def frequency_Hz(self, speeds_rpm: FloatArray) -> FloatArray:
        """Frequencies of the lines, (S, K)."""
        orders = [order.order for order in self.orders[: self.told.shape[1]]]
        return np.asarray(speeds_rpm[:, None] / 60.0 * orders)


@dataclass(frozen=True)
class LoadResponse:
    """A gearbox in small motion about a load, over S speeds of the first torque's shaft, rpm.

    Parameters
    ----------
    tangent : ndarray, shape (P, P)
        Mean stiffness of the meshes on their coordinates.
    sources : tuple of Source
        Meshes of two gears first, those together that keep step, then sets.
    cycles : tuple of SetCycle
        Of the sets.
    parting : Parting, optional
        Of flanks that part, where nonlinear motion is asked for.
    """

    solved: SolvedLoad
    machine: MovingMachine
    modes: Modes
    receptance: Receptance
    tangent: FloatArray
    speeds_rpm: FloatArray
    sources: tuple[Source, ...]
    cycles: tuple[SetCycle, ...] = ()
    parting: Parting | None = None

    @property
    def passing(self) -> tuple[Source, ...]:
        """Sources that are meshes, or sets."""
        return self.sources[: sum(source.mesh is not None for source in self.sources) + len(self.cycles)]

    @property
    def of_sets(self) -> tuple[Source, ...]:
        """Sources that are sets."""
        return self.passing[len(self.passing) - len(self.cycles) :]

    def source_of(self, number: int) -> tuple[Source, MeshMotion, int]:
        """Return the source in which a mesh of two gears is, its motion, and the place of the mesh there."""
        for source in self.sources:
            if source.mesh is not None and number in source.mesh.standing.numbers:
                return source, source.mesh, source.mesh.standing.numbers.index(number)
        raise IndexError(number)

    @property
    def lost(self) -> list[str]:
        """What was not found of flanks that part, and why."""
        return [f"load {self.solved.load.name}: {text}" for text in self.parting.lost] if self.parting else []

    @property
    def speed_of(self) -> str:
        """Words for what turns at the speeds."""
        return "the shaft of the first torque" if self.machine.gearbox.beams else "the member that the torque is on"

    @property
    def mesh_names(self) -> list[str]:
        """Names of all M meshes, those of two gears first."""
        of_sets = [f"{one.name}: {mesh}" for one in self.machine.sets for mesh in ("sun - planet", "planet - ring")]
        return [mesh.meshing.settings.name for mesh in self.solved.meshes] + of_sets

    def bearing_forces(self, readings: ComplexArray) -> ComplexArray:
        """Return forces and moments on what holds each bearing, (..., bearings, 6), from readings (..., o).

        Members of sets that stand in the housing follow the bearings, in axes of their plan.
        """
        bearings = self.machine.gearbox.bearings
        found = readings[..., : NODE * len(bearings)].reshape(*readings.shape[:-1], len(bearings), NODE).copy()
        place = self._first_of_sets + HUBS * len(self.machine.sets)
        for number, bearing in enumerate(bearings):
            for direction in bearing.rigid:
                found[..., number, direction] -= readings[..., place]  # a reaction acts on the shaft
                place += 1
        housed = [self.support_forces(n, readings)[..., one.housed, :] for n, one in enumerate(self.machine.sets)]
        return np.concatenate([found, *housed], axis=-2)

    def support_forces(self, number: int, readings: ComplexArray) -> ComplexArray:
        """Return forces and moments of a set on what holds sun, carrier and ring, (..., 3, 6), from readings (..., o).

        In axes of its plan: of sun and ring on shafts none; of the carrier those of all pins, about its hub.
        """
        sets, first = self.machine.sets, self._first_of_sets
        rigid = readings.shape[-1] - sum(len(one.matrices.constraints) for one in sets[number:])
        one, found = sets[number], readings[..., first + HUBS * number : first + HUBS * (number + 1)]
        held = one.on_supports @ one.matrices.constraints.T
        return (found - readings[..., rigid : rigid + held.shape[1]] @ held.T).reshape(*found.shape[:-1], 3, NODE)

    @property
    def _first_of_sets(self) -> int:
        """First reading of the supports of sets, behind those of bearings and housing."""
        return NODE * len(self.machine.gearbox.bearings) + self.machine.housing.stop - self.machine.housing.start

    def power(self, lines: Lines, source: Source) -> FloatArray:
        """Return the equivalent radiated power of the housing by lines, (S, K), mW: 0 where no surface is given."""
        omega = 2.0 * math.pi * source.frequency_Hz(self.speeds_rpm)
        normal = self.housing(lines.readings) @ self.machine.surface.T
        return np.asarray(2.0 * AIR * omega**2 * (abs(normal) ** 2).sum(axis=-1) * source.told)

    def housing(self, readings: ComplexArray) -> ComplexArray:
        """Return the displacements of the housing's coordinates, (..., H), from readings (..., o), mm."""
        first = NODE * len(self.machine.gearbox.bearings)
        return readings[..., first : first + self.machine.housing.stop - self.machine.housing.start]


def respond(
    model: GearboxModel, solved: SolvedLoad, pairs: Mapping[str, ReducedPair], motion: Motion, speeds_rpm: FloatArray,
    kept: KeptModes | None = None,
) -> LoadResponse:  # fmt: skip
    """Return the response of a loaded gearbox.

    Parameters
    ----------
    kept : dict, optional
        Modes of gears, as of `ringing_gears`.

    Raises
    ------
    ConvergenceError
        Where a mesh has no law about its load.
    CaseError
        Where a set has no motion of constant coefficients.
    """
    standing = {mesh.number: mesh for mesh in standing_meshes(solved, pairs, motion.harmonics)}
    ringing = ringing_gears(model, solved, standing.values(), FURTHER_MODES * motion.highest_frequency_Hz,
                            {} if kept is None else kept)  # fmt: skip
    for number in {gear.mesh for gear in ringing}:
        compliance = np.sum([gear.compliance for gear in ringing if gear.mesh == number], axis=0)
        standing[number] = standing[number].without(compliance)
    machine = moving_machine(model, solved, motion.highest_frequency_Hz, ringing)
    machine = with_sets(machine, model, solved.sets)
    parts: list[StandingMesh | StandingTrain] = [*standing.values(), *standing_trains(solved, motion.harmonics)]
    parts = [replace(part, backwards=machine.backwards(part.numbers[0])) for part in parts]
    together = coherent_meshes(machine, sorted(parts, key=lambda part: part.numbers))
    of_sets = tuple(
        (one, set_cycle(one, of.meshing.file, of.solution, 0, motion.harmonics))
        for one, of in zip(machine.sets, solved.sets, strict=True)
    )
    swinging = [*unbalances(model, machine), *ripples(machine)]
    return responded(machine, solved, together, of_sets, swinging, motion, speeds_rpm)


def respond_set(
    file: SetFile, solution: SetSolution, row: int, motion: Motion, speeds_rpm: FloatArray
) -> LoadResponse:
    """Return the response of a set by itself on its supports, over speeds of its loaded member.

    Parameters
    ----------
    row : int
        Of the torque in the solution.

    Raises
    ------
    ConvergenceError, CaseError
        As `respond`.
    """
    machine = machine_of_set(file, solution.train)
    (one,), nothing = machine.sets, np.zeros(0)
    load = LoadCase(name=torque_names(file)[row], torques=())
    solved = SolvedLoad(load, machine.gearbox, Equilibrium(nothing, nothing, ()), ())
    cycle = set_cycle(one, file, solution, row, motion.harmonics)
    return responded(machine, solved, [], ((one, cycle),), [], motion, speeds_rpm)


def torque_names(file: SetFile) -> list[str]:
    """Return names of the torques of a set, as those of the loads of a gearbox."""
    return [f"{torque:g} N m" for torque in file.torques_Nm]


def responded(
    machine: MovingMachine, solved: SolvedLoad, together: Sequence[CoherentMeshes],
    of_sets: tuple[tuple[MovingSet, SetCycle], ...], swinging: Sequence[Swinging], motion: Motion,
    speeds_rpm: FloatArray,
) -> LoadResponse:  # fmt: skip
    """Return the response of a machine to its meshes, sets, and what swings with shafts."""
    cycles = [meshes.cycle() for meshes in together]
    tangent = np.zeros((len(machine.meshes), len(machine.meshes)))
    for meshes, cycle in zip(together, cycles, strict=True):
        tangent[np.ix_(meshes.ports, meshes.ports)] = cycle.mean
    for one, passing in of_sets:
        tangent[one.own, one.own] = passing.tangent
    stiffness = closed(machine, tangent)
    modes = modes_of(machine, stiffness, FURTHER_MODES * motion.highest_frequency_Hz)
    acting = np.concatenate([machine.meshes, *(one.rows for one in swinging)])
    readings = np.concatenate([
        *bearing_rows(machine, solved), np.eye(len(machine.mass))[machine.housing],
        *(one.on_supports @ one.matrices.stiffness @ machine.padded(one.by) for one in machine.sets),
    ])  # fmt: skip
    receptance = receptance_of(machine, stiffness, modes, acting, readings, motion.damping_ratio)
    sources, first = list[Source](), len(tangent)
    pairs = COORDINATES * len(solved.meshes)
    means = MeanMeshes(tangent[:pairs, :pairs], of_sets)
    at_rest = transfer(receptance, np.zeros(1)).ports[0].real
    for meshes, cycle in zip(together, cycles, strict=True):
        own = MeshMotion(meshes, cycle, at_rest[np.ix_(meshes.ports, meshes.ports)])
        sources.append(_of_meshes(machine, receptance, means, own, motion, speeds_rpm))
    sources += [_of_set(machine, receptance, means, number, motion, speeds_rpm) for number in range(len(of_sets))]
    for swings in swinging:
        ports = slice(first, first + len(swings.rows))
        sources.append(_of_shaft(machine, receptance, means, swings, ports, motion, speeds_rpm))
        first = ports.stop
    passing_sets = tuple(passing for _, passing in of_sets)
    return LoadResponse(solved, machine, modes, receptance, tangent, speeds_rpm, tuple(sources), passing_sets)


def of_mesh(number: int) -> slice:
    """Return the coordinates of a mesh among those of all."""
    return slice(COORDINATES * number, COORDINATES * (number + 1))


def _of_meshes(
    machine: MovingMachine, receptance: Receptance, means: MeanMeshes, mesh: MeshMotion, motion: Motion,
    speeds_rpm: FloatArray,
) -> Source:  # fmt: skip
    """Return what meshes that keep step excite."""
    cycle, own, standing = mesh.cycle, mesh.standing.ports, mesh.standing
    rate, speeds = machine.mesh_rate(standing.numbers[0]) / standing.own_passes[0], RPM * speeds_rpm
    orders = tuple(along(receptance, harmonic * rate, speeds, machine.sense) for harmonic in cycle.harmonics[1:])
    moving = mesh.moving(orders)
    constant = np.broadcast_to(time_invariant(cycle), moving.shape[:3])
    varying = constant if motion.mesh_stiffness == "mean" else over_pitches(cycle, moving)
    count, found = len(standing.told), list[Lines]()
    wanted = slice(1, count + 1)
    for acting in (varying, constant):
        lines = _lines(orders[:count], means, own, acting[:, wanted])
        lines.mesh_forces[..., standing.numbers] = mesh.forces(moving, acting)[:, wanted]
        found.append(lines)
    return Source(standing.name, rate, own, orders, found[0], found[1], _told(orders[:count], motion), mesh)


def _of_set(
    machine: MovingMachine, receptance: Receptance, means: MeanMeshes, number: int, motion: Motion,
    speeds_rpm: FloatArray,
) -> Source:  # fmt: skip
    (one, cycle), speeds = means.sets[number], RPM * speeds_rpm
    at_rest = transfer(receptance, np.zeros(1)).ports[0, one.own, one.own].real
    mean = motion.mesh_stiffness == "mean"
    excited = set_excitation(receptance, at_rest, one, cycle, motion.harmonics, speeds, machine.sense, mean)
    found, place = list[Lines](), len(means.pairs) // COORDINATES + 2 * number
    for acting in (excited.varying, excited.constant):
        lines = _lines(excited.orders, means, one.own, acting)
        moved = np.stack([
            np.einsum("sab,sb->sa", order.ports(one.own, one.own), acting[:, n])
            for n, order in enumerate(excited.orders)
        ], axis=1)  # fmt: skip
        lines.mesh_forces[..., place : place + 2] = over_planets(cycle, acting - moved @ cycle.tangent.T, moved)[0]
        found.append(lines)
    orders, places = excited.orders, [(line.harmonic / cycle.pitches, line.sideband) for line in excited.lines]
    if cycle.blades.carried:
        varying, constant = (_in_housing(one, lines) for lines in found)
        found, places = [varying, constant], [(harmonic, j) for harmonic, _ in places for j in SIDEBANDS]
        orders = tuple(
            replace(order, order=order.order + j * machine.sense * one.carrier) for order in orders for j in SIDEBANDS
        )
    return Source(
        one.name, abs(one.rate), one.own, orders, found[0], found[1], _told(orders, motion), sidebands=tuple(places),
        why_constant=excited.why_constant,
    )  # fmt: skip


def _in_housing(one: MovingSet, lines: Lines) -> Lines:
    """Lines of a set by itself that were seen from its carrier: each as three; what meshes do is the middle one's."""
    acting, forces, parted = (
        np.repeat(values, len(SIDEBANDS), axis=1) for values in (lines.acting, lines.mesh_forces, lines.parted)
    )
    middle = np.tile(np.array(SIDEBANDS) == 0, lines.acting.shape[1])[:, None]
    return Lines(acting, forces * middle, parted * middle, one.in_housing(lines.readings))


def _of_shaft(
    machine: MovingMachine, receptance: Receptance, means: MeanMeshes, swinging: Swinging, own: Ports, motion: Motion,
    speeds_rpm: FloatArray,
) -> Source:  # fmt: skip
    order = along(receptance, swinging.rate, RPM * speeds_rpm, machine.sense)
    growing = np.ones(len(speeds_rpm)) if swinging.steady else (RPM * speeds_rpm) ** 2
    lines = _lines((order,), means, own, (growing[:, None] * swinging.by_speed)[:, None])
    told = _told((order,), motion)
    return Source(swinging.name, swinging.rate, own, (order,), lines, lines, told)


def _lines(orders: Sequence[Order], means: MeanMeshes, own: Ports, acting: ComplexArray) -> Lines:
    """Motion under forces on some ports, (S, K, q), all meshes with their mean stiffness."""
    every = slice(0, len(means.pairs) + sum(one.size for one, _ in means.sets))
    ports = np.stack(
        [np.einsum("sab,sb->sa", order.ports(every, own), acting[:, n]) for n, order in enumerate(orders)], axis=1
    )
    forces, parted = means.moved(ports)
    readings = np.stack([order.readings(own, acting[:, n]) for n, order in enumerate(orders)], axis=1)
    return Lines(acting, forces, parted.copy(), readings)


def _told(orders: Sequence[Order], motion: Motion) -> BoolArray:
    """Whether the lines are below the highest frequency, (S, K)."""
    omega = np.stack([order.order * order.speeds for order in orders], axis=1)
    return np.asarray(omega <= 2.0 * math.pi * motion.highest_frequency_Hz)
