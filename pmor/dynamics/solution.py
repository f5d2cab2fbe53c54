"""The motion of the pair of a case under all its torques: force law, responses, their peaks, runs."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path

from pmor.case import Case, for_motion
from pmor.case.capability import refuse_beyond
from pmor.dynamics.force_law import Shifted, shifted
from pmor.dynamics.gear_model import GearModel, gear_model
from pmor.dynamics.kernels.laws import ForceTable
from pmor.dynamics.law import MeshLaw, backlash_of, cycles_of, mesh_laws
from pmor.dynamics.measure import BRANCHES, RUNS, Data, Task, joined, mesh_Hz, solve, with_speeds
from pmor.dynamics.moved_axes import model_error
from pmor.gear.pair import GearPair
from pmor.pair.model import gear_pair
from pmor.work.cost import meshed_within_memory
from pmor.work.pieces import Piece, run_pieces
from pmor_offline.gears import line_basis
from pmor_online.mesh_force import LineLoadLaw
from pmor_online.model import ReducedPair, reduced_pair


@dataclass(frozen=True)
class Dynamics:
    """The pair of a case in motion."""

    case: Case
    pair: GearPair
    model: GearModel
    backlash: float | None  # See `backlash_of`
    laws: tuple[MeshLaw, ...]  # One per torque that has one
    responses: tuple[Data, ...]  # One per torque that has one, as in `dynamics.json`
    failures: tuple[str, ...]  # Torques without a force law or a response, parts of responses that are lost, and why


def reduced_of(case: Case) -> ReducedPair:
    """Return the reduced pair of a case, by line loads; errors as in `refuse_other_models`."""
    refuse_other_models(case)
    bare = for_motion(case)
    return reduced_pair(line_basis(bare, mesh=meshed_within_memory(bare)))


def refuse_other_models(case: Case) -> None:
    """Raise CaseError for a case whose mesh has no force law by displacement, or one with too long a period."""
    refuse_beyond(case, "dynamics")
    cycles_of(case, gear_pair(case))


def task_of(case: Case, model: GearModel, law: ForceTable, torque_Nm: float) -> Task:
    """Return the problem of one torque."""
    dynamics = case.dynamics
    asked = dynamics.mesh_frequency_Hz
    if dynamics.speed_range_rpm is not None:
        asked = tuple(mesh_Hz(speed, case.pair.pinion.teeth) for speed in dynamics.speed_range_rpm)
    low, high = dynamics.mesh_frequency_ratio if asked is None else asked
    return Task(
        model, law, torque_Nm, dynamics.mesh_damping_N_s_mm, dynamics.damping_ratio, (low, high), asked is not None,
        dynamics.run_cycles,
    )  # fmt: skip


def run_dynamics(
    case: Case, reduced: ReducedPair, pieces_folder: Path, *, executor: Executor | None = None,
    progress: Callable[[int], None] | None = None,
) -> Dynamics:  # fmt: skip
    """Solve all torques of a case; branches and runs of each are pieces of work. Errors as in `pmor.dynamics.run`."""
    pair = reduced.meshed.pair
    model = gear_model(case, pair)
    parts = (BRANCHES, *(RUNS if case.dynamics.run_cycles else ()))
    laws, failures = mesh_laws(case, reduced, model, executor)
    tasks = [
        _with_law(replace(task_of(case, model, law.table, law.torque_Nm), limit=law.limit), law, reduced, case)
        for law in laws
    ]
    errors = [asdict(law.error) for law in laws]
    pieces = [
        Piece(_name(task, part), {"case": case}, errors, partial(solve, task, part)) for task in tasks for part in parts
    ]
    done, lost = run_pieces(pieces, pieces_folder, executor=executor, progress=progress, what="parts of responses")
    responses, missing = [], [*failures, *lost]
    for task, law in zip(tasks, laws, strict=True):
        if _name(task, BRANCHES) in done:
            response = joined(dict(done[name]) for part in parts if (name := _name(task, part)) in done)
            share, largest = None, response["largest"]
            if model.supports and largest is not None:
                share = model_error(case, model, reduced, law.table, largest)
                if share is None:
                    response["lost"].append("no mesh force with the axes displaced as in the largest motion")
            response["axes_motion_force_error_share"] = share
            responses.append(with_speeds(response, case.pair.pinion.teeth))
            missing += [f"{law.torque_Nm:g} N m: {sentence}" for sentence in response["lost"]]
    return Dynamics(case, pair, model, backlash_of(case, pair), laws, tuple(responses), tuple(missing))


def _with_law(task: Task, law: MeshLaw, reduced: ReducedPair, case: Case) -> Task:
    """Return a task with the line loads behind its table where the case asks for them."""
    if case.dynamics.law != "exact":
        return task
    table = shifted(law.table, -law.shift)
    exact = LineLoadLaw(reduced, law.assembly, table.low, table.high, table.backlash)
    return replace(task, exact=Shifted(exact, law.shift))


def _name(task: Task, part: str) -> str:
    return f"{task.torque_Nm:g} N m, {part.replace('_', '-')}"
