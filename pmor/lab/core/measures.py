"""Measures of errors and of run times, and changes of a case, that more than one laboratory needs.

Run times that compare are measured in turn, so that all see the same machine.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

import numpy as np

from pmor.case.reader import Sections
from pmor.core.arrays import FloatArray
from pmor.results.sweep import SteSweep


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


Key = TypeVar("Key")


def times_in_turn(
    work: Mapping[Key, Callable[[], float]], repeats: int, longest: float = math.inf
) -> dict[Key, list[float]]:
    """Measure pieces of work in rounds, after one that warms up; return the times of all rounds by key.

    Every other round goes through the work backwards, so that neither neighbour has the warmer cache. Work whose times
    add up to more than `longest` has no further rounds.
    """
    times: dict[Key, list[float]] = {key: [] for key in work}
    for run in work.values():
        run()
    for repeat in range(repeats):
        for key in list(work)[:: -1 if repeat % 2 else 1]:
            if not repeat or sum(times[key]) <= longest:
                times[key].append(work[key]())
    return times


def ms_per_position(solve: Callable[[], SteSweep]) -> float:
    """Do a sweep and return its time per position, ms."""
    sweep = solve()
    return 1e3 * sweep.seconds / sweep.ste_um.size


def merged(*changes: Sections) -> dict[str, dict[str, Any]]:
    """Return all changes in one; where they name the same key the last one counts."""
    result: dict[str, dict[str, Any]] = {}
    for sections in changes:
        for name, keys in sections.items():
            result.setdefault(name, {}).update(keys)
    return result
