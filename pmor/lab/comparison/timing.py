"""Run time of reduced models: compiled sweeps in turn, so that all of them see the same machine."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from statistics import median

from pmor.lab.comparison.measure import without_estimate
from pmor.lab.core.timing import ms_per_position, times_in_turn
from pmor.pair.conditions import nominal_condition
from pmor.reduction.basis import Basis
from pmor_online.model import online_angles, reduced_pair
from pmor_online.sweep import sweep_reduced_pair

ANGLES = 200  # a full pitch
# A model with hundreds of unknowns takes seconds for a sweep: it is repeated until it had this share.
LONGEST_MS = 2500.0


def online_times_ms(
    bases: Sequence[Basis], repeats: int, progress: Callable[[], None] = lambda: None
) -> list[tuple[float, float]]:
    """Time a position at the misalignment and the nominal torque of the case, with and without the error estimate.

    Parameters
    ----------
    bases : sequence of Basis
    repeats : int
        Sweeps of each, less where they take long.
    progress : callable
        Called after each round, for progress.

    Returns
    -------
    list of (with, without)
        Medians, ms; one thread.
    """
    work = {}
    for i, basis in enumerate(bases):
        for estimated in (True, False):
            reduced = reduced_pair(basis if estimated else without_estimate(basis))
            phi = online_angles(reduced.meshed.pair.pitch, ANGLES)
            sweep = partial(sweep_reduced_pair, reduced, phi, [nominal_condition(basis.case)])
            work[i, estimated] = partial(ms_per_position, sweep)
    times = times_in_turn(work, repeats, progress, LONGEST_MS / ANGLES)
    return [(median(times[i, True]), median(times[i, False])) for i in range(len(bases))]
