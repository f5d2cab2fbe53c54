"""From a good variant downhill to the best one near it: by exact derivatives, then to the steps of manufacture."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.design.judge import Judge, Verdict
from pmor.design.settings import Constraint
from pmor.design.variables import limits, steps_around

# Sharpness of the smooth peak-to-peak times that of the start: first round for a way past kinks, then close to it.
SHARPNESS = (10.0, 60.0, 300.0)
# Steps of the optimiser in each round, and the change of the objective, over itself, at which it ends.
MOST_STEPS, TOLERANCE = 25, 1e-4
# Of the range of a variable, for the differences by which constraints follow it.
DIFFERENCE = 1e-3
# Tolerance of a constraint, over its bound: round-off of differences.
SLACK = 1e-6


class Descent:
    """One way downhill; `step` is called after each judgement, for progress."""

    def __init__(self, judge: Judge, step: Callable[[], None] = lambda: None) -> None:
        self.judge, self.evaluations, self._step = judge, 0, step
        self.low, high = limits(judge.design.variables)
        self.span = high - self.low

    def run(self, start: FloatArray) -> list[Verdict]:
        """Return the end of the descent from `start`, and the variants around it that can be made, best first.

        Parameters
        ----------
        start : ndarray, shape (n,)
        """
        first = self._judge(start)
        # Where an STE hardly varies, figures below a nanometre are noise.
        level = max(first.objective, 1e-3)
        z = (start - self.low) / self.span
        for share in SHARPNESS:
            z, value = self._minimise(z, share / level)
            level = max(value, 1e-2 * level)
        around = steps_around(self.judge.design.variables, self.low + z * self.span)
        return ranked([first, *map(self._judge, around)], self.judge.design.constraints)

    def _judge(self, x: FloatArray) -> Verdict:
        self._count()
        return self.judge.verdict(x)

    def _count(self) -> None:
        self.evaluations += 1
        self._step()

    def _minimise(self, z: FloatArray, sharpness: float) -> tuple[FloatArray, float]:
        """Return where the smooth objective is least near `z`, in shares of the ranges, and its value."""
        from scipy.optimize import Bounds, minimize

        constraints = self.judge.design.constraints
        known: dict[bytes, tuple[float, FloatArray, FloatArray]] = {}

        def at(z: FloatArray) -> tuple[float, FloatArray, FloatArray]:
            # The optimiser asks for objective and constraints one after the other.
            key = z.tobytes()
            if key not in known:
                self._count()
                known[key] = self.judge.smooth(self.low + z * self.span, sharpness)
            return known[key]

        scale = max(abs(at(z)[0]), 1e-6)

        def objective(z: FloatArray) -> tuple[float, FloatArray]:
            value, slope, _ = at(z)
            return value / scale, slope * self.span / scale

        def kept_by(z: FloatArray) -> FloatArray:
            return slack(constraints, at(z)[2])

        def rates(z: FloatArray) -> FloatArray:
            return self._slack_rates(z, kept_by(z))

        held = [{"type": "ineq", "fun": kept_by, "jac": rates}] if constraints else []
        done = minimize(
            objective, z, jac=True, method="SLSQP", bounds=Bounds(0.0, 1.0, keep_feasible=True), constraints=held,
            options={"maxiter": MOST_STEPS, "ftol": TOLERANCE},
        )  # fmt: skip
        end = np.clip(done.x, 0.0, 1.0)
        end = end if np.isfinite(end).all() else z
        return end, at(end)[0]

    def _slack_rates(self, z: FloatArray, here: FloatArray) -> FloatArray:
        """Derivatives of the constraints by each variable, (C, n): differences, since their kinks are everywhere."""
        constraints, columns = self.judge.design.constraints, []
        for n in range(len(z)):
            further = z.copy()
            further[n] += DIFFERENCE if z[n] + DIFFERENCE <= 1.0 else -DIFFERENCE
            self._count()
            there = slack(constraints, self.judge.limits(self.low + further * self.span))
            columns.append((there - here) / (further[n] - z[n]))
        return np.stack(columns, axis=1)


def slack(constraints: Sequence[Constraint], results: FloatArray) -> FloatArray:
    """Return by how much constraints are kept, over their bounds (over 1 where a bound is 0), (..., C)."""
    bound = np.array([c.at_most for c in constraints])
    return np.asarray((bound - results) / np.where(bound > 0.0, bound, 1.0))


def kept(constraints: Sequence[Constraint], results: FloatArray) -> FloatArray:
    """Return whether all constraints are kept, (...,) bool."""
    return np.asarray((slack(constraints, results) >= -SLACK).all(axis=-1))


def ranked(verdicts: Sequence[Verdict], constraints: Sequence[Constraint]) -> list[Verdict]:
    """Return verdicts with the best first: those that keep the constraints, by the objective; unknown ones last."""
    objective, limits = (np.array([getattr(verdict, name) for verdict in verdicts]) for name in ("objective", "limits"))
    return [verdicts[n] for n in best_first(objective, limits, constraints)]


def best_first(objective: FloatArray, limits: FloatArray, constraints: Sequence[Constraint]) -> IntArray:
    """Return the numbers of variants as `ranked` orders them, by objectives (V,) and constrained results (V, C)."""
    unknown, broken = ~np.isfinite(objective), np.logical_not(kept(constraints, limits))
    return np.asarray(np.lexsort((np.where(unknown, np.inf, objective), broken, unknown)), dtype=np.int64)
