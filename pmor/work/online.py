"""The online stage as a job: sweep and comparison, with progress on the screen."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path

from pmor.core.progress import Progress, Steps, quietly
from pmor.pair.conditions import assembly_of
from pmor.pair.model import ElasticModel
from pmor.work.advice import with_verdict
from pmor_online.compare import compare_models
from pmor_online.conditions import ConditionSweep, sweep_listed
from pmor_online.model import ReducedPair, sweep_angles
from pmor_online.readings import read_off
from pmor_online.root_stress import root_stress_causes
from pmor_online.run import OnlineResult, root_stress_of_case, sweep_case, web_stress_of_case
from pmor_online.samples import solve_samples


def run_online(
    reduced: ReducedPair, basis_path: Path, model: ElasticModel | None = None, *, basis_bytes: float | None = None,
    executor: Executor | None = None, progress: Steps = quietly,
) -> OnlineResult:  # fmt: skip
    """Sweep with the reduced model and, given the full one, compare.

    Parameters
    ----------
    basis_path : Path
        File of the basis.
    model : ElasticModel, optional
        Full FE of the same case.
    basis_bytes : float, optional
        Size of the file when the basis was read; by default its present one.
    executor : concurrent.futures.Executor, optional
        Of threads: shares out the angles.
    progress : callable
        Called with the number of angles solved: of the sweep, of the listed conditions, of the comparison.
    """
    case = reduced.basis.case
    scheme, angles = case.contact.scheme, len(sweep_angles(case))
    with Progress(angles, f"{scheme}: reduced model", further=progress) as bar:
        sweep = sweep_case(reduced, executor, bar.step)
    readings = read_off(reduced, sweep, executor) if sweep.states is not None else None
    stress = root_stress_of_case(reduced, executor)
    causes = root_stress_causes(reduced, sweep_angles(case), assembly_of(case), case.torque_Nm, executor)
    conditions: tuple[ConditionSweep, ...] = ()
    if case.conditions:
        with Progress(angles * len(case.conditions), "conditions", further=progress) as bar:
            conditions = sweep_listed(reduced, executor, bar.step)
    samples = solve_samples(reduced, case.online.torques_Nm, case.online.angles_per_pitch, executor)
    size_mib = (basis_path.stat().st_size if basis_bytes is None else basis_bytes) / 2**20
    found = OnlineResult(reduced, sweep, None, size_mib, executor is not None, conditions, basis_path.name,
                         readings=readings, root_stress=stress, root_stress_causes=causes,
                         web_stress=web_stress_of_case(reduced, executor), samples=samples)  # fmt: skip
    found = with_verdict(found)
    return found if model is None else with_comparison(found, model, executor, progress)


def with_comparison(
    found: OnlineResult, model: ElasticModel | None, executor: Executor | None = None, progress: Steps = quietly
) -> OnlineResult:
    """Return a result beside full FE; parameters as of `compare_models`, progress in angles."""
    case = found.case
    with Progress(case.compare.angles, f"{case.contact.scheme}: full FE, unseen angles", further=progress) as bar:
        return replace(found, comparison=compare_models(found.reduced, model, bar.step, executor))
