"""The front door of gearboxes: a gearbox file in, its result out; beside it the same meshes on rigid supports.

Rigid supports do not depend on the load: all loads of a mesh are swept there at once. Hubs that give way move teeth as
rigid bodies, so that stress follows from the line loads alone (`pmor_online.root_stress`).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np

from pmor.case.capability import refuse_beyond
from pmor.core.errors import ConvergenceError, Stopped
from pmor.core.progress import Progress, quietly, stage
from pmor.core.threads import in_order
from pmor.gear.condition import Condition
from pmor.line.lost import lost_of_pair
from pmor.line.several import GearTrain
from pmor.machine.coupled import (
    RigidMesh,
    RootStresses,
    SolvedLoad,
    SolvedMesh,
    Trains,
    condition_of,
    solve_load,
    swept_angles,
)
from pmor.machine.coupled_sets import sets_on_rigid_supports
from pmor.machine.fit import fit_meshes
from pmor.machine.groups import GroupKey, group_trains, group_under, mesh_sweep
from pmor.machine.load_settings import LoadCase
from pmor.machine.loader import GearboxFile
from pmor.machine.model import GearboxModel, placed_groups
from pmor.machine.output import FILES, set_files
from pmor.machine.result import GearboxResult
from pmor.pair.samples import lost_samples
from pmor.results.root_stress import RootStress
from pmor.results.sweep import SteSweep
from pmor.sets.lost import lost_positions
from pmor.sets.run import coarse_train_of, train_of
from pmor.sets.solution import SetSolution
from pmor.storage.gear_store import KeptGear, kept_beside, not_kept
from pmor.storage.results_folder import results_folder
from pmor.work.cost import meshed_within_memory
from pmor_offline.gears import line_basis, solved_once
from pmor_online.mesh_error import with_mesh_error
from pmor_online.model import ReducedPair, keeping_sections, on_hubs, reduced_pair
from pmor_online.root_stress import root_stress_of
from pmor_online.samples import solve_samples
from pmor_online.sweep import sweep_reduced_pair

# Angles of a pitch, at least, at which stress is found, of those that are swept. *Measured* on two helical pairs: the
# largest is up to 0.5 % below that of 200.
STRESS_ANGLES = 32


def run(
    file: GearboxFile, *, folder: Path | str | None = None, overwrite: bool = False, executor: Executor | None = None,
    progress: Callable[[int], None] | None = None,
) -> GearboxResult:  # fmt: skip
    """Solve a gearbox under all its load cases; those without an equilibrium are in `failures`.

    Parameters
    ----------
    folder, overwrite, executor, progress
        As in `pmor.app.capabilities`; the executor is one of threads. Gears are kept beside the folder.

    Raises
    ------
    OutputError
    CaseError
        Where loads turn with shafts that no few turns of a carrier bring back.
    """
    names = (*FILES, *set_files(file))
    with nullcontext() if folder is None else results_folder(Path(folder), names, (), overwrite, file.inputs):
        kept = kept_beside(None if folder is None else Path(folder), overwrite)
        return solved(file, kept, executor, progress or quietly)


def solved(
    file: GearboxFile, kept: KeptGear, executor: Executor | None = None, step: Callable[[int], None] = quietly
) -> GearboxResult:
    """Solve a gearbox as `run`, its gears from where they are kept."""
    refuse_beyond(file, "sweep")
    seconds = dict[str, float]()
    with _timed(seconds, "finite elements"):
        trained, trains = meshes_and_trains(file, kept, executor)
    so_far = list[SolvedLoad]()
    try:
        loads, failures = solved_loads(file, trained, trains, executor, step, seconds, so_far)
        with _timed(seconds, "tolerances"):
            loads = tuple(with_samples(load, trained, file.angles_per_pitch, executor) for load in loads)
        failures += tuple(text for load in loads for text in lost_within_tolerances(load))
        pairs = {name: keeping_sections(reduced) for name, reduced in trained.items()}
        with _timed(seconds, "flanks that fit"), stage("flanks that fit"):
            fits = fit_meshes(file.model, loads, pairs)
    except KeyboardInterrupt:
        if so_far:
            raise Stopped(_interrupted(file, so_far, trained, trains, executor)) from None
        raise
    return GearboxResult(file, loads, failures, fits, trained, seconds)


def solved_loads(
    file: GearboxFile, trained: Mapping[str, ReducedPair], trains: Trains, executor: Executor | None = None,
    step: Callable[[int], None] = quietly, seconds: dict[str, float] | None = None,
    so_far: list[SolvedLoad] | None = None,
) -> tuple[tuple[SolvedLoad, ...], tuple[str, ...]]:  # fmt: skip
    """Solve all loads of a gearbox that have an equilibrium, beside rigid supports; sentences tell what has none.

    Parameters
    ----------
    trained, trains : mapping
        As `meshes_and_trains` returns them.
    seconds : dict, optional
        Takes the time of each phase.
    so_far : list, optional
        Takes each load as soon as it is solved.
    """
    seconds, failures = {} if seconds is None else seconds, list[str]()
    loads = list[SolvedLoad]() if so_far is None else so_far
    angles, every = file.angles_per_pitch, file.model.sections.loads
    over_loads, inside = (None, executor) if len(every) == 1 else (executor, None)

    def solve(load: LoadCase) -> SolvedLoad | str:
        pairs = {name: keeping_sections(reduced) for name, reduced in trained.items()}
        try:
            return solve_load(file.model, load, pairs, angles, trains=trains, executor=inside)
        except ConvergenceError as error:
            return f"load {load.name}: {error}"

    with _timed(seconds, "loads"), Progress(len(every), "loads", further=step) as bar:
        for found in in_order(solve, every, over_loads, bar.step):
            if isinstance(found, str):
                failures.append(found)
            else:
                loads.append(found)
                failures += lost_of_load(found)
    pairs = {name: keeping_sections(reduced) for name, reduced in trained.items()}
    with _timed(seconds, "rigid supports, root stress"):
        return with_rigid_supports(loads, pairs, trains, angles, executor), tuple(failures)


def _interrupted(
    file: GearboxFile, loads: Sequence[SolvedLoad], trained: Mapping[str, ReducedPair], trains: Trains,
    executor: Executor | None,
) -> GearboxResult:  # fmt: skip
    """Return the result of those loads that were solved before an interruption."""
    there = {load.load.name for load in loads}
    left = [one.name for one in file.model.sections.loads if one.name not in there]
    failures = [text for load in loads for text in lost_of_load(load)]
    failures += [f"load {name}: interrupted before it was solved" for name in left]
    failures += [] if left else ["interrupted before tolerances and the flanks that fit were found"]
    pairs = {name: keeping_sections(reduced) for name, reduced in trained.items()}
    found = with_rigid_supports(loads, pairs, trains, file.angles_per_pitch, executor)
    return GearboxResult(file, found, tuple(failures), (), trained)


def with_samples(
    solved: SolvedLoad, trained: Mapping[str, ReducedPair], angles: int, executor: Executor | None = None
) -> SolvedLoad:
    """Return a load with the pairs that the tolerances of its meshes draw; of meshes that share gears none are."""
    meshes = []
    for number, mesh in enumerate(solved.meshes):
        if number not in solved.gearbox.grouped:
            pair = on_hubs(trained[mesh.meshing.key], mesh.hubs)
            mesh = mesh._replace(samples=solve_samples(pair, [1e-3 * mesh.torque], angles, executor))
        meshes.append(mesh)
    return replace(solved, meshes=tuple(meshes))


def lost_within_tolerances(solved: SolvedLoad) -> Iterator[str]:
    """Yield a sentence for meshes and sets of which samples lack positions under a load."""
    parts = [(f"mesh {one.meshing.settings.name}", one.samples, one.torque) for one in solved.meshes]
    parts += [(f"set {one.meshing.settings.name}", one.samples, one.torque) for one in solved.sets]
    for name, samples, torque in parts:
        for text in lost_samples(samples, [1e-3 * torque]) if samples else ():
            yield f"load {solved.load.name}, {name}: {text}"


def meshes_and_trains(
    file: GearboxFile, kept: KeptGear = not_kept, executor: Executor | None = None
) -> tuple[dict[str, ReducedPair], dict[str | GroupKey, GearTrain]]:
    """Return the reduced pairs of the meshes of a gearbox, and its trains as of `trains_of`: each gear solved once."""
    kept, pairs = solved_once(kept), dict[str, ReducedPair]()
    for name, case in file.model.reduced_cases(file.cases).items():
        mesh = meshed_within_memory(case)
        with stage(f"finite elements of {name}"):
            pairs[name] = reduced_pair(line_basis(case, kept, mesh))
    return pairs, trains_of(file.model, file.model.sections.loads, kept, executor)


def trains_of(
    model: GearboxModel, loads: Iterable[LoadCase], kept: KeptGear = not_kept, executor: Executor | None = None
) -> dict[str | GroupKey, GearTrain]:
    """Return the trains of the sets of a gearbox, and of its meshes that share gears, for `solve_load`."""
    trains: dict[str | GroupKey, GearTrain] = {
        name: train_of(planetary, kept, executor) for name, planetary in model.sets.items()
    }
    for name, planetary in model.sets.items():
        if (coarse := coarse_train_of(planetary, kept, executor)) is not None:
            trains[GroupKey(name, ()).on_half] = coarse
    groups = [placed for load in loads for placed in placed_groups(model, load)]
    if groups:
        with stage("finite elements of gears in several meshes"):
            trains.update(group_trains(groups, kept, executor))
    return trains


def lost_of_load(solved: SolvedLoad) -> list[str]:
    """Return a sentence for each mesh and set with positions that have no solution under a load."""
    found, load = list[str](), f"load {solved.load.name}"
    for mesh in solved.meshes:
        assert mesh.sweep.overloaded is not None, "of line loads"
        name = f"{load}, mesh {mesh.meshing.settings.name}"
        found += lost_of_pair([name], mesh.sweep.converged, mesh.sweep.overloaded)
    for one in solved.sets:
        name = f"{load}, set {one.meshing.settings.name}"
        found += lost_positions(one.solution, [name])
        if one.turn is not None and not one.turn.converged.all():
            count = f"{np.count_nonzero(~one.turn.converged)} of {len(one.turn.converged)} positions"
            found.append(f"{name}: {count} of the turn of its carrier have no equilibrium")
    return found


@contextmanager
def _timed(seconds: dict[str, float], phase: str) -> Iterator[None]:
    start = time.perf_counter()
    try:
        yield
    finally:
        seconds[phase] = seconds.get(phase, 0.0) + time.perf_counter() - start


def with_rigid_supports(
    loads: Sequence[SolvedLoad], pairs: Mapping[str, ReducedPair], trains: Trains, angles: int,
    executor: Executor | None = None,
) -> tuple[SolvedLoad, ...]:  # fmt: skip
    """Return solved loads with root stress, and with the same pairs and sets on rigid supports.

    Parameters
    ----------
    pairs : mapping of str to ReducedPair
        Of the meshes, by name.
    trains : mapping
        As of `pmor.machine.coupled.solve_load`.
    angles : int
        Of a pitch, in the sweeps.
    executor : concurrent.futures.Executor, optional
        Of threads: shares out the meshes.
    """
    grouped = loads[0].gearbox.grouped if loads else set()

    def compared(number: int) -> list[tuple[SolvedMesh, RigidMesh]]:
        """Return a mesh under each load, with the one on rigid supports."""
        if number in grouped:
            return [_group_mesh(load, number, trains, angles) for load in loads]
        meshes, both = [load.meshes[number] for load in loads], dict[int, tuple[SolvedMesh, RigidMesh]]()
        for key in dict.fromkeys(mesh.meshing.key for mesh in meshes):
            rows, reduced = [row for row, mesh in enumerate(meshes) if mesh.meshing.key == key], pairs[key]
            conditions = [condition_of(reduced, meshes[row].torque) for row in rows]
            sweep = sweep_reduced_pair(reduced, swept_angles(reduced, angles), conditions, recorded=True)
            sweep = with_mesh_error(sweep, reduced, conditions)
            stress = _largest(reduced, conditions, sweep)
            for place, (row, condition) in enumerate(zip(rows, conditions, strict=True)):
                (own,) = _largest(reduced, [condition], meshes[row].sweep)
                both[row] = meshes[row]._replace(root_stress=own), RigidMesh(sweep, place, stress[place])
        return [both[row] for row in range(len(loads))]

    by_mesh = list(in_order(compared, range(len(loads[0].meshes) if loads else 0), executor))
    names = [one.settings.name for one in loads[0].gearbox.sets] if loads else []
    by_set = [
        sets_on_rigid_supports([load.sets[number] for load in loads], trains[name], executor)
        for number, name in enumerate(names)
    ]
    return tuple(
        replace(
            load, meshes=tuple(both[row][0] for both in by_mesh), rigid=tuple(both[row][1] for both in by_mesh),
            sets=tuple(sets[row] for sets in by_set),
        ) for row, load in enumerate(loads)
    )  # fmt: skip


def _group_mesh(load: SolvedLoad, number: int, trains: Trains, angles: int) -> tuple[SolvedMesh, RigidMesh]:
    """Return a mesh that shares gears with its root stress, and the same one on rigid supports."""
    placed = next(placed for placed in load.gearbox.groups if number in placed.group.numbers)
    own, place, mesh = load.groups[placed.key], placed.group.numbers.index(number), load.meshes[number]
    forces = np.array([load.meshes[n].force for n in placed.group.numbers])
    rigid, half = group_under(placed, trains[placed.key], forces, angles), placed.key.on_half
    coarse = group_under(placed, trains[half], forces, angles) if half in trains else None
    stresses = [_of_bodies(solution, placed.group.ends[place]) for solution in (own, rigid)]
    beside = RigidMesh(mesh_sweep(placed, rigid, place, coarse), 0, stresses[1])
    return mesh._replace(root_stress=stresses[0]), beside


def _of_bodies(solution: SetSolution, ends: tuple[int, int]) -> RootStresses:
    """Largest root stress of two gears of a group, by all of their meshes, MPa."""
    stress = solution.root_stress
    pinion, wheel = (float(np.nanmax(stress[body].max_principal_MPa[0])) if stress else 0.0 for body in ends)
    return (pinion, wheel) if stress else None


def _largest(reduced: ReducedPair, conditions: Sequence[Condition], sweep: SteSweep) -> list[RootStresses]:
    """Largest root stress of pinion and wheel under each condition, MPa; none where the basis holds no root stress."""
    assert sweep.states is not None
    some = slice(None, None, max(len(sweep.phi_rad) // (STRESS_ANGLES * sweep.pitches), 1))
    stress = root_stress_of(reduced, sweep.phi_rad[some], conditions, sweep.states.loads.at_angles(some))
    return [None] * len(conditions) if stress is None else [_of_both(stress, i) for i in range(len(conditions))]


def _of_both(stress: RootStress, torque: int) -> RootStresses:
    pinion, wheel = (stress.largest(torque, gear) for gear in range(2))
    return None if pinion is None or wheel is None else (pinion.max_principal_MPa, wheel.max_principal_MPa)
