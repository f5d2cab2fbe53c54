"""Error measures of a study, in two families that must not be confused.

*Mesh against reference*: a curve of condensed full FE on some mesh against the reference mesh, at the same angles. It
says what discretisation costs. *Reduced against full*: the reduced against the full model on the same mesh, at
positions that were never trained. It says what the reduction costs.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pmor.case import Case, changed_text, load_case, parse_case, text_of, without_models
from pmor.core.arrays import FloatArray, IntArray
from pmor.core.roots_and_minima import root
from pmor.lab.core.measures import Sections, merged, statistic
from pmor.lab.study.settings import Cell, ReferenceMesh, Study
from pmor.work.pieces import Result

# Orders that refinement can show: below, the error falls too slowly to extrapolate; above, differences are mere chance.
OBSERVABLE_ORDERS = (0.3, 6.0)
# Linear elements converge no faster than this in the long run: a larger observed order is not extrapolated with.
LARGEST_TRUSTED_ORDER = 2.0


@dataclass(frozen=True)
class Curve:
    """STE and load sharing over one pitch at one torque."""

    ste_um: FloatArray  # shape (n,): NaN where not converged
    pair_share: FloatArray  # shape (n, p): Fraction of the torque that each tooth pair carries
    pair_index: IntArray  # shape (p,)

    @property
    def mean_um(self) -> float:
        """Mean over the converged angles, um."""
        return statistic(self.ste_um, np.mean)

    @property
    def peak_to_peak_um(self) -> float:
        """Largest minus smallest, um."""
        return statistic(self.ste_um, np.ptp)


def mean_error_um(curve: Curve, reference: Curve) -> float:
    """Mean over the angles of the difference to the reference, um (signed)."""
    return statistic(curve.ste_um - reference.ste_um, np.mean)


def peak_to_peak_error_um(curve: Curve, reference: Curve) -> float:
    """Peak-to-peak STE minus that of the reference, um (signed)."""
    return curve.peak_to_peak_um - reference.peak_to_peak_um


def shape_error_um(curve: Curve, reference: Curve) -> float:
    """Standard deviation over the angles of the difference to the reference, um: blind to a constant offset."""
    return statistic(curve.ste_um - reference.ste_um, np.std)


def load_share_error(curve: Curve, reference: Curve) -> float:
    """Largest difference of any tooth pair's share of the torque to the reference at the same angle."""
    known = np.isfinite(curve.ste_um) & np.isfinite(reference.ste_um)
    pairs = np.union1d(curve.pair_index, reference.pair_index)
    difference = np.abs(_shares(curve, pairs) - _shares(reference, pairs))[known]
    return float(difference.max()) if difference.size else math.nan


@dataclass(frozen=True)
class Convergence:
    """Estimated error of the finest of a family of meshes."""

    order: float  # Observed order of convergence; NaN where the family does not show one
    error: float  # Estimated error of the finest mesh, in the unit of the quantity, magnitude


def richardson(spacing: Sequence[float], distance_to_finest: Sequence[float]) -> Convergence:
    """Estimate the error of the finest of two or three meshes from how far the coarser ones are from it.

    With an error ``c h^p`` the coarser meshes differ from the finest by ``|c| (h_i^p - h_0^p)``: two differences give p
    and c. This holds for numbers and, with a c that depends on the angle, for the standard deviation of a difference of
    curves alike. Element sizes h and distances go from coarse to fine. Where no order can be observed (two meshes,
    differences of different sign, or an order outside `OBSERVABLE_ORDERS`) the error is the last difference itself;
    above `LARGEST_TRUSTED_ORDER` it is extrapolated with that one.

    Examples
    --------
    >>> richardson([4.0, 2.0, 1.0], [4.0**2 - 1.0, 2.0**2 - 1.0])
    Convergence(order=2.0, error=1.0)
    """
    fine = spacing[-1]
    last = abs(distance_to_finest[-1])
    unknown = Convergence(math.nan, last)
    if len(distance_to_finest) < 2 or not distance_to_finest[0] * distance_to_finest[1] > 0.0:
        return unknown
    coarse, middle = (h / fine for h in spacing[:2])
    ratio = distance_to_finest[0] / distance_to_finest[1]

    def excess(order: float) -> float:
        return (coarse**order - 1.0) / (middle**order - 1.0) - ratio

    low, high = OBSERVABLE_ORDERS
    if not excess(low) < 0.0 < excess(high):
        return unknown
    order = round(root(excess, low, high), 9)
    return Convergence(order, last / (middle ** min(order, LARGEST_TRUSTED_ORDER) - 1.0))


def break_even(offline_s: float, slow_ms: float, fast_ms: float) -> int | None:
    """Return from how many positions on an offline stage (s) pays; None when it never does."""
    saved = slow_ms - fast_ms
    return math.ceil(1e3 * offline_s / saved) if saved > 0.0 else None


def _shares(curve: Curve, pairs: IntArray) -> FloatArray:
    share = np.zeros((len(curve.ste_um), len(pairs)))
    share[:, np.searchsorted(pairs, curve.pair_index)] = curve.pair_share
    return share


@dataclass(frozen=True)
class StudyCases:
    """All cases of a study, checked before anything runs."""

    cells: Mapping[Cell, Case]
    meshes: Mapping[ReferenceMesh, Case]  # The reference's family
    peer: Case | None  # Of the independent solver


@dataclass(frozen=True)
class StudyParts:
    """The results of all pieces of work."""

    study: Study
    cases: StudyCases
    results: Mapping[str, Result]  # By the name of the piece; missing for those that failed
    failures: tuple[str, ...]  # Pieces that did not converge at all


def study_cases(study: Study) -> StudyCases:
    """Make the cases of a study; `CaseError` when the base case, or a cell's change of it, is refused."""
    base = text_of(without_models(load_case(study.base)))

    def case(cell: Cell, changes: Sections) -> Case:
        text = changed_text(base, merged(study.changes_of(cell), changes))
        return parse_case(text, cell.label, f"{study.where}: cell {cell.label}")

    return StudyCases(
        cells={cell: case(cell, {}) for cell in study.cells},
        meshes={m: case(Cell(m.n_profile, m.lodm), {"mesh": {"width_elements": m.n_width}}) for m in study.meshes},
        peer=case(study.peer.cell, study.peer.changes) if study.peer is not None else None,
    )
