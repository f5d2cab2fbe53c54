"""From a training to what a reduction is worth: errors against full FE, size, effort, and its own error estimate."""

from __future__ import annotations

import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.jobs.states import Solved, States, load_errors_percent, not_converged, sweep_states
from pmor.lab.comparison.measures import effectivity
from pmor.lab.comparison.training import TrainingSet
from pmor.lab.comparison.variants import Variant
from pmor.lab.core.measures import max_and_rms
from pmor.pair.model import ElasticModel
from pmor.reduction.basis import Basis
from pmor.storage.basis_file import write_basis
from pmor_offline.gather import make_basis
from pmor_online.model import reduced_pair
from pmor_online.sweep import largest_size

Row = dict[str, Any]


@dataclass(frozen=True)
class Truth:
    """What reductions are held against.

    Parameters
    ----------
    model : ElasticModel
        Full FE.
    states : States
    full : Solved
        Its solutions there.
    """

    model: ElasticModel
    states: States
    full: Solved


@dataclass(frozen=True)
class Reduction:
    """A variant with its basis.

    Parameters
    ----------
    variant : Variant
    training : TrainingSet
        What it is built from.
    basis : Basis
    seconds : float
        For basis and file.
    mib, mib_without : float
        File with and without what the error estimate needs.
    """

    variant: Variant
    training: TrainingSet
    basis: Basis
    seconds: float
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
        write_basis(files[1], without_estimate(basis), force)
        sizes = [file.stat().st_size / 2**20 for file in files]
    return Reduction(variant, training, basis, seconds, sizes[0], sizes[1])


def without_estimate(basis: Basis) -> Basis:
    """Return a basis that gives no error estimate; line loads stand on what others estimate with."""
    return basis if basis.shapes is None else replace(basis, compliance=None)


def effort(reduction: Reduction) -> Row:
    """Return what a reduction costs, but for its run time.

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


def ste_errors(ste_um: FloatArray, estimate_um: FloatArray, truth: Truth) -> Row:
    """Hold the reduced STE and its estimate against full FE at all states: full less reduced STE."""
    states, full = truth.states, truth.full
    error = full.ste_um - ste_um
    relative = 100.0 * error / full.ste_um
    largest, rms = max_and_rms(relative)
    worst = int(np.nanargmax(np.abs(relative))) if np.isfinite(relative).any() else 0
    return {
        "ste_error_max_percent": largest,
        "ste_error_rms_percent": rms,
        "ste_error_um": error,
        "estimate_um": estimate_um,
        "effectivity": vars(effectivity(error, estimate_um)),
        "worst_ste_at": states.where(worst),
    }


def worth(reduction: Reduction, truth: Truth) -> Row:
    """Measure the errors of a reduction, those of line loads over the peak load of their state."""
    states = truth.states
    found, estimate = sweep_states(reduced_pair(reduction.basis), states)
    row = ste_errors(found.ste_um, estimate, truth)
    loads = load_errors_percent(found, truth.full)
    worst = int(np.nanargmax(loads)) if loads is not None and np.isfinite(loads).any() else None
    # Where full FE has no solution there is nothing to hold against it; that is named once, by the run.
    solvable = np.isfinite(truth.full.ste_um)
    return row | {
        "load_error_percent": None if loads is None or worst is None else float(loads[worst]),
        "worst_load_at": None if worst is None else states.where(worst),
        "failures": not_converged(states, np.where(solvable, found.ste_um, 0.0), reduction.variant.label),
    }
