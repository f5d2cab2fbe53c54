"""The front door of designs: settings of a file or of sections in, the result out."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial
from pathlib import Path

from pmor.core.errors import CaseError
from pmor.core.threads import one_thread, refuse_processes
from pmor.design.files import PairDesign, SetDesign
from pmor.design.output import FILES
from pmor.design.pair_judge import PairJudge
from pmor.design.readings import read_first, read_off, with_gearbox
from pmor.design.result import DesignResult
from pmor.design.search import Search, trained_pair
from pmor.design.set_judge import SetJudge
from pmor.design.supports import supports_of
from pmor.pair.model import refuse_loads
from pmor.sets.variants import train_of_variants
from pmor.storage.results_folder import start_results, working_folder
from pmor.work.cost import refuse_large_sweep
from pmor.work.results import pieces_folder
from pmor_online.model import ReducedPair

# Folder of the pieces of the search on aligned axes, inside of that of the others.
ALIGNED = "aligned"


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
    if isinstance(settings, SetDesign):
        return _run_set(settings, folder, overwrite, executor, progress, asked)
    supports = None if settings.box is None else supports_of(settings)
    if supports is not None:
        settings, reduced = supports.file, supports.reduced
    if reduced is None:
        reduced = trained_pair(settings.case, settings.design.load.torques_Nm)
    else:
        _refuse_unfit(settings, reduced)
    design = settings.design
    angles = design.search.angles * settings.pitches
    refuse_large_sweep(settings.name, reduced.meshed, angles, len(design.load.torques_Nm))
    with pieces_folder(folder, FILES, inputs=settings.inputs, overwrite=overwrite) as pieces:
        search = partial(Search, settings, executor=executor, progress=progress)
        alone = PairJudge(reduced, design, settings.base)
        if supports is None:
            return _searched(search(alone, pieces), folder, asked)
        assert settings.box is not None
        judge = PairJudge(reduced, design, settings.base, hubs=supports.hubs)
        in_box = search(judge, pieces, around=settings.box.text)
        _tell_first(in_box, folder, asked)
        aligned = search(alone, working_folder(pieces) / ALIGNED).found(best_alone=True)
        also = [] if aligned.best is None else [aligned.variants.x[aligned.best]]
        found = in_box.found(also)
        return DesignResult(found, with_gearbox(read_off(found, executor), supports, found, aligned, executor))


def _run_set(
    file: SetDesign, folder: Path | str | None, overwrite: bool, executor: Executor | None,
    progress: Callable[[int], None] | None, asked: Callable[[DesignResult], None] | None,
) -> DesignResult:  # fmt: skip
    with pieces_folder(folder, FILES, inputs=file.inputs, overwrite=overwrite) as pieces:
        judge = SetJudge(file, train_of_variants(file.set, executor), file.design)
        search = Search(file, judge, pieces, around=file.set.whole_text, executor=executor, progress=progress)
        return _searched(search, folder, asked)


def _searched(search: Search, folder: Path | str | None, asked: Callable[[DesignResult], None] | None) -> DesignResult:
    _tell_first(search, folder, asked)
    found = search.found()
    return DesignResult(found, read_off(found, search.executor))


def _tell_first(search: Search, folder: Path | str | None, asked: Callable[[DesignResult], None] | None) -> None:
    """Write the page of the first result, and tell of it, where somebody waits for either."""
    if folder is None and asked is None:
        return
    found = search.first()
    if found is None:
        return
    first = DesignResult(found, read_first(found))
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
