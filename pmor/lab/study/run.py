"""The work of a study: a list of independent pieces, each kept in a part file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

from pmor.case import Case
from pmor.lab.core.models import ModelStore
from pmor.lab.study import rivals, solve
from pmor.lab.study.cells import StudyCases, study_cases
from pmor.lab.study.settings import Cell, Study
from pmor.lab.study.timing import time_cells
from pmor.report.provenance import machine
from pmor.storage.results_folder import working_folder
from pmor.work.cost import refuse_beyond_memory
from pmor.work.pieces import PARTS, Piece, Result, file_name, run_pieces

# Folders of a study: finished pieces, and the bases of its cells.
WORKING = (PARTS, "cells")


@dataclass(frozen=True)
class StudyParts:
    """What all pieces of work gave.

    Parameters
    ----------
    study : Study
    cases : StudyCases
    results : mapping of str to Result
        By the name of the piece; missing for those that failed.
    failures : tuple of str
        Pieces that did not converge at all.
    """

    study: Study
    cases: StudyCases
    results: Mapping[str, Result]
    failures: tuple[str, ...]


def run_parts(study: Study, out: Path, jobs: int, overwrite: bool) -> StudyParts:
    """Do all pieces of work that are not finished yet.

    Parameters
    ----------
    study : Study
    out : Path
        Folder of the study.
    jobs : int
        Angles solved at a time, where run times are not measured.
    overwrite : bool
        Start anew.
    """
    cases = study_cases(study)
    for case in (*cases.members.values(), *cases.cells.values()):
        refuse_beyond_memory(case)
    parts, bases = (working_folder(out / name, overwrite) for name in WORKING)
    pieces = list(_pieces(study, cases, bases, jobs))
    results, failures = run_pieces(pieces, parts)
    return StudyParts(study, cases, results, failures)


def _pieces(study: Study, cases: StudyCases, bases: Path, jobs: int) -> Iterator[Piece]:
    store, grid = ModelStore(), asdict(study.grid) | {"cells": None}
    paths = {cell: bases / f"{file_name(cell.label)}.h5" for cell in cases.cells}
    for member, case in cases.members.items():
        work = partial(solve.reference_member, case, study, jobs)
        yield Piece(f"reference {member.label}", {"case": case}, grid, work)
    for cell, case in cases.cells.items():
        if cell in study.reduced_cells:
            work = partial(solve.grid_cell, case, study, store, paths[cell], jobs)
            yield Piece(f"cell {cell.label}", {"case": case}, grid, work, partial(_has_basis, paths[cell], case))
        else:
            work = partial(solve.variant_cell, case, study, store, jobs)
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
    for n in settings.stepped:
        case = next(case for cell, case in cases.cells.items() if cell.n_profile == n)
        yield Piece(f"conventional step {n}", {"case": case}, None, partial(rivals.conventional_step, case))
    if peer is not None and cases.peer is not None and rivals.peer_installed():
        work = partial(rivals.peer_cell, cases.peer, store)
        yield Piece(f"peer {peer.cell.label}", {"case": cases.peer}, None, work)


def _has_basis(path: Path, case: Case, found: Result) -> bool:
    return solve.basis_is_valid(path, case)


def _run_times(timed: Mapping[Cell, tuple[Case, Path]], store: ModelStore) -> Result:
    there = {cell: entry for cell, entry in timed.items() if entry[1].exists()}  # a cell may have failed
    return {"cells": time_cells(there, store), "machine": machine()}
