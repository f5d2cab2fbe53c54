"""The trainings that the reductions share: each state is solved once, its time counts for each of them."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass

from pmor.case import Case
from pmor.pair.model import ElasticModel
from pmor.reduction.basis import Snapshots
from pmor_offline.adaptive import greedy_snapshots
from pmor_offline.sampling import TrainingPosition, grid_positions, sobol_positions
from pmor_offline.snapshots import solve_snapshots
from pmor_online.errors import estimate_errors


@dataclass(frozen=True)
class TrainingSet:
    """Full-FE solutions in the order in which they were made."""

    snapshots: tuple[Snapshots, ...] = ()
    # Wall time until each of them, choosing included, s; and until the end of the sampling
    seconds: tuple[float, ...] = (0.0,)

    @property
    def solves(self) -> int:
        """Full solves: angles with as many conditions each."""
        return sum(len(s.converged) for s in self.snapshots)

    @property
    def failures(self) -> tuple[str, ...]:
        """Name the solves that did not converge."""
        return tuple(f"full FE at {failure}" for s in self.snapshots for failure in s.failures)

    def first(self, positions: int) -> TrainingSet:
        """Return the training after so many positions."""
        if positions >= len(self.snapshots):
            return self
        return TrainingSet(self.snapshots[:positions], (*self.seconds[:positions], self.seconds[positions - 1]))


def greedy_training(case: Case, model: ElasticModel) -> TrainingSet:
    """Solve each state where the error estimate is largest."""
    known: list[Snapshots] = []
    return _timed(greedy_snapshots(case, model, estimate_errors, known), known)


def sobol_training(case: Case, model: ElasticModel, count: int) -> TrainingSet:
    """Solve a Sobol sequence; a smaller `count` gives its beginning."""
    return _at(sobol_positions(case.offline, model.mesh.meshed.pair, count), model)


def grid_training(case: Case, model: ElasticModel) -> TrainingSet:
    """Solve the grid of a case."""
    return _at(grid_positions(case.offline, model.mesh.meshed.pair), model)


def solves_until(greedy: TrainingSet, tolerance_percent: float) -> int:
    """Return after how many solves a greedy sampling with a larger tolerance would have ended."""
    below = (i for i, s in enumerate(greedy.snapshots) if s.estimate_percent <= tolerance_percent)
    return next(below, greedy.solves)


def _at(positions: Iterable[TrainingPosition], model: ElasticModel) -> TrainingSet:
    return _timed((solve_snapshots(model, position) for position in positions), [])


def _timed(solving: Iterable[Snapshots], known: list[Snapshots]) -> TrainingSet:
    start, seconds = time.perf_counter(), []
    for snapshots in solving:
        known.append(snapshots)
        seconds.append(time.perf_counter() - start)
    return TrainingSet(tuple(known), (*seconds, time.perf_counter() - start))
