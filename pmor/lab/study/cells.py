"""From the cells of a study to cases and models."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from pmor.case import Case, changed_text, load_case, parse_case, text_of, without_models
from pmor.core.arrays import FloatArray
from pmor.gear.condition import Condition
from pmor.lab.core.variants import Sections, merged
from pmor.lab.study.settings import Cell, Member, Study
from pmor.line import full_model as line_full
from pmor.line.layered_pair import LayeredPair
from pmor.pair.model import ElasticModel
from pmor.pair.sweep import collect_sweep, solve_positions
from pmor.penalty.pair import as_penalty
from pmor.results.sweep import SteSweep

# A loaded pair counts as inside the path of contact at this fraction of a pitch from where it enters or leaves mesh.
ENTRY_EXIT_MARGIN = 0.1


@dataclass(frozen=True)
class StudyCases:
    """All cases of a study, checked before anything runs.

    Parameters
    ----------
    cells : mapping of Cell to Case
    members : mapping of Member to Case
        The reference's family.
    peer : Case or None
        What the independent solver is given.
    """

    cells: Mapping[Cell, Case]
    members: Mapping[Member, Case]
    peer: Case | None


def study_cases(study: Study) -> StudyCases:
    """Make the cases of a study.

    Raises
    ------
    CaseError
        When the base case or what a cell makes of it is refused.
    """
    base = text_of(without_models(load_case(study.base)))

    def case(cell: Cell, changes: Sections) -> Case:
        text = changed_text(base, merged(study.changes_of(cell), changes))
        return parse_case(text, cell.label, f"{study.where}: cell {cell.label}")

    return StudyCases(
        cells={cell: case(cell, {}) for cell in study.cells},
        members={m: case(Cell(m.n_profile, m.lodm), {"mesh": {"width_elements": m.n_width}}) for m in study.members},
        peer=case(study.peer.cell, study.peer.changes) if study.peer is not None else None,
    )


@dataclass(frozen=True)
class FullSweep:
    """Condensed full FE over a set of angles.

    Parameters
    ----------
    sweep : SteSweep
    torque_ratio_error : ndarray, shape (n_torques, n_angles)
        ``|T2 z1 / (T1 z2) - 1|`` of the contact torques; NaN where not converged, and where a pair is about to enter
        or to leave mesh.
    """

    sweep: SteSweep
    torque_ratio_error: FloatArray


def solve_full(model: ElasticModel, phi: FloatArray, conditions: Sequence[Condition], jobs: int) -> FullSweep:
    """Solve condensed full FE at all angles and torques.

    Parameters
    ----------
    model : ElasticModel
    phi : ndarray, shape (n,)
        Pinion angles, rad.
    conditions : sequence of Condition
    jobs : int
        Angles solved at a time.
    """
    meshed, pair = model.mesh.meshed, model.mesh.meshed.pair
    started = time.perf_counter()
    if isinstance(meshed, LayeredPair):
        return _of_lines(meshed, model, phi, conditions, jobs)
    with ThreadPoolExecutor(max_workers=jobs) as pool:
        solved = solve_positions(as_penalty(meshed), model.elasticity_at, phi, conditions, executor=pool)
    sweep = collect_sweep(meshed, solved, phi, conditions, time.perf_counter() - started)
    first, last = pair.roll_position_range
    margin = ENTRY_EXIT_MARGIN * pair.pitch
    ratio = np.full(sweep.ste_um.shape, np.nan)
    for i, position in enumerate(solved):
        roll = float(phi[i]) + position.position.pair_index * pair.pitch
        for t, equilibrium in enumerate(position.equilibria):
            if equilibrium is None:
                continue
            torque = equilibrium.pair_torque(len(roll))
            loaded = roll[torque > 0.0]
            if first + margin <= loaded.min() and loaded.max() <= last - margin:
                teeth = pair.wheel.teeth / pair.pinion.teeth
                ratio[t, i] = abs(equilibrium.wheel_torque / float(torque.sum()) / teeth)
    return FullSweep(sweep, np.abs(ratio - 1.0))


def _of_lines(
    meshed: LayeredPair, model: ElasticModel, phi: FloatArray, conditions: Sequence[Condition], jobs: int
) -> FullSweep:
    started, teeth = time.perf_counter(), meshed.pair.wheel.teeth / meshed.pair.pinion.teeth
    with ThreadPoolExecutor(max_workers=jobs) as pool:
        solved = list(pool.map(lambda at: line_full.solve_angle(meshed, model.elasticity_at, at, conditions), phi.tolist()))
    sweep = line_full.collect_sweep(meshed, solved, phi, conditions, time.perf_counter() - started)
    first, last = meshed.pair.roll_position_range
    margin = ENTRY_EXIT_MARGIN * meshed.pair.pitch
    ratio = np.full(sweep.ste_um.shape, np.nan)
    for i, angle in enumerate(solved):
        for t, state in enumerate(angle.states):
            if state is None:
                continue
            loaded = phi[i] + state.pair * meshed.pair.pitch
            if first + margin <= loaded.min() and loaded.max() <= last - margin:
                ratio[t, i] = abs(state.wheel_torque / float(state.torque.sum()) / teeth)
    return FullSweep(sweep, np.abs(ratio - 1.0))
