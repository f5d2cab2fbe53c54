"""One function per command: the one place that knows foundation, offline stage and online stage.

Imports of what is heavy or belongs to a stage stand inside the functions, so that `pmor --help` stays instant.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pmor.app.run import RunResult
    from pmor.case import Case
    from pmor.design.result import DesignResult
    from pmor.dynamics.result import DynamicsResult
    from pmor.pair.model import MeshModel


def run(case_path: Path, out: Path | None = None, jobs: int = 1, overwrite: bool = False) -> None:
    """Do everything that the case asks for: offline if there is no valid basis, sweep, comparison, report."""
    _run_case(case_path, out, jobs, overwrite, pages=True)


def compare(case_path: Path, out: Path | None = None, jobs: int = 1, overwrite: bool = False) -> None:
    """Compare the reduced with the full model: error and run time."""
    _run_case(case_path, out, jobs, overwrite, pages=False)


def _run_case(case_path: Path, out: Path | None, jobs: int, overwrite: bool, pages: bool) -> None:
    from pmor.app.run import run_case
    from pmor.case import load_case
    from pmor.core.threads import threads

    case = load_case(case_path)
    with threads(jobs) as executor:
        _finish(run_case(case, out, pages=pages, overwrite=overwrite, executor=executor, inputs=(case_path,)))


def plan(case_path: Path) -> None:
    """Print what will run, and how much of it; runs nothing."""
    from pmor.app.plan import plan_parts
    from pmor.case import load_case

    for number, part in enumerate(plan_parts(load_case(case_path))):
        print("\n" * (number > 0) + part)


def offline(case_path: Path, basis_path: Path, resume: bool = False, jobs: int = 1, overwrite: bool = False) -> None:
    """Generate the reduced basis of a case and write it to `basis_path`."""
    from pmor.app.training import train_file
    from pmor.case import load_case
    from pmor.core.errors import ConvergenceError
    from pmor.core.threads import threads

    case = load_case(case_path)
    with threads(jobs) as executor:
        done = train_file(case, basis_path, resume=resume, overwrite=overwrite, executor=executor, inputs=(case_path,))
    print(f"{basis_path}: {done.solved} angles solved, {done.resumed} taken over, {done.seconds:.3g} s")
    if done.failed:
        raise ConvergenceError(f"{len(done.failed)} full solves did not converge: {'; '.join(done.failed)}", [])


def online(
    basis_path: Path, out: Path | None = None, case_path: Path | None = None, jobs: int = 1, overwrite: bool = False
) -> None:
    """Sweep the static transmission error with the reduced model of a basis file."""
    from pmor.app.training import load_model
    from pmor.case import load_case
    from pmor.core.threads import threads
    from pmor.storage.results_folder import default_folder

    model = load_model(basis_path, case=load_case(case_path) if case_path else None)
    folder, inputs = out or default_folder(model.case.name), (case_path,) if case_path else ()
    with threads(jobs) as executor:
        _finish(model.report(folder, compare=False, overwrite=overwrite, executor=executor, inputs=inputs))


def study(
    study_path: Path, out: Path | None = None, jobs: int = 1, quick: bool = False, overwrite: bool = False
) -> None:
    """Run a study: a grid of meshes and refinements, three models, error against run time, one report."""
    from pmor.core.threads import use_one_thread

    use_one_thread()  # before anything loads numpy
    from pmor.core.errors import ConvergenceError
    from pmor.core.threads import threads
    from pmor.lab.study.loader import load
    from pmor.lab.study.run import run
    from pmor.storage.results_folder import default_folder

    settings = load(study_path, quick=quick)
    folder = out or default_folder(settings.name, "_quick" * quick)
    with threads(jobs) as executor:
        result = run(settings, folder=folder, overwrite=overwrite, executor=executor)
    result.write(folder, overwrite=overwrite)
    print(f"{result}\n  results in {folder}")
    if result.failures:
        raise ConvergenceError(f"{len(result.failures)} did not converge, first: {result.failures[0]}", [])


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
    from pmor.lab.bench import read_rows, run
    from pmor.storage.results_folder import results_folder

    case = load_case(case_path)
    if json_path.suffix in ("", ".md"):  # the name of the table beside the numbers, or none at all
        raise OutputError(f"{json_path}: is no name for the numbers; choose one that ends in .json")
    names = json_path.name, json_path.with_suffix(".md").name
    with results_folder(json_path.parent, names, (), overwrite, (case_path,)):
        result = run(case, jobs=jobs, before=read_rows(json_path))
        result.write(json_path)
    print(result)


def export(
    source: Path, to: str, target: Path | None = None, stage: int | None = None, torque_Nm: float | None = None,
    overwrite: bool = False,
) -> None:  # fmt: skip
    """Write a basis, a gearbox or results in the format of another program."""
    from pmor.app.export import export_file

    print(f"{export_file(source, to, target, stage=stage, torque_Nm=torque_Nm, overwrite=overwrite)}: written")


def info(path: Path, verify: bool = False) -> None:
    """Print what is in an HDF5 file and, where asked for, whether a basis obeys its laws."""
    from pmor.app import files
    from pmor.core.errors import FileFormatError
    from pmor.storage.basis_file import BASIS_SCHEMA

    print(files.info(path))
    if verify:
        found = files.verify(path)
        print(found)
        if found.failures:
            raise FileFormatError(
                f"{path}: does not obey its own laws: {', '.join(found.failures)}; {BASIS_SCHEMA.remedy}"
            )


def _meshed_case(case_path: Path) -> tuple[Case, MeshModel]:
    """Read a case and mesh it: refuses what cannot be meshed before any folder is made."""
    from pmor.case import load_case

    case = load_case(case_path)
    from pmor.work.cost import meshed_within_memory

    return case, meshed_within_memory(case)


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


def _finish(result: RunResult) -> None:
    """Print the result of a run and where its files are; exit with 3 where a position did not converge."""
    from pmor.core.errors import ConvergenceError

    print(result)
    print(f"  results in {result.folder}")
    if result.failures:
        raise ConvergenceError(f"{len(result.failures)} positions did not converge, first: {result.failures[0]}", [])
