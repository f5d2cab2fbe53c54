"""How the error falls with the number of full solves: greedy sampling and Sobol sequence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pmor.case import Case
from pmor.lab.comparison.measure import Row, Truth
from pmor.lab.comparison.training import TrainingSet, sobol_training
from pmor.lab.comparison.variants import Variant, changed, counts_up_to
from pmor_offline.gather import make_basis

SAMPLINGS = ("greedy", "sobol")


@dataclass(frozen=True)
class Point:
    """A basis of flank lines on the curve of a sampling."""

    variant: Variant
    training: TrainingSet

    @property
    def name(self) -> str:
        """Unique."""
        return f"decay {self.variant.sampling} {self.training.solves}"

    def measure(self, truth: Truth) -> Row:
        """Compare it with full FE."""
        basis, _ = make_basis(self.variant.case, truth.model, self.training.snapshots)
        errors = truth.errors(basis)
        return {
            "solves": self.training.solves,
            "max_percent": errors["ste_error_max_percent"],
            "rms_percent": errors["ste_error_rms_percent"],
            "effectivity": errors["effectivity"],
        }


@dataclass(frozen=True)
class Curves:
    """Errors of flank lines over the number of solves, by sampling."""

    # Rows by sampling, in the order of the solves: ``solves``, ``max_percent``, ``rms_percent`` and ``effectivity``
    points: Mapping[str, Sequence[Mapping[str, Any]]]
    estimate: list[tuple[int, float]]  # Largest error by the estimate of the greedy sampling, after so many solves
    target_percent: float  # Accuracy that the samplings are compared at: the tolerance of the greedy one

    def reached(self, sampling: str) -> int | None:
        """Return the fewest solves with which a sampling is as accurate as wanted; None where it never is."""
        good = (p["solves"] for p in self.points[sampling]
                if p["max_percent"] is not None and p["max_percent"] <= self.target_percent)  # fmt: skip
        return min(good, default=None)


def points_of_curves(
    case: Case, truth: Truth, greedy: TrainingSet, most_solves: int
) -> tuple[list[Point], tuple[str, ...]]:
    """Return growing trainings of flank lines, of both samplings, and name the full solves that did not converge."""
    sobol = sobol_training(case, truth.model, most_solves)
    failures, points = sobol.failures, []
    for sampling, training in (("greedy", greedy), ("sobol", sobol)):
        own = Variant("flank_lines", sampling, None, None, changed(case, {"sampling": sampling}))
        points += [Point(own, training.first(n)) for n in counts_up_to(training.solves)]
    return points, failures


def curves_of(case: Case, points: Sequence[Point], rows: Sequence[Row], greedy: TrainingSet) -> Curves:
    """Return the curves from the rows of their points."""
    curves: dict[str, list[Row]] = {sampling: [] for sampling in SAMPLINGS}
    for point, row in zip(points, rows, strict=True):
        curves[point.variant.sampling].append(row)
    ordered = {name: sorted(own, key=lambda row: row["solves"]) for name, own in curves.items()}
    estimate = [(i, s.estimate_percent) for i, s in enumerate(greedy.snapshots) if s.estimate_percent >= 0.0]
    return Curves(ordered, estimate, case.offline.tolerance_percent)
