"""Pareto fronts: variants that no other one beats in both of two values."""

from __future__ import annotations

import numpy as np

from pmor.core.arrays import FloatArray, IntArray

# Gain in the second value, over itself, that is none: values are told to about as many digits.
SAME = 1e-3


def pareto_front(values: FloatArray) -> IntArray:
    """Return the rows of `values` (m, 2), smaller being better, that no other beats in both; by their first value.

    Rows with NaN are none; of rows that are the same, but for `SAME` of the second value, the first one counts.
    """
    known = np.flatnonzero(np.isfinite(values).all(axis=1))
    order = known[np.lexsort((known, values[known, 1], values[known, 0]))]
    front, least = list[int](), np.inf
    for row, second in zip(order.tolist(), values[order, 1].tolist(), strict=True):
        if second < least - (SAME * abs(least) if front else 0.0):
            front.append(row)
            least = second
    return np.array(front, dtype=np.int64)
