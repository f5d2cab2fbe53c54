"""Capabilities, and experiments on the program, as functions: each runs, and writes its files if asked to.

All take a case or a file of settings (or the settings that its `load` returns), a folder, and by keyword:

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

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from pmor.app.kinds import KINDS, QUESTIONS, called, kind_of, kind_of_settings
from pmor.core.errors import CaseError, OutputError
from pmor.core.progress import Steps, quietly
from pmor.core.threads import one_thread
from pmor.core.wording import suggesting

if TYPE_CHECKING:
    from pmor.campaigns.campaign import Campaign
    from pmor.campaigns.result import CampaignResult
    from pmor.case import Case
    from pmor.design.files import DesignFile
    from pmor.design.result import DesignResult
    from pmor.dynamics.result import DynamicsResult
    from pmor.lab.bench import Bench
    from pmor.lab.comparison.result import Comparison as ReductionsResult
    from pmor.lab.convergence.result import Convergence as ConvergenceResult
    from pmor.lab.stability.result import Stability as StabilityResult
    from pmor.lab.study.result import StudyResult
    from pmor.lab.study.settings import Study
    from pmor.machine.loader import GearboxFile
    from pmor.machine.result import GearboxResult
    from pmor.sets.loader import SetFile
    from pmor.sets.result import SetResult

Place = Path | str


class _Result(Protocol):
    def write(self, folder: Place, *, overwrite: bool = False) -> None: ...


_Found = TypeVar("_Found", bound=_Result)


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
        When it takes more memory than there is, or nothing tells its work beforehand.
    GeometryError, MeshError
        When there is no such gear, pair or mesh.
    """
    settings = load(file) if isinstance(file, str | Path) else file
    kind = KINDS[kind_of_settings(settings)]
    if not kind.plan:
        raise CaseError(f"{settings.name}: the work of {kind.words} is not told beforehand: use pmor {kind.command}")
    found: str = called(kind.plan)(settings)
    return found


@suggesting
def run(
    file: Any, folder: Place | None = None, *, executor: Executor | None = None, progress: Steps | None = None,
    overwrite: bool = False,
) -> Any:  # fmt: skip
    """Answer what a file asks for, as `pmor run` does.

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
    if kind == "case":
        if folder is None:
            raise CaseError(f"{settings.name}: a case leaves a basis: pass a folder, or use pmor.train(case).sweep()")
        return called(KINDS[kind].run)(settings, folder, executor=executor, progress=progress or quietly,
                                       overwrite=overwrite)  # fmt: skip
    return _answered(kind, settings, folder, overwrite, executor=executor, progress=progress)


@suggesting
def run_dynamics(
    case: Case, folder: Place | None = None, *, executor: Executor | None = None, progress: Steps | None = None,
    overwrite: bool = False,
) -> DynamicsResult:  # fmt: skip
    """Find the motion of a pair over its speed, as `pmor dynamics`; the executor is one of processes."""
    return _run(called(QUESTIONS["dynamics"].run), case, folder, overwrite, executor=executor, progress=progress)


@suggesting
def run_design(
    file: Place | DesignFile, folder: Place | None = None, *, executor: Executor | None = None,
    progress: Steps | None = None, overwrite: bool = False, asked: Callable[[DesignResult], None] | None = None,
) -> DesignResult:  # fmt: skip
    """Search the flank modifications that a design file asks for, as `pmor design`; the executor is one of threads.

    The file names a case, or a gearbox and those of its meshes that are searched on its supports under each load, or a
    set, all of whose meshes are then solved at once. `asked` is called with the first result, the best of few
    samples, once its page is in the folder.
    """
    return _answered("design", file, folder, overwrite, executor=executor, progress=progress, asked=asked)


@suggesting
def gearbox(
    file: Place | GearboxFile, folder: Place | None = None, *, executor: Executor | None = None,
    progress: Steps | None = None, overwrite: bool = False,
) -> GearboxResult:  # fmt: skip
    """Solve shafts, bearings and all meshes of a gearbox file, as `pmor gearbox`; the executor is one of threads."""
    return _answered("gearbox", file, folder, overwrite, executor=executor, progress=progress)


@suggesting
def gear_set(
    file: Place | SetFile, folder: Place | None = None, *, executor: Executor | None = None,
    progress: Steps | None = None, overwrite: bool = False,
) -> SetResult:  # fmt: skip
    """Solve all meshes of a planetary set, an idler chain or a star at once, as `pmor set`; threads share out members.

    The folder keeps the finite elements of each member for the next solution there.
    """
    return _answered("set", file, folder, overwrite, executor=executor, progress=progress)


@suggesting
def campaign(
    file: Place | Campaign, folder: Place | None = None, *, executor: Executor | None = None,
    progress: Steps | None = None, overwrite: bool = False,
) -> CampaignResult:  # fmt: skip
    """Solve all designs of a campaign file, as `pmor campaign`.

    The executor may be one of threads, processes or a cluster: it hands out chunks of designs, and each of its threads
    has a process of its own that solves. The results are the same to the last bit.
    """
    return _answered("campaign", file, folder, overwrite, executor=executor, progress=progress)


@suggesting
def study(
    file: Place | Study, folder: Place | None = None, *, quick: bool = False, executor: Executor | None = None,
    progress: Steps | None = None, overwrite: bool = False,
) -> StudyResult:  # fmt: skip
    """Solve the grid of meshes, refinements and models of a study file, or its quick variant, as `pmor study`."""
    from pmor.lab.study.run import run
    from pmor.lab.study.settings import load

    settings = load(Path(file), quick=quick) if isinstance(file, str | Path) else file
    return _run(run, settings, folder, overwrite, executor=executor, progress=progress)


@suggesting
def convergence(
    case: Case, folder: Place | None = None, *, executor: Executor | None = None, progress: Steps | None = None,
    overwrite: bool = False,
) -> ConvergenceResult:  # fmt: skip
    """Solve a case on finer and finer meshes of each element, as `pmor convergence`."""
    return _run(called(QUESTIONS["convergence"].run), case, folder, overwrite, executor=executor, progress=progress)


@suggesting
def stability(
    case: Case, folder: Place | None = None, *, only: str = "", executor: Executor | None = None,
    progress: Steps | None = None, overwrite: bool = False,
) -> StabilityResult:  # fmt: skip
    """Run stiff and extreme variants of a case, those with a text in name or group, as `pmor stability`."""
    return _run(
        called(QUESTIONS["stability"].run), case, folder, overwrite, only=only, executor=executor, progress=progress
    )


@suggesting
def reductions(
    case: Case, folder: Place | None = None, *, executor: Executor | None = None, progress: Steps | None = None,
    overwrite: bool = False,
) -> ReductionsResult:  # fmt: skip
    """Compare the reductions, and the samplings of their training, over the ranges of a case, as `pmor reductions`."""
    return _run(called(QUESTIONS["reductions"].run), case, folder, overwrite, executor=executor, progress=progress)


@suggesting
@one_thread()
def bench(
    case: Case, file: Place | None = None, *, threads: int = 2, overwrite: bool = False, inputs: Sequence[Path] = ()
) -> Bench:
    """Measure run times by phase and size, as `pmor bench`.

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
        found = run(case, jobs=threads, before=read_rows(path))
        found.write(path)
    return found


@suggesting
def write_design_case(
    file: Place | DesignFile, folder: Place, variant: int, *, overwrite: bool = False
) -> Path:
    """Write a variant of finished results of a design file in a folder as a case or set file, and return its path."""
    from pmor.design.loader import load
    from pmor.design.variant_case import write_variant

    settings = load(Path(file)) if isinstance(file, str | Path) else file
    return write_variant(settings, Path(folder), variant, overwrite=overwrite)


@suggesting
def write_campaign_case(file: Place | Campaign, folder: Place, number: int, *, overwrite: bool = False) -> Path:
    """Write the case file of a design of a campaign into a folder, and return its path; numbers start at 1."""
    from pmor.campaigns.loader import load
    from pmor.campaigns.output import write_design

    settings = load(file) if isinstance(file, str | Path) else file
    return write_design(settings, number, Path(folder), overwrite)


def _answered(kind: str, file: Any, folder: Place | None, overwrite: bool, **options: Any) -> Any:
    """Answer a file of a kind, or what its reader returned."""
    settings = called(KINDS[kind].load)(Path(file)) if isinstance(file, str | Path) else file
    return _run(called(KINDS[kind].run), settings, folder, overwrite, **options)


@one_thread()
def _run(run: Callable[..., _Found], settings: Any, folder: Place | None, overwrite: bool, **options: Any) -> _Found:
    found = run(settings, folder=folder, overwrite=overwrite, **options)
    if folder is not None:
        found.write(folder, overwrite=overwrite)
    return found
