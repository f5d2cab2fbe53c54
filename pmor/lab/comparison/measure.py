"""From a training to what a reduction is worth: errors against full FE, size, effort, and its own error estimate."""

from __future__ import annotations

import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from pmor_offline.gather import make_basis
from pmor_online.errors import estimate_errors
from pmor_online.model import reduced_pair

from pmor.arrays import FloatArray
from pmor.lab.comparison.measures import Effectivity, effectivity
from pmor.lab.comparison.states import Solved, States, load_errors_percent, not_converged, solve_states
from pmor.lab.comparison.training import TrainingSet
from pmor.lab.comparison.variants import Variant
from pmor.lab.study.measures import max_and_rms
from pmor.pair.model import ElasticModel
from pmor.reduction.basis import Basis
from pmor.storage.basis_file import write_basis


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
class SteErrors:
    """STE of a reduced model against full FE at the unseen states.

    Parameters
    ----------
    error_um : ndarray, shape (n,)
        Full less reduced STE; NaN where either did not converge.
    estimate_um : ndarray, shape (n,)
        What the reduced model says of it.
    max_percent, rms_percent : float
        Over the full STE.
    worst : int
        State with the largest relative error.
    effectivity : Effectivity
    """

    error_um: FloatArray
    estimate_um: FloatArray
    max_percent: float
    rms_percent: float
    worst: int
    effectivity: Effectivity


@dataclass(frozen=True)
class Entry:
    """A row of the table.

    Parameters
    ----------
    label, shapes, sampling, training : str
        Of the variant.
    solves : int
        Full solves of the training.
    unknowns : int
        Of the reduced model, at most, under the nominal torque.
    offline_s : float
        Full solves, their choice, and the basis with its file; finite elements not included.
    basis_mib, basis_without_mib : float
        File with and without what the error estimate needs.
    errors : SteErrors
    load_error_percent : float or None
        Largest error of a line load over the peak load of its state; None without line contact.
    worst_load : int or None
        State that it belongs to.
    failures : tuple of str
    """

    label: str
    shapes: str
    sampling: str
    training: str
    solves: int
    unknowns: int
    offline_s: float
    basis_mib: float
    basis_without_mib: float
    errors: SteErrors
    load_error_percent: float | None
    worst_load: int | None
    failures: tuple[str, ...]


def ste_errors(basis: Basis, truth: Truth) -> SteErrors:
    """Hold the compiled reduced model and its estimate against full FE at all states."""
    states, full = truth.states, truth.full
    ste, estimate = estimate_errors(basis, states.phi, states.conditions)
    error = full.ste_um - ste
    relative = 100.0 * error / full.ste_um
    largest, rms = max_and_rms(relative)
    worst = int(np.nanargmax(np.abs(relative))) if np.isfinite(relative).any() else 0
    return SteErrors(error, estimate, largest, rms, worst, effectivity(error, estimate))


def measure(variant: Variant, training: TrainingSet, truth: Truth, jobs: int) -> tuple[Entry, Basis]:
    """Build a reduction and measure everything but its run time.

    Parameters
    ----------
    variant : Variant
    training : TrainingSet
        What it is built from.
    truth : Truth
    jobs : int
        States solved at a time.

    Returns
    -------
    Entry, Basis
    """
    basis, built_s, sizes = _built(variant, training, truth.model)
    reduced = reduced_pair(basis)
    errors = ste_errors(basis, truth)
    # The compiled sweep gives no line loads; its slow twin does.
    twin = solve_states(reduced.meshed, reduced.elasticity_at, truth.states, jobs)
    loads = load_errors_percent(twin, truth.full)
    worst_load = int(np.nanargmax(loads)) if loads is not None and np.isfinite(loads).any() else None
    entry = Entry(
        label=variant.label,
        shapes=variant.shapes,
        sampling=variant.sampling,
        training=variant.training,
        solves=training.solves,
        unknowns=reduced.size,
        offline_s=training.seconds[-1] + built_s,
        basis_mib=sizes[0],
        basis_without_mib=sizes[1],
        errors=errors,
        load_error_percent=None if loads is None or worst_load is None else float(loads[worst_load]),
        worst_load=worst_load,
        failures=_failures(variant, truth, errors, twin),
    )
    return entry, basis


def without_estimate(basis: Basis) -> Basis:
    """Return a basis that gives no error estimate."""
    return replace(basis, compliance=None)


def _built(variant: Variant, training: TrainingSet, model: ElasticModel) -> tuple[Basis, float, tuple[float, float]]:
    """Basis, seconds for it and its file, and MiB of the file with and without the error estimate."""
    with tempfile.TemporaryDirectory() as folder:
        files = Path(folder) / "with.h5", Path(folder) / "without.h5"
        start = time.perf_counter()
        basis, force = make_basis(variant.case, model, training.snapshots)
        write_basis(files[0], basis, force)
        seconds = time.perf_counter() - start
        write_basis(files[1], without_estimate(basis), force)
        sizes = [file.stat().st_size / 2**20 for file in files]
    return basis, seconds, (sizes[0], sizes[1])


def _failures(variant: Variant, truth: Truth, errors: SteErrors, twin: Solved) -> tuple[str, ...]:
    # Where full FE has no solution there is nothing to hold against it; that is named once, by the run.
    solvable = np.isfinite(truth.full.ste_um)
    swept = np.where(solvable, errors.error_um, 0.0)
    again = np.where(solvable, twin.ste_um, 0.0)
    return (
        *not_converged(truth.states, swept, variant.label),
        *not_converged(truth.states, again, f"{variant.label}, line loads"),
    )


def plain_entry(entry: Entry, states: States) -> dict[str, Any]:
    """Return an entry as plain numbers, with the places of its largest errors."""
    kept = {name: value for name, value in vars(entry).items() if name not in ("errors", "worst_load", "failures")}
    errors = entry.errors
    return {
        **kept,
        "ste_error_max_percent": errors.max_percent,
        "ste_error_rms_percent": errors.rms_percent,
        "ste_error_um": errors.error_um,
        "estimate_um": errors.estimate_um,
        "effectivity": vars(errors.effectivity),
        "worst_ste_at": states.where(errors.worst),
        "worst_load_at": None if entry.worst_load is None else states.where(entry.worst_load),
        "failures": entry.failures,
    }
