"""Capabilities, and experiments on the program, as functions: each runs, and writes its files if asked to.

All take the name of a file (or what `load` returned, or a case), a folder, and by keyword:

``executor``
    A `concurrent.futures.Executor` that shares out the work; by default it is done here, one piece after the other.
``progress``
    Called with the number of further pieces that are done.
``overwrite``
    Replace files in the folder, whoever wrote them.

With a folder, finished pieces are kept there until the results are written: an interrupted run goes on where it
stopped. Without, `write` of the result leaves the files. Its ``failures``, or ``failed``, name what did not converge.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

from pmor.app.records import COMMANDS, KINDS, called, kind_of, kind_of_settings, settings_for, typed
from pmor.core.errors import CaseError, OutputError, Stopped
from pmor.core.progress import Steps, format_time, quietly
from pmor.core.threads import one_thread
from pmor.core.wording import suggesting, typed_out

if TYPE_CHECKING:
    from pmor.campaigns.campaign import Campaign
    from pmor.campaigns.result import CampaignResult
    from pmor.case import Case
    from pmor.design.files import DesignFile
    from pmor.design.result import DesignResult
    from pmor.dynamics.result import DynamicsResult
    from pmor.dynamics.whine.result import MotionResult
    from pmor.lab.bench import Bench
    from pmor.lab.comparison.result import Comparison as ReductionsResult
    from pmor.lab.convergence.result import Convergence as ConvergenceResult
    from pmor.lab.stability.result import Stability as StabilityResult
    from pmor.lab.study.result import StudyResult
    from pmor.lab.study.settings import Study
    from pmor.machine.loader import GearboxFile
    from pmor.sets.loader import SetFile
    from pmor.work.cost import Plan

Place = Path | str


class Work(TypedDict, total=False):
    """Keywords that all functions take which answer a file."""

    executor: Executor | None
    progress: Steps | None
    overwrite: bool


WORKING = typed_out(Work, executor=None, progress=None, overwrite=False)


@one_thread()
def answered(
    name: str, settings: Any, folder: Place | None, overwrite: bool, workers: AbstractContextManager[Executor | None],
    **options: Any,
) -> Any:  # fmt: skip
    """Answer what a command asks of settings, and write it once the threads have ended: beside them no other draws."""
    run = called(COMMANDS[name].answers[kind_of_settings(settings)])
    try:
        with workers as executor:
            result = run(settings, folder=folder, overwrite=overwrite, executor=executor, **options)
    except Stopped as stopped:  # what is solved has its page
        if folder is not None:
            logging.getLogger("pmor").info("interrupted: the page of what is solved is written first ...")
            stopped.result.write(folder, overwrite=overwrite)
        raise
    if folder is not None:
        result.write(folder, overwrite=overwrite)
    return result


def _answer(name: str, file: Any, folder: Place | None, options: Any, **more: Any) -> Any:
    options = {"overwrite": False, "progress": None, **options, **more}
    workers = nullcontext(options.pop("executor", None))
    return answered(name, settings_for(file, name), folder, workers=workers, **options)


@suggesting
def load(file: Place) -> Any:
    """Read and check a file that describes a machine, or asks about one: TOML, or a gearbox or set in REXS.

    Returns
    -------
    Case, SetFile, GearboxFile, DesignFile, Campaign or Study
        By what the file says; `run` and `plan` take it.

    Raises
    ------
    CaseError, GeometryError, FileFormatError
        One line with file, place, rule and remedy.
    """
    path = Path(file)
    return called(KINDS[kind_of(path)].load)(path)


@suggesting
def plan(file: Any) -> str:
    """Return what a file asks for, how much work and time it is, and what is left out, as `pmor plan` prints it.

    Parameters
    ----------
    file : Path, str, or what `load` or `make_case` returned

    Raises
    ------
    CaseError
        When it takes more memory than there is.
    GeometryError, MeshError
        When there is no such gear, pair or mesh.
    """
    return "\n\n".join(plan_parts(load(file) if isinstance(file, str | Path) else file))


def plan_of(settings: Any) -> Plan:
    """Return the plan of settings: its text, and the time of each command that answers them."""
    found: Plan = called(KINDS[kind_of_settings(settings)].plan)(settings)
    return found


def plan_parts(settings: Any) -> Iterator[str]:
    """Yield the parts of a plan; the last one tells the time of each command that answers settings."""
    found = plan_of(settings)
    yield from found.parts()
    rows = {typed(name): seconds for name, seconds in found.seconds.items()}
    if found.compiling_s:
        rows["and once, to compile kernels"] = found.compiling_s
    lines = [f"  {name:<34} about {format_time(seconds)}" for name, seconds in rows.items()]
    yield "\n".join(["In all: time of one core, within a factor of two", *lines])


@suggesting
def run(
    file: Any, folder: Place | None = None, *, executor: Executor | None = None, progress: Steps | None = None,
    overwrite: bool = False,
) -> Any:  # fmt: skip
    """Answer what a file asks for, as `pmor run` does.

    The executor is one of threads, of a campaign any. The folder keeps finite elements for the next run there.

    Parameters
    ----------
    file : Path, str, or what `load` or `make_case` returned

    Returns
    -------
    RunResult, SetResult, GearboxResult, DesignResult, CampaignResult or StudyResult

    Raises
    ------
    CaseError, GeometryError, MeshError, OutputError, ConvergenceError
    """
    settings = load(file) if isinstance(file, str | Path) else file
    kind = kind_of_settings(settings)
    if kind != "case":
        options = {"executor": executor, "progress": progress, "overwrite": overwrite}
        return _answer(KINDS[kind].command, settings, folder, options)
    if folder is None:
        raise CaseError(f"{settings.name}: a case leaves a basis: pass a folder, or use pmor.train(case).sweep()")
    run_case = called(COMMANDS["run"].answers[kind])
    return run_case(settings, folder, executor=executor, progress=progress or quietly, overwrite=overwrite)


@suggesting
@WORKING
def run_dynamics(
    file: Place | Case | SetFile | GearboxFile, folder: Place | None = None, **options: Unpack[Work]
) -> DynamicsResult | MotionResult:
    """Find the motion of a machine over its speed, as `pmor dynamics`.

    The executor is one of processes, of a gearbox or a set one of threads.
    """
    return _answer("dynamics", file, folder, options)


@suggesting
@WORKING
def run_design(
    file: Place | DesignFile, folder: Place | None = None, *,
    asked: Callable[[DesignResult], None] | None = None, **options: Unpack[Work],
) -> DesignResult:  # fmt: skip
    """Search the flank modifications that a design file asks for, as `pmor design`; the executor is one of threads.

    The file names a case, or a gearbox and those of its meshes that are searched on its supports under each load, or a
    set, all of whose meshes are then solved at once. `asked` is called with the first result, the best of few
    samples, once its page is in the folder.
    """
    return _answer("design", file, folder, options, asked=asked)


@suggesting
@WORKING
def campaign(file: Place | Campaign, folder: Place | None = None, **options: Unpack[Work]) -> CampaignResult:
    """Solve all designs of a campaign file, as `pmor campaign`.

    The executor may be one of threads, processes or a cluster: it hands out chunks of designs, and each of its threads
    has a process of its own that solves. The results are the same to the last bit.
    """
    return _answer("campaign", file, folder, options)


@suggesting
@WORKING
def study(
    file: Place | Study, folder: Place | None = None, *, quick: bool = False, **options: Unpack[Work]
) -> StudyResult:
    """Solve the grid of meshes, refinements and models of a study file, or its quick variant, as `pmor lab study`."""
    settings = settings_for(file, "study", quick=quick) if isinstance(file, str | Path) else file
    return _answer("study", settings, folder, options)


@suggesting
@WORKING
def convergence(file: Place | Case, folder: Place | None = None, **options: Unpack[Work]) -> ConvergenceResult:
    """Solve a case on finer and finer meshes of each element, as `pmor lab convergence`."""
    return _answer("convergence", file, folder, options)


@suggesting
@WORKING
def stability(
    file: Place | Case, folder: Place | None = None, *, only: str = "", **options: Unpack[Work]
) -> StabilityResult:
    """Run stiff and extreme variants of a case, those with a text in name or group, as `pmor lab stability`."""
    return _answer("stability", file, folder, options, only=only)


@suggesting
@WORKING
def reductions(file: Place | Case, folder: Place | None = None, **options: Unpack[Work]) -> ReductionsResult:
    """Compare reductions, and samplings of their training, over the ranges of a case, as `pmor lab reductions`."""
    return _answer("reductions", file, folder, options)


@suggesting
@one_thread()
def bench(
    case: Case | GearboxFile, file: Place | None = None, *, threads: int = 2, overwrite: bool = False,
    inputs: Sequence[Path] = (),
) -> Bench:  # fmt: skip
    """Measure run times by phase and size, as `pmor lab bench`.

    Parameters
    ----------
    file : Path or str, optional
        JSON file to write; one that is there is compared with first.
    threads : int
        Of the parallel sweep.
    overwrite : bool
        Replace the file, whoever wrote it.
    inputs : sequence of Path
        Files that are not replaced at any rate.

    Raises
    ------
    OutputError
    """
    from pmor.lab.bench import read_rows, run
    from pmor.storage.results_folder import results_folder

    if file is None:
        return run(case, jobs=threads, before=[])
    path = Path(file)
    if path.suffix in ("", ".md"):  # the name of the table beside the numbers, or none at all
        raise OutputError(f"{path}: is no name for the numbers; choose one that ends in .json")
    names = path.name, path.with_suffix(".md").name
    with results_folder(path.parent, names, (), overwrite, inputs):
        measured = run(case, jobs=threads, before=read_rows(path))
        measured.write(path)
    return measured


@suggesting
def write_design_case(
    file: Place | DesignFile, folder: Place, variant: int, *, overwrite: bool = False
) -> Path:
    """Write a variant of finished results of a design file in a folder as a case or set file, and return its path."""
    from pmor.design.variant_case import write_variant

    return write_variant(settings_for(file, "design"), Path(folder), variant, overwrite=overwrite)


@suggesting
def write_campaign_case(file: Place | Campaign, folder: Place, number: int, *, overwrite: bool = False) -> Path:
    """Write the case file of a design of a campaign into a folder, and return its path; numbers start at 1."""
    from pmor.campaigns.output import write_design

    return write_design(settings_for(file, "campaign"), number, Path(folder), overwrite)
