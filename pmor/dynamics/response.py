"""The response of a pair over its speed: all branches, their stability, jumps of motion, and the largest motion."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pmor.core.arrays import BoolArray, FloatArray
from pmor.core.errors import ConvergenceError
from pmor.dynamics.continuation import Branch, Fold, Follower, Point, first_point, follower, trace
from pmor.dynamics.force_law import ForceLaw
from pmor.dynamics.harmonic_balance import Balance, in_Hz, quasi_static, rest, solve_at
from pmor.dynamics.oscillator import Oscillator
from pmor.dynamics.stability import complex_crossings, doubled_branch, doublings, monodromy, stable_along

# Harmonics of the mesh frequency: on the benchmark the last quarter of them makes 4e-5 of the motion where it is
# largest, 3.6 times the displacement under the mean load.
HARMONICS = 20


# If no motion is found at the upper limit, higher frequencies are tried: factor, and how far.
FARTHER, FARTHEST = 1.3, 3.0
# Of the unknowns, when two motions at one frequency are the same.
SAME = 1e-6


@dataclass(frozen=True)
class Response:
    """Periodic motions between two mesh frequencies."""

    # The one from the upper limit of the frequency downwards; where it does not pass the motion that begins near rest
    # at the lower limit, the one from there upwards; then those of twice the period
    branches: tuple[Branch, ...]
    stable: tuple[BoolArray, ...]  # By point, of each branch
    doublings: tuple[Point, ...]  # Where branches of twice the period begin
    lost: tuple[str, ...]  # Failures, and why
    # Mesh frequencies at which complex multipliers leave the unit circle: motion sways from there
    swaying: tuple[float, ...] = ()

    @property
    def folds(self) -> tuple[Fold, ...]:
        """Folds of motion that repeats with the mesh, by rising frequency."""
        all_folds = [fold for branch in self.branches if branch.balance.cycles == 1 for fold in branch.folds]
        return tuple(sorted(all_folds, key=lambda fold: fold.point.speed))


def response(
    oscillator: Oscillator, law: ForceLaw, limits: tuple[float, float], harmonics: int = HARMONICS
) -> Response:
    """Follow periodic motion from both ends of the frequency, and the motion of twice the period that branches off.

    Limits are angular mesh frequencies. ConvergenceError where no motion is found at the upper one.
    """
    balance = Balance(oscillator, law, cycles=1, harmonics=harmonics)
    follow, start = _from_above(balance, limits[1])
    lost: list[str] = []
    main = trace(follow, start, limits)
    known = _known("branch from the upper limit", main, lost)
    for below in _from_below(follow, main, limits, lost):
        known += _known("branch from the lower limit", below, lost)
    places = [place for branch, grown in known for place in doublings(branch, follow, grown, limits, lost)]
    for place in places:
        name = f"twice the period at mesh frequency {in_Hz(place.speed)}"
        try:
            known += _known(name, doubled_branch(place, follow, limits), lost)
        except ConvergenceError as error:
            lost.append(f"{name}: {error}")
    by_branch = [(branch, np.asarray(np.linalg.eigvals(grown), dtype=complex)) for branch, grown in known]
    branches, growth = [branch for branch, _ in known], [stable_along(*one) for one in by_branch]
    swaying = [speed for one in by_branch for speed in complex_crossings(*one)]
    return Response(tuple(branches), tuple(growth), tuple(places), tuple(lost), tuple(swaying))


def _from_above(balance: Balance, high: float) -> tuple[Follower, Point]:
    """Return the motion at the upper limit, headed downwards.

    Where the limit lies within a resonance the branch is begun above it, and followed down to the limit.
    """
    speed = high
    while True:
        try:
            motion = solve_at(balance, speed, rest(balance))
            break
        except ConvergenceError:
            if speed > FARTHEST * high:
                speed, motion = high, solve_at(balance, high, quasi_static(balance))
                break
            speed *= FARTHER
    follow = follower(balance, motion, speed)
    start = first_point(follow, motion, speed, upwards=False)
    if speed == high:
        return follow, start
    last = trace(follow, start, (high, speed)).points[-1]
    if last.speed > high:
        raise ConvergenceError(f"no periodic motion found at mesh frequency {in_Hz(high)}")
    return follow, last


def _from_below(follow: Follower, main: Branch, limits: tuple[float, float], lost: list[str]) -> list[Branch]:
    """Follow the motion that begins near rest at the lower limit, unless the main branch comes there."""
    balance, low = follow.balance, limits[0]
    try:
        start = _near_rest(balance, low)
        end = solve_at(balance, low, main.points[-1].unknowns) if main.points[-1].speed < low else None
    except ConvergenceError as error:
        lost.append(f"motion at the lower limit: {error}")
        return []
    if end is not None and np.linalg.norm(end - start) <= SAME * np.linalg.norm(start):
        return []
    return [trace(follow, first_point(follow, start, low, upwards=True), limits)]


def _near_rest(balance: Balance, speed: float) -> FloatArray:
    try:
        return solve_at(balance, speed, rest(balance))
    except ConvergenceError:
        return solve_at(balance, speed, quasi_static(balance))


def _known(name: str, branch: Branch, lost: list[str]) -> list[tuple[Branch, FloatArray]]:
    """Return a branch as far as the growth of disturbances is known, and that; nothing where it is not at the start."""
    lost += branch.lost
    growths = []
    for point in branch.points:
        try:
            growths.append(monodromy(branch.balance, point.unknowns, point.speed))
        except ConvergenceError as error:
            if not growths:
                lost.append(f"{name}: {error}")
                return []
            branch = replace(branch, points=branch.points[: len(growths)], ended=str(error))
            break
    return [(branch, np.array(growths))]
