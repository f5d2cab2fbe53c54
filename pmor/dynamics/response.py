"""The response of a pair over its speed: all branches, what is stable, where motion jumps and where it is largest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pmor.arrays import BoolArray, FloatArray
from pmor.dynamics.continuation import Branch, Fold, Follower, Point, first_point, follower, trace
from pmor.dynamics.force_law import ForceLaw
from pmor.dynamics.harmonic_balance import Balance, rest, rms, solve_at
from pmor.dynamics.oscillator import Oscillator
from pmor.dynamics.period_doubling import Doubling, doubled_branch, doublings
from pmor.dynamics.stability import is_stable
from pmor.errors import ConvergenceError

# Harmonics of the mesh frequency: on the benchmark the last quarter of them makes 4e-5 of the motion where it is
# largest, 3.6 times the displacement under the mean load.
HARMONICS = 20


@dataclass(frozen=True)
class Response:
    """Periodic motions between two mesh frequencies.

    Parameters
    ----------
    main : Branch
        Of the period of the mesh, from the upper limit of the frequency.
    doubled : tuple of Branch
        Of twice the period.
    doublings : tuple of Doubling
        Where they begin.
    lost : tuple of str
        Why motion of twice the period was not found where it begins.
    stable : tuple of ndarray of bool
        By point, of `main` and of each of `doubled`.
    """

    main: Branch
    doubled: tuple[Branch, ...]
    doublings: tuple[Doubling, ...]
    lost: tuple[str, ...]
    stable: tuple[BoolArray, ...]

    @property
    def branches(self) -> tuple[Branch, ...]:
        """All of them, the main one first."""
        return (self.main, *self.doubled)

    @property
    def folds(self) -> tuple[Fold, ...]:
        """Of the main branch, in its order."""
        return self.main.folds


def response(oscillator: Oscillator, law: ForceLaw, limits: tuple[float, float]) -> Response:
    """Follow periodic motion from the upper mesh frequency down to the lower one, and what branches off it.

    Parameters
    ----------
    oscillator : Oscillator
    law : ForceLaw
    limits : tuple of float
        Mesh frequencies, angular.

    Returns
    -------
    Response

    Raises
    ------
    ConvergenceError
        Where no motion is found at the upper frequency.
    """
    balance = Balance(oscillator, law, cycles=1, harmonics=HARMONICS)
    start = solve_at(balance, limits[1], rest(balance))
    follow = follower(balance, start, limits[1])
    main = trace(follow, first_point(follow, start, limits[1], upwards=False), limits)
    places = doublings(main, follow)
    doubled, lost = [], []
    for place in places:
        try:
            doubled.append(doubled_branch(place, follow, limits))
        except ConvergenceError as error:
            lost.append(f"at mesh frequency {place.point.speed:.6g}: {error}")
    stable = tuple(stability_of(branch) for branch in (main, *doubled))
    return Response(main, tuple(doubled), places, tuple(lost), stable)


def stability_of(branch: Branch) -> BoolArray:
    """Whether the motions along a branch are stable, (points,)."""
    return np.array([is_stable(branch.balance, point.unknowns, point.speed) for point in branch.points])


def largest(branch: Branch, follow: Follower) -> Point:
    """Return the point of a branch at which the root mean square of its motion is largest."""
    size: FloatArray = rms(branch.unknowns)
    top = int(size.argmax())

    def growth(point: Point) -> float:
        return float(point.unknowns[1:] @ point.tangent[1:-1])

    for i in (top - 1, top):
        if 0 <= i < len(size) - 1 and growth(branch.points[i]) * growth(branch.points[i + 1]) < 0.0:
            return follow.refine(branch.points[i], follow.length(branch.points[i], branch.points[i + 1]), growth)
    return branch.points[top]
