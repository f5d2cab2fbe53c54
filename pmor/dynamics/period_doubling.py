"""Motion of twice the period, which branches off where a Floquet multiplier passes -1."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.errors import ConvergenceError
from pmor.dynamics.continuation import Branch, Follower, Point, trace
from pmor.dynamics.harmonic_balance import Balance, fourier_rows, in_Hz, rms
from pmor.dynamics.stability import alternating, monodromy

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
    found = []
    for i in np.flatnonzero(signs[:-1] * signs[1:] < 0.0):
        point = branch.points[i]
        step = follow.length(point, branch.points[i + 1])
        try:
            place = follow.refine(point, step, lambda p: _distance(branch.balance, p))
        except ConvergenceError as error:
            lost.append(f"period doubling near mesh frequency {in_Hz(point.speed)}: {error}")
        else:
            found += [place] if limits[0] <= place.speed <= limits[1] else []
    return found


def doubled_branch(point: Point, follow: Follower, limits: tuple[float, float]) -> Branch:
    """Follow the motion of twice the period that begins at a doubling, until it ends at another one.

    The follower is that of the branch it was found on. ConvergenceError where no such motion is found beside it.
    """
    old = follow.balance
    new = replace(old, cycles=2 * old.cycles)
    twice = Follower(new, np.append(np.full(new.size, follow.scale[0]), follow.scale[-1]))
    direction = np.append(_direction(old, new, point), 0.0)
    start = twice.at(embedded(point.unknowns), point.speed)
    off, _ = twice.correct(start + FIRST_STEP * direction, direction)
    return trace(twice, off, limits, lambda p: between_orders(p.unknowns) < VANISHED * abs(p.unknowns[0]))


def embedded(unknowns: FloatArray) -> FloatArray:
    """Return motion as motion of twice the period: its harmonics become the even ones."""
    orders = (len(unknowns) - 1) // 2
    twice = np.zeros(4 * orders + 1)
    twice[0], twice[3::4], twice[4::4] = unknowns[0], unknowns[1::2], unknowns[2::2]
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
    unknowns = fourier_rows(both, new.orders).T @ np.concatenate([seen, -seen])
    return np.asarray(unknowns / np.linalg.norm(unknowns))
