"""The front door of gearboxes: a gearbox file in, its result out; beside it the same meshes on rigid supports.

Rigid supports do not depend on the load: all loads of a mesh are swept there at once. Hubs that give way move teeth as
rigid bodies, so that stress follows from the line loads alone (`pmor_online.root_stress`).
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from pmor.core.errors import ConvergenceError
from pmor.core.progress import quietly, stage
from pmor.core.threads import in_order
from pmor.gear.condition import Condition
from pmor.line.lost import lost_of_pair
from pmor.line.several import GearTrain
from pmor.machine.coupled import (
    RigidMesh,
    RootStresses,
    SolvedLoad,
    SolvedMesh,
    condition_of,
    solve_load,
    swept_angles,
)
from pmor.machine.coupled_sets import sets_on_rigid_supports
from pmor.machine.fit import fit_meshes
from pmor.machine.loader import GearboxFile
from pmor.machine.output import FILES, set_files
from pmor.machine.result import GearboxResult
from pmor.machine.settings import LoadCase
from pmor.pair.model import elastic_model
from pmor.results.root_stress import RootStress
from pmor.results.sweep import SteSweep
from pmor.sets.lost import lost_positions
from pmor.sets.run import gear_files, kept_in_folder, train_of
from pmor.storage.basis_file import read_basis
from pmor.storage.results_folder import results_folder
from pmor.work.cost import meshed_within_memory
from pmor.work.models import valid_basis
from pmor.work.offline import parts_of, run_offline
from pmor_online.model import ReducedPair, keeping_sections, reduced_pair
from pmor_online.root_stress import root_stress_of
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
        As in `pmor.app.capabilities`; the executor is one of threads. The folder keeps the basis of each mesh.

    Raises
    ------
    OutputError
    """
    step, seconds = progress or quietly, dict[str, float]()
    with _timed(seconds, "finite elements"), _bases_folder(file, folder, overwrite) as bases:
        trained = {name: _trained(file, name, bases, overwrite, executor) for name in file.cases}
        trains = {
            name: train_of(one, kept_in_folder(bases, overwrite, prefix_of(name)), executor)
            for name, one in file.model.sets.items()
        }
    loads, failures = list[SolvedLoad](), list[str]()
    angles = max((case.online.angles_per_pitch for case in file.cases.values()), default=0)
    every = file.model.sections.loads

    def solve(load: LoadCase) -> SolvedLoad | str:
        pairs = {name: keeping_sections(reduced) for name, reduced in trained.items()}
        try:
            return solve_load(
                file.model, load, pairs, angles, trains=trains, executor=executor if len(every) == 1 else None
            )
        except ConvergenceError as error:
            return f"load {load.name}: {error}"

    with _timed(seconds, "loads"):
        for solved in in_order(solve, every, None if len(every) == 1 else executor, lambda: step(1)):
            if isinstance(solved, str):
                failures.append(solved)
            else:
                loads.append(solved)
                failures += lost_of_load(solved)
    pairs = {name: keeping_sections(reduced) for name, reduced in trained.items()}
    with _timed(seconds, "rigid supports, root stress"):
        compared = with_rigid_supports(loads, pairs, trains, angles, executor)
    with _timed(seconds, "flanks that fit"), stage("flanks that fit"):
        fits = fit_meshes(file.model, loads, pairs)
    return GearboxResult(file, compared, tuple(failures), fits, trained, seconds)


def lost_of_load(solved: SolvedLoad) -> list[str]:
    """Return a sentence for each mesh and set with positions that have no solution under a load."""
    found, load = list[str](), f"load {solved.load.name}"
    for mesh in solved.meshes:
        assert mesh.sweep.overloaded is not None, "of line loads"
        name = f"{load}, mesh {mesh.meshing.settings.name}"
        found += lost_of_pair([name], mesh.sweep.converged, mesh.sweep.overloaded)
    for one in solved.sets:
        found += lost_positions(one.solution, [f"{load}, set {one.meshing.settings.name}"])
    return found


@contextmanager
def _timed(seconds: dict[str, float], phase: str) -> Iterator[None]:
    start = time.perf_counter()
    try:
        yield
    finally:
        seconds[phase] = seconds.get(phase, 0.0) + time.perf_counter() - start


def basis_name(mesh: str) -> str:
    """Return the name of the basis file of a mesh."""
    return f"basis_{mesh}.h5"


def prefix_of(name: str) -> str:
    """Return what stands in front of the members of a set in the names of the files that keep them."""
    return f"{name}_"


@contextmanager
def _bases_folder(file: GearboxFile, folder: Path | str | None, overwrite: bool) -> Iterator[Path]:
    names = [basis_name(name) for name in file.cases]
    of_sets = [name for set_name, one in file.model.sets.items() for name in gear_files(one, prefix_of(set_name))]
    if folder is None:
        with tempfile.TemporaryDirectory() as temporary:
            yield Path(temporary)
        return
    working = [parts_of(Path(name)).name for name in names]
    files = (*FILES, *set_files(file), *names, *(of_sets if overwrite else ()))
    with results_folder(Path(folder), files, working, overwrite, file.inputs) as held:
        yield held


def _trained(file: GearboxFile, name: str, folder: Path, overwrite: bool, executor: Executor | None) -> ReducedPair:
    """Return the reduced pair of a mesh; a basis that is there and is made from the same settings is taken over."""
    case, path = file.cases[name], folder / basis_name(name)
    basis = None if overwrite else valid_basis(path, case)
    if basis is None:
        with stage(f"finite elements of {name}"):
            model = elastic_model(case, meshed_within_memory(case))
        run_offline(case, model, path, executor=executor, resume=not overwrite, overwrite=True)
        basis = read_basis(path)
    return reduced_pair(basis)


def with_rigid_supports(
    loads: Sequence[SolvedLoad], pairs: Mapping[str, ReducedPair], trains: Mapping[str, GearTrain], angles: int,
    executor: Executor | None = None,
) -> tuple[SolvedLoad, ...]:  # fmt: skip
    """Return solved loads with root stress, and with the same pairs and sets on rigid supports.

    Parameters
    ----------
    pairs : mapping of str to ReducedPair
        Of the meshes, by name.
    trains : mapping of str to GearTrain
        Of the planetary sets, by name.
    angles : int
        Of a pitch, in the sweeps.
    executor : concurrent.futures.Executor, optional
        Of threads: shares out the meshes.
    """

    def compared(number: int) -> list[tuple[SolvedMesh, RigidMesh]]:
        """Return a mesh under each load, with the one on rigid supports."""
        meshes = [load.meshes[number] for load in loads]
        reduced = pairs[meshes[0].meshing.settings.name]
        conditions = [condition_of(reduced, mesh.torque) for mesh in meshes]
        sweep = sweep_reduced_pair(reduced, swept_angles(reduced, angles), conditions, recorded=True)
        stress, both = _largest(reduced, conditions, sweep), []
        for row, (mesh, condition) in enumerate(zip(meshes, conditions, strict=True)):
            (own,) = _largest(reduced, [condition], mesh.sweep)
            both.append((mesh._replace(root_stress=own), RigidMesh(sweep, row, stress[row])))
        return both

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


def _largest(reduced: ReducedPair, conditions: Sequence[Condition], sweep: SteSweep) -> list[RootStresses]:
    """Largest root stress of pinion and wheel under each condition, MPa; none where the basis holds no root stress."""
    assert sweep.states is not None
    some = slice(None, None, max(len(sweep.phi_rad) // (STRESS_ANGLES * sweep.pitches), 1))
    stress = root_stress_of(reduced, sweep.phi_rad[some], conditions, sweep.states.loads.at_angles(some))
    return [None] * len(conditions) if stress is None else [_of_both(stress, i) for i in range(len(conditions))]


def _of_both(stress: RootStress, torque: int) -> RootStresses:
    pinion, wheel = (stress.largest(torque, gear) for gear in range(2))
    return None if pinion is None or wheel is None else (pinion.max_principal_MPa, wheel.max_principal_MPa)
