"""How the response of a loaded machine is found: forces of its meshes, sets and shafts, and what these move."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pmor.case.motion import Motion
from pmor.core.arrays import BoolArray, ComplexArray, FloatArray
from pmor.dynamics.whine.blades import SIDEBANDS
from pmor.dynamics.whine.coherent import CoherentMeshes, coherent_meshes
from pmor.dynamics.whine.cycle import StandingMesh, StandingTrain, standing_meshes, standing_trains
from pmor.dynamics.whine.modal import Receptance, closed, modes_of, receptance_of, transfer
from pmor.dynamics.whine.moving import MovingMachine, bearing_rows, moving_machine
from pmor.dynamics.whine.moving_sets import machine_of_set, with_sets
from pmor.dynamics.whine.orders import Order, Ports, along
from pmor.dynamics.whine.pitches import over_pitches, time_invariant
from pmor.dynamics.whine.planets import MovingSet
from pmor.dynamics.whine.response import RPM, Lines, LoadResponse, MeshMotion, Source
from pmor.dynamics.whine.ringing import KeptModes, ringing_gears
from pmor.dynamics.whine.set_cycle import SetCycle, set_cycle
from pmor.dynamics.whine.set_response import over_planets, set_excitation
from pmor.dynamics.whine.swinging import Swinging, ripples, turning, unbalances
from pmor.line.hub_law import COORDINATES
from pmor.machine.coupled import SolvedLoad
from pmor.machine.load_settings import LoadCase
from pmor.machine.model import GearboxModel
from pmor.machine.system import Equilibrium
from pmor.sets.loader import SetFile
from pmor.sets.solution import SetSolution
from pmor_online.model import ReducedPair

# Modes go up to this times the highest frequency.
FURTHER_MODES = 2.0


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
    swinging = [*unbalances(model, machine), *turning(machine), *ripples(machine)]
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
        one.name, abs(one.rate), one.own, orders, found[0], found[1], _told(orders, motion), of_set=excited.motion,
        sidebands=tuple(places), why_constant=excited.why_constant,
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
