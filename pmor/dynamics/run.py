"""The motion of the pair of a case under all its torques: force law, responses, runs."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path

from pmor.case import Case, change_case, without_models
from pmor.core.errors import CaseError
from pmor.core.threads import threads
from pmor.dynamics.gear_model import GearModel, gear_model
from pmor.dynamics.kernels.laws import ForceTable
from pmor.dynamics.law import MeshLaw, backlash_of, cycles_of, force_law, mesh_laws
from pmor.dynamics.measure import BRANCHES, RUNS, Data, Task, joined, solve
from pmor.dynamics.moved_axes import model_error
from pmor.gear.pair import GearPair
from pmor.lab.slices.run import SLICES, compared, sliced
from pmor.pair.model import elastic_model, gear_pair
from pmor.work.cost import meshed_within_memory
from pmor.work.pieces import PARTS, Piece, run_pieces
from pmor_offline.train import train
from pmor_online.mesh_force import LineLoadLaw
from pmor_online.model import ReducedPair, reduced_pair


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
    laws : tuple of MeshLaw
        One per torque.
    responses : tuple of dict
        One per torque, as in `dynamics.json`.
    slices : tuple of dict
        One per torque, where the case compares thin slices; see `pmor.lab.slices.run`.
    failures : tuple of str
        Torques without a response, and why.
    """

    case: Case
    pair: GearPair
    model: GearModel
    backlash: float | None
    laws: tuple[MeshLaw, ...]
    responses: tuple[Data, ...]
    slices: tuple[Data, ...]
    failures: tuple[str, ...]


def reduced_of(case: Case) -> ReducedPair:
    """Return the reduced pair of a case: finite elements of the gears, line loads as unknowns."""
    refuse_other_models(case)
    # Motion asks for none of what else a basis holds.
    bare = change_case(without_models(case), mesh={"error_bar": False})
    return reduced_pair(train(bare, elastic_model(bare, meshed_within_memory(bare))).basis)


def refuse_other_models(case: Case) -> None:
    """Raise CaseError for a case whose mesh has no force law by displacement, or one that takes too long to repeat.

    Raises
    ------
    CaseError
    """
    if case.reduction.shapes != "line_loads":
        raise CaseError(
            f'case {case.name}: [reduction] shapes = "{case.reduction.shapes}": dynamics take the mesh force from line '
            'loads: write [contact] scheme = "line" and [reduction] shapes = "line_loads"'
        )
    cycles_of(case, gear_pair(case))


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
        Called with a line of progress for each table and each piece.
    """
    pair = reduced.meshed.pair
    model = gear_model(case, pair)
    parts = (BRANCHES, *(RUNS if case.dynamics.run_cycles else ()))
    with threads(jobs) as executor, _solver(jobs) as solver:
        laws = mesh_laws(case, reduced, model, executor, announce)
        tasks = [
            _with_law(task, law, reduced, case)
            for task, law in zip(tasks_of(case, model, laws[0].table), laws, strict=True)
        ]
        wanted = {_name(task, part): partial(solver, solve, task, part) for task in tasks for part in parts}
        if case.dynamics.thin_slices:
            alone = tasks_of(case, model, force_law(case, sliced(reduced), executor)[0])
            wanted |= {_name(task, SLICES): partial(solver, compared, task, slices)
                       for task, slices in zip(tasks, alone, strict=True)}  # fmt: skip
        pieces = [
            Piece(name, {"case": case}, [asdict(law.error) for law in laws], work) for name, work in wanted.items()
        ]
        found, failures = run_pieces(pieces, folder / PARTS, executor=executor)
    there = [[dict(found[name]) for name in (_name(task, part) for part in parts) if name in found]
             for task in tasks if _name(task, BRANCHES) in found]  # fmt: skip
    slices = tuple(dict(found[name]) for name in (_name(task, SLICES) for task in tasks) if name in found)
    responses = [joined(parts) for parts in there]
    for response in responses:
        law = laws[case.dynamics.torques_Nm.index(response["torque_Nm"])]
        known = model.supports and response["largest"] is not None
        response["axes_left_out_share"] = (
            model_error(case, model, reduced, law.table, response["largest"]) if known else None
        )
    return Dynamics(case, pair, model, backlash_of(case, pair), laws, tuple(responses), slices, failures)


def _with_law(task: Task, law: MeshLaw, reduced: ReducedPair, case: Case) -> Task:
    """Return a task with the law of its torque, and with the line loads behind it where the case asks for them."""
    table, exact = law.table, None
    if case.dynamics.law == "exact":
        exact = LineLoadLaw(reduced, law.assembly, table.low, table.high, table.backlash)
    return replace(task, law=table, exact=exact)


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
