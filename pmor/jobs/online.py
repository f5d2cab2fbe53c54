"""The online stage as a job: sweep and comparison, with threads and progress on the screen."""

from __future__ import annotations

from pathlib import Path

from pmor.core.progress import Progress
from pmor.core.threads import threads
from pmor.pair.model import ElasticModel
from pmor_online.compare import compare_models
from pmor_online.conditions import ConditionSweep, sweep_listed
from pmor_online.model import ReducedPair, sweep_angles
from pmor_online.readings import read_off
from pmor_online.run import OnlineResult, root_stress_of_case, sweep_case


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
        Angles solved at a time.

    Returns
    -------
    OnlineResult
    """
    case, comparison = reduced.basis.case, None
    scheme = case.contact.scheme
    with threads(jobs) as executor:
        with Progress(len(sweep_angles(case)), f"{scheme}: reduced model") as progress:
            sweep = sweep_case(reduced, executor, progress.step)
        readings = read_off(reduced, sweep, executor) if sweep.states is not None else None
        stress = root_stress_of_case(reduced, executor)
        conditions: tuple[ConditionSweep, ...] = ()
        if case.conditions:
            with Progress(len(sweep_angles(case)) * len(case.conditions), "conditions") as progress:
                conditions = sweep_listed(reduced, executor, progress.step)
        if model is not None:
            with Progress(case.compare.angles, f"{scheme}: full FE, unseen angles") as progress:
                comparison = compare_models(reduced, model, progress.step, executor)
    size_mib = basis_path.stat().st_size / 2**20
    return OnlineResult(reduced, sweep, comparison, size_mib, jobs, conditions, basis_path.name, readings=readings,
                        root_stress=stress)  # fmt: skip
