"""Greedy sampling: full FE where the reduced model says that it is worst.

After each full solution the basis is made anew, its error estimated at many candidate states, and the worst of them
solved next (Prud'homme et al., J. Fluids Eng. 124 (2002) 70; the weak greedy algorithm). It ends when the estimate is
below a tolerance at every candidate, or a budget is spent. The candidates fill the ranges of the roll angle and of all
declared parameters with a Sobol sequence; they are the same in every round and in every run. Errors fall from round to
round, so a candidate is estimated anew only while its last estimate could be the largest (Hesthaven, Stamm &
Zhang, ESAIM: M2AN 48 (2014) 259); before it ends all of them are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from functools import partial
from typing import Protocol

import numpy as np

from pmor.case import Case
from pmor.core.arrays import FloatArray
from pmor.core.threads import in_order
from pmor.gear.condition import Condition
from pmor.pair.conditions import training_values
from pmor.pair.model import ElasticModel
from pmor.reduction.basis import Basis, Snapshots
from pmor_offline.gather import make_basis
from pmor_offline.sampling import SEED, TrainingPosition, first_positions, on_flanks_of, sobol_positions
from pmor_offline.snapshots import solve_snapshots


class ErrorEstimate(Protocol):
    """STE and error estimate of a basis, as a greedy sampling needs them."""

    def __call__(
        self, basis: Basis, phi: FloatArray, conditions: Sequence[Condition], *, executor: Executor | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Return STE and the estimate of its error, um, at pinion angles under as many conditions.

        NaN where not converged; the executor may take several at a time.
        """


Estimate = Callable[[Basis, FloatArray, Sequence[Condition]], tuple[FloatArray, FloatArray]]
# States at which the error is estimated for each dimension: angle, and every parameter with a range. With a quarter of
# them, the sampling of a pair with misaligned axes ended at a fifth of the largest error at 200 other states.
CANDIDATES_PER_DIMENSION = 512
# Candidates that are estimated together.
BATCH = 64


def greedy_snapshots(
    case: Case, model: ElasticModel, estimate: ErrorEstimate, known: Sequence[Snapshots],
    executor: Executor | None = None,
) -> Iterator[Snapshots]:  # fmt: skip
    """Solve full FE state by state, each where the estimate is largest.

    Parameters
    ----------
    estimate : callable
        See `ErrorEstimate`.
    known : sequence of Snapshots
        Snapshots solved before; those that this yields are appended.
    executor : concurrent.futures.Executor, optional
        Estimates several errors, and solves several of the positions to begin with, at a time.

    Yields
    ------
    Snapshots
        To be appended to `known` by the caller before the next is asked for.
    """
    offline, pair = case.offline, model.mesh.meshed.pair
    begin = on_flanks_of(case, first_positions(offline, pair))
    yield from in_order(partial(solve_snapshots, model), begin[len(known) : offline.solves], executor)
    candidates = _candidates(case, model)
    percent = np.full(len(candidates), np.inf)
    ask = partial(estimate, executor=executor)
    # Positions solved before are chosen again without being solved: the estimates go on as without a break.
    for count in range(len(begin), offline.solves):
        basis, _ = make_basis(case, model, known[:count])
        _update(percent, candidates, basis, ask, 0.0)
        if percent.max() <= offline.tolerance_percent:
            _update(percent, candidates, basis, ask, -np.inf)
            if percent.max() <= offline.tolerance_percent:
                return
        worst = int(np.argmax(percent))
        if count == len(known):
            yield solve_snapshots(model, candidates[worst], float(percent[worst]))
        # A second solution there adds nothing.
        candidates = candidates[:worst] + candidates[worst + 1 :]
        percent = np.delete(percent, worst)


def _candidates(case: Case, model: ElasticModel) -> tuple[TrainingPosition, ...]:
    offline = case.offline
    dimensions = 1 + sum(len(values) > 1 for values in training_values(offline))
    count = CANDIDATES_PER_DIMENSION * dimensions
    return on_flanks_of(case, sobol_positions(offline, model.mesh.meshed.pair, count, SEED + 1))


def _update(
    percent: FloatArray, candidates: tuple[TrainingPosition, ...], basis: Basis, estimate: Estimate, largest: float
) -> None:
    """Update the errors of candidates, the largest first, until the others are below `largest` or one just found."""
    order = np.argsort(-percent, kind="stable")
    every = np.isneginf(largest)
    for start in range(0, len(order), BATCH):
        batch = order[start : start + BATCH]
        if percent[batch[0]] <= largest and not every:
            return
        conditions = [candidates[i].conditions[0] for i in batch]
        ste, error = estimate(basis, np.array([candidates[i].phi for i in batch]), conditions)
        # A state that the reduced model cannot solve is as bad as can be.
        percent[batch] = np.where(np.isfinite(error), 100.0 * np.abs(error / ste), np.inf)
        largest = max(largest, float(percent[batch].max()))
