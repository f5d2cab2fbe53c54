"""Compare the reductions and samplings of a case: full FE once, unseen states, table, curves, run times."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from concurrent.futures import Executor
from functools import partial
from pathlib import Path

from pmor.case import Case
from pmor.core.errors import CaseError, ConvergenceError
from pmor.core.threads import refuse_processes
from pmor.lab.comparison.curves import SAMPLINGS, Point, curves_of, points_of_curves
from pmor.lab.comparison.measure import Reduction, Row, Truth, build, effort, online_times_ms, worth
from pmor.lab.comparison.result import FILES, Comparison
from pmor.lab.comparison.training import TrainingSet, greedy_training, grid_training, sobol_training, solves_until
from pmor.lab.comparison.variants import Variant, changed, grid_keys, table_grids, variants
from pmor.pair.model import elastic_model, gear_pair
from pmor.work.cost import meshed_within_memory
from pmor.work.pieces import Piece, run_pieces
from pmor.work.results import pieces_folder
from pmor.work.states import not_converged, solve_states, unseen_states
from pmor_offline.sampling import first_positions
from pmor_offline.snapshots import solve_snapshots

LOG = logging.getLogger("pmor")
# The greedy sampling goes on beyond the tolerance of the case, to this share of it: its estimate is small where it
# looked, and the error elsewhere may still be larger.
FURTHER = 0.1


def run(
    case: Case, *, states: int = 200, repeats: int = 31, most_solves: int = 512, folder: Path | str | None = None,
    overwrite: bool = False, executor: Executor | None = None, progress: Callable[[int], None] | None = None,
) -> Comparison:  # fmt: skip
    """Compare all reductions over the ranges of a case's training.

    Parameters
    ----------
    case : Case
        Of a scheme of contact points; its own sampling and shapes do not matter.
    states : int
        Unseen states.
    repeats : int
        Sweeps whose median is the run time.
    most_solves : int
        End of the curve of the Sobol sequence.
    folder, overwrite, executor, progress
        As in `pmor.app.capabilities`; the executor is one of threads, trainings and run times are timed on one.

    Raises
    ------
    CaseError, OutputError
    ConvergenceError
        When no reduction, or no point of a sampling, is left.
    """
    started = time.perf_counter()
    refuse_processes(executor)
    if case.contact.kind == "line":
        raise CaseError(
            f'case {case.name}: [contact] scheme = "line": has no trained shapes to compare: write scheme = "direct"'
        )
    gear_pair(case)  # refused before there is a folder
    with pieces_folder(folder, FILES, overwrite=overwrite) as parts:
        truth = _truth(case, states, executor)
        trainings = _trainings(case, truth)
        greedy = trainings["greedy"]
        listed = variants(case, solves_until(greedy, case.offline.tolerance_percent))
        reductions = [build(variant, _training_of(variant, trainings), truth.model) for variant in listed]
        # The Sobol training of the table is the beginning of that of the curves.
        points, failures = points_of_curves(case, truth, greedy, most_solves)

        def piece(name: str, of: Reduction | Point, work: Callable[[], Row]) -> Piece:
            return Piece(name, {"case": case, "own": of.variant.case}, [states, of.training.solves], work)

        pieces = [
            *(piece(r.variant.label, r, partial(worth, r, truth)) for r in reductions),
            *(piece(p.name, p, partial(p.measure, truth)) for p in points),
        ]
        done, broken = run_pieces(pieces, parts, executor=executor, progress=progress, what="reductions")
    reductions = [r for r in reductions if r.variant.label in done]
    points = [p for p in points if p.name in done]
    if not any(r.training.solves for r in reductions) or {p.variant.sampling for p in points} != set(SAMPLINGS):
        raise ConvergenceError(f"{len(broken)} reductions did not converge at all, first: {broken[0]}", [])
    LOG.info("run times of %d reductions", len(reductions))
    online = online_times_ms([r.basis for r in reductions], repeats)
    entries = [
        {**effort(r), **done[r.variant.label], "online_ms": slow, "online_without_ms": fast}
        for r, (slow, fast) in zip(reductions, online, strict=True)
    ]
    failed = [
        *not_converged(truth.states, truth.ste_um, "full FE"),
        *(failure for training in trainings.values() for failure in training.failures),
        *(failure for entry in entries for failure in entry["failures"]),
        *failures,
        *broken,
    ]
    curves = curves_of(case, points, [done[point.name] for point in points], greedy)
    seconds = time.perf_counter() - started
    return Comparison(case, truth, tuple(entries), curves, tuple(dict.fromkeys(failed)), seconds)


def _truth(case: Case, count: int, executor: Executor | None) -> Truth:
    model = elastic_model(case, meshed_within_memory(case))
    meshed = model.mesh.meshed
    states = unseen_states(case.offline, meshed.pair, count)
    LOG.info("full FE at %d unseen states", count)
    return Truth(model, states, solve_states(meshed, model.elasticity_at, states, executor))


def _trainings(case: Case, truth: Truth) -> dict[str, TrainingSet]:
    """Solve each sampling once, one state after the other: their times are compared."""
    model, budget = truth.model, case.offline.solves
    solve_snapshots(model, first_positions(case.offline, model.mesh.meshed.pair)[0])  # compiles
    further = {"sampling": "greedy", "tolerance_percent": FURTHER * case.offline.tolerance_percent}
    LOG.info("trainings of at most %d solves: greedy, Sobol, grids", budget)
    trainings = {
        "greedy": greedy_training(changed(case, further), model),
        "sobol": sobol_training(case, model, budget),
        "none": TrainingSet(),
    }
    for grid in table_grids(case.offline):
        trainings[grid.label] = grid_training(changed(case, grid_keys(grid)), model)
    return trainings


def _training_of(variant: Variant, trainings: dict[str, TrainingSet]) -> TrainingSet:
    whole = trainings[variant.grid.label if variant.grid else variant.sampling]
    return whole if variant.positions is None else whole.first(variant.positions)
