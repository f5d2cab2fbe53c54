"""Stability of periodic motion: Floquet multipliers from the growth of disturbances over a period.

A disturbance y of the motion obeys M y'' + C y' + K y + l F'(psi, x(psi)) l . y = 0. What its 2n independent solutions
become after a period is the monodromy matrix; motion is stable where no eigenvalue of it is outside the unit circle.
One that leaves it at 1 makes a fold, at -1 motion of twice the period (Nayfeh & Balachandran, Applied Nonlinear
Dynamics, 1995, ch. 7).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.linalg import expm

from pmor.core.arrays import BoolArray, FloatArray
from pmor.core.errors import ConvergenceError
from pmor.dynamics.force_law import forces_at
from pmor.dynamics.harmonic_balance import Balance, fourier_rows
from pmor.dynamics.kernels.growth import grow

# Steps per mesh cycle at least, in two runs that are extrapolated; samples of the slope per mesh cycle, and most steps.
STEPS, SAMPLES = 512, 8192
# Longest step times the largest natural frequency of the mesh: above 2 the steps themselves are unstable.
LONGEST_STEP = 0.3
# A disturbance that grows by less per period is none: the accuracy of the multipliers.
GROWTH = 1e-6


def monodromy(balance: Balance, unknowns: FloatArray, speed: float) -> FloatArray:
    """Return the matrix by which displacements and velocities of a disturbance grow over a period, (2n, 2n).

    ConvergenceError where the motion leaves the force law between the samples of the balance.
    """
    slope = _slopes(balance, unknowns, speed)
    fine, coarse = (_grown(balance, means, speed)[0] for means in (slope, slope.reshape(-1, 2).mean(axis=1)))
    if not (np.isfinite(fine).all() and np.isfinite(coarse).all()):
        raise ConvergenceError("the growth of disturbances over a period is beyond all numbers")
    return (4.0 * fine - coarse) / 3.0


def stability_of(grown: FloatArray) -> BoolArray:
    """Whether small disturbances die out, or at least do not grow, by monodromy matrices (points, 2n, 2n)."""
    return np.asarray(np.abs(np.linalg.eigvals(grown)).max(axis=1) <= 1.0 + GROWTH)


def alternating(balance: Balance, unknowns: FloatArray, speed: float) -> tuple[FloatArray, FloatArray]:
    """Return the phases of a period and the disturbance there, along the line of action, that comes nearest to -1."""
    found, vectors = np.linalg.eig(monodromy(balance, unknowns, speed))
    nearest = vectors[:, [np.abs(found + 1.0).argmin()]].real
    seen = _grown(balance, _slopes(balance, unknowns, speed), speed, nearest)[1][:, 0]
    return 2.0 * np.pi * balance.cycles * (np.arange(len(seen)) + 0.5) / len(seen), seen


@lru_cache(maxsize=8)
def _rows(samples: int, orders: int) -> FloatArray:
    """Rows of the harmonics at so many places of a period: the same for all points of a branch."""
    return fourier_rows(2.0 * np.pi * (np.arange(samples) + 0.5) / samples, orders)


def _slopes(balance: Balance, unknowns: FloatArray, speed: float) -> FloatArray:
    """Mean of dF/dx over each step of a period, (steps,)."""
    phase = 2.0 * np.pi * (np.arange(SAMPLES * balance.cycles) + 0.5) / SAMPLES
    _, slope = forces_at(balance.law, phase, _rows(len(phase), balance.orders) @ unknowns)
    if not np.isfinite(slope).all():
        raise ConvergenceError("the motion leaves the range of the force law")
    lever = balance.oscillator.lever
    fastest = np.sqrt(max(float(slope.max()), 0.0) * float(lever @ np.linalg.solve(balance.oscillator.mass, lever)))
    steps = STEPS
    while steps < SAMPLES and 2.0 * np.pi * fastest > LONGEST_STEP * steps * speed:
        steps *= 2
    return np.asarray(slope.reshape(-1, SAMPLES // steps).mean(axis=1))


def _grown(
    balance: Balance, slope: FloatArray, speed: float, start: FloatArray | None = None
) -> tuple[FloatArray, FloatArray]:
    """Carry disturbances, by default all independent ones, through a period; return them, and those of the mesh."""
    oscillator, n = balance.oscillator, balance.oscillator.size
    h = 2.0 * np.pi * balance.cycles / len(slope) / speed
    inverse = np.linalg.inv(oscillator.mass)
    free = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ oscillator.stiffness, -inverse @ oscillator.damping]])
    matrix = np.eye(2 * n) if start is None else np.array(start)
    seen = np.empty((len(slope), matrix.shape[1]))
    half = np.ascontiguousarray(expm(0.5 * h * free))
    grow(half, oscillator.lever, -inverse @ oscillator.lever, h * slope, matrix, np.empty_like(matrix), seen)
    return matrix, seen
