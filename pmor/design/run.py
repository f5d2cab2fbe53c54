"""The front door of designs: settings of a file or of sections in, the result out."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from pmor.core.errors import CaseError, ConvergenceError, GeometryError, MeshError
from pmor.core.threads import one_thread, refuse_processes
from pmor.design.files import PairDesign, SetDesign
from pmor.design.judge import Judge
from pmor.design.output import FILES
from pmor.design.pair_judge import PairJudge
from pmor.design.plan import coarse_first
from pmor.design.readings import read_first, read_off, with_gearbox
from pmor.design.result import DesignResult
from pmor.design.search import Search, trained_pair
from pmor.design.set_judge import SetJudge
from pmor.design.supports import Supports, supports_of
from pmor.pair.model import refuse_loads
from pmor.sets.variants import train_of_variants
from pmor.storage.results_folder import start_results, working_folder
from pmor.work.cost import refuse_large_sweep
from pmor.work.results import pieces_folder
from pmor_online.model import ReducedPair

# Folders of the pieces of searches on aligned axes, and on half as many elements, inside of that of the others.
ALIGNED, COARSE = "aligned", "coarse"


@one_thread()
def run(
    settings: PairDesign | SetDesign, *, reduced: ReducedPair | None = None, folder: Path | str | None = None,
    overwrite: bool = False, executor: Executor | None = None, progress: Callable[[int], None] | None = None,
    asked: Callable[[DesignResult], None] | None = None,
) -> DesignResult:  # fmt: skip
    """Search flank modifications over ranges, with tolerances; variants without a solution are in `failures`.

    Of a mesh of a gearbox they are searched on its supports under each load, and on aligned axes for comparison. Of a
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
        built = _built(settings, reduced, executor)
        whole = search(built.file, built.judge, pieces, around=built.around)
        if waited and not told:
            tell(whole)
        if built.alone is None or built.supports is None:
            found = whole.found()
            return DesignResult(found, read_off(found, executor))
        aligned = search(built.file, built.alone, working_folder(pieces) / ALIGNED).found(best_alone=True)
        found = whole.found([] if aligned.best is None else [aligned.variants.x[aligned.best]])
        read = with_gearbox(read_off(found, executor), built.supports, found, aligned, executor)
        return DesignResult(found, read)


@dataclass(frozen=True)
class _Built:
    """A design whose finite elements are solved; of a mesh of a gearbox with its judge on aligned axes."""

    file: PairDesign | SetDesign
    judge: Judge[Any, Any]
    around: str = ""
    alone: PairJudge | None = None
    supports: Supports | None = None


def _built(file: PairDesign | SetDesign, reduced: ReducedPair | None, executor: Executor | None) -> _Built:
    if isinstance(file, SetDesign):
        return _Built(file, SetJudge(file, train_of_variants(file.set, executor), file.design), file.set.whole_text)
    supports = None if file.box is None else supports_of(file, executor)
    if supports is not None:
        file, reduced = supports.file, supports.reduced
    if reduced is None:
        reduced = trained_pair(file.case, file.design.load.torques_Nm)
    else:
        _refuse_unfit(file, reduced)
    design = file.design
    angles = design.search.angles * file.pitches
    refuse_large_sweep(file.name, reduced.meshed, angles, len(design.load.torques_Nm))
    alone = PairJudge(reduced, design, file.base)
    if supports is None or file.box is None:
        return _Built(file, alone)
    judge = PairJudge(reduced, design, file.base, hubs=supports.hubs)
    return _Built(file, judge, file.box.text, alone, supports)


def _told_coarsely(
    file: PairDesign | SetDesign, search: Callable[..., Search], pieces: Path, executor: Executor | None,
    tell: Callable[..., None],
) -> bool:  # fmt: skip
    """Tell of a first result on half as many elements, where all of them take much of the time; whether it was told."""
    coarse = coarse_first(file)
    if coarse is None:
        return False
    try:
        built = _built(coarse, None, executor)
        tell(search(built.file, built.judge, working_folder(pieces) / COARSE, around=built.around), coarse=True)
    except (ConvergenceError, GeometryError, MeshError, CaseError):  # it may hold on the elements of the search
        return False
    return True


def _tell_first(
    search: Search, folder: Path | str | None, asked: Callable[[DesignResult], None] | None, coarse: bool = False
) -> None:
    """Write the page of the first result, and tell of it."""
    found = search.first()
    if found is None:
        return
    first = DesignResult(found, replace(read_first(found), coarse=coarse))
    if folder is not None:
        start_results(Path(folder), search.file.text)
        first.write_into(Path(folder))
    if asked is not None:
        asked(first)


def _refuse_unfit(file: PairDesign, reduced: ReducedPair) -> None:
    """Raise CaseError where a model that was trained for another purpose does not suffice."""
    case = reduced.basis.case
    if "root_stress_MPa" in file.design.results and reduced.basis.root_stress is None:
        raise CaseError(f"{file.name}: root_stress_MPa: the model holds none: train with [results] root_stress = true")
    refuse_loads(replace(case, online=replace(case.online, torques_Nm=file.design.load.torques_Nm)), reduced.meshed)
