"""One function per command that does more than answer a file: see `pmor.app.records`.

Imports of heavy libraries and of stages stand inside the functions, so that `pmor --help` stays instant.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pmor.app import capabilities
from pmor.app.records import COMMANDS, KINDS, kind_of, kind_of_settings, settings_for, typed
from pmor.core.errors import ConvergenceError, FileFormatError, PmorError, printable
from pmor.core.progress import Progress, format_time, told_late
from pmor.core.threads import cores, threads
from pmor.storage.results_folder import default_folder

if TYPE_CHECKING:
    from pmor.app.run import RunResult
    from pmor.design.result import DesignResult


def answer(
    name: str, file_path: Path, out: Path | None = None, jobs: int = 1, overwrite: bool = False, **options: Any
) -> None:
    """Answer what a command asks of a file, and leave its files."""
    _answer(name, settings_for(file_path, name), out, jobs, overwrite, **options)


def _answer(
    name: str, settings: Any, out: Path | None, jobs: int, overwrite: bool, *, workers: Any = None, suffix: str = "",
    **options: Any,
) -> None:  # fmt: skip
    command = COMMANDS[name]
    folder = out or default_folder(settings.name, command.folder + suffix)
    make = threads if kind_of_settings(settings) in command.on_threads else command.workers
    workers = workers or make(jobs)
    with told_late(_foretold(name, settings)):
        result = capabilities.answered(name, settings, folder, overwrite, workers, **options)
    _finish(result, folder, result.failures, command.failed)


def run(file_path: Path, out: Path | None = None, jobs: int | None = None, overwrite: bool = False) -> None:
    """Do everything that a file asks for, whatever kind it is."""
    kind = kind_of(file_path)
    name = KINDS[kind].command
    if name != "run":
        print(f"{printable(file_path.name)}: {KINDS[kind].words}, as {typed(name)}", file=sys.stderr)
    elif kind == "set" and file_path.suffix.lower() != ".toml":
        remedy = f"with its shafts and bearings: pmor export {file_path} --to gearbox"
        print(printable(f"{file_path.name}: {KINDS[kind].words}; {remedy}"), file=sys.stderr)
    if name == "design":
        design(file_path, out, jobs, overwrite)
    elif name == "campaign":
        campaign(file_path, out, jobs or 1, overwrite)
    elif name == "study":
        study(file_path, out, jobs or 1, overwrite)
    elif kind == "case":
        _case(file_path, "run", out, jobs or 1, overwrite, pages=True)
    else:
        answer("run", file_path, out, jobs or 1, overwrite)


def compare(case_path: Path, out: Path | None = None, jobs: int = 1, overwrite: bool = False) -> None:
    """Compare the reduced with the full model: error and run time."""
    _case(case_path, "compare", out, jobs, overwrite, pages=False)


def _case(path: Path, command: str, out: Path | None, jobs: int, overwrite: bool, pages: bool) -> None:
    from pmor.app.run import run_case

    case = settings_for(path, command)
    folder = out or default_folder(case.name)
    with told_late(_foretold(command, case)), threads(jobs) as executor:
        result = run_case(
            case, folder, pages=pages, overwrite=overwrite, executor=executor, inputs=(path,), asked=_say_asked
        )
    _finish_pair(result, folder)


def _foretold(name: str, settings: Any) -> str:
    """What is said of a command that takes long: how long, by its plan where there is one."""
    found = None if kind_of_settings(settings) == "campaign" else capabilities.plan_of(settings)
    if found is None or name not in found.seconds:
        return f"{settings.name}: at work ..."
    once = f", and about {format_time(found.compiling_s)} once to compile kernels" if found.compiling_s else ""
    seconds = format_time(found.seconds[name])
    return f"{settings.name}: takes about {seconds} of one core, less where bodies are kept{once} ..."


def plan(file_path: Path) -> None:
    """Print what will run, and how much of it; runs nothing."""
    parts = capabilities.plan_parts(capabilities.load(file_path))
    for number, part in enumerate(parts):  # the first ones stand where there is too little memory
        print("\n" * (number > 0) + part)


def new(kind: str) -> None:
    """Print a file to start from."""
    from pmor.app.start import start_text

    print(start_text(kind), end="")


def schema(kind: str | None = None) -> None:
    """Print the JSON Schema of a kind of file."""
    from pmor.app.start import schema_text

    print(schema_text(kind), end="")


def offline(case_path: Path, basis_path: Path, resume: bool = False, jobs: int = 1, overwrite: bool = False) -> None:
    """Generate the reduced basis of a case and write it to `basis_path`."""
    from pmor.app.training import train_file

    case = settings_for(case_path, "offline")
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

    model = load_model(basis_path, case=settings_for(case_path, "online") if case_path else None)
    folder, inputs = out or default_folder(model.case.name), (case_path,) if case_path else ()
    with threads(jobs) as executor:
        result = model.report(
            folder, compare=False, overwrite=overwrite, executor=executor, inputs=inputs, asked=_say_asked
        )
    _finish_pair(result, folder)


def design(
    file_path: Path, out: Path | None = None, jobs: int | None = None, overwrite: bool = False,
    number: int | None = None,
) -> None:  # fmt: skip
    """Search the flank modifications that a design file asks for, or write one variant as a file."""
    settings = settings_for(file_path, "design")
    folder = out or default_folder(settings.name)
    if number is not None:
        _say(f"{capabilities.write_design_case(settings, folder, number, overwrite=overwrite)}: written")
        return

    def say_first(first: DesignResult) -> None:
        print(first)
        _say(f"  so far in {folder}; the search goes on")
        sys.stdout.flush()

    _answer("design", settings, folder, jobs or cores(), overwrite, asked=say_first)


def campaign(
    file_path: Path, out: Path | None = None, jobs: int = 1, overwrite: bool = False, dask: str | None = None,
    number: int | None = None,
) -> None:  # fmt: skip
    """Solve a table of designs, each with gears of its own, on processes of this machine or on a cluster."""
    settings = settings_for(file_path, "campaign")
    if number is not None:
        _say(f"{capabilities.write_campaign_case(settings, out or Path(), number, overwrite=overwrite)}: written")
        return
    from pmor.campaigns.cluster import dask_executor
    from pmor.campaigns.supervise import LocalProcesses

    workers = dask_executor(dask) if dask else LocalProcesses(jobs)
    with Progress(settings.count, "designs") as bar:
        _answer("campaign", settings, out, jobs, overwrite, workers=workers, progress=bar.step)


def study(
    file_path: Path, out: Path | None = None, jobs: int = 1, overwrite: bool = False, quick: bool = False
) -> None:
    """Run a study, or its short variant."""
    settings = settings_for(file_path, "study", quick=quick)
    _answer("study", settings, out, jobs, overwrite, suffix="_quick" * quick)


def bench(case_path: Path, json_path: Path, jobs: int = 2, overwrite: bool = False) -> None:
    """Measure run times by phase and by size, as ratios to an earlier measurement where there is one."""
    case = settings_for(case_path, "bench")
    print(capabilities.bench(case, json_path, threads=jobs, overwrite=overwrite, inputs=(case_path,)))


def validation(page: Path) -> None:
    """Set figures of others beside those of the program, and write the page."""
    from pmor.validation.page import write_page

    checks = write_page(page)
    _say(f"{len(checks)} figures in {page}")
    if far := [check.quantity for check in checks if not check.holds]:
        raise PmorError(f"{len(far)} figures are too far from their source: {', '.join(far)}")


def export(
    source: Path, to: str, target: Path | None = None, stage: int | None = None, torque_Nm: float | None = None,
    overwrite: bool = False,
) -> None:  # fmt: skip
    """Write a basis, a machine or results in the format of another program."""
    from pmor.app.export import export_file

    _say(f"{export_file(source, to, target, stage=stage, torque_Nm=torque_Nm, overwrite=overwrite)}: written")


def diff(first: Path, second: Path, out: Path | None = None, overwrite: bool = False) -> None:
    """Set the results of two folders beside each other."""
    from pmor.app.diff import diff as set_beside

    names = [path.resolve().name for path in (first, second)]
    folder = out or default_folder("_".join(names), "_diff")
    found = set_beside(first, second, folder, overwrite=overwrite)
    _finish(found, folder, found.failures, "failures in the results")


def info(path: Path, verify: bool = False) -> None:
    """Print what a file is and holds and, where asked for, whether a basis obeys its laws."""
    from pmor.app import files
    from pmor.storage.basis_file import BASIS_SCHEMA

    print(files.info(path))
    if verify:
        verification = files.verify(path)
        print(verification)
        if verification.failures:
            raise FileFormatError(
                f"{path}: does not obey its own laws: {', '.join(verification.failures)}; {BASIS_SCHEMA.remedy}"
            )


def _say_asked(result: RunResult) -> None:
    """Print what was asked for as soon as it is there: pages and proof take longer."""
    from pmor.report.screen import asked_text

    print(asked_text(result.found), flush=True)


def _finish_pair(result: RunResult, folder: Path) -> None:
    from pmor.report.screen import proof_text

    _finish(proof_text(result.found), folder, result.failures, COMMANDS["run"].failed)


def _finish(result: object, folder: Path, failures: Sequence[str], what_failed: str) -> None:
    """Print a result, and where its files are; ConvergenceError where a part of it failed."""
    print(result)
    _say(f"  results in {folder}")
    if failures:
        raise ConvergenceError(f"{len(failures)} {what_failed}, first: {failures[0]}", [])


def _say(line: str) -> None:
    """Print a line with names of files, which may hold any character."""
    print(printable(line))
