"""The work of a study: a list of independent pieces, each kept in a part file."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor
from dataclasses import asdict
from functools import partial
from pathlib import Path

from pmor.case import Case
from pmor.core.threads import refuse_processes
from pmor.lab.core.models import ModelStore
from pmor.lab.rivals.calculix import calculix_available
from pmor.lab.study import rivals, solve
from pmor.lab.study.measures import StudyCases, StudyParts, study_cases
from pmor.lab.study.result import FILES, StudyResult
from pmor.lab.study.settings import Cell, Study
from pmor.lab.study.table import study_table
from pmor.report.page import machine
from pmor.storage.results_folder import working_folder
from pmor.work.cost import refuse_beyond_memory
from pmor.work.pieces import Piece, Result, file_name, run_pieces
from pmor.work.results import pieces_folder

# Folder of the bases of the cells, among the finished pieces.
BASES = "bases"


def run(
    study: Study, *, folder: Path | str | None = None, overwrite: bool = False, executor: Executor | None = None,
    progress: Callable[[int], None] | None = None,
) -> StudyResult:  # fmt: skip
    """Do all pieces of work that are not finished yet, one after the other.

    Parameters
    ----------
    folder, overwrite, executor, progress
        As in `pmor.app.capabilities`; the executor is one of threads, for the angles of full FE. Pieces and bases stay
        in the folder for the next run.

    Raises
    ------
    CaseError, OutputError
    """
    refuse_processes(executor)
    cases = study_cases(study)
    for case in (*cases.meshes.values(), *cases.cells.values()):
        refuse_beyond_memory(case)
    with pieces_folder(folder, FILES, overwrite=overwrite) as parts:
        working_folder(parts, overwrite)
        pieces = list(_pieces(study, cases, working_folder(parts / BASES), executor))
        results, failures = run_pieces(pieces, parts, progress=progress)
    all_parts = StudyParts(study, cases, results, failures)
    return StudyResult(all_parts, study_table(all_parts))


def _pieces(study: Study, cases: StudyCases, bases: Path, executor: Executor | None) -> Iterator[Piece]:
    store, grid = ModelStore(), asdict(study.grid) | {"cells": None}
    paths = {cell: bases / f"{file_name(cell.label)}.h5" for cell in cases.cells}
    for mesh, case in cases.meshes.items():
        work = partial(solve.reference_mesh, case, study, executor)
        yield Piece(f"reference {mesh.label}", {"case": case}, grid, work)
    for cell, case in cases.cells.items():
        if cell in study.reduced_cells:
            work = partial(solve.grid_cell, case, study, store, paths[cell], executor)
            yield Piece(f"cell {cell.label}", {"case": case}, grid, work, partial(_has_basis, paths[cell], case))
        else:
            work = partial(solve.variant_cell, case, study, store, executor)
            yield Piece(f"cell {cell.label}", {"case": case}, grid, work)
    yield from _rival_pieces(study, cases, store)
    timed = {cell: (case, paths[cell]) for cell, case in cases.cells.items() if cell in study.reduced_cells}
    labelled = {cell.label: case for cell, (case, _) in timed.items()}
    if timed:
        yield Piece("run times", labelled, None, partial(_run_times, timed, store),
                    lambda found: set(found["cells"]) == set(labelled))  # fmt: skip


def _rival_pieces(study: Study, cases: StudyCases, store: ModelStore) -> Iterator[Piece]:
    settings, peer = study.conventional, study.peer
    for cell in settings.solved:
        case = cases.cells[cell]
        work = partial(rivals.conventional_cell, case, store)
        yield Piece(f"conventional {cell.label}", {"case": case}, None, work)
    if peer is not None and cases.peer is not None and calculix_available():
        work = partial(rivals.peer_cell, cases.peer, store)
        yield Piece(f"peer {peer.cell.label}", {"case": cases.peer}, None, work)


def _has_basis(path: Path, case: Case, found: Result) -> bool:
    return solve.basis_is_valid(path, case)


def _run_times(timed: Mapping[Cell, tuple[Case, Path]], store: ModelStore) -> Result:
    there = {cell: entry for cell, entry in timed.items() if entry[1].exists()}  # a cell may have failed
    return {"cells": solve.time_cells(there, store), "machine": machine()}
