"""Measures of errors and of run times that more than one laboratory needs."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from pmor.core.arrays import FloatArray


def statistic(values: FloatArray, of: Callable[[FloatArray], float]) -> float:
    """Statistic of the finite entries; NaN without any."""
    known = values[np.isfinite(values)]
    return float(of(known)) if len(known) else math.nan


def max_and_rms(error: FloatArray) -> tuple[float, float]:
    """Largest magnitude and root mean square over the finite entries; NaN without any."""
    return statistic(error, lambda e: np.max(np.abs(e))), statistic(error, lambda e: np.sqrt(np.mean(e**2)))


def fitted_exponent(x: Sequence[float], y: Sequence[float]) -> float:
    """Exponent p of the power law ``y ~ x^p`` by least squares in logarithms; NaN below two points."""
    known = [(a, b) for a, b in zip(x, y, strict=True) if math.isfinite(b) and b > 0.0]
    if len({a for a, _ in known}) < 2:
        return math.nan
    log_x, log_y = np.log(np.array(known)).T
    return float(np.polynomial.Polynomial.fit(log_x, log_y, deg=1).convert().coef[1])
