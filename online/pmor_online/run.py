"""The online stage as a job: sweep, comparison, and everything that is written about them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pmor.pair.conditions import conditions_of
from pmor.pair.model import ElasticModel
from pmor.parallel import threads
from pmor.progress import Progress
from pmor.results.sweep import SteSweep
from pmor_online.compare import Comparison, compare_models, failed_positions, training_failures
from pmor_online.model import ReducedPair, online_angles
from pmor_online.sweep import sweep_reduced_pair


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
    reduced: ReducedPair, basis_path: Path, model: ElasticModel | None = None, jobs: int = 1
) -> OnlineResult:
    """Sweep with the reduced model and, given the full one, compare.

    Parameters
    ----------
    reduced : ReducedPair
    basis_path : Path
        Where the basis came from.
    model : ElasticModel, optional
        Full FE of the same case.
    jobs : int
        Angles of the full model solved at a time. The reduced sweep is timed, and runs on one thread.

    Returns
    -------
    OnlineResult
    """
    case, pair = reduced.basis.case, reduced.meshed.pair
    phi = online_angles(pair.pitch, case.online.angles_per_pitch)
    conditions = conditions_of(case, case.online.torques_Nm)
    sweep_reduced_pair(reduced, phi[:1], conditions)  # compiles: run times are those of warm code
    with Progress(len(phi), "reduced model") as progress:
        sweep = sweep_reduced_pair(reduced, phi, conditions, advance=progress.advance)
    failures = training_failures(reduced.basis.training) + failed_positions(sweep, "reduced model")
    comparison = None
    if model is not None:
        with threads(jobs) as executor, Progress(case.compare.angles, "full FE, unseen angles") as progress:
            comparison = compare_models(reduced, model, progress.advance, executor)
        failures += failed_positions(comparison.full, "full FE")
        failures += failed_positions(comparison.reduced, "reduced model, unseen angle")
    mib = basis_path.stat().st_size / 2**20
    return OnlineResult(reduced, sweep, comparison, mib, tuple(failures))
