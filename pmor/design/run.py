"""The front door of designs: settings of a file or of sections in, the result out."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial
from pathlib import Path

from pmor.core.errors import CaseError, ConvergenceError, GeometryError, MeshError
from pmor.core.threads import one_thread, refuse_processes
from pmor.design.elements import elements_of
from pmor.design.files import DesignFile
from pmor.design.judge import Judge
from pmor.design.output import FILES
from pmor.design.plan import coarse_first
from pmor.design.readings import read_first, read_off, with_gearbox
from pmor.design.result import DesignResult
from pmor.design.search import Search
from pmor.storage.results_folder import start_results, working_folder
from pmor.work.results import pieces_folder
from pmor_online.model import ReducedPair

# Folders of the pieces of searches on aligned axes, and on half as many elements, inside of that of the others.
ALIGNED, COARSE = "aligned", "coarse"


@one_thread()
def run(
    settings: DesignFile, *, reduced: ReducedPair | None = None, folder: Path | str | None = None,
    overwrite: bool = False, executor: Executor | None = None, progress: Callable[[int], None] | None = None,
    asked: Callable[[DesignResult], None] | None = None,
) -> DesignResult:  # fmt: skip
    """Search flank modifications over ranges, with tolerances; variants without a solution are in `failures`.

    Of meshes of a gearbox they are searched on its supports under each load, and on aligned axes for comparison. Of a
    set all of its meshes are solved at once for each variant.

    Parameters
    ----------
    reduced : ReducedPair, optional
        Reduced model of the pair, by line loads; by default it is made. None of a set.
    folder, overwrite, executor, progress
        As in `pmor.app.capabilities`; the executor is one of threads, and the number of pieces grows with each stage.
    asked : callable, optional
        Called with the first result, the best of few samples beside what the file has, once its page is in the folder.

    Raises
    ------
    CaseError
        Where a torque is beyond the range of the contact, or the reduced model does not suffice.
    ConvergenceError
        Where the gearbox has no equilibrium under a load.
    OutputError
    """
    refuse_processes(executor)
    with pieces_folder(folder, FILES, inputs=settings.inputs, overwrite=overwrite) as pieces:
        search = partial(Search, executor=executor, progress=progress)
        tell = partial(_tell_first, folder=folder, asked=asked)
        waited = folder is not None or asked is not None
        told = waited and reduced is None and _told_coarsely(settings, search, pieces, executor, tell)
        elements = elements_of(settings, reduced, executor)
        whole = search(Judge(elements), pieces)
        if waited and not told:
            tell(whole)
        if settings.box is None:
            outcome = whole.found()
            return DesignResult(outcome, read_off(outcome, executor))
        held = Judge(elements, on_supports=False)
        aligned = search(held, working_folder(pieces) / ALIGNED, around="").found(best_alone=True)
        outcome = whole.found([] if aligned.best is None else [aligned.variants.x[aligned.best]])
        return DesignResult(outcome, with_gearbox(read_off(outcome, executor), outcome, aligned, executor))


def _told_coarsely(
    file: DesignFile, search: Callable[..., Search], pieces: Path, executor: Executor | None, tell: Callable[..., None]
) -> bool:
    """Tell of a first result on half as many elements, where all of them take much of the time; whether it was told."""
    coarse = coarse_first(file)
    if coarse is None:
        return False
    try:
        tell(search(Judge(elements_of(coarse, None, executor)), working_folder(pieces) / COARSE), coarse=True)
    except (ConvergenceError, GeometryError, MeshError, CaseError):  # it may hold on the elements of the search
        return False
    return True


def _tell_first(
    search: Search, folder: Path | str | None, asked: Callable[[DesignResult], None] | None, coarse: bool = False
) -> None:
    """Write the page of the first result, and tell of it."""
    outcome = search.first()
    if outcome is None:
        return
    first = DesignResult(outcome, replace(read_first(outcome), coarse=coarse))
    if folder is not None:
        start_results(Path(folder), search.file.text)
        first.write_into(Path(folder))
    if asked is not None:
        asked(first)
