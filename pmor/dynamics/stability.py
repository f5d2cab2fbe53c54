"""Stability of periodic motion: Floquet multipliers from the growth of disturbances over a period.

A disturbance y of the motion obeys M y'' + C y' + K y + l^T F'(psi, x(psi)) l y = 0. What its 2n independent solutions
become after a period is the monodromy matrix; motion is stable where no eigenvalue of it is outside the unit circle.
One that leaves it at 1 makes a fold, at -1 motion of twice the period (Nayfeh & Balachandran, Applied Nonlinear
Dynamics, 1995, ch. 7).

Motion of twice the period branches off where a multiplier passes -1.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
from scipy.linalg import expm

from pmor.core.arrays import BoolArray, ComplexArray, FloatArray
from pmor.core.errors import ConvergenceError
from pmor.dynamics.continuation import Branch, Follower, Point, trace
from pmor.dynamics.force_law import coordinate_forces, samples_of
from pmor.dynamics.harmonic_balance import Balance, fourier_rows, in_Hz, rms
from pmor.dynamics.kernels.growth import grow, grow_by_modes

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
    fine, coarse = (_grown(balance, means, speed)[0] for means in (slope, _means(slope, 2)))
    if not (np.isfinite(fine).all() and np.isfinite(coarse).all()):
        raise ConvergenceError("the growth of disturbances over a period is beyond all numbers")
    return (4.0 * fine - coarse) / 3.0


def stability_of(multipliers: ComplexArray) -> BoolArray:
    """Whether small disturbances die out, or at least do not grow, by Floquet multipliers (points, 2n)."""
    return np.asarray(np.abs(multipliers).max(axis=1) <= 1.0 + GROWTH)


def stable_along(branch: Branch, multipliers: ComplexArray) -> BoolArray:
    """Return the stability of the points of a branch, by Floquet multipliers (points, 2n).

    At a fold a real multiplier is 1 in the equations that are followed; that of the monodromy, which has no end of
    harmonics, is there a little earlier or later. Beside a fold the points before it count as stable as far as they are
    wrong by this multiplier alone, and those after it as unstable.
    """
    outside = np.abs(multipliers) > 1.0 + GROWTH
    odd = (outside & (multipliers.imag == 0.0) & (multipliers.real > 0.0)).sum(axis=1) % 2 == 1
    ahead = np.array([point.tangent[-1] > 0.0 for point in branch.points])
    turned = ahead if (ahead == odd).mean() > 0.5 else ~ahead
    stable, wrong = np.asarray(~outside.any(axis=1)), np.asarray(odd != turned)
    for fold in np.flatnonzero(ahead[:-1] != ahead[1:]):
        for place, way in ((fold, -1), (fold + 1, 1)):
            while 0 <= place < len(stable) and wrong[place]:
                stable[place] = not turned[place] and outside[place].sum() == 1
                place += way
    return np.asarray(stable)


def complex_crossings(branch: Branch, multipliers: ComplexArray) -> list[float]:
    """Return the angular mesh frequencies where a pair of complex multipliers leaves the unit circle.

    There motion begins to sway with a frequency of its own. Halfway between neighbouring points of the branch.
    """
    largest = multipliers[np.arange(len(multipliers)), np.abs(multipliers).argmax(axis=1)]
    stable, speed = stability_of(multipliers), branch.speed
    places = np.flatnonzero(stable[:-1] != stable[1:])
    beyond = places + stable[places]
    swaying = abs(largest[beyond].imag) > GROWTH
    return [float(0.5 * (speed[i] + speed[i + 1])) for i in places[swaying]]


def alternating(balance: Balance, unknowns: FloatArray, speed: float) -> tuple[FloatArray, FloatArray]:
    """Return the phases of a period and the disturbance there, (steps, r), that comes nearest to -1."""
    multipliers, vectors = np.linalg.eig(monodromy(balance, unknowns, speed))
    nearest = vectors[:, [np.abs(multipliers + 1.0).argmin()]].real
    seen = _grown(balance, _slopes(balance, unknowns, speed), speed, nearest)[1][:, :, 0]
    return 2.0 * np.pi * balance.cycles * (np.arange(len(seen)) + 0.5) / len(seen), seen


@lru_cache(maxsize=8)
def _rows(samples: int, orders: int) -> FloatArray:
    """Rows of the harmonics at so many places of a period: the same for all points of a branch."""
    return fourier_rows(2.0 * np.pi * (np.arange(samples) + 0.5) / samples, orders)


def _slopes(balance: Balance, unknowns: FloatArray, speed: float) -> FloatArray:
    """Mean of dF/dx over each step of a period, (steps,)."""
    samples = samples_of(balance.law, SAMPLES)
    phase = 2.0 * np.pi * (np.arange(samples * balance.cycles) + 0.5) / samples
    displacement = balance.by_coordinate(unknowns) @ _rows(len(phase), balance.orders).T
    slope = coordinate_forces(balance.law, phase, displacement)[1].transpose(2, 0, 1)
    if not np.isfinite(slope).all():
        raise ConvergenceError("the motion leaves the range of the force law")
    rows = balance.oscillator.rows
    mobility = rows @ np.linalg.solve(balance.oscillator.mass, rows.T)
    fastest = np.sqrt(max(float(np.einsum("sab,ba->s", slope, mobility).max()), 0.0))
    steps = min(STEPS, samples)
    while steps < samples and 2.0 * np.pi * fastest > LONGEST_STEP * steps * speed:
        steps *= 2
    return _means(slope, samples // steps)


def _means(slope: FloatArray, together: int) -> FloatArray:
    """Means of neighbouring slopes, (steps, r, r)."""
    return np.asarray(slope.reshape(-1, together, *slope.shape[1:]).mean(axis=1))


def _grown(
    balance: Balance, slope: FloatArray, speed: float, start: FloatArray | None = None
) -> tuple[FloatArray, FloatArray]:
    """Carry disturbances, by default all independent ones, through a period; return them, and those of the mesh."""
    oscillator, rows = balance.oscillator, np.ascontiguousarray(balance.oscillator.rows)
    n, modes, push = oscillator.size, oscillator.modes, oscillator.push
    h = 2.0 * np.pi * balance.cycles / len(slope) / speed
    begun = np.eye(2 * n) if start is None else np.array(start)
    seen = np.zeros((len(slope), len(rows), begun.shape[1]))
    if modes is None:
        half = np.ascontiguousarray(expm(0.5 * h * oscillator.free))
        return grow(half, half @ half, rows, push, h * slope, begun, seen), seen
    # One of each pair: states are the real part.
    own = modes.values.imag >= 0.0
    value, states = modes.values[own], modes.states[:, own] * np.where(modes.values[own].imag > 0.0, 2.0, 1.0)
    amplitude, kick = modes.amplitudes[own] @ begun, modes.amplitudes[own, n:] @ push
    real, imaginary = amplitude.real.copy(), amplitude.imag.copy()
    half = np.exp(0.5 * h * value)
    grow_by_modes(half, half**2, rows @ states[:n], kick, h * slope, real, imaginary, seen)
    return states.real @ real - states.imag @ imaginary, seen


# First step off the branch, in the scaled space, and the share of motion between the old harmonics that is none.
FIRST_STEP, VANISHED = 0.02, 0.005


def doublings(
    branch: Branch, follow: Follower, grown: FloatArray, limits: tuple[float, float], lost: list[str]
) -> list[Point]:
    """Find where multipliers pass -1 along a branch of monodromy matrices `grown`, (points, 2n, 2n).

    There det(monodromy + 1) changes its sign. Returns the points within the limits of the frequency; failures are added
    to `lost`.
    """
    signs = np.linalg.slogdet(grown + np.eye(grown.shape[1])).sign
    places = []
    for i in np.flatnonzero(signs[:-1] * signs[1:] < 0.0):
        point = branch.points[i]
        step = follow.length(point, branch.points[i + 1])
        try:
            place = follow.refine(point, step, lambda p: _distance(branch.balance, p))
        except ConvergenceError as error:
            lost.append(f"period doubling near mesh frequency {in_Hz(point.speed)}: {error}")
        else:
            places += [place] if limits[0] <= place.speed <= limits[1] else []
    return places


def doubled_branch(point: Point, follow: Follower, limits: tuple[float, float]) -> Branch:
    """Follow the motion of twice the period that begins at a doubling, until it ends at another one.

    The follower is that of the branch it was found on. ConvergenceError where no such motion is found beside it.
    """
    old = follow.balance
    new = replace(old, cycles=2 * old.cycles)
    twice = Follower(new, np.append(np.full(new.size, follow.scale[0]), follow.scale[-1]))
    direction = np.append(_direction(old, new, point), 0.0)
    start = twice.at(embedded(old.by_coordinate(point.unknowns)).ravel(), point.speed)
    off, _ = twice.correct(start + FIRST_STEP * direction, direction)
    return trace(twice, off, limits, lambda p: _vanished(new.by_coordinate(p.unknowns)[0]))


def _vanished(unknowns: FloatArray) -> bool:
    return between_orders(unknowns) < VANISHED * abs(float(unknowns[0]))


def embedded(unknowns: FloatArray) -> FloatArray:
    """Return motion (..., n) as motion of twice the period: its harmonics become the even ones."""
    orders = (unknowns.shape[-1] - 1) // 2
    twice = np.zeros((*unknowns.shape[:-1], 4 * orders + 1))
    twice[..., 0], twice[..., 3::4], twice[..., 4::4] = unknowns[..., 0], unknowns[..., 1::2], unknowns[..., 2::2]
    return twice


def between_orders(unknowns: FloatArray) -> float:
    """Root mean square of the odd harmonics: zero for motion of the single period."""
    odd = unknowns.copy()
    odd[3::4] = odd[4::4] = 0.0
    return float(rms(odd))


def _distance(balance: Balance, point: Point) -> float:
    grown = monodromy(balance, point.unknowns, point.speed)
    return float(np.linalg.det(grown + np.eye(len(grown))))


def _direction(old: Balance, new: Balance, point: Point) -> FloatArray:
    """Return the disturbance that turns its sign from period to period, as unknowns of the doubled motion."""
    phase, seen = alternating(old, point.unknowns, point.speed)
    both = np.concatenate([phase, phase + 2.0 * np.pi * old.cycles]) / new.cycles
    unknowns = (fourier_rows(both, new.orders).T @ np.concatenate([seen, -seen])).T.ravel()
    return np.asarray(unknowns / np.linalg.norm(unknowns))
