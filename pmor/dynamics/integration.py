"""Motion over time at constant speed or while the speed rises or falls: the second way to an answer, without orders.

Nothing is assumed of the motion, so that a run-up passes over folds as the machine does, jumping where its motion ends.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.errors import ConvergenceError
from pmor.dynamics.force_law import CompiledLaw, cycles_of, forces_at
from pmor.dynamics.harmonic_balance import in_Hz
from pmor.dynamics.kernels.motion import DONE, EquationOfMotion, move
from pmor.dynamics.oscillator import Oscillator

# Samples per mesh cycle, and cycles that are integrated at a time.
SAMPLES, CYCLES_PER_PIECE = 64, 100
# Error allowed per step, relative to the state. That of runs changes their root mean square by 6e-6 in the median and
# 3e-5 at most between jumps; a jump comes some cycles earlier or later, as it does by round-off alone.
TOLERANCE, RUN_TOLERANCE = 1e-9, 1e-7
# Steps per sample to begin with.
FIRST_SHARE = 0.25


@dataclass(frozen=True)
class Motion:
    """Motion over whole mesh cycles."""

    phase: FloatArray  # shape (s,): Of the mesh; the start is not among them, the end is
    speed: FloatArray  # shape (s,): Mesh frequency, angular
    states: FloatArray  # shape (s, 2n): Displacements and velocities
    # shape (s,): Along the line of action
    displacement: FloatArray
    force: FloatArray
    steps: int
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
    oscillator: Oscillator, law: CompiledLaw, start: FloatArray, speeds: tuple[float, float], cycles: int,
    tolerance: float = TOLERANCE,
) -> Motion:  # fmt: skip
    """Integrate over mesh cycles, from phase 0, while the speed changes evenly over time.

    Parameters
    ----------
    start : ndarray, shape (2n,)
        Displacements and velocities.
    speeds : tuple of float
        Mesh frequencies at the beginning and at the end.
    tolerance : float
        Error of a step, relative to the largest displacement or velocity at the start, and to the state.

    Raises
    ------
    ConvergenceError
        Where the motion leaves the range of the force law.
    """
    first, last = speeds
    duration = 4.0 * np.pi * cycles / (first + last)
    rate = (last - first) / duration
    phase = 2.0 * np.pi * np.arange(1, cycles * SAMPLES + 1) / SAMPLES
    # Root of speed t + rate t^2 / 2 = phase that stays finite for a constant speed.
    times = 2.0 * phase / (first + np.sqrt(np.maximum(first**2 + 2.0 * rate * phase, 0.0)))
    state, seen = start.astype(float), np.empty((len(times), len(start)))
    status, _, steps = move(
        law, _equation(oscillator, first, rate), times, state, FIRST_SHARE * times[0], tolerance, _floor(start, first),
        seen,
    )  # fmt: skip
    if status != DONE:
        raise ConvergenceError(
            f"between mesh frequencies {in_Hz(first)} and {in_Hz(last)} the motion leaves the range of the force law"
        )
    along = seen[:, : oscillator.size] @ oscillator.lever
    return Motion(phase, first + rate * times, seen, along, forces_at(law, phase, along)[0], steps, cycles_of(law))


def run_through(
    oscillator: Oscillator, law: CompiledLaw, start: FloatArray, speeds: tuple[float, float], cycles: int
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
        piece = integrate(oscillator, law, state, (ends[0], ends[1]), count, RUN_TOLERANCE)
        state, done = piece.states[-1], done + count
        yield piece


def _equation(oscillator: Oscillator, speed: float, rate: float) -> EquationOfMotion:
    inverse = np.linalg.inv(oscillator.mass)
    rows = np.ascontiguousarray(-inverse @ np.hstack([oscillator.stiffness, oscillator.damping]))
    return EquationOfMotion(
        rows, inverse @ oscillator.load, -inverse @ oscillator.lever, oscillator.lever, 0.0, speed, rate
    )


def _floor(start: FloatArray, speed: float) -> FloatArray:
    """Size below which displacements and velocities need no digits of their own."""
    half = len(start) // 2
    size = max(float(np.abs(start[:half]).max()), float(np.abs(start[half:]).max()) / speed)
    return np.repeat([size, size * speed], half)
