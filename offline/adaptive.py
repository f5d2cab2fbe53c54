"""Greedy sampling: full FE where the reduced model says that it is worst.

After each full solution the basis is made anew, its error estimated at many candidate states, and the worst of them
solved next (Prud'homme et al., J. Fluids Eng. 124 (2002) 70; the weak greedy algorithm). It ends when the estimate is
below a tolerance at every candidate, or a budget is spent. The candidates fill the ranges of the roll angle and of all
declared parameters with a Sobol sequence; they are the same in every round and in every run.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import astuple

import numpy as np

from offline.gather import make_basis
from offline.sampling import SEED, TrainingPosition, first_positions, sobol_positions
from offline.snapshots import solve_snapshots
from pmor.case import Case
from pmor.contact.misalignment import OperatingCondition
from pmor.gear.conventions import FloatArray
from pmor.model import ElasticModel
from pmor.storage.basis_file import Basis
from pmor.storage.snapshot_file import Snapshots

# STE and estimate of what it lacks, um, of a basis at pinion angles under as many conditions; NaN where not converged.
ErrorEstimate = Callable[[Basis, FloatArray, Sequence[OperatingCondition]], tuple[FloatArray, FloatArray]]

# States at which the error is estimated for each dimension: angle, and every parameter with a range.
CANDIDATES_PER_DIMENSION = 128


def greedy_snapshots(
    case: Case, model: ElasticModel, estimate: ErrorEstimate, known: Sequence[Snapshots]
) -> Iterator[Snapshots]:
    """Solve full FE state by state, each where the estimate is largest.

    Parameters
    ----------
    case : Case
    model : ElasticModel
    estimate : callable
        See `ErrorEstimate`.
    known : sequence of Snapshots
        What is solved already; grows while this runs, by what it yields.

    Yields
    ------
    Snapshots
        To be appended to `known` by the caller before the next is asked for.
    """
    offline, pair = case.offline, model.mesh.meshed.pair
    begin = first_positions(offline, pair)
    while len(known) < min(len(begin), offline.solves):
        yield solve_snapshots(model, begin[len(known)])
    candidates = _candidates(case, model)
    while len(known) < offline.solves:
        worst, percent = _worst(case, model, estimate, known, candidates)
        if percent <= offline.tolerance_percent:
            return
        yield solve_snapshots(model, candidates[worst], percent)


def _candidates(case: Case, model: ElasticModel) -> tuple[TrainingPosition, ...]:
    offline = case.offline
    ranges = (offline.torques_Nm, offline.in_plane_um, offline.out_of_plane_um, offline.centre_distance_um)
    dimensions = 1 + sum(len(values) > 1 for values in ranges)
    count = CANDIDATES_PER_DIMENSION * dimensions
    return sobol_positions(offline, model.mesh.meshed.pair, count, SEED + 1)


def _worst(
    case: Case, model: ElasticModel, estimate: ErrorEstimate, known: Sequence[Snapshots],
    candidates: tuple[TrainingPosition, ...],
) -> tuple[int, float]:  # fmt: skip
    """Return the candidate with the largest estimate over the STE, and that in per cent."""
    basis, _ = make_basis(case, model, known)
    conditions = [c.conditions[0] for c in candidates]
    ste, error = estimate(basis, np.array([c.phi for c in candidates]), conditions)
    # A state that the reduced model cannot solve is as bad as can be.
    percent = np.where(np.isfinite(error), 100.0 * np.abs(error / ste), np.inf)
    solved = {(s.phi, *s.torque, *map(tuple, s.misalignment)) for s in known}
    for i, (candidate, condition) in enumerate(zip(candidates, conditions, strict=True)):
        # Solved once, it has given what it can.
        if (candidate.phi, condition.torque, astuple(condition.misalignment)) in solved:
            percent[i] = 0.0
    worst = int(np.argmax(percent))
    return worst, float(percent[worst])
