"""The motion of a pair under one torque, as plain data: branches and folds, run-up, run-down, each by itself.

A task can go to another process: it holds numbers alone.
Speeds of the pinion, rpm, stand beside the mesh frequencies, Hz.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from pmor.core.arrays import BoolArray, FloatArray
from pmor.core.errors import ConvergenceError
from pmor.dynamics.continuation import Branch
from pmor.dynamics.force_law import LoadLimit, SolvedLaw, cycles_of, mean_stiffness, static_displacement
from pmor.dynamics.gear_model import GearModel, NaturalModes, natural_modes
from pmor.dynamics.harmonic_balance import SAMPLES, in_Hz, rms, solve_at, without_harmonic
from pmor.dynamics.harmonic_balance import rest as resting
from pmor.dynamics.integration import SAMPLES as RUN_SAMPLES
from pmor.dynamics.integration import Motion, integrate, run_through
from pmor.dynamics.kernels.laws import ForceTable
from pmor.dynamics.oscillator import Oscillator, position_under
from pmor.dynamics.peaks import peaks_of
from pmor.dynamics.quantities import UM, cycle_of, quantities
from pmor.dynamics.response import HARMONICS, Response, response
from pmor.line.hertz import TOO_WIDE

HZ = 1.0 / (2.0 * np.pi)
# Cycles at the first speed of a run, in which the disturbance by its start dies out.
SETTLING = 300
# Highest harmonic at the lowest speed, over the natural frequency.
BEYOND_NATURAL = 1.6
# Harmonics whose products the samples of harmonic balance tell apart.
MOST_HARMONICS = SAMPLES // 4
# Points that are kept of a run.
RUN_POINTS = 400
# Spectra of a run: cycles of each, at least, highest order, how many.
SPECTRUM_CYCLES, HIGHEST_ORDER, SPECTRA = 8, 5.0, 150
# Samples of a cycle that are kept where motion is largest.
HISTORY = 256

# Parts of a response, each solved by itself; the last two are keys of it.
BRANCHES, RUN_UP, RUN_DOWN = "branches", "run_up", "run_down"
RUNS = RUN_UP, RUN_DOWN

# Name of the first degree of freedom.
MESH_MOTION = "gears against each other"

Data = dict[str, Any]


@dataclass(frozen=True)
class Task:
    """A pair under one torque."""

    model: GearModel
    law: ForceTable
    torque_Nm: float
    mesh_damping: float | None  # N s/mm; None by the ratio
    damping_ratio: float
    limits: tuple[float, float]  # Mesh frequencies, Hz or over the natural one
    in_Hz: bool
    run_cycles: int
    exact: SolvedLaw | None = None  # Law of the branches, instead of the table
    limit: LoadLimit | None = None  # Of the motion in which no section is overloaded

    @property
    def repeats(self) -> bool:
        """Whether the law repeats with the mesh, as motion on a branch does."""
        return cycles_of(self.law) == 1


@dataclass(frozen=True)
class AtRest:
    """A pair at rest under its torque, and its small vibrations."""

    oscillator: Oscillator
    stiffness: float  # Of the mesh, mean of the tangent over the cycle, N/mm
    modes: NaturalModes
    interval: tuple[float, float]  # Range of displacements of the law

    @property
    def natural(self) -> float:
        """Angular frequency of the mode in which the mesh gives way most."""
        return float(self.modes.frequency[self.modes.of_mesh])


def at_rest(task: Task) -> AtRest:
    """Return the state at rest and the small vibrations; ConvergenceError where the table does not bear the torque."""
    interval = task.law.low, task.law.high
    load = float(task.model.oscillator(task.torque_Nm, 0.0).load[0])
    stiffness = mean_stiffness(task.law, load, interval)
    damping = task.mesh_damping
    if damping is None:
        damping = 2.0 * task.damping_ratio * float(np.sqrt(stiffness * task.model.mass))
    oscillator = task.model.oscillator(task.torque_Nm, damping)
    return AtRest(oscillator, stiffness, natural_modes(oscillator, stiffness), interval)


def speeds_of(task: Task, rest: AtRest) -> tuple[float, float]:
    """Return the lowest and the highest mesh frequency, angular."""
    scale = 1.0 / HZ if task.in_Hz else rest.natural
    return scale * task.limits[0], scale * task.limits[1]


def needed_harmonics(rest: AtRest, limits: tuple[float, float]) -> int:
    """Return the number of harmonics of the mesh frequency up to well above the natural frequency at all speeds.

    ConvergenceError where these are more than the samples of a mesh cycle tell.
    """
    highest = BEYOND_NATURAL * rest.natural
    if highest > MOST_HARMONICS * limits[0]:
        raise ConvergenceError(
            f"at mesh frequencies below {in_Hz(highest / MOST_HARMONICS)} the natural frequency is beyond the "
            f"{MOST_HARMONICS} harmonics that are solved for: raise the lowest mesh frequency"
        )
    return max(HARMONICS, math.ceil(highest / limits[0]))


def solve(task: Task, part: str) -> Data:
    """Return a part, BRANCHES or one of RUNS, of a response: keys of `dynamics.json`, and failures in `lost`.

    ConvergenceError for branches, where the table does not bear the torque.
    """
    return _branches(task) if part == BRANCHES else _run(task, part)


def joined(parts: Iterable[Data]) -> Data:
    """Return the response to a torque, as `dynamics.json` holds it, from the branches and the runs there are."""
    whole: Data = {**dict.fromkeys((*RUNS, "waterfall")), "lost": []}
    for part in parts:
        whole = {**whole, **part, "lost": [*whole["lost"], *part["lost"]]}
    return whole


def _branches(task: Task) -> Data:
    rest = at_rest(task)
    limits, lost = speeds_of(task, rest), list[str]()
    solved = Response((), (), (), ())
    if task.repeats:
        try:
            solved = response(rest.oscillator, task.exact or task.law, limits, needed_harmonics(rest, limits))
        except ConvergenceError as error:
            lost.append(f"response: {error}")
    lost += solved.lost
    lost += [
        f"branch {number}: ends at {_hz(branch.points[-1].speed):.6g} Hz: {branch.ended}"
        for number, branch in enumerate(solved.branches)
        if not branch.ended.startswith(("end of", "back at"))
    ]
    for number, branch in enumerate(solved.branches):
        balance = branch.balance
        wide = [
            p.speed for p in branch.points if _overloads(task, balance.phase, balance.displacement(p.unknowns)[0]).any()
        ]
        lost += _overloaded(f"branch {number}", wide)
    points = [_points(task.model, *pair) for pair in zip(solved.branches, solved.stable, strict=True)]
    modes = _modes(task.model, rest.modes)
    static = UM * static_displacement(task.law, float(rest.oscillator.load[0]), _phases(task.law), rest.interval)
    return {
        "torque_Nm": task.torque_Nm,
        "natural_frequency_Hz": _hz(rest.natural),
        "natural_frequencies_Hz": [_hz(frequency) for frequency in rest.modes.frequency],
        "modes": modes,
        "mesh_stiffness_mean_N_per_um": 1e-3 * rest.stiffness,
        "mesh_damping_N_s_mm": float(rest.oscillator.damping[0, 0]),
        "mesh_force_mean_N": float(rest.oscillator.load[0]),
        "ste_mean_um": float(static.mean()),
        "ste_rms_um": float(static.std()),
        "ste_peak_to_peak_um": float(np.ptp(static)),
        "mesh_frequencies_Hz": [_hz(speed) for speed in limits],
        "branches": points,
        "peaks": peaks_of(points, modes, partial(_rms_without, task, solved)),
        "folds": [
            {"mesh_frequency_Hz": _hz(fold.point.speed), "dte_rms_um": UM * float(rms(fold.point.unknowns)),
             "kind": fold.kind}
            for fold in solved.folds
        ],
        "period_doublings_Hz": [_hz(point.speed) for point in solved.doublings],
        "swaying_Hz": [_hz(speed) for speed in solved.swaying],
        "largest": _largest(task.model, solved),
        "lost": lost,
    }  # fmt: skip


def _modes(model: GearModel, modes: NaturalModes) -> list[Data]:
    names = [MESH_MOTION, *(support.name for support in model.supports)]
    return [
        {"natural_frequency_Hz": _hz(frequency), "mesh_strain_energy_share": float(share),
         "moves_most": names[int(kinetic.argmax())]}
        for frequency, share, kinetic in zip(modes.frequency, modes.mesh_share, modes.kinetic, strict=True)
    ]  # fmt: skip


def _points(model: GearModel, branch: Branch, stable: Any) -> list[Data]:
    return [
        {"mesh_frequency_Hz": _hz(point.speed), "stable": bool(holds), "period_mesh_cycles": branch.balance.cycles}
        | asdict(quantities(model, branch.balance, point.unknowns, point.speed))
        for point, holds in zip(branch.points, stable, strict=True)
    ]


def _rms_without(task: Task, solved: Response, branch: int, place: int, order: int) -> float | None:
    """Transmission error at a point with a harmonic of the excitation switched off, by the table; None: not found."""
    balance, point = replace(solved.branches[branch].balance, law=task.law), solved.branches[branch].points[place]
    if order * balance.cycles > balance.orders:
        return None
    balance = without_harmonic(balance, order)
    for start in (resting(balance), point.unknowns):
        try:
            return UM * float(rms(solve_at(balance, point.speed, start)))
        except ConvergenceError:
            continue
    return None


def _largest(model: GearModel, solved: Response) -> Data | None:
    """Return the stable motion of the largest root mean square, over its cycle."""
    held = [
        (float(rms(point.unknowns)), number, place)
        for number, (branch, stable) in enumerate(zip(solved.branches, solved.stable, strict=True))
        for place, point in enumerate(branch.points)
        if stable[place]
    ]
    if not held:
        return None
    _, number, place = max(held)
    branch = solved.branches[number]
    point = branch.points[place]
    cycle = cycle_of(model, branch.balance, point.unknowns, point.speed)
    every = len(cycle.phase) // HISTORY
    return {
        "mesh_frequency_Hz": _hz(point.speed),
        "mesh_cycles": (cycle.phase[::every] / (2.0 * np.pi)).tolist(),
        "displacement_um": (UM * cycle.displacement[::every]).tolist(),
        "velocity_mm_s": cycle.velocity[::every].tolist(),
        "mesh_force_N": cycle.force[::every].tolist(),
        "bearing_displacement_um": {
            support.name: (UM * cycle.positions[::every, place]).tolist()
            for place, support in enumerate(model.supports)
        },
    }


def _run(task: Task, key: str) -> Data:
    """Integrate over time through the speeds, up or down; the way up gives spectra too."""
    try:
        rest = at_rest(task)
        limits = speeds_of(task, rest)
        pieces = _pieces(task, rest, *(limits if key == RUN_UP else limits[::-1]))
        wide = list[float]()
        points, spectra = follow(_watched(task, pieces, wide), task.run_cycles, cycles_of(task.law))
    except ConvergenceError as error:
        return {key: None, "lost": [f"{key}: {error}"]}
    return {key: points, "lost": _overloaded(key, wide)} | ({"waterfall": spectra} if key == RUN_UP else {})


def _watched(task: Task, pieces: Iterable[Motion], speeds: list[float]) -> Iterator[Motion]:
    """Yield the pieces of a run; `speeds` takes those of cycles in which a section is overloaded."""
    for piece in pieces:
        wide = _overloads(task, piece.phase, piece.displacement).reshape(-1, RUN_SAMPLES).any(axis=1)
        speeds.extend(piece.cycle_speed[wide].tolist())
        yield piece


def _overloads(task: Task, phase: FloatArray, x: FloatArray) -> BoolArray:
    """Whether a section is overloaded, at phases and displacements."""
    if task.limit is None or np.isinf(task.limit.displacement).all():
        return np.zeros(len(x), dtype=bool)
    return task.limit.exceeded(phase, x)


def _overloaded(name: str, speeds: Sequence[float]) -> list[str]:
    """Sentence on a part of a response in which a section is overloaded at some speeds; none without such speeds."""
    if not speeds:
        return []
    return [f"{name}: from {_hz(min(speeds)):.6g} to {_hz(max(speeds)):.6g} Hz motion {TOO_WIDE}"]


def _pieces(task: Task, rest: AtRest, first: float, last: float) -> Iterator[Motion]:
    """Yield the pieces of a run that begins settled at its first speed."""
    oscillator, law = rest.oscillator, task.law
    start = resting_state(oscillator, law, rest.interval)
    settling = cycles_of(law) * math.ceil(SETTLING / cycles_of(law))
    settled = integrate(oscillator, law, start, (first, first), settling).states[-1]
    yield from run_through(oscillator, law, settled, (first, last), task.run_cycles)


def resting_state(oscillator: Oscillator, law: ForceTable, interval: tuple[float, float]) -> FloatArray:
    """Return displacements and velocities at rest under the load at phase 0."""
    force = float(oscillator.load[0] / oscillator.lever[0])
    along = static_displacement(law, force, np.zeros(1), interval)[0]
    return np.append(position_under(oscillator, np.array([force]), np.array([along])), np.zeros(oscillator.size))


def follow(pieces: Iterable[Motion], cycles: int, period: int = 1) -> tuple[list[Data], Data | None]:
    """Return the points of a run, piece by piece, and the spectra along it; None for a short run.

    A long run, of so many cycles in all, has more samples than memory. Spectra are those of whole periods of the law.
    """
    kept, spectra = list[FloatArray](), list[tuple[float, FloatArray]]()
    block = period * math.ceil(SPECTRUM_CYCLES / period)
    stride, due, done = max(block, cycles // SPECTRA), 0, 0
    for piece in pieces:
        force = piece.force.reshape(-1, RUN_SAMPLES)
        apart = (force == 0.0).mean(axis=1)
        parted = np.maximum(0.0, -piece.displacement.reshape(-1, RUN_SAMPLES).min(axis=1))
        pushed = force.max(axis=1), force.mean(axis=1)
        kept.append(np.column_stack([piece.cycle_speed, piece.rms, apart, *pushed, parted]))
        count = len(apart)
        while due < done + count:
            start = min(due - done, count - block)
            if start >= 0:
                spectra.append((float(piece.cycle_speed[start : start + block].mean()),
                                _spectrum(piece.displacement[start * RUN_SAMPLES :], block)))  # fmt: skip
            due += stride
        done += count
    return _run_points(np.concatenate(kept), period), _spectra(spectra, block)


def _run_points(kept: FloatArray, period: int) -> list[Data]:
    """Motion over a run, of neighbouring cycles: mean frequency and loss of contact, largest force and separation."""
    ends = np.linspace(0, len(kept), min(RUN_POINTS, max(len(kept) // period, 1)) + 1).astype(int)
    points = []
    for a, b in zip(ends[:-1], ends[1:], strict=True):
        speed, size, apart, largest, mean, parted = kept[a:b].T
        points.append({
            "mesh_frequency_Hz": _hz(speed.mean()), "dte_rms_um": UM * float(np.sqrt((size**2).mean())),
            "contact_loss": float(apart.mean()), "largest_force_N": float(largest.max()),
            "dynamic_factor": float(largest.max() / mean.mean()), "separation_um": UM * float(parted.max()),
        })  # fmt: skip
    return points


def _spectrum(displacement: FloatArray, cycles: int) -> FloatArray:
    """Amplitudes of the orders of the mesh frequency in the first cycles of some, whole and broken orders.

    Without a window: motion repeats after these cycles, or after a part of them.
    """
    block = displacement[: cycles * RUN_SAMPLES]
    count = int(HIGHEST_ORDER * cycles) + 1
    return np.asarray(np.abs(np.fft.rfft(block - block.mean()))[:count] * (2.0 / len(block)))


def _spectra(spectra: list[tuple[float, FloatArray]], cycles: int) -> Data | None:
    if not spectra:
        return None
    return {
        "mesh_frequency_Hz": [_hz(speed) for speed, _ in spectra],
        "order": (np.arange(len(spectra[0][1])) / cycles).tolist(),
        # Of five digits: a picture shows three.
        "amplitude_um": [[float(f"{UM * amplitude:.5g}") for amplitude in spectrum] for _, spectrum in spectra],
    }


def _phases(law: ForceTable) -> FloatArray:
    return np.asarray(2.0 * np.pi / HISTORY * np.arange(HISTORY * cycles_of(law)), dtype=float)


def _hz(speed: Any) -> float:
    return float(HZ * speed)


#: keys of the speed, by those of the frequency: at a natural speed the mesh has the natural frequency
SPEEDS = {
    "mesh_frequency_Hz": "speed_rpm",
    "mesh_frequencies_Hz": "speeds_rpm",
    "natural_frequency_Hz": "natural_speed_rpm",
    "natural_frequencies_Hz": "natural_speeds_rpm",
    "period_doublings_Hz": "period_doublings_rpm",
    "swaying_Hz": "swaying_rpm",
    "resonance_Hz": "resonance_rpm",
}


def rpm(frequency_Hz: float, teeth: int) -> float:
    """Return the speed in rpm at which a pinion with so many teeth has a mesh frequency."""
    return 60.0 * frequency_Hz / teeth


def mesh_Hz(speed_rpm: float, teeth: int) -> float:
    """Return the mesh frequency in Hz of a pinion with so many teeth at a speed."""
    return speed_rpm * teeth / 60.0


def with_speeds(data: Any, teeth: int) -> Any:
    """Return plain data with the speed of the pinion in rpm beside each frequency in it with a key of `SPEEDS`."""
    if isinstance(data, list | tuple):
        return [with_speeds(value, teeth) for value in data]
    if not isinstance(data, dict):
        return data
    content = {}
    for key, value in data.items():
        content[key] = with_speeds(value, teeth)
        if key in SPEEDS:
            content[SPEEDS[key]] = [rpm(f, teeth) for f in value] if isinstance(value, list) else rpm(value, teeth)
    return content
