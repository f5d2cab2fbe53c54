"""A case run as a whole: models, sweeps, comparison with full FE, and all files that `pmor run` leaves in a folder."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any

from pmor.app.result import SweepResult
from pmor.case import Case, text_of
from pmor.case.width import case_of_page, takes_whole_width
from pmor.core.progress import Steps, quietly, stage
from pmor.core.shown import Columns
from pmor.core.threads import one_thread, refuse_processes
from pmor.core.wording import suggesting
from pmor.fe.sector import SectorMesh
from pmor.pair.conditions import assembly_of
from pmor.pair.model import ElasticModel, refuse_loads
from pmor.report.curves import Drawn
from pmor.report.run_page import page_files, write_pages
from pmor.report.screen import result_text
from pmor.report.summary import result_files, summary, write_results, write_summary
from pmor.results.root_stress import RootStress
from pmor.results.tabular import Labelled
from pmor.storage.results_folder import results_folder, start_results
from pmor.work.cost import meshed_within_memory, refuse_beyond_memory, refuse_large_sweep_of
from pmor.work.live import live_pair
from pmor.work.models import OWN_BASIS, basis_names, meshed_models, run_models, unfinished
from pmor.work.offline import solved_bodies
from pmor.work.online import run_online
from pmor_online.compare import Comparison
from pmor_online.model import ReducedPair
from pmor_online.run import OnlineResult

_LOG = logging.getLogger("pmor")


@dataclass(frozen=True, eq=False, repr=False)
class RunResult(Drawn):
    """Results of a run, and the folder with its files."""

    found: OnlineResult
    folder: Path

    @property
    def case(self) -> Case:
        """The case that was run."""
        return self.found.case

    @property
    def sweep(self) -> SweepResult:
        """The sweep of the case's own reduced model."""
        reduced = self.found.reduced
        return SweepResult(
            self.found.sweep, reduced.meshed.pair, reduced, assembly_of(self.case), holes=self.case.pair.holes
        )

    @property
    def comparison(self) -> Comparison | None:
        """The reduced model beside full FE at unseen angles; None where full FE was left out."""
        return self.found.comparison

    @property
    def root_stress(self) -> RootStress | None:
        """Stress along the root fillets; None where the case does not ask for it."""
        return self.found.root_stress

    @property
    def summary(self) -> dict[str, Any]:
        """Figures as plain data: the content of `summary.json`."""
        return summary(self.found)

    @property
    def page(self) -> Path | None:
        """The report page; None where there is none."""
        path = self.folder / "report.html"
        return path if path.exists() else None

    @property
    def failures(self) -> tuple[str, ...]:
        """Positions that did not converge, and a disagreement with full FE, in words."""
        return self.found.all_failures

    def columns(self) -> Columns:
        """All of it by the names of columns, for `to_dataframe`: a value for each torque and angle."""
        return self.sweep.columns()

    def _labelled(self) -> Mapping[str, Labelled]:
        return self.sweep._labelled()

    def _shown(self) -> Columns:
        return self.sweep._shown()

    def __repr__(self) -> str:
        return f"<RunResult of {self.case.name!r} in {str(self.folder)!r}: {self.sweep!r}>"

    def __str__(self) -> str:
        return result_text(self.found)


@suggesting
def run_case(
    case: Case, folder: Path | str, *, pages: bool = True, overwrite: bool = False,
    executor: Executor | None = None, progress: Steps = quietly, inputs: Sequence[Path] = (),
    asked: Callable[[RunResult], None] | None = None,
) -> RunResult:  # fmt: skip
    """Do everything that a case asks for, and leave the files of `pmor run`.

    A valid basis in the folder is taken over, and an interrupted training continued.

    Parameters
    ----------
    folder : Path or str
        For the results, made unless it is there.
    pages : bool
        Write pictures and report page too, as far as the case asks for them; without, it is `pmor compare`.
    overwrite : bool
        Replace files there, whoever wrote them, and train anew.
    executor : concurrent.futures.Executor, optional
        Of threads: shares out full solutions and angles; the results are the same to the last bit.
    progress : callable
        Called with the number of positions solved.
    inputs : sequence of Path
        Files that are not replaced at any rate, such as that of the case.
    asked : callable, optional
        Given the sweep with all that is read off it, whose tables are written then, before proof and pages.

    Raises
    ------
    CaseError, GeometryError, MeshError
        When there is no such gear, pair or mesh, or the load is beyond it.
    ConvergenceError
        When no full solution of the training converged.
    OutputError
        When somebody else's file is in the way, or the folder cannot be written to.
    """
    return run_models_of(case, Path(folder), None, None, pages, overwrite, executor, progress, inputs, asked)


@one_thread()
def run_models_of(
    case: Case, folder: Path, save: Callable[[Path], None] | None, elastic: ElasticModel | None, pages: bool,
    overwrite: bool, executor: Executor | None, progress: Steps, inputs: Sequence[Path] = (),
    asked: Callable[[RunResult], None] | None = None,
) -> RunResult:  # fmt: skip
    """Do the same with the basis that `save` writes, and with solved full FE of the case, where they are given."""
    started = time.perf_counter()
    refuse_processes(executor)
    # Cases that cannot be meshed are refused before any folder is made.
    mesh, others = elastic.mesh if elastic else meshed_within_memory(case), meshed_models(case)
    own = (OWN_BASIS,) if save else ()
    files = (*result_files(case), *(page_files(case) if pages else ()), *(basis_names(case) if overwrite else own))
    with results_folder(folder, files, unfinished(case), overwrite, inputs):
        if save is not None:
            save(folder / OWN_BASIS)
        solve = cache(lambda: elastic or solved_bodies(case, mesh))
        found = run_models(
            case, mesh, solve, others, folder, given=save is not None, executor=executor, overwrite=overwrite,
            started=started, progress=progress, asked=partial(_write_first, folder, asked),
        )  # fmt: skip
        write_summary(found, folder)
        if pages:
            _write_pages(found, mesh.pinion, folder)
    return RunResult(found, folder.absolute())


@one_thread()
def sweep_model(
    reduced: ReducedPair, basis: tuple[Path, int] | Callable[[Path], None], folder: Path, *, overwrite: bool,
    executor: Executor | None, progress: Steps, inputs: Sequence[Path], asked: Callable[[RunResult], None] | None,
) -> RunResult:  # fmt: skip
    """Sweep with a reduced model alone, and leave what `pmor online` leaves.

    Parameters
    ----------
    basis : (Path, int) or callable
        Basis file of the model and its size in bytes; or a function that writes one beside the results.
    folder, overwrite, executor, progress, inputs, asked
        As in `run_case`.
    """
    case = reduced.basis.case
    refuse_processes(executor)
    refuse_large_sweep_of(case, reduced.meshed)
    refuse_loads(case, reduced.meshed)  # a sweep may go beyond those that the training has been through
    if takes_whole_width(case):
        refuse_beyond_memory(case_of_page(case))
    names = (*result_files(case), *page_files(case), *((OWN_BASIS,) if callable(basis) else ()))
    with results_folder(folder, names, (), overwrite, inputs):
        if callable(basis):
            basis(folder / OWN_BASIS)
        path, size = (folder / OWN_BASIS, None) if callable(basis) else basis
        with stage(f"{case.contact.scheme}: sweep over angles and torques"):
            found = run_online(reduced, path, basis_bytes=size, executor=executor, progress=progress)
        _write_first(folder, asked, found)
        _write_pages(found, None, folder)
    return RunResult(found, folder.absolute())


def _write_first(folder: Path, asked: Callable[[RunResult], None] | None, found: OnlineResult) -> None:
    start_results(folder, text_of(found.case))
    write_results(found, folder)
    if asked is not None:
        asked(RunResult(found, folder.absolute()))


def _write_pages(found: OnlineResult, mesh: SectorMesh | None, folder: Path) -> None:
    live = live_pair(found.reduced)
    # No stage around it: its timer would be a second thread, beside which no other process draws.
    _LOG.info("pictures and page ...")
    write_pages(found, mesh, folder, live)
