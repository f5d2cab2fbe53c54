"""The online stage as a job: sweep, comparison, and everything that is written about them."""

from __future__ import annotations

import hashlib
import os
import platform
import sys
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

import pmor
from online.compare import Comparison, compare_models, failed_positions, training_failures
from online.model import ReducedPair, online_angles
from online.sweep import sweep_reduced_pair
from online.tables import summary_text, write_ste_csv, write_summary_json
from pmor.case import Case, beyond_training
from pmor.model import ElasticModel
from pmor.progress import Progress
from pmor.result import SteSweep, largest_error_um, peak_to_peak_um, ripple_um, ste_mean_um, torque_exponent


@dataclass(frozen=True)
class OnlineResult:
    """What the online stage found.

    Parameters
    ----------
    reduced : ReducedPair
    sweep : SteSweep
        Of the reduced model, at the case's online angles and torques.
    comparison : Comparison or None
        None when it was not asked for.
    basis_mib : float
        Size of the basis file.
    failures : tuple of str
        Positions that did not converge.
    """

    reduced: ReducedPair
    sweep: SteSweep
    comparison: Comparison | None
    basis_mib: float
    failures: tuple[str, ...]

    @property
    def nominal(self) -> int:
        """Index of the nominal torque in the sweep."""
        return self.reduced.basis.case.online.torques_Nm.index(self.reduced.basis.case.torque_Nm)


def run_online(
    reduced: ReducedPair, basis_path: Path, model: ElasticModel | None = None
) -> OnlineResult:
    """Sweep with the reduced model and, given the full one, compare.

    Parameters
    ----------
    reduced : ReducedPair
    basis_path : Path
        Where the basis came from.
    model : ElasticModel, optional
        Full FE of the same case.

    Returns
    -------
    OnlineResult
    """
    case, pair = reduced.basis.case, reduced.meshed.pair
    phi = online_angles(pair.pitch, case.online.angles_per_pitch)
    torques = [1e3 * t for t in case.online.torques_Nm]
    sweep_reduced_pair(reduced, phi[:1], torques)  # compiles: run times are those of warm code
    with Progress(len(phi), "reduced model") as progress:
        sweep = sweep_reduced_pair(reduced, phi, torques, advance=progress.advance)
    failures = training_failures(reduced.basis.training) + failed_positions(sweep, "reduced model")
    comparison = None
    if model is not None:
        with Progress(case.compare.angles, "full FE, unseen angles") as progress:
            comparison = compare_models(reduced, model, progress.advance)
        failures += failed_positions(comparison.full, "full FE")
        failures += failed_positions(comparison.reduced, "reduced model, unseen angle")
    mib = basis_path.stat().st_size / 2**20
    return OnlineResult(reduced, sweep, comparison, mib, tuple(failures))


def summary(result: OnlineResult) -> dict[str, Any]:
    """Return the machine-readable summary; None for what was not asked for."""
    case, sweep, comparison, i = result.reduced.basis.case, result.sweep, result.comparison, result.nominal
    return {
        "case": case.name,
        "n_profile": case.mesh.profile_elements,
        "scheme": case.contact.scheme,
        "lodm": case.contact.lodm_profile if case.contact.kind == "nodal" else None,
        "n_angles": len(sweep.phi_rad),
        "torque_Nm": case.torque_Nm,
        "ste_mean_um": ste_mean_um(sweep)[i],
        "ste_peak_to_peak_um": peak_to_peak_um(sweep)[i],
        "ste_ripple_um": ripple_um(sweep, i),
        "ste_torque_exponent": torque_exponent(sweep),
        "ste_error_estimate_max_um": largest_error_um(sweep),
        "extrapolated": beyond_training(case),
        "rom_size": result.reduced.size,
        "rom_vs_full_ste_max_rel": comparison.max_relative_error if comparison else None,
        "rom_vs_full_ste_rms_rel": comparison.rms_relative_error if comparison else None,
        "online_ms_per_position": ms_per_position(sweep),
        "full_ms_per_position": ms_per_position(comparison.full) if comparison else None,
        "offline_s": result.reduced.basis.training.seconds,
        "basis_mib": result.basis_mib,
        "n_positions_failed": len(result.failures),
    }


def summary_rows(result: OnlineResult) -> list[tuple[str, float | int | None, str, str]]:
    """Return the summary in words: (label, value, unit, note)."""
    s, comparison = summary(result), result.comparison
    rows = [
        ("STE mean", s["ste_mean_um"], "um", f"at {s['torque_Nm']:g} N m"),
        ("STE peak-to-peak", s["ste_peak_to_peak_um"], "um", ""),
        ("STE ripple", s["ste_ripple_um"], "um", "about a quartic where one pair carries the load"),
        ("STE over torque", s["ste_torque_exponent"], "", "exponent; 1 is linear"),
        ("STE error bar, max", s["ste_error_estimate_max_um"], "um", "what the reduction costs, estimated online"),
        ("reduced model size", s["rom_size"], "", "unknowns at most"),
        ("online time", s["online_ms_per_position"], "ms", f"per position, {len(result.sweep.phi_rad)} angles x "
         f"{len(result.sweep.torque_Nm)} torques"),
    ]  # fmt: skip
    if comparison is not None:
        positions = f"{comparison.full.ste_um.size} unseen positions"
        rows += [
            ("reduced vs full, max", 100 * s["rom_vs_full_ste_max_rel"], "%", positions),
            ("reduced vs full, rms", 100 * s["rom_vs_full_ste_rms_rel"], "%", ""),
            ("full FE time", s["full_ms_per_position"], "ms", "per position, compliance condensed beforehand"),
        ]
    return [
        *rows,
        ("offline time", s["offline_s"], "s", "finite elements and training"),
        ("basis", s["basis_mib"], "MiB", ""),
    ]


def write_results(result: OnlineResult, out: Path) -> None:
    """Write the tables that every run has.

    Raises
    ------
    OutputError
    """
    write_ste_csv(out / "ste.csv", result.sweep)
    write_summary_json(out / "summary.json", summary(result))


def result_text(result: OnlineResult) -> str:
    """Return the short summary for the screen."""
    text = summary_text(result.reduced.basis.case.title, summary_rows(result))
    return "\n".join([text, *(f"  ! {warning}" for warning in warnings(result))])


def warnings(result: OnlineResult) -> tuple[str, ...]:
    """Return what a reader must know beside the numbers: extrapolation, and positions that failed."""
    beyond = (
        f"extrapolated: {text}; what the results are worth, their error bar says"
        for text in beyond_training(result.reduced.basis.case)
    )
    return (*beyond, *result.failures)


def provenance(case: Case) -> list[tuple[str, str]]:
    """Return what somebody needs to repeat a run."""
    import h5py
    import numba
    import scipy

    return [
        ("date", datetime.now(UTC).isoformat(timespec="seconds")),
        ("pmor", pmor.__version__),
        ("Python", sys.version.split()[0]),
        ("numpy, scipy, numba, h5py", ", ".join(m.__version__ for m in (np, scipy, numba, h5py))),
        ("machine", f"{platform.machine()}, {os.cpu_count()} cores, {platform.system()}"),
        ("case file, SHA-256", hashlib.sha256(case.text.encode()).hexdigest()),
    ]


def ms_per_position(sweep: SteSweep) -> float:
    """Return the wall time of a sweep per angle and torque, ms."""
    return 1e3 * sweep.seconds / sweep.ste_um.size
