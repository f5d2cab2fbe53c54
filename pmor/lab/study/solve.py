"""The pieces of work that solve contact: each takes cases and gives plain data for a part file."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from pmor.case import Case, basis_key
from pmor.core.arrays import FloatArray
from pmor.core.threads import threads
from pmor.fe.assembly import degrees_of_freedom
from pmor.gear.condition import Condition
from pmor.lab.core.measures import max_and_rms, ms_per_position, times_in_turn
from pmor.lab.core.models import ModelStore
from pmor.lab.study.settings import Cell, Study
from pmor.pair.conditions import conditions_of, nominal_condition
from pmor.pair.model import ElasticModel, MeshModel, elastic_model, mesh_model
from pmor.pair.sweep import sweep_ste
from pmor.results.sweep import SteSweep, ripple_um
from pmor.storage.basis_file import read_basis
from pmor.work.offline import run_offline
from pmor_online.compare import training_failures
from pmor_online.model import ReducedPair, online_angles, reduced_pair, unseen_angles
from pmor_online.sweep import largest_size, sweep_reduced_pair

# Rounds over all cells, and positions of one measurement.
REPEATS, CONDENSED_ANGLES, REDUCED_ANGLES = 5, 8, 200


def reference_mesh(case: Case, study: Study, executor: Executor | None) -> dict[str, Any]:
    """Solve one mesh of the reference's family on the regular grid of angles."""
    started = time.perf_counter()
    model = elastic_model(case, mesh_model(case))
    elastic_s = time.perf_counter() - started
    return _full_on_grid(model, case, study, executor) | {"elastic_s": elastic_s}


def variant_cell(case: Case, study: Study, store: ModelStore, executor: Executor | None) -> dict[str, Any]:
    """Solve a cell with other settings by condensed full FE on the regular grid of angles."""
    model, elastic_s = store.model(case)
    return _full_on_grid(model, case, study, executor) | {"elastic_s": elastic_s}


def grid_cell(
    case: Case, study: Study, store: ModelStore, basis_path: Path, executor: Executor | None
) -> dict[str, Any]:
    """Solve a cell by condensed full FE, train its reduced model on one thread, and compare the two."""
    model, elastic_s = store.model(case)
    pair, conditions = model.mesh.meshed.pair, [nominal_condition(case)]
    grid = online_angles(pair.pitch, study.grid.angles_per_pitch)
    full = _full_on_grid(model, case, study, executor)
    # The compiled code is warm by now, so that the offline time below is that of a second run.
    offline = run_offline(case, model, basis_path, overwrite=True)
    reduced = reduced_pair(read_basis(basis_path))
    training = reduced.basis.training
    on_grid = sweep_reduced_pair(reduced, grid, conditions)
    curve = sweep_reduced_pair(reduced, online_angles(pair.pitch, study.curve_angles), conditions)
    unseen = unseen_angles(pair.meshing_range[0], pair.pitch, case.compare.angles, case.offline.angles_per_pitch)
    comparison = compare_at(reduced, full_sweep(model, unseen, conditions_of(case, case.compare.torques_Nm), executor))
    return full | {
        "reduced": sweep_data(on_grid),
        "reduced_curve": sweep_data(curve),
        "reduced_ripple_um": ripple_um(curve, 0),
        "comparison": comparison,
        "training_failures": training_failures(training),
        "flank_unknowns": int(model.pinion.compliance.shape[1]),
        "rom_size": largest_size(reduced),
        "basis_mib": basis_path.stat().st_size / 2**20,
        "n_angles_trained": len(training.phi),
        "n_torques_trained": len(training.torque),
        "elastic_s": elastic_s,
        "offline_s": elastic_s + offline.seconds,
    }


def compare_at(reduced: ReducedPair, sweep: SteSweep) -> dict[str, Any]:
    """Solve the positions of a full sweep with the reduced model as well."""
    fast = sweep_reduced_pair(reduced, sweep.phi_rad, conditions_of(reduced.basis.case, sweep.torque_Nm))
    largest, rms = max_and_rms((fast.ste_um - sweep.ste_um) / sweep.ste_um)
    return {"full": sweep_data(sweep), "reduced": sweep_data(fast), "max_rel": largest, "rms_rel": rms}


def sweep_data(sweep: SteSweep) -> dict[str, Any]:
    """Return the data of a sweep for a part file: everything but its duration."""
    names = ("phi_rad", "torque_Nm", "ste_um", "pair_share", "pair_index", "newton_steps", "pitch_rad")
    return {name: np.asarray(getattr(sweep, name)).tolist() for name in names}


def basis_is_valid(path: Path, case: Case) -> bool:
    """Whether the basis file of a cell is there, whole, and made from this very case."""
    from pmor.core.errors import FileFormatError

    try:
        return path.exists() and basis_key(read_basis(path).case) == basis_key(case)
    except FileFormatError:
        return False


def _full_on_grid(model: ElasticModel, case: Case, study: Study, executor: Executor | None) -> dict[str, Any]:
    phi = online_angles(model.mesh.meshed.pair.pitch, study.grid.angles_per_pitch)
    sweep = full_sweep(model, phi, [nominal_condition(case)], executor)
    return {
        "full": sweep_data(sweep),
        "full_ripple_um": ripple_um(sweep, 0),
        "fe_unknowns": _fe_unknowns(model.mesh),
        "solve_s": sweep.seconds,
    }


def full_sweep(
    model: ElasticModel, phi: FloatArray, conditions: Sequence[Condition], executor: Executor | None = None
) -> SteSweep:
    """Solve condensed full FE at all angles (rad) under all conditions."""
    return sweep_ste(model.mesh.meshed, model.elasticity_at, phi, conditions, executor=executor)


def _fe_unknowns(mesh: MeshModel) -> int:
    """Unknowns of both rings as they are meshed: sectors share their side faces, and the bore is fixed."""
    total = 0
    for sector in (mesh.pinion, mesh.wheel):
        elsewhere = degrees_of_freedom(np.unique(np.concatenate([sector.right, sector.bore, sector.middles])))
        total += sector.teeth * (3 * len(sector.nodes) - len(np.union1d(elsewhere, sector.held_axially)))
    return total


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
