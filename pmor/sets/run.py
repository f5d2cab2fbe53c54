"""The front door of sets: a set file in, its result out."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from pathlib import Path

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.progress import quietly, stage
from pmor.line.several import GearTrain
from pmor.sets.loader import SetFile
from pmor.sets.lost import lost_positions
from pmor.sets.model import build_train
from pmor.sets.output import FILES, PIN_FILES, REXS_FILES, SAMPLE_FILES
from pmor.sets.result import SetResult
from pmor.sets.solution import solve_set
from pmor.sets.tolerances import lost_samples, solve_samples
from pmor.storage.compliance_file import KeptGear
from pmor.storage.results_folder import results_folder
from pmor.work.line_gear import kept_in_file, not_kept
from pmor.work.pieces import file_name

Kept = Callable[[str], KeptGear]


def run(
    file: SetFile, *, folder: Path | str | None = None, overwrite: bool = False, executor: Executor | None = None,
    progress: Callable[[int], None] | None = None,
) -> SetResult:  # fmt: skip
    """Solve a set over a mesh cycle under all its torques; those with positions not converged are in `failures`.

    Parameters
    ----------
    folder, overwrite, executor, progress
        As in `pmor.app.capabilities`; the executor is one of threads. The folder keeps the finite elements of each
        member: other loads, errors, supports and modifications solve none.

    Raises
    ------
    CaseError, GeometryError, MeshError, OutputError
    """
    with _held(file, folder, overwrite):
        return solved(file, kept_in_folder(folder, overwrite), executor, progress or quietly)


def solved(
    file: SetFile, kept: Kept, executor: Executor | None = None, step: Callable[[int], None] = quietly
) -> SetResult:
    """Solve a set as `run`, its members from where they are kept as in `train_of`."""
    train = train_of(file, kept, executor)
    step(1)
    found = solve_set(file.plan, train, first_torques_Nm(file), file.angles_per_pitch, file.pitches, executor)
    samples = solve_samples(file, found, executor)
    step(1)
    failures = tuple(lost_positions(found, [f"{amount:g} N m" for amount in file.torques_Nm]))
    if samples is not None:
        failures += lost_samples(samples, file.torques_Nm)
    return SetResult(file, found, samples, failures)


def train_of(file: SetFile, kept: Kept = lambda member: not_kept, executor: Executor | None = None) -> GearTrain:
    """Solve the finite elements of a set, each member's once, and put its train together.

    Parameters
    ----------
    kept : callable
        Gives where a member is kept; by default nowhere.
    executor : concurrent.futures.Executor, optional
        Of threads.
    """
    plan = file.plan
    with stage("finite elements of all members"):
        return build_train(file.cases, plan.bodies, plan.meshes, plan.free, plan.compliance, kept, executor)


def first_torques_Nm(file: SetFile) -> FloatArray:
    """Return the torques on the first gear that are solved, (D,)."""
    return np.array(file.torques_Nm) * file.plan.torque_Nm / file.plan.nominal_Nm


def _held(file: SetFile, folder: Path | str | None, overwrite: bool) -> AbstractContextManager[Path | None]:
    """Hold the folder of the results, where there is one."""
    if folder is None:
        return nullcontext()
    files = (*FILES, *SAMPLE_FILES, *PIN_FILES, *REXS_FILES, *(gear_files(file) if overwrite else ()))
    return results_folder(Path(folder), files, (), overwrite, file.inputs)


def kept_in_folder(folder: Path | str | None, anew: bool = False, prefix: str = "") -> Kept:
    """Return where members are kept, of `train_of`: each in a file of a folder.

    Parameters
    ----------
    folder : path or None
        None keeps nothing.
    anew : bool
        Solve them whether they are kept or not.
    prefix : str
        Of the names of the members in the names of the files.
    """
    return partial(_kept, folder, anew, prefix)


def gear_files(file: SetFile, prefix: str = "") -> tuple[str, ...]:
    """Return the names of the files that keep the finite elements of the members."""
    return tuple(_gear_file(prefix + member) for member in dict.fromkeys(body.member for body in file.plan.bodies))


def _gear_file(member: str) -> str:
    return f"gear_{file_name(member)}.h5"


def _kept(folder: Path | str | None, anew: bool, prefix: str, member: str) -> KeptGear:
    return not_kept if folder is None else kept_in_file(Path(folder) / _gear_file(prefix + member), anew)
