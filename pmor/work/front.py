"""Pareto fronts: variants that no other one beats in both of two values."""

from __future__ import annotations

import numpy as np

from pmor.core.arrays import FloatArray, IntArray


def pareto_front(values: FloatArray) -> IntArray:
    """Return the rows of `values` (m, 2), smaller being better, that no other beats in both; by their first value.

    Rows with NaN are none; of equal rows the first one counts.
    """
    known = np.flatnonzero(np.isfinite(values).all(axis=1))
    order = known[np.lexsort((known, values[known, 1], values[known, 0]))]
    best = np.minimum.accumulate(np.concatenate([[np.inf], values[order, 1]]))[:-1]
    return np.asarray(order[values[order, 1] < best], dtype=np.int64)
