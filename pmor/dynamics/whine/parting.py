"""Flanks of a gearbox that part: which meshes, over which speeds, and their motion there.

Meshes part whose least force in the linear answer is not above zero, and with them those that keep step with them.
Where all of these repeat with the slowest, motion that repeats with it is followed over the speed by harmonic balance;
else it is integrated over time, speed by speed, upwards and downwards. All other meshes stay at their mean tangents;
what they and other sources excite is added to the bearings' forces by its squares, as that of sources of different
frequency is in the linear answer.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pmor.core.arrays import BoolArray, ComplexArray, FloatArray
from pmor.core.errors import ConvergenceError
from pmor.dynamics.continuation import Branch
from pmor.dynamics.integration import integrate, settle
from pmor.dynamics.law import backlash_of
from pmor.dynamics.response import response as periodic_motion
from pmor.dynamics.whine.cycle import StandingMesh
from pmor.dynamics.whine.modal import transfer
from pmor.dynamics.whine.nonlinear import PartingMachine, backlash_at, parting_machine
from pmor.dynamics.whine.readings import bearing_names
from pmor.dynamics.whine.response import RPM, LoadResponse, of_mesh
from pmor.line.hub_law import COORDINATES
from pmor.machine.loader import GearboxFile

BALANCE, OVER_TIME = "harmonic balance", "integration over time"
# Around the speeds at which flanks part in the linear answer: motion with loss of contact reaches further down.
BELOW, ABOVE = 0.8, 1.1
# Harmonics of the mesh: up to this times the highest mode that strains it, at the lowest speed of a range.
LEAST_HARMONICS, MOST_HARMONICS, BEYOND_MODES, STRAINING = 15, 60, 1.2, 0.01
# Over time: speeds of a range, cycles at each until motion is settled, by decay times of the slowest mode that strains
# a mesh, and cycles that are looked at.
SPEEDS, DECAYS, LEAST_CYCLES, MOST_CYCLES, SEEN_CYCLES = 40, 3.0, 60, 400, 64
# Phases of a cycle at which the least force of the linear answer is looked for; of the mean force, what is none.
PHASES, NOTHING = 256, 1e-9
# Of a ratio of periods: rounding.
EXACT = 1e-9
#: what is told of each parting mesh at each point, in this order
TOLD = (
    "force_rms_N", "largest_force_N", "least_force_N", "dynamic_factor", "contact_loss", "back_contact", "separation_um"
)  # fmt: skip


@dataclass(frozen=True)
class Course:
    """Motion along a branch, or on a way over the speeds; P points, M meshes that part, B bearings.

    Parameters
    ----------
    name : str
    period : int
        Mesh cycles after which motion repeats; 0 over time.
    meshes : ndarray, shape (P, M, 7)
        As `TOLD`.
    bearings : ndarray, shape (P, B)
        Forces, rms of all sources, N.
    """

    name: str
    period: int
    speeds_rpm: FloatArray
    stable: BoolArray
    meshes: FloatArray
    bearings: FloatArray


@dataclass(frozen=True)
class Parting:
    """What becomes of flanks that part under a load.

    Parameters
    ----------
    numbers : tuple of int
        Of the meshes that part, the slowest first; none do where it is empty.
    by : str
        `BALANCE`, `OVER_TIME`, or empty.
    least : ndarray, shape (S, meshes)
        Least force of each mesh of two gears in the linear answer, over its mean.
    ranges_rpm : tuple of (float, float)
        Over which motion was looked for.
    backlash_um : tuple of float
        Of the meshes that part, under the load; infinite where backs of teeth are not known.
    jumps : tuple of (float, str)
        Speeds at which motion jumps, and on which way.
    doublings_rpm, swaying_rpm : tuple of float
        Where motion of twice the period begins, and where motion begins to sway with a frequency of its own.
    lost : tuple of str
        Failures, and why.
    """

    numbers: tuple[int, ...]
    by: str
    least: FloatArray
    ranges_rpm: tuple[tuple[float, float], ...] = ()
    backlash_um: tuple[float, ...] = ()
    courses: tuple[Course, ...] = ()
    jumps: tuple[tuple[float, str], ...] = ()
    doublings_rpm: tuple[float, ...] = ()
    swaying_rpm: tuple[float, ...] = ()
    harmonics: tuple[int, ...] = ()
    lost: tuple[str, ...] = ()


def parting(response: LoadResponse, file: GearboxFile) -> Parting:
    """Find the motion of meshes of two gears whose flanks part about a load."""
    least = least_forces(response)
    parted = np.flatnonzero((least <= 0.0).any(axis=0)).tolist()
    if not parted:
        return Parting((), "", least)
    together = {number for one in parted for number in response.source_of(one)[1].standing.numbers}
    numbers = tuple(sorted(together, key=response.machine.mesh_rate))
    ratios = [response.machine.mesh_rate(number) / response.machine.mesh_rate(numbers[0]) for number in numbers]
    by = BALANCE if all(abs(ratio - round(ratio)) <= EXACT for ratio in ratios) else OVER_TIME
    ranges = ranges_of(response.speeds_rpm, np.any(least <= 0.0, axis=1))
    backlash = [backlash_of_mesh(response, file, number) for number in numbers]
    found = Parting(numbers, by, least, ranges)
    found = replace(found, backlash_um=tuple(1e3 * one for one in backlash))
    try:
        machine = machine_of(response, numbers, backlash)
    except ConvergenceError as error:
        return replace(found, lost=(str(error),))
    for low, high in ranges:
        found = (_balanced if by == BALANCE else over_time)(response, found, machine, low, high)
    return found


def least_forces(response: LoadResponse) -> FloatArray:
    """Return the least force of each mesh of two gears in the linear answer over its mean, (S, meshes).

    Lines of its own in their phases, those above the highest frequency too; those of other sources at their largest.
    """
    speeds, found = len(response.speeds_rpm), np.ones((len(response.speeds_rpm), len(response.solved.meshes)))
    phase = 2.0 * np.pi * np.arange(PHASES) / PHASES
    for number, solved in enumerate(response.solved.meshes):
        least = np.zeros(speeds)
        for source in response.sources:
            lines = source.lines.mesh_forces[..., number]
            if source.mesh is not None and number in source.mesh.standing.numbers:
                turns = np.exp(1j * np.array(source.mesh.standing.told)[:, None] * phase)
                least += 2.0 * (lines @ turns).real.min(axis=1)
            else:
                least -= 2.0 * abs(lines).sum(axis=1)
        found[:, number] += least / float(solved.force)
    return found


def ranges_of(speeds: FloatArray, parted: BoolArray) -> tuple[tuple[float, float], ...]:
    """Return the ranges of speeds over which motion is looked for, around those at which flanks part."""
    ranges = list[tuple[float, float]]()
    for speed in speeds[parted].tolist():
        low, high = max(BELOW * speed, float(speeds[0])), min(ABOVE * speed, float(speeds[-1]))
        if ranges and low <= ranges[-1][1]:
            ranges[-1] = ranges[-1][0], high
        else:
            ranges.append((low, high))
    return tuple(ranges)


def backlash_of_mesh(response: LoadResponse, file: GearboxFile, number: int) -> float:
    """Return the backlash of a mesh under its load along the line of action, mm; infinite where backs are not known."""
    meshing = response.machine.gearbox.meshes[number]
    drawn = backlash_of(file.cases[meshing.settings.name], meshing.pair)
    return np.inf if drawn is None else max(backlash_at(_standing(response, number)[0], drawn), 0.0)


def _standing(response: LoadResponse, number: int) -> tuple[StandingMesh, float]:
    """A mesh where its hubs stand, and by how much of its cycle it is ahead at time 0."""
    _, motion, place = response.source_of(number)
    mesh = motion.standing.parts[place]
    assert isinstance(mesh, StandingMesh), "gears have no other mesh"
    return mesh, motion.standing.ahead[place]


def machine_of(response: LoadResponse, numbers: Sequence[int], backlash: Sequence[float]) -> PartingMachine:
    """Return the machine whose meshes part, by their numbers, with their backlash, mm; without gyroscopic moments."""
    standing = [_standing(response, number) for number in range(len(response.solved.meshes))]
    rates = [response.machine.mesh_rate(number) for number in numbers]
    return parting_machine(
        response.receptance, response.tangent, [mesh for mesh, _ in standing], numbers,
        [rate / rates[0] for rate in rates], backlash=backlash, ahead=[standing[number][1] for number in numbers],
    )  # fmt: skip


def _balanced(response: LoadResponse, found: Parting, machine: PartingMachine, low: float, high: float) -> Parting:
    """Follow motion that repeats with the mesh over a range of speeds; over time where none is found."""
    rate = RPM * response.machine.mesh_rate(found.numbers[0])
    spin = 0.5 * response.machine.sense * RPM * (low + high)
    spinning, harmonics = machine.spun(response.receptance, spin), _harmonics(response, found.numbers, rate * low)
    try:
        solved = periodic_motion(spinning.oscillator, spinning.law, (rate * low, rate * high), harmonics)
    except ConvergenceError as error:
        reason = f"{error}; motion is integrated over time from {low:.5g} to {high:.5g} rpm"
        return over_time(response, replace(found, lost=(*found.lost, reason)), machine, low, high)
    further = _others(response, found.numbers)
    courses = tuple(
        _along(response, found, spinning, branch, stable, spin, further, f"branch {number}")
        for number, (branch, stable) in enumerate(zip(solved.branches, solved.stable, strict=True), len(found.courses))
    )
    lost = [
        f"{course.name}: ends at {course.speeds_rpm[-1]:.5g} rpm: {branch.ended}"
        for course, branch in zip(courses, solved.branches, strict=True)
        if not branch.ended.startswith(("end of", "back at"))
    ]
    return replace(
        found, courses=found.courses + courses, lost=(*found.lost, *solved.lost, *lost),
        jumps=found.jumps + tuple((fold.point.speed / rate, fold.kind) for fold in solved.folds),
        doublings_rpm=found.doublings_rpm + tuple(point.speed / rate for point in solved.doublings),
        swaying_rpm=found.swaying_rpm + tuple(speed / rate for speed in solved.swaying),
        harmonics=(*found.harmonics, harmonics),
    )  # fmt: skip


def _harmonics(response: LoadResponse, numbers: Sequence[int], lowest: float) -> int:
    """Harmonics up to beyond the highest mode that strains a mesh, at the lowest angular mesh frequency."""
    highest = math.sqrt(max(_straining(response, numbers)[-1:], default=0.0))
    return int(np.clip(math.ceil(BEYOND_MODES * highest / lowest), LEAST_HARMONICS, MOST_HARMONICS))


def _straining(response: LoadResponse, numbers: Sequence[int]) -> list[float]:
    """Squares of the angular frequencies of modes in which meshes have a share of the strain energy."""
    square, found = response.modes.square, np.zeros(len(response.modes.square))
    for own in map(of_mesh, numbers):
        ports = response.receptance.ports[own]
        found = np.maximum(found, (ports * (response.tangent[own, own] @ ports)).sum(axis=0))
    return square[(square > 0.0) & (found > STRAINING * square)].tolist()


def _along(
    response: LoadResponse, found: Parting, machine: PartingMachine, branch: Branch, stable: BoolArray, spin: float,
    further: FloatArray, name: str,
) -> Course:  # fmt: skip
    """Return what is told along a branch."""
    balance, rows, bearings = branch.balance, list[FloatArray](), list[FloatArray]()
    own = np.concatenate([np.arange(COORDINATES) + COORDINATES * number for number in found.numbers])
    order = np.arange(1, balance.orders + 1) / balance.cycles
    for point in branch.points:
        moved = np.ascontiguousarray(balance.displacement(point.unknowns))
        force, at = machine.law.mesh_forces(balance.phase, moved)
        rows.append(_told(machine, force, at))
        pushed = machine.law.forces(balance.phase, moved)[0]
        lines = np.fft.rfft(pushed, axis=1)[:, 1 : balance.orders + 1] / pushed.shape[1]
        frequency = point.speed * order
        by_ports = transfer(response.receptance, frequency, np.full(len(frequency), spin)).readings[..., own]
        readings: ComplexArray = np.einsum("kop,pk->ko", by_ports, machine.arms[:, None] * lines)
        squares = 2.0 * (abs(response.bearing_forces(readings)[..., :3]) ** 2).sum(axis=(0, 2))
        bearings.append(squares)
    speeds = branch.speed / (RPM * response.machine.mesh_rate(found.numbers[0]))
    return Course(name, balance.cycles, speeds, stable, np.array(rows),
                  _with_others(np.array(bearings), speeds, response, further))  # fmt: skip


def _told(machine: PartingMachine, force: FloatArray, at: FloatArray) -> FloatArray:
    """What is told of each mesh over a period, (M, 7), of forces and approaches (r, s)."""
    pushed, mean = force[::COORDINATES], machine.law.meshes.load[::COORDINATES, None]
    none, backs = abs(pushed) <= NOTHING * mean, pushed < -NOTHING * mean
    return np.column_stack([
        pushed.std(axis=1), pushed.max(axis=1), pushed.min(axis=1), (pushed / mean).max(axis=1), none.mean(axis=1),
        backs.mean(axis=1), 1e3 * np.maximum(0.0, -at[::COORDINATES].min(axis=1)),
    ])  # fmt: skip


def _others(response: LoadResponse, numbers: Sequence[int]) -> FloatArray:
    """Mean squares of the bearing forces by all other sources, in the linear answer, (S, B)."""
    own = {id(response.source_of(number)[0]) for number in numbers}
    others = [source for source in response.sources if id(source) not in own]
    nothing = np.zeros((len(response.speeds_rpm), len(bearing_names(response))))
    return np.asarray(sum(((response.force_lines(one) ** 2).sum(axis=1) for one in others), nothing))


def _with_others(squares: FloatArray, speeds: FloatArray, response: LoadResponse, further: FloatArray) -> FloatArray:
    beside = [np.interp(speeds, response.speeds_rpm, one) for one in further.T]
    return np.sqrt(squares + np.array(beside).T.reshape(squares.shape))


def over_time(response: LoadResponse, found: Parting, machine: PartingMachine, low: float, high: float) -> Parting:
    """Integrate speed by speed up and down a range, the motion at one the start of the next."""
    rate, oscillator = RPM * response.machine.mesh_rate(found.numbers[0]), machine.oscillator
    slowest = min(_straining(response, found.numbers), default=np.inf)
    decay = response.receptance.damping_ratio[-1] * math.sqrt(slowest)
    further, speeds = _others(response, found.numbers), np.linspace(low, high, SPEEDS)
    elastic = response.modes.square > 0.0
    own = np.concatenate([np.arange(COORDINATES) + COORDINATES * number for number in found.numbers])
    by_modes, left = response.receptance.readings[:, elastic], response.receptance.left_readings[:, own] * machine.arms
    for name, way in (("run-up", speeds), ("run-down", speeds[::-1])):
        state, done, rows, bearings = np.zeros(2 * oscillator.size), 0, list[FloatArray](), list[FloatArray]()
        try:
            for speed in (rate * way).tolist():
                cycles = int(np.clip(DECAYS * speed / (2.0 * np.pi * decay), LEAST_CYCLES, MOST_CYCLES))
                state, done = settle(oscillator, machine.law, state, speed, cycles, done), done + cycles
                motion = integrate(oscillator, machine.law, state, (speed, speed), SEEN_CYCLES, done=done)
                state, done = motion.states[-1], done + SEEN_CYCLES
                moved = np.ascontiguousarray(motion.displacement.T)
                rows.append(_told(machine, *machine.law.mesh_forces(motion.phase, moved)))
                readings = motion.states[:, : oscillator.size] @ by_modes.T
                readings += (motion.force - machine.law.meshes.load) @ left.T
                force = response.bearing_forces(readings.astype(complex))[..., :3].real
                bearings.append(force.var(axis=0).sum(axis=-1))
        except ConvergenceError as error:
            found = replace(found, lost=(*found.lost, f"{name}: {error}"))
        if rows:
            told = way[: len(rows)]
            course = Course(name, 0, told, np.ones(len(told), dtype=bool), np.array(rows),
                            _with_others(np.array(bearings), told, response, further))  # fmt: skip
            found = replace(found, courses=(*found.courses, course))
    return found
