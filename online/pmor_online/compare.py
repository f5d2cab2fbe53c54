"""Reduced against full FE on the same mesh, at positions that were never trained: error and run time."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.shown import Columns, brief
from pmor.line.hertz import TOO_WIDE
from pmor.line.unloaded import with_unloaded
from pmor.pair.conditions import conditions_of
from pmor.pair.model import ElasticModel
from pmor.pair.sweep import sweep_ste
from pmor.reduction.basis import Training
from pmor.results.sweep import SteSweep
from pmor.results.tabular import Tabular
from pmor_online.model import ReducedPair, unseen_angles
from pmor_online.sweep import sweep_reduced_pair


@brief
@dataclass(frozen=True, eq=False)
class Comparison(Tabular):
    """The same positions solved by both models.

    Parameters
    ----------
    reduced, full : SteSweep
        At the same angles and torques.
    """

    reduced: SteSweep
    full: SteSweep

    @property
    def relative_error(self) -> FloatArray:
        """Reduced minus full STE over the full deflection, shape (n_torques, n_angles); NaN where either is missing."""
        return np.asarray((self.reduced.ste_um - self.full.ste_um) / self.full.deflection_um)

    @property
    def max_relative_error(self) -> float:
        """Largest magnitude of the relative error; NaN when nothing could be compared."""
        error = np.abs(self.relative_error)
        return float(np.nanmax(error)) if np.isfinite(error).any() else float("nan")

    @property
    def rms_relative_error(self) -> float:
        """Root mean square of the relative error; NaN when nothing could be compared."""
        error = self.relative_error
        return float(np.sqrt(np.nanmean(error**2))) if np.isfinite(error).any() else float("nan")

    def columns(self) -> Columns:
        """All of it by the names of columns, for `to_dataframe`: a value for each torque and angle."""
        torques, angles = self.full.ste_um.shape
        return {
            "torque_Nm": np.repeat(self.full.torque_Nm, angles), "phi_rad": np.tile(self.full.phi_rad, torques),
            "ste_reduced_um": self.reduced.ste_um.ravel(), "ste_full_um": self.full.ste_um.ravel(),
            "error_percent": 100.0 * self.relative_error.ravel(),
        }  # fmt: skip


def compare_models(
    reduced: ReducedPair, model: ElasticModel | None, progress: Callable[[], None] = lambda: None,
    executor: Executor | None = None,
) -> Comparison:  # fmt: skip
    """Solve the case's comparison positions with the reduced and the full model.

    Parameters
    ----------
    model : ElasticModel or None
        Full FE of the same case. None: line loads are held against full contact on the compliance in their basis, which
        is that of the finite elements.
    progress : callable
        Called after each angle of the full model, for progress.
    executor : concurrent.futures.Executor, optional
        Solves several angles of the full model at a time.
    """
    case, pair = reduced.basis.case, reduced.meshed.pair
    meshed, elasticity = (model.mesh.meshed, model.elasticity_at) if model else (reduced.meshed, reduced.elasticity_at)
    phi = unseen_angles(pair.meshing_range[0], pair.pitch, case.compare.angles, case.offline.angles_per_pitch)
    conditions = conditions_of(case, case.compare.torques_Nm)
    sweep_reduced_pair(reduced, phi[:1], conditions)  # compiles: run times are those of warm code
    sweep_ste(meshed, elasticity, phi[:1], conditions[:1])
    full = sweep_ste(meshed, elasticity, phi, conditions, progress, executor)
    return Comparison(
        reduced=sweep_reduced_pair(reduced, phi, conditions), full=with_unloaded(full, meshed, conditions)
    )


def disagreement(comparison: Comparison, bound_percent: float) -> list[str]:
    """Name the position where both models differ most, if that is by more than a bound (percent of the deflection)."""
    error = 100.0 * np.abs(np.nan_to_num(comparison.relative_error))
    t, i = np.unravel_index(int(np.argmax(error)), error.shape)
    if not error[t, i] > bound_percent:
        return []
    full = comparison.full
    return [
        f"reduced model: the STE is {error[t, i]:.3g} % from that of full FE at phi = {full.phi_rad[i]:.6g} rad, "
        f"torque = {full.torque_Nm[t]:g} N m, more than [compare] largest_error_percent = {bound_percent:g}: train at "
        'more angles and torques ([offline]), choose shapes = "line_loads", or raise the bound'
    ]


def training_failures(training: Training) -> list[str]:
    """Name the full-FE solutions that are missing from a basis: it answers there too, but worse."""
    return [
        f"training: phi = {training.phi[i]:.6g} rad, torque = {1e-3 * training.torque[t, i]:g} N m did not converge"
        for t, i in np.argwhere(~training.converged)
    ]


def failed_positions(sweep: SteSweep, label: str) -> list[str]:
    """Name the positions of a sweep that did not converge."""
    wide = np.zeros_like(sweep.converged) if sweep.overloaded is None else sweep.overloaded
    return [
        f"{label}: phi = {sweep.phi_rad[i]:.6g} rad, torque = {sweep.torque_Nm[t]:g} N m "
        + (TOO_WIDE if wide[t, i] else "did not converge")
        for t, i in np.argwhere(~sweep.converged)
    ]
