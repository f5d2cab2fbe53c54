"""Run time of reduced models: compiled sweeps in turn, so that all of them see the same machine."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from statistics import median

from pmor_online.model import online_angles, reduced_pair
from pmor_online.sweep import sweep_reduced_pair

from pmor.lab.comparison.measure import without_estimate
from pmor.pair.conditions import nominal_condition
from pmor.reduction.basis import Basis

ANGLES = 200  # a full pitch
# A model with hundreds of unknowns takes seconds for a sweep: it is repeated until it had this share, s.
LONGEST = 5.0


def online_times_ms(
    bases: Sequence[Basis], repeats: int, advance: Callable[[], None] = lambda: None
) -> list[tuple[float, float]]:
    """Time a position at the misalignment and the nominal torque of the case, with and without the error estimate.

    Parameters
    ----------
    bases : sequence of Basis
    repeats : int
        Sweeps of each, less where they take long.
    advance : callable
        Called after each round, for progress.

    Returns
    -------
    list of (with, without)
        Medians, ms; one thread.
    """
    pairs = [(reduced_pair(basis), reduced_pair(without_estimate(basis))) for basis in bases]
    times: list[tuple[list[float], list[float]]] = [([], []) for _ in bases]
    for repeat in range(repeats + 1):  # the first round warms up
        for both, found in zip(pairs, times, strict=True):
            if repeat > 1 and sum(found[0]) + sum(found[1]) > LONGEST:
                continue
            # In turn first: neither has the warmer cache, or the quieter machine.
            for reduced, own in list(zip(both, found, strict=True))[:: 1 if repeat % 2 else -1]:
                phi = online_angles(reduced.meshed.pair.pitch, ANGLES)
                seconds = sweep_reduced_pair(reduced, phi, [nominal_condition(reduced.basis.case)]).seconds
                if repeat:
                    own.append(seconds)
        if repeat:
            advance()
    return [(1e3 * median(slow) / ANGLES, 1e3 * median(fast) / ANGLES) for slow, fast in times]
