"""Motion over time at constant speed or while the speed rises or falls: the second way to an answer, without orders.

Pairs and machines whose meshes part go the same way, in steps of even phase (`pmor.dynamics.kernels.motion`). Nothing
is assumed of the motion, so that a run-up passes over folds as the machine does, jumping where its motion ends.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from pmor.core.arrays import FloatArray
from pmor.core.errors import ConvergenceError
from pmor.dynamics.force_law import (
    MachineLaw,
    OverTime,
    centre_of,
    compiled_law,
    coordinate_forces,
    cycles_of,
    steps_of,
    stiffness_of,
)
from pmor.dynamics.harmonic_balance import in_Hz
from pmor.dynamics.kernels.motion import FreeMotion, march
from pmor.dynamics.oscillator import Oscillator, static_stiffness_of

# Samples per mesh cycle, and cycles that are integrated at a time.
SAMPLES, CYCLES_PER_PIECE = 64, 100
# Longest step by the frequency of the masses on the mesh alone.
LONGEST_STEP = 0.1

# Of a sample, rad.
PHASE = 2.0 * np.pi / SAMPLES


@dataclass(frozen=True)
class Motion:
    """Motion over whole mesh cycles."""

    phase: FloatArray  # shape (s,): Of the mesh; the start is not among them, the end is
    speed: FloatArray  # shape (s,): Mesh frequency, angular
    states: FloatArray  # shape (s, 2n): Displacements and velocities
    # shape (s,), or (s, r) of r coordinates: along the line of action
    displacement: FloatArray
    force: FloatArray
    period: int = 1  # Mesh cycles after which the law repeats

    @property
    def rms(self) -> FloatArray:
        """Root mean square of the displacement of each mesh cycle about its mean over the period of the law, (cycles,).

        What is left of a period at the end has its own mean.
        """
        cycles = self.displacement.reshape(-1, SAMPLES)
        first = np.arange(0, len(cycles), self.period)
        lengths = np.diff(np.append(first, len(cycles)))
        means = np.repeat(np.add.reduceat(cycles.mean(axis=1), first) / lengths, lengths)
        return np.asarray(np.sqrt(((cycles - means[:, None]) ** 2).mean(axis=1)))

    @property
    def cycle_speed(self) -> FloatArray:
        """Mean mesh frequency of each cycle, (cycles,)."""
        return np.asarray(self.speed.reshape(-1, SAMPLES).mean(axis=1))


def integrate(
    oscillator: Oscillator, law: OverTime, start: FloatArray, speeds: tuple[float, float], cycles: int,
    steps: int | None = None, done: float = 0.0,
) -> Motion:  # fmt: skip
    """Integrate over mesh cycles while the speed changes evenly over time, even in each cycle.

    Parameters
    ----------
    start : ndarray, shape (2n,)
        Displacements and velocities.
    speeds : tuple of float
        Mesh frequencies at the beginning and at the end.
    steps : int, optional
        Of a sample; by default those of the law, and as many as its stiffness asks for.
    done : float
        Mesh cycles before these.

    Raises
    ------
    ConvergenceError
        Where the motion leaves the range of the force law.
    """
    states, cycle_speed = _marched(oscillator, law, start, speeds, cycles, steps, done, kept=True)
    states = states.reshape(-1, len(start))
    phase = 2.0 * np.pi * (done + np.arange(1, cycles * SAMPLES + 1) / SAMPLES)
    along = states[:, : oscillator.size] @ oscillator.lever.T + _offset(law)
    force = coordinate_forces(law, phase, np.atleast_2d(along.T))[0].T.reshape(along.shape)
    return Motion(phase, np.repeat(cycle_speed, SAMPLES), states, along, force, cycles_of(law))


def settle(
    oscillator: Oscillator, law: OverTime, start: FloatArray, speed: float, cycles: int, done: float = 0.0
) -> FloatArray:
    """Return displacements and velocities after so many cycles at a speed; arguments as in `integrate`."""
    state, _ = _marched(oscillator, law, start, (speed, speed), cycles, None, done, kept=False)
    return state


def _marched(
    oscillator: Oscillator, law: OverTime, start: FloatArray, speeds: tuple[float, float], cycles: int,
    steps: int | None, done: float, kept: bool,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """States at the samples, or where they are not kept that at the end; the speed of each cycle."""
    first, last = speeds
    rate = (last**2 - first**2) / (4.0 * np.pi * cycles)
    ends = 2.0 * np.pi * np.arange(cycles + 1)
    # Root of speed t + rate t^2 / 2 = phase that stays finite for a constant speed.
    times = 2.0 * ends / (first + np.sqrt(np.maximum(first**2 + 2.0 * rate * ends, 0.0)))
    cycle_speed = 2.0 * np.pi / np.diff(times)
    steps = steps or max(steps_of(law), math.ceil(_swing(oscillator, law) / (LONGEST_STEP * min(speeds)) * PHASE))
    free, rest = _free_motion(oscillator, law, 2.0 * np.pi / (SAMPLES * steps * cycle_speed))
    state, seen = start - rest, np.empty((cycles, SAMPLES, len(start) if kept else 0))
    if not march(compiled_law(law), free, done, steps, state, seen):
        raise ConvergenceError(
            f"between mesh frequencies {in_Hz(first)} and {in_Hz(last)} the motion leaves the range of the force law"
        )
    return seen + rest if kept else state + rest, cycle_speed


def run_through(
    oscillator: Oscillator, law: OverTime, start: FloatArray, speeds: tuple[float, float], cycles: int
) -> Iterator[Motion]:
    """Integrate as `integrate` does, piece by piece of `CYCLES_PER_PIECE`; the last state of one is where to resume.

    Pieces begin where the law does, and are longer where it takes more cycles to repeat.
    """
    first, last = speeds
    duration = 4.0 * np.pi * cycles / (first + last)
    rate = (last - first) / duration
    done, state = 0, start
    length = cycles_of(law) * math.ceil(CYCLES_PER_PIECE / cycles_of(law))
    while done < cycles:
        count = min(length, cycles - done)
        ends = [float(np.sqrt(first**2 + 4.0 * np.pi * rate * after)) for after in (done, done + count)]
        piece = integrate(oscillator, law, state, (ends[0], ends[1]), count)
        state, done = piece.states[-1], done + count
        yield piece


def _swing(oscillator: Oscillator, law: OverTime) -> float:
    """Angular frequency of the masses on the mesh alone."""
    mobility = oscillator.rows @ np.linalg.solve(oscillator.mass, oscillator.rows.T)
    return float(np.sqrt(abs(np.linalg.eigvals(mobility @ stiffness_of(law))).max()))


def _free_motion(oscillator: Oscillator, law: OverTime, step: FloatArray) -> tuple[FreeMotion, FloatArray]:
    """Motion without meshes in cycles of such steps, about a rest, and that, (2n,)."""
    inverse, rows = np.linalg.inv(oscillator.mass), np.ascontiguousarray(oscillator.rows)
    stiffness, damping = inverse @ oscillator.stiffness, inverse @ oscillator.damping
    # Forces at rest, and the displacements of all that is not held by the mesh alone.
    force = law.load if isinstance(law, MachineLaw) else static_stiffness_of(oscillator)[1]
    rest = np.linalg.lstsq(oscillator.stiffness, oscillator.load - force @ rows, rcond=None)[0]
    half, whole = (drifts(stiffness, damping, share * step) for share in (0.5, 1.0))
    push = np.ascontiguousarray(-(inverse @ rows.T).T)
    along, force = rows @ rest + _offset(law), np.array(force, dtype=float)
    free = FreeMotion(half, whole, step, rows, push, -push @ rows.T, along, force)
    return free, np.append(rest, np.zeros(len(rest)))


def _offset(law: OverTime) -> FloatArray | float:
    """Coordinates of the meshes where displacements are zero."""
    centre = centre_of(law)
    return 0.0 if centre is None else centre


def drifts(stiffness: FloatArray, damping: FloatArray, times: FloatArray) -> FloatArray:
    """Return what displacements and velocities become after times (C,), by matrices over the mass (n, n).

    As `FreeMotion` has it.
    """
    if all(np.array_equal(part, np.diag(np.diag(part))) for part in (stiffness, damping)):
        square, slow = np.diag(stiffness), 0.5 * np.diag(damping)
        swing, time = np.sqrt(square - slow**2 + 0j), times[:, None]
        cosine = (np.exp(-slow * time) * np.cos(swing * time)).real
        sine = (np.exp(-slow * time) * time * np.sinc(swing * time / np.pi)).real
        return np.stack([cosine + slow * sine, sine, -square * sine, cosine - slow * sine], axis=1)
    n = len(stiffness)
    matrix = np.block([[np.zeros((n, n)), np.eye(n)], [-stiffness, -damping]])
    different, place = np.unique(times, return_inverse=True)
    return np.ascontiguousarray(expm(different[:, None, None] * matrix).transpose(0, 2, 1))[place]
