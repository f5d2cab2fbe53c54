"""Errors against full FE, size, effort and run time of a reduction made from a training."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.lab.comparison.training import TrainingSet
from pmor.lab.comparison.variants import Variant
from pmor.lab.core.measures import max_and_rms, ms_per_position, times_in_turn
from pmor.pair.conditions import nominal_condition
from pmor.pair.model import ElasticModel
from pmor.reduction.basis import Basis
from pmor.storage.basis_file import write_basis
from pmor.work.states import SMALLEST_ERROR_UM, States, not_converged
from pmor_offline.gather import make_basis
from pmor_online.errors import estimate_errors
from pmor_online.model import online_angles, reduced_pair
from pmor_online.sweep import largest_size, sweep_reduced_pair

Row = Mapping[str, Any]
# Effectivities that serve an engineer: the right order of magnitude, rather too large than too small.
WANTED_EFFECTIVITY = (0.3, 5.0)
# Positions of a timed sweep, over a full pitch.
ANGLES = 200
# A model with hundreds of unknowns takes seconds for a sweep: no repeats beyond this sum.
LONGEST_MS = 2500.0


@dataclass(frozen=True)
class Effectivity:
    """An error estimate against the true error; None where there is nothing to compare."""

    states: int  # With a true error above `SMALLEST_ERROR_UM`; the numbers below are theirs, but for the last
    # Quantiles (2.5, 50, 97.5 %) of abs(estimate / error)
    low: float | None = None
    median: float | None = None
    high: float | None = None
    wanted_share: float | None = None  # Share of the states within `WANTED_EFFECTIVITY`
    # Spearman's, of the magnitudes, over all states; None too where no error is above `SMALLEST_ERROR_UM`
    rank_correlation: float | None = None


def effectivity(error_um: FloatArray, estimate_um: FloatArray) -> Effectivity:
    """Compare an estimate with the true error, arrays of the same shape (n,), NaN where not converged."""
    known = np.isfinite(error_um) & np.isfinite(estimate_um)
    true, estimate = np.abs(error_um[known]), np.abs(estimate_um[known])
    counted = true > SMALLEST_ERROR_UM
    if not counted.any():
        return Effectivity(0)
    ratio = estimate[counted] / true[counted]
    low, high = WANTED_EFFECTIVITY
    first, median, last = np.quantile(ratio, (0.025, 0.5, 0.975)).tolist()
    wanted = float(np.mean((ratio >= low) & (ratio <= high)))
    return Effectivity(int(counted.sum()), first, median, last, wanted, rank_correlation(true, estimate))


def rank_correlation(first: FloatArray, second: FloatArray) -> float | None:
    """Return Spearman's rank correlation; None where one of the two does not vary."""
    from scipy.stats import spearmanr  # takes half a second to load

    if min(np.ptp(first), np.ptp(second)) == 0.0:
        return None
    return float(spearmanr(first, second).statistic)


@dataclass(frozen=True)
class Truth:
    """Full FE at the states at which reductions are compared with it."""

    model: ElasticModel  # Full FE
    states: States
    ste_um: FloatArray  # shape (n,): Its STE there; NaN where not converged

    def errors(self, basis: Basis) -> Row:
        """Compare the reduced STE and its estimate with full FE at all states: full less reduced STE."""
        ste_um, estimate_um = estimate_errors(basis, self.states.phi, self.states.conditions)
        error = self.ste_um - ste_um
        relative = 100.0 * error / self.ste_um
        largest, rms = max_and_rms(relative)
        worst = int(np.nanargmax(np.abs(relative))) if np.isfinite(relative).any() else 0
        return {
            "ste_error_max_percent": largest,
            "ste_error_rms_percent": rms,
            "ste_error_um": error,
            "estimate_um": estimate_um,
            "effectivity": vars(effectivity(error, estimate_um)),
            "worst_ste_at": self.states.where(worst),
        }


@dataclass(frozen=True)
class Reduction:
    """A variant with its basis."""

    variant: Variant
    training: TrainingSet  # Full solves that it is built from
    basis: Basis
    seconds: float  # For basis and file
    # File with the data of the error estimate, and without
    mib: float
    mib_without: float


def build(variant: Variant, training: TrainingSet, model: ElasticModel) -> Reduction:
    """Build a reduction from a training."""
    with tempfile.TemporaryDirectory() as folder:
        files = Path(folder) / "with.h5", Path(folder) / "without.h5"
        start = time.perf_counter()
        basis, force = make_basis(variant.case, model, training.snapshots)
        write_basis(files[0], basis, force)
        seconds = time.perf_counter() - start
        write_basis(files[1], replace(basis, compliance=None), force)
        sizes = [file.stat().st_size / 2**20 for file in files]
    return Reduction(variant, training, basis, seconds, sizes[0], sizes[1])


def effort(reduction: Reduction) -> Row:
    """Return the cost of a reduction, but for its run time.

    ``offline_s`` counts full solves, their choice, and the basis with its file; finite elements are not included.
    """
    variant, training = reduction.variant, reduction.training
    return {
        "label": variant.label,
        "shapes": variant.shapes,
        "sampling": variant.sampling,
        "training": variant.training,
        "solves": training.solves,
        "unknowns": largest_size(reduced_pair(reduction.basis)),
        "offline_s": training.seconds[-1] + reduction.seconds,
        "basis_mib": reduction.mib,
        "basis_without_mib": reduction.mib_without,
    }


def worth(reduction: Reduction, truth: Truth) -> Row:
    """Measure the errors of a reduction, and name the states that it does not solve."""
    row = truth.errors(reduction.basis)
    # States without a solution of full FE are named once, by the run.
    lost: FloatArray = np.where(np.isfinite(truth.ste_um), row["ste_error_um"], 0.0)
    return {**row, "failures": not_converged(truth.states, lost, reduction.variant.label)}


def online_times_ms(bases: Sequence[Basis], repeats: int) -> list[tuple[float, float]]:
    """Time a position at nominal torque with and without the error estimate: medians (ms), all in turn, one thread."""
    work = {}
    for i, basis in enumerate(bases):
        for estimated in (True, False):
            reduced = reduced_pair(basis if estimated else replace(basis, compliance=None))
            phi = online_angles(reduced.meshed.pair.pitch, ANGLES)
            sweep = partial(sweep_reduced_pair, reduced, phi, [nominal_condition(basis.case)])
            work[i, estimated] = partial(ms_per_position, sweep)
    times = times_in_turn(work, repeats, longest=LONGEST_MS / ANGLES)
    return [(median(times[i, True]), median(times[i, False])) for i in range(len(bases))]
