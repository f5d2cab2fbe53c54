"""How the error falls with the number of full solves: greedy sampling, Sobol sequence, full-factorial grids."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from pmor_offline.gather import make_basis

from pmor.case import Case
from pmor.lab.comparison.measure import Truth, ste_errors
from pmor.lab.comparison.measures import Effectivity, solves_to_reach
from pmor.lab.comparison.training import TrainingSet, grid_training, nested_trainings, sobol_training
from pmor.lab.comparison.variants import Variant, counts_up_to, flank_line_case, grid_keys, nested_grids
from pmor.progress import Progress

SAMPLINGS = ("greedy", "sobol", "grid")


@dataclass(frozen=True)
class Point:
    """A basis of flank lines on the curve of a sampling.

    Parameters
    ----------
    solves : int
    label : str
        Which grid; empty for the other samplings.
    max_percent, rms_percent : float
        STE error over the unseen states.
    effectivity : Effectivity
    """

    solves: int
    label: str
    max_percent: float
    rms_percent: float
    effectivity: Effectivity


@dataclass(frozen=True)
class Decay:
    """Curves of all samplings.

    Parameters
    ----------
    points : dict
        By sampling, in the order of the solves.
    estimate : list of (solves, per cent)
        What the greedy sampling itself took for the largest error after so many solves.
    target_percent : float
        Accuracy that the samplings are compared at: the tolerance of the greedy one.
    """

    points: dict[str, list[Point]]
    estimate: list[tuple[int, float]]
    target_percent: float

    def reached(self, sampling: str) -> int | None:
        """Return the fewest solves with which a sampling is as accurate as wanted; None where it never is."""
        own = self.points[sampling]
        return solves_to_reach([p.solves for p in own], [p.max_percent for p in own], self.target_percent)


def decay_curves(
    case: Case, truth: Truth, greedy: TrainingSet, most_solves: int, jobs: int
) -> tuple[Decay, list[str]]:
    """Follow the error of flank lines over growing trainings.

    Parameters
    ----------
    case : Case
    truth : Truth
    greedy : TrainingSet
        Its curve ends with it.
    most_solves : int
        Of the other samplings.
    jobs : int
        Bases made and tried at a time.

    Returns
    -------
    Decay, list of str
        And the full solves that did not converge.
    """
    failures: list[str] = []

    def prefixes(sampling: str, training: TrainingSet) -> Iterable[tuple[Variant, TrainingSet, str]]:
        own = Variant("flank_lines", sampling, None, None, flank_line_case(case, {"sampling": sampling}))
        return [(own, training.first(n), "") for n in counts_up_to(training.solves)]

    sobol = sobol_training(case, truth.model, most_solves)
    failures += sobol.failures
    wanted = [*prefixes("greedy", greedy), *prefixes("sobol", sobol)]
    for grids in nested_grids(case.offline, most_solves):
        own = [Variant("flank_lines", "grid", None, grid, flank_line_case(case, grid_keys(grid))) for grid in grids]
        largest = grid_training(own[-1].case, truth.model)
        failures += largest.failures
        trainings = nested_trainings(largest, grids)
        wanted += zip(own, trainings, (grid.label for grid in grids), strict=True)

    def follow(item: tuple[Variant, TrainingSet, str]) -> tuple[str, Point]:
        variant, training, label = item
        errors = ste_errors(make_basis(variant.case, truth.model, training.snapshots)[0], truth)
        point = Point(training.solves, label, errors.max_percent, errors.rms_percent, errors.effectivity)
        return variant.sampling, point

    points: dict[str, list[Point]] = {sampling: [] for sampling in SAMPLINGS}
    with ThreadPoolExecutor(max_workers=jobs) as pool, Progress(len(wanted), "decay of the error") as progress:
        for sampling, point in pool.map(follow, wanted):
            points[sampling].append(point)
            progress.advance()
    ordered = {name: sorted(own, key=lambda p: p.solves) for name, own in points.items()}
    estimate = [(i, s.estimate_percent) for i, s in enumerate(greedy.snapshots) if s.estimate_percent >= 0.0]
    return Decay(ordered, estimate, case.offline.tolerance_percent), failures
