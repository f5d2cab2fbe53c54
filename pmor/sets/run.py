"""The front door of sets: a set file in, its result out."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np

from pmor.case.models import coarser
from pmor.core.arrays import FloatArray
from pmor.core.errors import Stopped
from pmor.core.progress import quietly, stage
from pmor.line.several import GearTrain
from pmor.pair.conditions import assembly_of
from pmor.pair.samples import lost_samples
from pmor.sets.loader import SetFile
from pmor.sets.lost import lost_positions
from pmor.sets.model import build_train
from pmor.sets.output import FILES, PIN_FILES, REXS_FILES, SAMPLE_FILES
from pmor.sets.result import SetResult
from pmor.sets.solution import solve_set, with_mesh_error
from pmor.sets.tolerances import solve_samples
from pmor.storage.gear_store import KeptGear, kept_beside, not_kept
from pmor.storage.results_folder import results_folder


def run(
    file: SetFile, *, folder: Path | str | None = None, overwrite: bool = False, executor: Executor | None = None,
    progress: Callable[[int], None] | None = None,
) -> SetResult:  # fmt: skip
    """Solve a set over a mesh cycle under all its torques; those with positions not converged are in `failures`.

    Parameters
    ----------
    folder, overwrite, executor, progress
        As in `pmor.app.capabilities`; the executor is one of threads. Gears are kept beside the folder: other loads,
        errors, supports and modifications solve none.

    Raises
    ------
    CaseError, GeometryError, MeshError, OutputError
    """
    names = (*FILES, *SAMPLE_FILES, *PIN_FILES, *REXS_FILES)
    with nullcontext() if folder is None else results_folder(Path(folder), names, (), overwrite, file.inputs):
        kept = kept_beside(None if folder is None else Path(folder), overwrite)
        return solved(file, kept, executor, progress or quietly)


def solved(
    file: SetFile, kept: KeptGear, executor: Executor | None = None, step: Callable[[int], None] = quietly
) -> SetResult:
    """Solve a set as `run`, its gears from where they are kept."""
    train = train_of(file, kept, executor)
    step(1)
    found = solve_set(file.plan, train, first_torques_Nm(file), file.angles_per_pitch, file.pitches, executor)
    try:
        found = with_mesh_error(found, file.cases.values(), coarse_train_of(file, kept, executor))
        samples = solve_samples(file, found, executor)
    except KeyboardInterrupt:
        left = ("interrupted before the error bar of the mesh and the tolerances were solved",)
        raise Stopped(SetResult(file, found, None, left)) from None
    step(1)
    failures = tuple(lost_positions(found, [f"{amount:g} N m" for amount in file.torques_Nm]))
    if samples is not None:
        failures += lost_samples(samples, file.torques_Nm)
    return SetResult(file, found, samples, failures)


def train_of(file: SetFile, kept: KeptGear = not_kept, executor: Executor | None = None) -> GearTrain:
    """Solve the finite elements of a set, each member's once, and put its train together.

    Parameters
    ----------
    kept : callable
        Where gears are kept; by default nowhere.
    executor : concurrent.futures.Executor, optional
        Of threads.
    """
    plan = file.plan
    with stage("finite elements of all members"):
        return build_train(file.cases, plan.bodies, plan.meshes, plan.free, plan.compliance, kept, executor)


def train_of_variants(file: SetFile, executor: Executor | None = None) -> GearTrain:
    """Solve the finite elements of a set, and put its train together with no modifications but those of teeth."""
    meshes = tuple(
        replace(mesh, assembly=(mesh.assembly or assembly_of(file.cases[mesh.case])).of_teeth)
        for mesh in file.plan.meshes
    )
    return train_of(replace(file, plan=replace(file.plan, meshes=meshes)), executor=executor)


def coarse_train_of(
    file: SetFile, kept: KeptGear = not_kept, executor: Executor | None = None
) -> GearTrain | None:
    """Return the train of a set on half as many elements; None where no error bar of the mesh is asked for."""
    halves = {name: half for name, case in file.cases.items() if (half := coarser(case)) is not None}
    if len(halves) < len(file.cases):
        return None
    return train_of(replace(file, cases=halves), kept, executor)


def first_torques_Nm(file: SetFile) -> FloatArray:
    """Return the torques on the first gear that are solved, (D,)."""
    return np.array(file.torques_Nm) * file.plan.torque_Nm / file.plan.nominal_Nm
