"""Run times that compare: measured in turn, so that all see the same machine."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TypeVar

from pmor.results.sweep import SteSweep

Key = TypeVar("Key")


def times_in_turn(
    work: Mapping[Key, Callable[[], float]], repeats: int, longest: float = math.inf
) -> dict[Key, list[float]]:
    """Measure pieces of work in rounds, after one that warms up; return the times of all rounds by key.

    Every other round goes through the work backwards, so that neither neighbour has the warmer cache. Work whose times
    add up to more than `longest` has no further rounds.
    """
    found: dict[Key, list[float]] = {key: [] for key in work}
    for run in work.values():
        run()
    for repeat in range(repeats):
        for key in list(work)[:: -1 if repeat % 2 else 1]:
            if not repeat or sum(found[key]) <= longest:
                found[key].append(work[key]())
    return found


def ms_per_position(solve: Callable[[], SteSweep]) -> float:
    """Do a sweep and return its time per position, ms."""
    sweep = solve()
    return 1e3 * sweep.seconds / sweep.ste_um.size
