"""From a good variant downhill to the best one near it: by exact derivatives, then to what can be made."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pmor.arrays import FloatArray
from pmor.design.settings import Constraint
from pmor.design.variables import limits, steps_around
from pmor.lab.design.judge import Judge, Verdict

# Sharpness of the smooth peak-to-peak times that of the start: first round for a way past kinks, then close to it.
SHARPNESS = (10.0, 60.0, 300.0)
# Steps of the optimiser in each round, and the change of the objective, over itself, at which it ends.
MOST_STEPS, TOLERANCE = 40, 1e-5
# Of the range of a variable, for the differences by which constraints follow it.
DIFFERENCE = 1e-4
# By how much a constraint may be missed, over its bound: what a difference leaves in the last digits.
SLACK = 1e-6


class Descent:
    """One way downhill.

    Parameters
    ----------
    judge : Judge
    """

    def __init__(self, judge: Judge) -> None:
        self.judge, self.evaluations = judge, 0
        self.low, high = limits(judge.design.variables)
        self.span = high - self.low

    def run(self, start: FloatArray) -> list[Verdict]:
        """Return the end of the way down from `start`, and what can be made around it, best first.

        Parameters
        ----------
        start : ndarray, shape (n,)
        """
        first = self._judge(start)
        # Where an STE hardly varies, figures below a nanometre are noise.
        level = max(first.objective, 1e-3)
        z = (start - self.low) / self.span
        for share in SHARPNESS:
            z = self._minimise(z, share / level)
            level = max(self.judge.smooth(self.low + z * self.span, share / level)[0], 1e-2 * level)
            self.evaluations += 1
        around = steps_around(self.judge.design.variables, self.low + z * self.span)
        return ranked([first, *map(self._judge, around)], self.judge.design.constraints)

    def _judge(self, x: FloatArray) -> Verdict:
        self.evaluations += 1
        return self.judge.verdict(x)

    def _minimise(self, z: FloatArray, sharpness: float) -> FloatArray:
        from scipy.optimize import Bounds, minimize

        constraints = self.judge.design.constraints
        scale, _, _ = self.judge.smooth(self.low + z * self.span, sharpness)
        self.evaluations += 1
        scale = max(abs(scale), 1e-6)

        def objective(z: FloatArray) -> tuple[float, FloatArray]:
            self.evaluations += 1
            value, slope, _ = self.judge.smooth(self.low + z * self.span, sharpness)
            return value / scale, slope * self.span / scale

        held = [{"type": "ineq", "fun": self._room, "jac": self._room_rates}] if constraints else []
        done = minimize(
            objective, z, jac=True, method="SLSQP", bounds=Bounds(0.0, 1.0, keep_feasible=True), constraints=held,
            options={"maxiter": MOST_STEPS, "ftol": TOLERANCE},
        )  # fmt: skip
        found = np.clip(done.x, 0.0, 1.0)
        return found if np.isfinite(found).all() else z

    def _room(self, z: FloatArray) -> FloatArray:
        self.evaluations += 1
        return room(self.judge.design.constraints, self.judge.limits(self.low + np.clip(z, 0.0, 1.0) * self.span))

    def _room_rates(self, z: FloatArray) -> FloatArray:
        here, columns = self._room(z), []
        for n in range(len(z)):
            further = z.copy()
            further[n] += DIFFERENCE if z[n] + DIFFERENCE <= 1.0 else -DIFFERENCE
            columns.append((self._room(further) - here) / (further[n] - z[n]))
        return np.stack(columns, axis=1)


def room(constraints: Sequence[Constraint], found: FloatArray) -> FloatArray:
    """Return by how much constraints are kept, over their bounds (over 1 where a bound is 0), (..., C)."""
    bound = np.array([c.at_most for c in constraints])
    return np.asarray((bound - found) / np.where(bound > 0.0, bound, 1.0))


def kept(constraints: Sequence[Constraint], found: FloatArray) -> FloatArray:
    """Return whether all constraints are kept, (...,) bool."""
    return np.asarray((room(constraints, found) >= -SLACK).all(axis=-1))


def ranked(verdicts: Sequence[Verdict], constraints: Sequence[Constraint]) -> list[Verdict]:
    """Return verdicts with the best first: those that keep the constraints, by the objective; unknown ones last."""
    def key(verdict: Verdict) -> tuple[bool, bool, float]:
        unknown = not np.isfinite(verdict.objective)
        return unknown, not bool(kept(constraints, verdict.limits)), verdict.objective if not unknown else 0.0

    return sorted(verdicts, key=key)
