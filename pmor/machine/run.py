"""The front door of gearboxes: a gearbox file in, its result out."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path

from pmor.core.errors import ConvergenceError
from pmor.core.progress import quietly, stage
from pmor.line.lost import lost_of_pair
from pmor.machine.compared import with_rigid_supports
from pmor.machine.coupled import SolvedLoad, solve_load
from pmor.machine.fit import fit_meshes
from pmor.machine.loader import GearboxFile
from pmor.machine.output import FILES, set_files
from pmor.machine.result import GearboxResult
from pmor.pair.model import elastic_model
from pmor.sets.lost import lost_positions
from pmor.sets.run import gear_files, kept_in_folder, train_of
from pmor.storage.basis_file import read_basis
from pmor.storage.results_folder import results_folder
from pmor.work.cost import meshed_within_memory
from pmor.work.models import valid_basis
from pmor.work.offline import parts_of, run_offline
from pmor_online.model import ReducedPair, keeping_sections, reduced_pair


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
    pairs = {name: keeping_sections(reduced) for name, reduced in trained.items()}
    loads, failures = list[SolvedLoad](), list[str]()
    angles = max((case.online.angles_per_pitch for case in file.cases.values()), default=0)
    for load in file.model.sections.loads:
        try:
            with _timed(seconds, "loads"):
                solved = solve_load(file.model, load, pairs, angles, trains=trains)
        except ConvergenceError as error:
            failures.append(f"load {load.name}: {error}")
        else:
            loads.append(solved)
            failures += lost_of_load(solved)
        step(1)
    with _timed(seconds, "rigid supports, root stress"):
        compared = with_rigid_supports(loads, pairs, trains, angles)
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
