"""Run times of condensed and reduced models, measured in one phase of one process."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

from pmor.case import Case
from pmor.core.threads import threads
from pmor.lab.core.models import ModelStore
from pmor.lab.core.timing import ms_per_position, times_in_turn
from pmor.lab.study.settings import Cell
from pmor.pair.conditions import nominal_condition
from pmor.pair.sweep import sweep_ste
from pmor.results.sweep import SteSweep
from pmor.storage.basis_file import read_basis
from pmor_online.model import online_angles, reduced_pair
from pmor_online.sweep import sweep_reduced_pair

# Rounds over all cells, and positions of one measurement.
REPEATS, CONDENSED_ANGLES, REDUCED_ANGLES = 5, 8, 200


def time_cells(cells: Mapping[Cell, tuple[Case, Path]], store: ModelStore) -> dict[str, dict[str, Any]]:
    """Time condensed and reduced model (ms per position) of cases and basis files by cell, in rounds over the cells.

    One position is one angle at the nominal torque. The condensed model solves each from the undeformed pair, the
    reduced one starts from the position before, on one thread and on all.
    """
    with threads(os.cpu_count() or 1) as executor:
        work = _sweeps(cells, store, executor)
        times = times_in_turn(work, REPEATS)
    result: dict[str, dict[str, Any]] = {}
    for (label, name), found in times.items():
        result.setdefault(label, {})[name] = median(found)
    return result


def _sweeps(
    cells: Mapping[Cell, tuple[Case, Path]], store: ModelStore, executor: Executor | None
) -> dict[tuple[str, str], Callable[[], float]]:
    """Return the timed sweeps (ms per position) by the label of the cell and the name of the model."""
    work: dict[tuple[str, str], Callable[[], float]] = {}
    for cell, (case, basis_path) in cells.items():
        model, _ = store.model(case)
        reduced, conditions = reduced_pair(read_basis(basis_path)), [nominal_condition(case)]
        pitch = model.mesh.meshed.pair.pitch
        few, many = (online_angles(pitch, n) for n in (CONDENSED_ANGLES, REDUCED_ANGLES))
        sweeps: dict[str, Callable[[], SteSweep]] = {
            "ms_condensed": partial(sweep_ste, model.mesh.meshed, model.elasticity_at, few, conditions),
            "ms_reduced": partial(sweep_reduced_pair, reduced, many, conditions),
            "ms_reduced_all_threads": partial(sweep_reduced_pair, reduced, many, conditions, executor),
        }
        work |= {(cell.label, name): partial(ms_per_position, sweep) for name, sweep in sweeps.items()}
    return work
