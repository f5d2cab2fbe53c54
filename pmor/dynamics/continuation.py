"""Branches of periodic motion over the mesh frequency, followed through their folds by pseudo-arclength.

A branch is a curve in the space of the unknowns, over the displacement under the mean load, and of the frequency, over
the one it starts from. From one point a step of given length is taken along the tangent and corrected at right angles
to it, so that the frequency may turn back (Keller 1977; Allgower & Georg, Numerical Continuation Methods, 1990).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.errors import ConvergenceError
from pmor.dynamics.harmonic_balance import Balance, in_Hz, solution_of

# Lengths of steps, in the scaled space.
FIRST_STEP, LARGEST_STEP, LEAST_STEP = 0.01, 0.06, 1e-7
MAX_POINTS = 2000
# Share of the frequency by which neighbours differ at most: curves through them shall look like curves.
LARGEST_PACE = 0.02
# Corrector: steps, tolerance on the scaled unknowns, and the number of steps that is taken for easy.
MAX_CORRECTIONS, CORRECTED, EASY = 8, 1e-8, 4
GROWTH, SHRINKAGE = 1.4, 0.5
# Cosine of the angle by which the tangent may turn in a step: more may be a hop to another branch.
LEAST_COSINE = 0.9
# Frequency's part in a tangent that is none: branches of a linear mesh stand upright where they are unstable.
UPRIGHT = 1e-6
# Refinements of a point between two others, and when it is found: on the quantity that vanishes there.
MAX_REFINEMENTS, REFINED = 40, 1e-9


@dataclass(frozen=True)
class Point:
    """A point of a branch."""

    speed: float  # Mesh frequency, angular
    unknowns: FloatArray  # shape (n,): Of `harmonic_balance.Balance`
    tangent: FloatArray  # shape (n + 1,): Of length 1 in the scaled space, the frequency last


@dataclass(frozen=True)
class Fold:
    """A place where the frequency turns back: there stable motion ends, and jumps, on a "run_up" or a "run_down"."""

    point: Point
    kind: str


@dataclass(frozen=True)
class Branch:
    """Periodic motions along a curve, and why it ends where it ends."""

    balance: Balance
    points: tuple[Point, ...]
    folds: tuple[Fold, ...]
    ended: str
    lost: tuple[str, ...] = ()  # Folds that were not found between their neighbours, and why

    @property
    def speed(self) -> FloatArray:
        """Mesh frequencies, (points,)."""
        return np.array([point.speed for point in self.points])

    @property
    def unknowns(self) -> FloatArray:
        """Unknowns, (points, n)."""
        return np.array([point.unknowns for point in self.points])


@dataclass(frozen=True)
class Follower:
    """Predictor and corrector for one balance, in scaled coordinates y = (unknowns / size, frequency / scale)."""

    balance: Balance
    scale: FloatArray

    def at(self, unknowns: FloatArray, speed: float) -> FloatArray:
        """Scaled coordinates."""
        return np.append(unknowns, speed) / self.scale

    def equations(self, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residual at scaled coordinates, and its derivatives, (n, n + 1)."""
        residual, matrix, rate = self.balance.residual(y[:-1] * self.scale[:-1], float(y[-1] * self.scale[-1]))
        return residual, np.column_stack([matrix, rate]) * self.scale

    def point(self, y: FloatArray, matrix: FloatArray, along: FloatArray) -> Point:
        """Return the point at corrected coordinates by the derivatives there; its tangent goes on along `along`."""
        bordered = np.vstack([matrix, along])
        tangent = solution_of(bordered, np.append(np.zeros(len(y) - 1), 1.0))
        return Point(float(y[-1] * self.scale[-1]), y[:-1] * self.scale[:-1], tangent / np.linalg.norm(tangent))

    def length(self, point: Point, further: Point) -> float:
        """Length of the step along the tangent from a point to a further one."""
        apart = self.at(further.unknowns, further.speed) - self.at(point.unknowns, point.speed)
        return float(apart @ point.tangent)

    def longest_step(self, point: Point) -> float:
        """Length of a step that changes the frequency by no more than it may."""
        pace = abs(float(point.tangent[-1])) * float(self.scale[-1])
        return LARGEST_STEP if pace * LARGEST_STEP <= LARGEST_PACE * point.speed else LARGEST_PACE * point.speed / pace

    def advance(self, point: Point, step: float) -> tuple[Point, int]:
        """Go a step along the tangent and correct; return the new point and the corrections it took."""
        return self.correct(self.at(point.unknowns, point.speed) + step * point.tangent, point.tangent)

    def correct(self, y: FloatArray, along: FloatArray) -> tuple[Point, int]:
        """Come to the branch at right angles to a direction."""
        for count in range(1, MAX_CORRECTIONS + 1):
            residual, matrix = self.equations(y)
            change = solution_of(np.vstack([matrix, along]), np.append(-residual, 0.0))
            y = y + change
            if np.linalg.norm(change) <= CORRECTED * (1.0 + np.linalg.norm(y)):
                return self.point(y, matrix, along), count
        raise ConvergenceError("the step along the branch was not corrected")

    def refine(self, point: Point, step: float, value: Callable[[Point], float]) -> Point:
        """Find where a quantity vanishes that has opposite signs at a point and a step further (Illinois).

        ConvergenceError where it is not found.
        """
        low, high = 0.0, step
        at_low, at_high = value(point), value(self.advance(point, step)[0])
        nearest, side = point, 0
        for _ in range(MAX_REFINEMENTS):
            if not np.isfinite(at_high - at_low):
                raise ConvergenceError("the place was not found between two points of the branch")
            middle = (low * at_high - high * at_low) / (at_high - at_low)
            nearest = self.advance(point, middle)[0]
            here = value(nearest)
            if abs(here) <= REFINED or high - low <= LEAST_STEP * step:
                break
            if (here > 0.0) == (at_high > 0.0):
                high, at_high, at_low, side = middle, here, at_low * (0.5 if side == 1 else 1.0), 1
            else:
                low, at_low, at_high, side = middle, here, at_high * (0.5 if side == -1 else 1.0), -1
        return nearest


def follower(balance: Balance, unknowns: FloatArray, speed: float) -> Follower:
    """Return a follower scaled by the mean displacement and the frequency of a state."""
    return Follower(balance, np.append(np.full(balance.size, abs(unknowns[0])), speed))


def first_point(follow: Follower, unknowns: FloatArray, speed: float, upwards: bool) -> Point:
    """Return the point of a solved state, headed towards higher or lower frequencies."""
    along = np.zeros(len(unknowns) + 1)
    along[-1] = 1.0 if upwards else -1.0
    y = follow.at(unknowns, speed)
    return follow.point(y, follow.equations(y)[1], along)


def trace(
    follow: Follower, start: Point, limits: tuple[float, float], over: Callable[[Point], bool] = lambda point: False
) -> Branch:
    """Follow a branch from a point along its tangent, until it leaves the limits of the frequency or is `over`.

    The last point may lie outside the limits, by less than a step; folds do not.
    """
    points, step = [start], FIRST_STEP
    folds, lost = list[Fold](), list[str]()

    def branch(ended: str) -> Branch:
        return Branch(follow.balance, tuple(points), tuple(folds), ended, tuple(lost))

    while len(points) < MAX_POINTS:
        last = points[-1]
        step = min(step, follow.longest_step(last))
        try:
            new, corrections = follow.advance(last, step)
        except ConvergenceError as error:
            new, corrections, reason = None, 0, str(error)
        if new is None or new.tangent @ last.tangent < LEAST_COSINE:
            reason = reason if new is None else "the branch turns too sharply"
            step *= SHRINKAGE
            if step < LEAST_STEP:
                return branch(reason)
            continue
        if new.tangent[-1] * last.tangent[-1] < 0.0 and max(abs(new.tangent[-1]), abs(last.tangent[-1])) > UPRIGHT:
            try:
                turn = follow.refine(last, step, lambda point: float(point.tangent[-1]))
                if limits[0] <= turn.speed <= limits[1]:
                    folds.append(Fold(turn, "run_up" if last.tangent[-1] > 0.0 else "run_down"))
            except ConvergenceError as error:
                lost.append(f"jump near mesh frequency {in_Hz(last.speed)}: {error}")
        points.append(new)
        if not limits[0] <= new.speed <= limits[1]:
            return branch("end of the speeds")
        if over(new):
            return branch("back at the branch it left")
        if corrections <= EASY:
            step = min(GROWTH * step, LARGEST_STEP)
    return branch(f"more than {MAX_POINTS} points")
