"""The motion of the pair of a case under all its torques: force law, responses, runs."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from pmor.case import Case, change_case, without_models
from pmor.dynamics.force_table import TableError, range_under, table_error, tabulate
from pmor.dynamics.gear_model import GearModel, gear_model
from pmor.dynamics.kernels.laws import ForceTable
from pmor.errors import CaseError, ConvergenceError
from pmor.gear.pair import ROUNDING, GearPair
from pmor.lab.core.parts import PARTS, Announcer, Piece, run_pieces
from pmor.lab.dynamics.measure import BRANCHES, RUNS, Data, Task, joined, solve
from pmor.lab.dynamics.slices import SLICES, compared, sliced
from pmor.pair.conditions import built_of
from pmor.pair.model import elastic_model, mesh_model, refuse_loads
from pmor.threads import threads
from pmor_offline.train import train
from pmor_online.mesh_force import mesh_force_of
from pmor_online.model import ReducedPair, reduced_pair

# Knots of the force law over the mesh cycle and over the displacement, and how far it goes: multiples of the
# displacement under the largest torque. At 2 % damping motion without relief goes to six or seven times that.
PHASES, DISPLACEMENTS, MULTIPLE = 400, 200, 10.0
# Places where a table is held against its law: their number squared.
CHECKED, SEED = 40, 18


@dataclass(frozen=True)
class Dynamics:
    """The pair of a case in motion.

    Parameters
    ----------
    case : Case
    pair : GearPair
    model : GearModel
    backlash : float or None
        See `backlash_of`.
    law : ForceTable
        Under all torques.
    error : TableError
        Of that table, over its largest force.
    largest_force : float
        In the table, N.
    responses : tuple of dict
        One per torque, as in `dynamics.json`.
    slices : tuple of dict
        One per torque, where the case compares thin slices; see `pmor.lab.dynamics.slices`.
    failures : tuple of str
        Torques without a response, and why.
    """

    case: Case
    pair: GearPair
    model: GearModel
    backlash: float | None
    law: ForceTable
    error: TableError
    largest_force: float
    responses: tuple[Data, ...]
    slices: tuple[Data, ...]
    failures: tuple[str, ...]

def reduced_of(case: Case) -> ReducedPair:
    """Return the reduced pair of a case: finite elements of the gears, line loads as unknowns."""
    refuse_other_models(case)
    # Motion asks for none of what else a basis holds.
    bare = change_case(without_models(case), mesh={"error_bar": False})
    return reduced_pair(train(bare, elastic_model(bare, mesh_model(bare))).basis)


def refuse_other_models(case: Case) -> None:
    """Raise CaseError for a case whose mesh has no force law by displacement that repeats with the mesh.

    Raises
    ------
    CaseError
    """
    if case.reduction.shapes != "line_loads":
        raise CaseError(
            f'case {case.name}: [reduction] shapes = "{case.reduction.shapes}": dynamics take the mesh force from line '
            'loads: write [contact] scheme = "line" and [reduction] shapes = "line_loads"'
        )
    for gear, modification in (("pinion", case.pinion_modification), ("wheel", case.wheel_modification)):
        if modification.pitch_deviations_um:
            raise CaseError(
                f"case {case.name}: [{gear}.modification] pitch_deviations_um: motion is looked for that repeats with "
                "the mesh, and teeth out of their place do not: leave it out"
            )


def force_law(
    case: Case, reduced: ReducedPair, executor: Executor | None = None
) -> tuple[ForceTable, TableError, float]:
    """Tabulate the force law of the pair of a case, and hold the table against the law.

    Parameters
    ----------
    case : Case
    reduced : ReducedPair
    executor : concurrent.futures.Executor, optional
        Of threads.

    Returns
    -------
    ForceTable
    TableError
    largest_force : float
        In the table, N.

    Raises
    ------
    CaseError
        Where a torque is beyond what the contact holds.
    ConvergenceError
        Where the law has no force within the range that it needs.
    """
    torques = case.dynamics.torques_Nm
    refuse_loads(replace(case, online=replace(case.online, torques_Nm=torques)), reduced.meshed)
    built = built_of(case)
    forces = mesh_force_of(reduced, built)
    load = 1e3 * torques[-1] / reduced.meshed.pair.pinion.base_radius
    limits = range_under(forces, load, built.spread, MULTIPLE)
    backlash = backlash_of(case, reduced.meshed.pair)
    gap = np.inf if backlash is None else backlash
    try:
        table = tabulate(forces, *limits, PHASES, DISPLACEMENTS, gap, executor)
    except ValueError as reason:
        raise ConvergenceError(f"force law: {reason}") from None
    error = table_error(table, forces, CHECKED, np.random.default_rng(SEED))
    return table, error, float(table.knots[:, -1, 0].max())


def backlash_of(case: Case, pair: GearPair) -> float | None:
    """Return from where working flanks touch to where backs of teeth do, along the line of action, mm.

    None, and motion goes on without backs of teeth, where the drawing has no backlash and the case gives none, or where
    tilted axes and flanks whose halves differ make the backs no mirror images of the flanks.
    """
    if case.dynamics.backlash_um is not None:
        return 1e-3 * case.dynamics.backlash_um
    if pair.backlash <= ROUNDING * pair.pinion.module or not built_of(case).backs_mirror_flanks:
        return None
    return pair.backlash


def tasks_of(case: Case, model: GearModel, law: ForceTable) -> list[Task]:
    """Return what is to be solved: one task per torque."""
    dynamics = case.dynamics
    asked = dynamics.mesh_frequency_Hz
    low, high = dynamics.mesh_frequency_ratio if asked is None else asked
    return [
        Task(
            model, law, torque, dynamics.mesh_damping_N_s_mm, dynamics.damping_ratio, (low, high), asked is not None,
            dynamics.run_cycles,
        )
        for torque in dynamics.torques_Nm
    ]  # fmt: skip


def run_dynamics(
    case: Case, reduced: ReducedPair, folder: Path, jobs: int = 1,
    announce: Callable[[str], None] = lambda text: None,
) -> Dynamics:  # fmt: skip
    """Solve all torques of a case; branches, runs and slices of each are kept when they are finished.

    Parameters
    ----------
    case : Case
    reduced : ReducedPair
    folder : Path
        Of the results.
    jobs : int
        Pieces of work done at a time, each in a process of its own.
    announce : callable
        Called with a line of progress for each piece.
    """
    pair = reduced.meshed.pair
    model = gear_model(case, pair)
    parts = (BRANCHES, *(RUNS if case.dynamics.run_cycles else ()))
    with threads(jobs) as executor, _solver(jobs) as solver:
        law, error, largest = force_law(case, reduced, executor)
        tasks = tasks_of(case, model, law)
        wanted = {_name(task, part): partial(solver, solve, task, part) for task in tasks for part in parts}
        if case.dynamics.thin_slices:
            alone = tasks_of(case, model, force_law(case, sliced(reduced), executor)[0])
            wanted |= {_name(task, SLICES): partial(solver, compared, task, slices)
                       for task, slices in zip(tasks, alone, strict=True)}  # fmt: skip
        pieces = [Piece(name, {"case": case}, asdict(error), work) for name, work in wanted.items()]
        announcer = Announcer(len(pieces), announce)
        found, failures = run_pieces(pieces, folder / PARTS, executor, announcer.started, announcer.finished)
    there = [[dict(found[name]) for name in (_name(task, part) for part in parts) if name in found]
             for task in tasks if _name(task, BRANCHES) in found]  # fmt: skip
    slices = tuple(dict(found[name]) for name in (_name(task, SLICES) for task in tasks) if name in found)
    backlash = backlash_of(case, pair)
    return Dynamics(case, pair, model, backlash, law, error, largest, tuple(map(joined, there)), slices, failures)


def _name(task: Task, part: str) -> str:
    return f"{task.torque_Nm:g} N m, {part.replace('_', '-')}"


@contextmanager
def _solver(jobs: int) -> Iterator[Callable[..., Data]]:
    """Give what calls a function with arguments: here, or in one of several processes: Python's lock stops threads."""
    if jobs == 1:
        yield lambda work, *arguments: work(*arguments)
        return
    with ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn")) as pool:
        yield lambda work, *arguments: pool.submit(work, *arguments).result()
