"""One function per command: the one place that knows foundation, offline stage and online stage.

Imports of what is heavy or belongs to a stage stand inside the functions, so that `pmor --help` stays instant.
"""

from __future__ import annotations

import logging
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pmor.case import Case
    from pmor.design.result import DesignResult
    from pmor.dynamics.result import DynamicsResult
    from pmor.pair.model import ElasticModel, MeshModel
    from pmor_online.run import OnlineResult


def run(case_path: Path, out: Path | None = None, jobs: int = 1, overwrite: bool = False) -> None:
    """Do everything that the case asks for: offline if there is no valid basis, sweep, comparison, report."""
    started = time.perf_counter()
    case, mesh = _meshed_case(case_path)
    from pmor.jobs.live import live_pair
    from pmor.jobs.models import basis_names, meshed_models, run_models, unfinished
    from pmor.report.run_page import page_files, write_pages
    from pmor.report.screen import result_text
    from pmor.report.summary import result_files, write_results
    from pmor.storage.results_folder import default_folder, results_folder, start_results

    folder, others = out or default_folder(case.name), meshed_models(case)
    names = (*result_files(case), *page_files(case), *(basis_names(case) if overwrite else ()))
    with results_folder(folder, names, unfinished(case), overwrite, (case_path,)):
        result = run_models(case, _elastic_model(case, mesh), others, folder, jobs, overwrite, started)
        start_results(folder, case.text)
        write_results(result, folder)
        write_pages(result, mesh.pinion, folder, live_pair(result.reduced))
    print(result_text(result))
    print(f"  results in {folder}")
    _require_convergence(result)


def plan(case_path: Path) -> None:
    """Print what will run, and how much of it; runs nothing."""
    from pmor.app.plan import plan_parts
    from pmor.case import load_case
    from pmor.pair.model import gear_pair

    case = load_case(case_path)
    gear_pair(case)  # what is no pair is refused before anything is said
    for number, part in enumerate(plan_parts(case)):
        print("\n" * (number > 0) + part)


def offline(case_path: Path, basis_path: Path, resume: bool = False, jobs: int = 1, overwrite: bool = False) -> None:
    """Generate the reduced basis of a case and write it to `basis_path`."""
    from pmor.core.errors import ConvergenceError
    from pmor.jobs.offline import parts_of
    from pmor.storage.atomic import ensure_writable, refuse_existing
    from pmor.storage.results_folder import refuse_foreign_folder, refuse_in_the_way

    started = time.perf_counter()
    # Before the work, not after it.
    refuse_existing(basis_path, overwrite)
    refuse_in_the_way([basis_path], overwrite, (case_path,))
    case, mesh = _meshed_case(case_path)
    ensure_writable(basis_path.parent)
    refuse_foreign_folder(parts_of(basis_path))
    model = _elastic_model(case, mesh)
    from pmor.jobs.offline import run_offline
    from pmor_online.errors import estimate_errors

    done = run_offline(case, model, basis_path, jobs, resume, overwrite, started, estimate_errors)
    print(f"{basis_path}: {done.solved} angles solved, {done.resumed} taken over, {done.seconds:.3g} s")
    if done.failed:
        raise ConvergenceError(f"{len(done.failed)} full solves did not converge: {'; '.join(done.failed)}", [])


def online(
    basis_path: Path, out: Path | None = None, case_path: Path | None = None, jobs: int = 1, overwrite: bool = False
) -> None:
    """Sweep the static transmission error with the reduced model of a basis file."""
    from pmor.case import load_case, text_of
    from pmor.case.live_page import takes_whole_width
    from pmor.case.width import whole_width
    from pmor.jobs.live import live_pair
    from pmor.jobs.online import run_online
    from pmor.pair.model import refuse_loads
    from pmor.report.run_page import page_files, write_pages
    from pmor.report.screen import result_text
    from pmor.report.summary import result_files, write_results
    from pmor.storage.basis_file import read_basis, require_made_from
    from pmor.storage.results_folder import default_folder, results_folder, start_results
    from pmor.work.cost import refuse_beyond_memory, refuse_large_basis
    from pmor_online.model import reduced_pair

    refuse_large_basis(basis_path)
    basis = read_basis(basis_path)
    if case_path is not None:
        case = load_case(case_path)
        require_made_from(basis_path, basis, case)
        basis = replace(basis, case=case)
    reduced = reduced_pair(basis)
    refuse_loads(basis.case, reduced.meshed)  # a sweep may go beyond those that the training has been through
    if takes_whole_width(basis.case):
        refuse_beyond_memory(whole_width(basis.case))
    folder, names = out or default_folder(basis.case.name), (*result_files(basis.case), *page_files(basis.case))
    inputs = (basis_path, *([case_path] if case_path else []))
    with results_folder(folder, names, (), overwrite, inputs):
        result = run_online(reduced, basis_path, jobs=jobs)
        start_results(folder, text_of(basis.case))
        write_results(result, folder)
        write_pages(result, None, folder, live_pair(result.reduced))
    print(result_text(result))
    print(f"  results in {folder}")
    _require_convergence(result)


def compare(case_path: Path, out: Path | None = None, jobs: int = 1, overwrite: bool = False) -> None:
    """Compare the reduced with the full model: error and run time."""
    started = time.perf_counter()
    case, mesh = _meshed_case(case_path)
    from pmor.jobs.models import meshed_models, run_models, unfinished
    from pmor.report.screen import result_text
    from pmor.report.summary import result_files, write_results
    from pmor.storage.results_folder import default_folder, results_folder, start_results

    folder, others = out or default_folder(case.name), meshed_models(case)
    with results_folder(folder, result_files(case), unfinished(case), overwrite, (case_path,)):
        result = run_models(case, _elastic_model(case, mesh), others, folder, jobs, False, started)
        start_results(folder, case.text)
        write_results(result, folder)
    print(result_text(result))
    _require_convergence(result)


def study(
    study_path: Path, out: Path | None = None, jobs: int = 1, quick: bool = False, overwrite: bool = False
) -> None:
    """Run a study: a grid of meshes and refinements, three models, error against run time, one report."""
    from pmor.core.threads import use_one_thread

    use_one_thread()  # before anything loads numpy
    from pmor.core.errors import ConvergenceError
    from pmor.lab.study.loader import load_study
    from pmor.lab.study.settings import quick_study

    settings = load_study(study_path)
    settings = quick_study(settings) if quick else settings
    from pmor.lab.study.output import FILES, study_text, write_study
    from pmor.lab.study.run import WORKING, run_parts
    from pmor.lab.study.table import study_table
    from pmor.storage.results_folder import default_folder, results_folder, start_results

    folder = out or default_folder(settings.name, "_quick" * quick)
    with results_folder(folder, FILES, WORKING, overwrite, (study_path, settings.base)):
        parts = run_parts(settings, folder, jobs, overwrite)
        table = study_table(parts)
        start_results(folder, f"{settings!r}\n{settings.base.read_text(encoding='utf-8')}")
        write_study(parts, table, folder)
    print(study_text(parts, table))
    print(f"  results in {folder}")
    if table.failures:
        raise ConvergenceError(f"{len(table.failures)} did not converge, first: {table.failures[0]}", [])


def convergence(case_path: Path, out: Path | None = None, overwrite: bool = False) -> None:
    """Solve a case on finer and finer meshes of each element: what does the mesh cost?"""
    from pmor.core.threads import use_one_thread

    use_one_thread()  # before anything loads numpy
    from pmor.case import load_case
    from pmor.lab.convergence.run import run
    from pmor.storage.results_folder import default_folder

    case = load_case(case_path)
    folder = out or default_folder(case.name, "_convergence")
    found = run(case, folder=folder, overwrite=overwrite)
    found.write(folder, overwrite=overwrite)
    print(f"{found}\n  results in {folder}")


def stability(case_path: Path, out: Path | None = None, jobs: int = 1, only: str = "", overwrite: bool = False) -> None:
    """Run stiff and extreme variants of a case: does the program hold, and how well?"""
    from pmor.core.threads import use_one_thread

    use_one_thread()  # before anything loads numpy
    from pmor.case import load_case
    from pmor.core.errors import ConvergenceError
    from pmor.core.threads import threads
    from pmor.lab.stability.run import run
    from pmor.storage.results_folder import default_folder

    case = load_case(case_path)
    folder = out or default_folder(case.name, "_stability")
    with threads(jobs) as executor:
        result = run(case, only=only, folder=folder, overwrite=overwrite, executor=executor)
    result.write(folder, overwrite=overwrite)
    print(f"{result}\n  results in {folder}")
    if result.failed:
        raise ConvergenceError(f"{len(result.failed)} variants failed, first: {result.failed[0].name}", [])


def reductions(case_path: Path, out: Path | None = None, jobs: int = 1, overwrite: bool = False) -> None:
    """Compare the reductions and the samplings of their training over the ranges of a case."""
    from pmor.core.threads import use_one_thread

    use_one_thread()  # before anything loads numpy
    from pmor.case import load_case
    from pmor.core.errors import ConvergenceError
    from pmor.core.threads import threads
    from pmor.lab.comparison.run import run
    from pmor.storage.results_folder import default_folder

    case = load_case(case_path)
    folder = out or default_folder(case.name, "_reductions")
    with threads(jobs) as executor:
        result = run(case, folder=folder, overwrite=overwrite, executor=executor)
    result.write(folder, overwrite=overwrite)
    print(f"{result}\n  results in {folder}")
    if result.failures:
        raise ConvergenceError(f"{len(result.failures)} states did not converge, first: {result.failures[0]}", [])


def dynamics(case_path: Path, out: Path | None = None, jobs: int = 1, overwrite: bool = False) -> None:
    """Find the motion of a pair over its speed: frequency response, run-up and run-down under each torque."""
    from pmor.core.threads import use_one_thread

    use_one_thread()  # before anything loads numpy
    from pmor.case import load_case
    from pmor.core.threads import processes
    from pmor.dynamics.run import run
    from pmor.storage.results_folder import default_folder

    case = load_case(case_path)
    folder = out or default_folder(case.name, "_dynamics")
    with processes(jobs) as executor:
        result = run(case, folder=folder, overwrite=overwrite, executor=executor)
    _leave(result, folder, overwrite, "parts of responses are missing")


def design(
    design_path: Path, out: Path | None = None, jobs: int = 1, overwrite: bool = False, variant: int | None = None
) -> None:
    """Search the flank modifications that a design file asks for, or write one variant as a case file."""
    from pmor.core.threads import use_one_thread

    use_one_thread()  # before anything loads numpy
    from pmor.core.threads import threads
    from pmor.design.loader import load
    from pmor.design.run import run
    from pmor.design.variant_case import write_variant
    from pmor.storage.results_folder import default_folder

    file = load(design_path)
    folder = out or default_folder(file.name)
    if variant is not None:
        print(f"{write_variant(file, folder, variant, overwrite=overwrite)}: written")
        return
    with threads(jobs) as executor:
        result = run(file, folder=folder, overwrite=overwrite, executor=executor)
    _leave(result, folder, overwrite, "did not converge")


def campaign(
    campaign_path: Path, out: Path | None = None, jobs: int = 1, dask: str | None = None,
    case_number: int | None = None, overwrite: bool = False,
) -> None:  # fmt: skip
    """Solve a table of designs, each with gears of its own, on processes of this machine or on a cluster."""
    from pmor.core.threads import use_one_thread

    use_one_thread()  # before anything loads numpy
    from pmor.campaigns.cluster import dask_executor
    from pmor.campaigns.loader import load
    from pmor.campaigns.output import write_design
    from pmor.campaigns.run import run
    from pmor.campaigns.supervise import LocalProcesses
    from pmor.core.errors import ConvergenceError
    from pmor.core.progress import Progress
    from pmor.storage.results_folder import default_folder

    settings = load(campaign_path)
    if case_number is not None:
        print(f"{write_design(settings, case_number, out or Path(), overwrite)}: written")
        return
    folder = out or default_folder(settings.name)
    with dask_executor(dask) if dask else LocalProcesses(jobs) as executor, Progress(settings.count, "designs") as bar:
        found = run(settings, folder=folder, executor=executor, progress=bar.step, overwrite=overwrite)
    found.write(folder, overwrite=overwrite)
    print(found)
    print(f"  results in {folder}")
    if len(found.failed):
        first = f"design {found.failed[0] + 1}: {found.reasons[found.failed[0]]}"
        raise ConvergenceError(f"{len(found.failed)} designs have no results, first: {first}", [])


def bench(case_path: Path, json_path: Path, jobs: int = 2, overwrite: bool = False) -> None:
    """Measure run times by phase and by size, as ratios to an earlier measurement where there is one."""
    from pmor.core.threads import use_one_thread

    use_one_thread()  # before anything loads numpy
    from pmor.case import load_case
    from pmor.core.errors import OutputError
    from pmor.lab.bench import bench_text, read_bench, run_bench, write_bench
    from pmor.storage.results_folder import results_folder

    case = load_case(case_path)
    if json_path.suffix in ("", ".md"):  # the name of the table beside the numbers, or none at all
        raise OutputError(f"{json_path}: is no name for the numbers; choose one that ends in .json")
    names = json_path.name, json_path.with_suffix(".md").name
    with results_folder(json_path.parent, names, (), overwrite, (case_path,)):
        before = read_bench(json_path)
        result = run_bench(case, jobs)
        write_bench(result, before, json_path)
    print(bench_text(result, before))


def export(
    source: Path, to: str, target: Path | None = None, stage: int | None = None, torque_Nm: float | None = None,
    overwrite: bool = False,
) -> None:  # fmt: skip
    """Write a basis, a gearbox or results in the format of another program."""
    from pmor.app.export import export_file

    done = export_file(source, to, target, overwrite, stage, torque_Nm)
    for note in done.notes:
        logging.getLogger("pmor").info("%s", note)
    print(f"{done.path}: written")


def info(path: Path, verify: bool = False) -> None:
    """Print what is in an HDF5 file and, where asked for, whether a basis obeys its laws."""
    from pmor.campaigns.describe import folder_text
    from pmor.storage.describe import file_text

    print(folder_text(path) if path.is_dir() else file_text(path))
    if verify:
        _verify(path)


def _verify(path: Path) -> None:
    """Hold a basis against full FE of the case in its file."""
    from pmor.core.errors import FileFormatError
    from pmor.core.progress import Progress
    from pmor.jobs.verify import UNSEEN_STATES, checks_text, verify_basis
    from pmor.storage.basis_file import BASIS_SCHEMA, read_basis
    from pmor.work.cost import meshed_within_memory

    basis = read_basis(path)
    model = _elastic_model(basis.case, meshed_within_memory(basis.case))
    with Progress(UNSEEN_STATES, "full FE, unseen states") as progress:
        checks = verify_basis(basis, model, progress.step)
    print(checks_text(checks))
    broken = ", ".join(f"{c.name} ({c.value:.2g}, at most {c.limit:.2g})" for c in checks if not c.ok)
    if broken:
        raise FileFormatError(f"{path}: does not obey its own laws: {broken}; {BASIS_SCHEMA.remedy}")


def _meshed_case(case_path: Path) -> tuple[Case, MeshModel]:
    """Read a case and mesh it: refuses what cannot be meshed before any folder is made."""
    from pmor.case import load_case

    case = load_case(case_path)
    from pmor.work.cost import meshed_within_memory

    return case, meshed_within_memory(case)


def _elastic_model(case: Case, mesh: MeshModel) -> ElasticModel:
    from pmor.pair.limits import range_warnings
    from pmor.pair.model import approach_estimate, elastic_model

    pair = mesh.meshed.pair
    for warning in range_warnings(case, pair, approach_estimate(case, pair)):
        logging.getLogger("pmor").warning("%s", warning)
    return elastic_model(case, mesh)


def _leave(result: DynamicsResult | DesignResult, folder: Path, overwrite: bool, what_failed: str) -> None:
    """Write a result and print it.

    Raises
    ------
    ConvergenceError
        Where a part of it failed.
    """
    from pmor.core.errors import ConvergenceError

    result.write(folder, overwrite=overwrite)
    print(result)
    print(f"  results in {folder}")
    if failures := result.failures:
        raise ConvergenceError(f"{len(failures)} {what_failed}, first: {failures[0]}", [])


def _require_convergence(result: OnlineResult) -> None:
    from pmor.core.errors import ConvergenceError

    if failures := result.all_failures:
        raise ConvergenceError(f"{len(failures)} positions did not converge, first: {failures[0]}", [])
