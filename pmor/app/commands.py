"""One function per command: the one place that knows foundation, offline stage and online stage.

Imports of heavy libraries and of stages stand inside the functions, so that `pmor --help` stays instant.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pmor.app import capabilities
from pmor.app.kinds import KINDS, QUESTIONS, called, kind_of, kind_of_settings, load_as
from pmor.core.errors import ConvergenceError, FileFormatError, printable
from pmor.core.progress import Progress
from pmor.core.threads import cores, one_thread, threads
from pmor.storage.results_folder import default_folder

if TYPE_CHECKING:
    from pmor.app.run import RunResult
    from pmor.case import Case
    from pmor.design.result import DesignResult


def run(file_path: Path, out: Path | None = None, jobs: int | None = None, overwrite: bool = False) -> None:
    """Do everything that a file asks for, whatever kind it is."""
    kind = kind_of(file_path)
    if KINDS[kind].command != "run":
        print(f"{printable(file_path.name)}: {KINDS[kind].words}, as pmor {KINDS[kind].command}", file=sys.stderr)
    answers: dict[str, Callable[..., None]] = {
        "case": _case, "design": design, "campaign": campaign, "study": study,
    }  # fmt: skip
    given = {} if jobs is None else {"jobs": jobs}
    if kind in answers:
        answers[kind](file_path, out, overwrite=overwrite, **given)
    else:
        _machine(called(KINDS[kind].load)(file_path), out, overwrite=overwrite, **given)


def compare(case_path: Path, out: Path | None = None, jobs: int = 1, overwrite: bool = False) -> None:
    """Compare the reduced with the full model: error and run time."""
    _answer_case(load_as(case_path, "compare", "case"), case_path, out, jobs, overwrite, pages=False)


def _case(case_path: Path, out: Path | None = None, jobs: int = 1, overwrite: bool = False) -> None:
    _answer_case(called(KINDS["case"].load)(case_path), case_path, out, jobs, overwrite, pages=True)


def _answer_case(case: Case, case_path: Path, out: Path | None, jobs: int, overwrite: bool, pages: bool) -> None:
    from pmor.app.run import run_case
    from pmor.report.screen import proof_text

    folder = out or default_folder(case.name)
    with threads(jobs) as executor:
        found = run_case(
            case, folder, pages=pages, overwrite=overwrite, executor=executor, inputs=(case_path,), asked=_say_asked
        )
    _finish(proof_text(found.found), folder, found.failures, KINDS["case"].failed)


def _machine(settings: Any, out: Path | None = None, jobs: int = 1, overwrite: bool = False) -> None:
    """Solve a gearbox or a set."""
    record = KINDS[kind_of_settings(settings)]
    folder = out or default_folder(settings.name)
    found = _written(record.run, settings, folder, overwrite, threads(jobs))
    _finish(found, folder, found.failures, record.failed)


def plan(file_path: Path) -> None:
    """Print what will run, and how much of it; runs nothing."""
    from pmor.app.plan import plan_parts

    settings = capabilities.load(file_path)
    if kind_of_settings(settings) != "case":
        print(capabilities.plan(settings))
        return
    for number, part in enumerate(plan_parts(settings)):  # the first ones stand where there is too little memory
        print("\n" * (number > 0) + part)


def offline(case_path: Path, basis_path: Path, resume: bool = False, jobs: int = 1, overwrite: bool = False) -> None:
    """Generate the reduced basis of a case and write it to `basis_path`."""
    from pmor.app.training import train_file
    from pmor.case import load_case

    case = load_case(case_path)
    with threads(jobs) as executor:
        done = train_file(case, basis_path, resume=resume, overwrite=overwrite, executor=executor, inputs=(case_path,))
    _say(f"{basis_path}: {done.solved} angles solved, {done.resumed} taken over, {done.seconds:.3g} s")
    if done.failed:
        raise ConvergenceError(f"{len(done.failed)} full solves did not converge: {'; '.join(done.failed)}", [])


def online(
    basis_path: Path, out: Path | None = None, case_path: Path | None = None, jobs: int = 1, overwrite: bool = False
) -> None:
    """Sweep the static transmission error with the reduced model of a basis file."""
    from pmor.app.training import load_model
    from pmor.case import load_case
    from pmor.report.screen import proof_text

    model = load_model(basis_path, case=load_case(case_path) if case_path else None)
    folder, inputs = out or default_folder(model.case.name), (case_path,) if case_path else ()
    with threads(jobs) as executor:
        found = model.report(
            folder, compare=False, overwrite=overwrite, executor=executor, inputs=inputs, asked=_say_asked
        )
    _finish(proof_text(found.found), folder, found.failures, KINDS["case"].failed)


def study(
    study_path: Path, out: Path | None = None, jobs: int = 1, quick: bool = False, overwrite: bool = False
) -> None:
    """Run a study: a grid of meshes and refinements, three models, error against run time, one report."""
    from pmor.lab.study.settings import load

    settings = load(study_path, quick=quick)
    folder = out or default_folder(settings.name, "_quick" * quick)
    found = _written(KINDS["study"].run, settings, folder, overwrite, threads(jobs))
    _finish(found, folder, found.failures, "did not converge")


def convergence(case_path: Path, out: Path | None = None, overwrite: bool = False) -> None:
    """Solve a case on finer and finer meshes of each element."""
    _asked("convergence", case_path, out, 1, overwrite)


def stability(case_path: Path, out: Path | None = None, jobs: int = 1, only: str = "", overwrite: bool = False) -> None:
    """Run stiff and extreme variants of a case."""
    _asked("stability", case_path, out, jobs, overwrite, only=only)


def reductions(case_path: Path, out: Path | None = None, jobs: int = 1, overwrite: bool = False) -> None:
    """Compare the reductions and the samplings of their training over the ranges of a case."""
    _asked("reductions", case_path, out, jobs, overwrite)


def dynamics(case_path: Path, out: Path | None = None, jobs: int = 1, overwrite: bool = False) -> None:
    """Find the motion of a pair over its speed: frequency response, run-up and run-down under each torque."""
    _asked("dynamics", case_path, out, jobs, overwrite)


def _asked(name: str, case_path: Path, out: Path | None, jobs: int, overwrite: bool, **options: str) -> None:
    """Answer a question of `QUESTIONS` about a case, and leave its files."""
    case, question = load_as(case_path, name, "case"), QUESTIONS[name]
    folder = out or default_folder(case.name, f"_{name}")
    found = _written(question.run, case, folder, overwrite, question.executor(jobs), **options)
    _finish(found, folder, found.failures, question.failed)


def design(
    design_path: Path, out: Path | None = None, jobs: int | None = None, overwrite: bool = False,
    variant: int | None = None,
) -> None:  # fmt: skip
    """Search the flank modifications that a design file asks for, or write one variant as a case file."""
    from pmor.design.loader import load

    settings = load(design_path)
    folder = out or default_folder(settings.name)
    if variant is not None:
        _say(f"{capabilities.write_design_case(settings, folder, variant, overwrite=overwrite)}: written")
        return

    def say_first(first: DesignResult) -> None:
        print(first)
        _say(f"  so far in {folder}; the search goes on")
        sys.stdout.flush()

    found = _written(KINDS["design"].run, settings, folder, overwrite, threads(jobs or cores()), asked=say_first)
    _finish(found, folder, found.failures, "did not converge")


def gearbox(file_path: Path, out: Path | None = None, jobs: int = 1, overwrite: bool = False) -> None:
    """Solve shafts, bearings and all meshes of a gearbox together: misalignment, transmission error, loads."""
    _machine(load_as(file_path, "gearbox", "gearbox"), out, jobs, overwrite)


def set(file_path: Path, out: Path | None = None, jobs: int = 1, overwrite: bool = False) -> None:
    """Solve all meshes of a planetary set, an idler chain or a star at once: transmission error, load sharing."""
    _machine(load_as(file_path, "set", "set"), out, jobs, overwrite)


def campaign(
    campaign_path: Path, out: Path | None = None, jobs: int = 1, dask: str | None = None,
    case_number: int | None = None, overwrite: bool = False,
) -> None:  # fmt: skip
    """Solve a table of designs, each with gears of its own, on processes of this machine or on a cluster."""
    from pmor.campaigns.cluster import dask_executor
    from pmor.campaigns.loader import load
    from pmor.campaigns.supervise import LocalProcesses

    settings = load(campaign_path)
    if case_number is not None:
        _say(f"{capabilities.write_campaign_case(settings, out or Path(), case_number, overwrite=overwrite)}: written")
        return
    folder = out or default_folder(settings.name)
    workers = dask_executor(dask) if dask else LocalProcesses(jobs)
    with Progress(settings.count, "designs") as bar:
        found = _written(KINDS["campaign"].run, settings, folder, overwrite, workers, progress=bar.step)
    _finish(found, folder, found.failures, "designs have no results")


def bench(case_path: Path, json_path: Path, jobs: int = 2, overwrite: bool = False) -> None:
    """Measure run times by phase and by size, as ratios to an earlier measurement where there is one."""
    from pmor.case import load_case

    print(capabilities.bench(load_case(case_path), json_path, threads=jobs, overwrite=overwrite, inputs=(case_path,)))


def export(
    source: Path, to: str, target: Path | None = None, stage: int | None = None, torque_Nm: float | None = None,
    overwrite: bool = False,
) -> None:  # fmt: skip
    """Write a basis, a gearbox, a set or results in the format of another program."""
    from pmor.app.export import export_file

    _say(f"{export_file(source, to, target, stage=stage, torque_Nm=torque_Nm, overwrite=overwrite)}: written")


def info(path: Path, verify: bool = False) -> None:
    """Print the content of an HDF5 file and, where asked for, whether a basis obeys its laws."""
    from pmor.app import files
    from pmor.storage.basis_file import BASIS_SCHEMA

    print(files.info(path))
    if verify:
        found = files.verify(path)
        print(found)
        if found.failures:
            raise FileFormatError(
                f"{path}: does not obey its own laws: {', '.join(found.failures)}; {BASIS_SCHEMA.remedy}"
            )


@one_thread()
def _written(
    run: str, settings: object, folder: Path, overwrite: bool, workers: AbstractContextManager[Executor | None],
    **options: object,
) -> Any:  # fmt: skip
    """Answer what settings ask for, and write it once the threads have ended: beside them no other process draws."""
    with workers as executor:
        found = called(run)(settings, folder=folder, overwrite=overwrite, executor=executor, **options)
    found.write(folder, overwrite=overwrite)
    return found


def _say_asked(found: RunResult) -> None:
    """Print what was asked for as soon as it is there: pages and proof take longer."""
    from pmor.report.screen import asked_text

    print(asked_text(found.found), flush=True)


def _finish(result: object, folder: Path, failures: Sequence[str] = (), what_failed: str = "") -> None:
    """Print a result, and where its files are.

    Raises
    ------
    ConvergenceError
        Where a part of it failed.
    """
    print(result)
    _say(f"  results in {folder}")
    if failures:
        raise ConvergenceError(f"{len(failures)} {what_failed}, first: {failures[0]}", [])


def _say(line: str) -> None:
    """Print a line with names of files, which may hold any character."""
    print(printable(line))
