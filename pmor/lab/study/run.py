"""Run a study: a list of independent pieces of work, each kept in a part file, then tables, pictures and report."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

from pmor.case import Case
from pmor.errors import ConvergenceError
from pmor.lab.study import rivals, solve
from pmor.lab.study.cells import ModelStore, StudyCases, study_cases
from pmor.lab.study.parts import part_key, read_part, write_part
from pmor.lab.study.settings import Cell, Study
from pmor.lab.study.timing import machine, time_cells
from pmor.progress import format_time
from pmor.storage.atomic import ensure_folder

# Rough seconds with 64 x 8 elements on a flank, of finite elements, one condensed position and one conventional Newton
# step: they only serve to weigh the pieces against each other for the time left.
ELASTIC_S, POSITION_S, STEP_S = 25.0, 0.08, 250.0
STEPS = 9.0
# Of any piece: meshing, compiling, files.
OVERHEAD_S = 2.0


@dataclass(frozen=True)
class WorkItem:
    """A piece of work.

    Parameters
    ----------
    name : str
        Unique; the part file is called after it.
    key : str
        Of the settings that it depends on.
    weight : float
        Roughly its seconds.
    run : callable
        Gives the result.
    is_whole : callable
        Whether a result that was found is all that there should be, with what it leaves beside the part file.
    """

    name: str
    key: str
    weight: float
    run: Callable[[], Mapping[str, Any]]
    is_whole: Callable[[Mapping[str, Any]], bool] = lambda result: True


@dataclass(frozen=True)
class StudyParts:
    """What all pieces of work gave.

    Parameters
    ----------
    study : Study
    cases : StudyCases
    results : mapping of str to mapping
        By the name of the piece; missing for those that failed.
    failures : tuple of str
        Pieces that did not converge at all.
    """

    study: Study
    cases: StudyCases
    results: Mapping[str, Mapping[str, Any]]
    failures: tuple[str, ...]


def run_parts(
    study: Study, out: Path, jobs: int, overwrite: bool, announce: Callable[[str], None] = lambda text: None
) -> StudyParts:
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
    announce : callable
        Called with a line of progress for each piece.

    Returns
    -------
    StudyParts
    """
    cases = study_cases(study)
    parts, bases = out / "parts", out / "cells"
    if overwrite:
        for folder in (parts, bases):
            shutil.rmtree(folder, ignore_errors=True)
    for folder in (parts, bases):
        ensure_folder(folder)
    items = _work(study, cases, bases, jobs)
    results: dict[str, Mapping[str, Any]] = {}
    failures = []
    for item in items:
        found = read_part(_file(parts, item), item.key)
        if found is not None and item.is_whole(found):
            results[item.name] = found
    total = len(items)
    missing = [item for item in items if item.name not in results]
    if results:
        announce(f"{len(results)} of {total} pieces are finished and taken over")
    started, done = time.perf_counter(), 0.0
    for i, item in enumerate(missing):
        left = sum(other.weight + OVERHEAD_S for other in missing[i:])
        elapsed = time.perf_counter() - started
        rest = f", about {format_time(elapsed / done * left)} left" if done > 0.0 else ""
        announce(f"[{total - len(missing) + i + 1}/{total}] {item.name} ({format_time(elapsed)} so far{rest})")
        try:
            results[item.name] = write_part(_file(parts, item), item.key, item.run())
        except ConvergenceError as error:
            failures.append(f"{item.name}: {error}")
        done += item.weight + OVERHEAD_S
    return StudyParts(study, cases, results, tuple(failures))


def _work(study: Study, cases: StudyCases, bases: Path, jobs: int) -> list[WorkItem]:
    store = ModelStore()
    grid = asdict(study.grid) | {"cells": None}
    items = []
    for member, case in cases.members.items():
        weight = _elastic_weight(case) + study.grid.angles_per_pitch * _position_weight(case)
        name = f"reference {member.label}"
        items.append(WorkItem(name, part_key(name, {"case": case}, grid), weight,
                              partial(solve.reference_member, case, study, jobs)))  # fmt: skip
    paths = {cell: bases / f"{file_name(cell.label)}.h5" for cell in cases.cells}
    for cell, case in cases.cells.items():
        name, path = f"cell {cell.label}", paths[cell]
        if cell not in study.reduced_cells:
            weight = _elastic_weight(case) + study.grid.angles_per_pitch * _position_weight(case)
            items.append(WorkItem(name, part_key(name, {"case": case}, grid), weight,
                                  partial(solve.variant_cell, case, study, store, jobs)))  # fmt: skip
            continue
        positions = study.grid.angles_per_pitch + case.compare.angles + case.offline.angles_per_pitch
        weight = _elastic_weight(case) + positions * 3.0 * _position_weight(case)
        items.append(WorkItem(name, part_key(name, {"case": case}, grid), weight,
                              partial(solve.grid_cell, case, study, store, path, jobs),
                              partial(_has_basis, path, case)))  # fmt: skip
    for settings, family in zip(study.trainings, cases.trainings, strict=True):
        name = f"training {settings.label}"
        labelled = {f"{angles} {torques}": case for (angles, torques), case in family.items()}
        solves = sum(angles * len(torques) for angles, torques in family)
        weight = solves * _position_weight(next(iter(family.values())))
        items.append(WorkItem(name, part_key(name, labelled, None), weight,
                              partial(solve.trainings, family, store, bases, jobs)))  # fmt: skip
    items += _rival_work(study, cases, store)
    timed = {cell: (case, paths[cell]) for cell, case in cases.cells.items() if cell in study.reduced_cells}
    name, labelled = "run times", {cell.label: case for cell, (case, _) in timed.items()}
    timing = study.timing
    positions = (timing.repeats + 1) * timing.condensed_angles
    weight = sum(_elastic_weight(case) + positions * _position_weight(case) + OVERHEAD_S for case in labelled.values())
    items.append(WorkItem(name, part_key(name, labelled, asdict(timing)), weight,
                          partial(_run_times, timed, study, store),
                          lambda found: set(found["cells"]) == set(labelled)))  # fmt: skip
    return items


def _has_basis(path: Path, case: Case, found: Mapping[str, Any]) -> bool:
    return solve.basis_is_valid(path, case)


def _run_times(timed: Mapping[Cell, tuple[Case, Path]], study: Study, store: ModelStore) -> dict[str, Any]:
    there = {cell: entry for cell, entry in timed.items() if entry[1].exists()}  # a cell may have failed
    return {"cells": time_cells(there, study.timing, store), "machine": machine()}


def _rival_work(study: Study, cases: StudyCases, store: ModelStore) -> list[WorkItem]:
    items = []
    settings, peer = study.conventional, study.peer
    for cell in settings.solved:
        case, name = cases.cells[cell], f"conventional {cell.label}"
        weight = STEPS * settings.angles * _step_weight(case)
        items.append(WorkItem(name, part_key(name, {"case": case}, settings.angles), weight,
                              partial(rivals.conventional_cell, case, settings.angles, store)))  # fmt: skip
    for n in settings.stepped:
        case = next(case for cell, case in cases.cells.items() if cell.n_profile == n)
        name = f"conventional step {n}"
        items.append(WorkItem(name, part_key(name, {"case": case}, None), 0.2 * _step_weight(case),
                              partial(rivals.conventional_step, case)))  # fmt: skip
    if peer is not None and cases.peer is not None and rivals.peer_installed():
        name = f"peer {peer.cell.label}"
        weight = STEPS * peer.angles * _step_weight(cases.peer)
        items.append(WorkItem(name, part_key(name, {"case": cases.peer}, peer.angles), weight,
                              partial(rivals.peer_cell, cases.peer, peer.angles, store)))  # fmt: skip
    return items


def file_name(label: str) -> str:
    """Name of a file for a label: letters, digits, and underscores for the rest."""
    return "".join(c if c.isalnum() else "_" for c in label)


def _file(folder: Path, item: WorkItem) -> Path:
    return folder / f"{file_name(item.name)}.json"


def _size(case: Case) -> float:
    return case.mesh.profile_elements * case.mesh.width_elements / (64.0 * 8.0)


def _elastic_weight(case: Case) -> float:
    return ELASTIC_S * _size(case) ** 2.4


def _position_weight(case: Case) -> float:
    size = _size(case)
    return POSITION_S * size ** (1.5 if size < 1.0 else 3.0)


def _step_weight(case: Case) -> float:
    return STEP_S * _size(case) ** 1.9
