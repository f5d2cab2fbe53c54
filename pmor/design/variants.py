"""Many variants in arrays, and as plain data in the files of finished pieces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.design.descent import kept
from pmor.design.judge import Verdict
from pmor.design.settings import Constraint, Design
from pmor.work.pieces import Result

ARRAYS = ("x", "results", "objective", "limits")


@dataclass(frozen=True)
class Variants:
    """Variants that were judged: V of n variables, T torques, R results, C constraints.

    Parameters
    ----------
    x : ndarray, shape (V, n)
    results : ndarray, shape (V, T, R)
        Nominal; NaN where a position did not converge.
    objective : ndarray, shape (V,)
    limits : ndarray, shape (V, C)
    origin : tuple of str
        Origin of each: "sample", "descent", "trade-off", "as drawn" (best without scatter), "170 N m" (best for
        that torque alone).
    """

    x: FloatArray
    results: FloatArray
    objective: FloatArray
    limits: FloatArray
    origin: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.x)


def as_data(verdicts: Sequence[Verdict], origin: str, evaluations: int) -> Result:
    """Return verdicts of one origin as plain data, with the judgements that they took."""
    return {
        "x": [v.x.tolist() for v in verdicts], "results": [v.results.tolist() for v in verdicts],
        "objective": [v.objective for v in verdicts], "limits": [v.limits.tolist() for v in verdicts],
        "origin": [origin] * len(verdicts), "evaluations": evaluations,
    }  # fmt: skip


def from_data(part: Result, design: Design) -> Variants:
    """Turn the content of a part file into arrays; null is NaN."""
    count, torques = len(part["x"]), len(design.load.torques_Nm)
    return Variants(
        np.array(part["x"], dtype=float).reshape(count, len(design.variables)),
        np.array(part["results"], dtype=float).reshape(count, torques, len(design.results)),
        np.array(part["objective"], dtype=float),
        np.array(part["limits"], dtype=float).reshape(count, len(design.constraints)),
        tuple(part["origin"]),
    )


def together(parts: Sequence[Variants]) -> Variants:
    """Return variants one behind the other."""
    arrays = {name: np.concatenate([getattr(part, name) for part in parts]) for name in ARRAYS}
    return Variants(origin=tuple(origin for part in parts for origin in part.origin), **arrays)


def best_first(variants: Variants, constraints: Sequence[Constraint]) -> IntArray:
    """Return the numbers of variants, best first: those that keep the constraints, by the objective."""
    unknown = np.logical_not(np.isfinite(variants.objective))
    broken = np.logical_not(kept(constraints, variants.limits))
    return np.asarray(np.lexsort((np.where(unknown, np.inf, variants.objective), broken, unknown)), dtype=np.int64)
