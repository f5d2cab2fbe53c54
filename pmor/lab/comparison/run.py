"""Compare the reductions and samplings of a case: full FE once, unseen states, table, curves, run times."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from pmor.case import Case
from pmor.core.errors import ConvergenceError
from pmor.core.progress import Progress
from pmor.jobs.states import not_converged, solve_states, unseen_states
from pmor.lab.comparison.decay import Decay, Point, decay_of, decay_points, measure_point
from pmor.lab.comparison.measure import Reduction, Row, Truth, build, effort, worth
from pmor.lab.comparison.timing import online_times_ms
from pmor.lab.comparison.training import TrainingSet, greedy_training, grid_training, sobol_training, solves_until
from pmor.lab.comparison.variants import Variant, flank_line_case, grid_keys, table_grids, variants
from pmor.pair.model import ElasticModel
from pmor.work.pieces import PARTS, Piece, run_pieces
from pmor_offline.sampling import first_positions
from pmor_offline.snapshots import solve_snapshots

# The greedy sampling is followed beyond the tolerance of the case, to this share of it: its estimate is small where it
# looked, and the error elsewhere may still be larger.
FURTHER = 0.1


@dataclass(frozen=True)
class Comparison:
    """What the comparison gave.

    Parameters
    ----------
    case : Case
    truth : Truth
    entries : tuple of dict
        Plain data of each reduction, in the order of the table: `pmor.lab.comparison.measure.effort` and `worth`, and
        ``online_ms``, ``online_without_ms`` per position, with and without the error estimate.
    decay : Decay
    failures : tuple of str
        States that did not converge anywhere.
    """

    case: Case
    truth: Truth
    entries: tuple[Row, ...]
    decay: Decay
    failures: tuple[str, ...]


def compare_reductions(
    case: Case, model: ElasticModel, out: Path, jobs: int = 1, states: int = 200, repeats: int = 31,
    most_solves: int = 512,
) -> Comparison:  # fmt: skip
    """Compare all reductions over the ranges of a case's training.

    Parameters
    ----------
    case : Case
        Whatever its own sampling and shapes are.
    model : ElasticModel
        Full FE of the case.
    out : Path
        Folder of the results, where finished reductions are kept until these are written.
    jobs : int
        States, or reductions, at a time; what is timed runs on one thread.
    states : int
        Unseen states.
    repeats : int
        Sweeps whose median is the run time.
    most_solves : int
        At which the curves of the samplings that are not greedy end.
    """
    truth = _truth(case, model, jobs, states)
    trainings = _trainings(case, truth)
    greedy = trainings["greedy"]
    listed = variants(case, solves_until(greedy, case.offline.tolerance_percent))
    reductions = [build(variant, _training_of(variant, trainings), model) for variant in listed]
    # The Sobol training of the table is the beginning of that of the curves.
    points, failures = decay_points(case, truth, greedy, most_solves)

    def piece(name: str, of: Reduction | Point, work: Callable[[], Row]) -> Piece:
        return Piece(name, {"case": case, "own": of.variant.case}, [states, of.training.solves], work)

    pieces = [
        *(piece(r.variant.label, r, partial(worth, r, truth)) for r in reductions),
        *(piece(p.name, p, partial(measure_point, p, truth)) for p in points),
    ]
    with ThreadPoolExecutor(max_workers=jobs) as pool, Progress(len(pieces), "reductions") as progress:
        found, broken = run_pieces(pieces, out / PARTS, executor=pool, progress=progress.step, what="reductions")
    if broken:
        raise ConvergenceError(f"{len(broken)} reductions did not converge at all, first: {broken[0]}", [])
    with Progress(repeats, "run times") as progress:
        online = online_times_ms([r.basis for r in reductions], repeats, progress.step)
    entries = [
        {**effort(r), **found[r.variant.label], "online_ms": slow, "online_without_ms": fast}
        for r, (slow, fast) in zip(reductions, online, strict=True)
    ]
    failed = [
        *not_converged(truth.states, truth.full.ste_um, "full FE"),
        *(failure for training in trainings.values() for failure in training.failures),
        *(failure for entry in entries for failure in entry["failures"]),
        *failures,
    ]
    decay = decay_of(case, points, [found[point.name] for point in points], greedy)
    return Comparison(case, truth, tuple(entries), decay, tuple(dict.fromkeys(failed)))


def _truth(case: Case, model: ElasticModel, jobs: int, count: int) -> Truth:
    meshed = model.mesh.meshed
    states = unseen_states(case.offline, meshed.pair, count)
    with ThreadPoolExecutor(max_workers=jobs) as pool, Progress(count, "full FE, unseen states") as progress:
        full = solve_states(meshed, model.elasticity_at, states, pool, progress.step)
    return Truth(model, states, full)


def _trainings(case: Case, truth: Truth) -> dict[str, TrainingSet]:
    """Solve each sampling once, one state after the other: their times are compared."""
    model, budget = truth.model, case.offline.solves
    solve_snapshots(model, first_positions(case.offline, model.mesh.meshed.pair)[0])  # compiles
    further = {"sampling": "greedy", "tolerance_percent": FURTHER * case.offline.tolerance_percent}
    with Progress(budget, "full FE, greedy") as progress:
        greedy = greedy_training(flank_line_case(case, further), model, progress.step)
    with Progress(budget, "full FE, Sobol") as progress:
        sobol = sobol_training(case, model, budget, progress.step)
    found = {"greedy": greedy, "sobol": sobol, "none": TrainingSet()}
    for grid in table_grids(case.offline):
        with Progress(grid.angles, "full FE, grid") as progress:
            found[grid.label] = grid_training(flank_line_case(case, grid_keys(grid)), model, progress.step)
    return found


def _training_of(variant: Variant, trainings: dict[str, TrainingSet]) -> TrainingSet:
    whole = trainings[variant.grid.label if variant.grid else variant.sampling]
    return whole if variant.positions is None else whole.first(variant.positions)
