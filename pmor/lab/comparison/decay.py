"""How the error falls with the number of full solves: greedy sampling, Sobol sequence, full-factorial grids."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pmor.case import Case
from pmor.lab.comparison.measure import Row, Truth, ste_errors
from pmor.lab.comparison.measures import solves_to_reach
from pmor.lab.comparison.training import TrainingSet, grid_training, nested_trainings, sobol_training
from pmor.lab.comparison.variants import Variant, counts_up_to, flank_line_case, grid_keys, nested_grids
from pmor_offline.gather import make_basis
from pmor_online.errors import estimate_errors

SAMPLINGS = ("greedy", "sobol", "grid")


@dataclass(frozen=True)
class Point:
    """A basis of flank lines on the curve of a sampling.

    Parameters
    ----------
    variant : Variant
    training : TrainingSet
    label : str
        Which grid; empty for the other samplings.
    """

    variant: Variant
    training: TrainingSet
    label: str

    @property
    def name(self) -> str:
        """Unique."""
        return f"decay {self.variant.sampling} {self.label} {self.training.solves}"


@dataclass(frozen=True)
class Decay:
    """Curves of all samplings.

    Parameters
    ----------
    points : mapping
        Rows by sampling, in the order of the solves: ``solves``, ``label``, ``max_percent``, ``rms_percent`` and
        ``effectivity``.
    estimate : list of (solves, per cent)
        What the greedy sampling itself took for the largest error after so many solves.
    target_percent : float
        Accuracy that the samplings are compared at: the tolerance of the greedy one.
    """

    points: Mapping[str, Sequence[Mapping[str, Any]]]
    estimate: list[tuple[int, float]]
    target_percent: float

    def reached(self, sampling: str) -> int | None:
        """Return the fewest solves with which a sampling is as accurate as wanted; None where it never is."""
        own = self.points[sampling]
        errors = [float("nan") if p["max_percent"] is None else p["max_percent"] for p in own]
        return solves_to_reach([p["solves"] for p in own], errors, self.target_percent)


def decay_points(case: Case, truth: Truth, greedy: TrainingSet, most_solves: int) -> tuple[list[Point], list[str]]:
    """Return growing trainings of flank lines.

    Parameters
    ----------
    case : Case
    truth : Truth
    greedy : TrainingSet
        Its curve ends with it.
    most_solves : int
        Of the other samplings.

    Returns
    -------
    list of Point, list of str
        And the full solves that did not converge.
    """
    sobol = sobol_training(case, truth.model, most_solves)
    failures, points = [*sobol.failures], []
    for sampling, training in (("greedy", greedy), ("sobol", sobol)):
        own = Variant("flank_lines", sampling, None, None, flank_line_case(case, {"sampling": sampling}))
        points += [Point(own, training.first(n), "") for n in counts_up_to(training.solves)]
    for grids in nested_grids(case.offline, most_solves):
        listed = [Variant("flank_lines", "grid", None, grid, flank_line_case(case, grid_keys(grid))) for grid in grids]
        largest = grid_training(listed[-1].case, truth.model)
        failures += largest.failures
        trainings = nested_trainings(largest, grids)
        points += [Point(*found) for found in zip(listed, trainings, (grid.label for grid in grids), strict=True)]
    return points, failures


def measure_point(point: Point, truth: Truth) -> Row:
    """Measure a point of a curve."""
    basis, _ = make_basis(point.variant.case, truth.model, point.training.snapshots)
    found = ste_errors(*estimate_errors(basis, truth.states.phi, truth.states.conditions), truth)
    return {
        "solves": point.training.solves,
        "label": point.label,
        "max_percent": found["ste_error_max_percent"],
        "rms_percent": found["ste_error_rms_percent"],
        "effectivity": found["effectivity"],
    }


def decay_of(case: Case, points: Sequence[Point], rows: Sequence[Mapping[str, Any]], greedy: TrainingSet) -> Decay:
    """Return the curves from the rows of their points."""
    curves: dict[str, list[Mapping[str, Any]]] = {sampling: [] for sampling in SAMPLINGS}
    for point, row in zip(points, rows, strict=True):
        curves[point.variant.sampling].append(row)
    ordered = {name: sorted(own, key=lambda row: row["solves"]) for name, own in curves.items()}
    estimate = [(i, s.estimate_percent) for i, s in enumerate(greedy.snapshots) if s.estimate_percent >= 0.0]
    return Decay(ordered, estimate, case.offline.tolerance_percent)
