"""Training as a job: on the screen, in files that an interrupted run leaves for the next, one writer at a time."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path

from pmor.case import Case, basis_key
from pmor.core.progress import Progress, Steps, quietly, stage
from pmor.pair.conditions import on_trained_flanks
from pmor.pair.model import ElasticModel, MeshModel, elastic_model, mesh_model
from pmor.reduction.basis import Basis, Snapshots
from pmor.storage.atomic import ensure_folder, refuse_existing, remove_abandoned
from pmor.storage.basis_file import write_basis
from pmor.storage.gear_store import KeptGear, not_kept
from pmor.storage.lock import only_writer_of_file
from pmor.storage.manifest import listed, origin_in
from pmor.storage.results_folder import remove_working_folder, working_folder
from pmor.storage.snapshot_file import read_snapshots, write_snapshots
from pmor.work.live import whole_width_beside
from pmor_offline.sampling import TrainingPosition, most_positions, planned_positions
from pmor_offline.train import Trained, train
from pmor_online.errors import estimate_errors

BODIES = "finite elements of both gears"


@dataclass(frozen=True)
class OfflineSummary:
    """Summary of the offline stage.

    Parameters
    ----------
    solved, resumed : int
        Angles solved now, and taken from an interrupted run.
    failed : tuple of str
        Angle and torque of each full solve that did not converge.
    seconds : float
        Wall time of this run.
    basis : Basis
        As it is in the file.
    """

    solved: int
    resumed: int
    failed: tuple[str, ...]
    seconds: float
    basis: Basis


def run_offline(
    case: Case, model: ElasticModel | None, path: Path, *, executor: Executor | None = None, resume: bool = False,
    overwrite: bool = False, started: float | None = None, progress: Steps = quietly,
    asked: Callable[[Basis], None] = lambda basis: None, mesh: MeshModel | None = None, kept: KeptGear = not_kept,
) -> OfflineSummary:  # fmt: skip
    """Solve full FE over the training set and write the basis.

    Parameters
    ----------
    model : ElasticModel or None
        None: it is solved for where its forces are trained on; line loads take their gears from where they are kept.
    path : Path
        Of the basis file. Snapshots are kept beside it, in a folder of the same name with ``.parts``, until it is
        written.
    executor : concurrent.futures.Executor, optional
        Of threads: shares out full solutions and error estimates.
    resume : bool
        Take over the snapshots that an interrupted run has left.
    overwrite : bool
        Replace an existing basis file.
    started : float, optional
        ``time.perf_counter()`` at the start of the offline stage, when meshing and finite elements shall count.
    progress : callable
        Called with the number of positions solved.
    asked : callable
        Given the basis as soon as it can answer, before that of the whole width is added and the file is written.
    mesh, kept
        As of `pmor_offline.gears.line_basis`.

    Raises
    ------
    OutputError
        When the file exists or cannot be written, or another process is writing it.
    ConvergenceError
        When no full solve converged at all.
    """
    started = time.perf_counter() if started is None else started
    ensure_folder(path.parent)
    with only_writer_of_file(path):
        refuse_existing(path, overwrite)
        remove_abandoned(path.parent, path.name)
        parts = working_folder(parts_of(path), anew=not resume)
        if case.reduction.shapes != "line_loads" and model is None:
            model = solved_bodies(case, mesh or mesh_model(case))
        key, known, solved = basis_key(case), _kept(case, model, parts), list[int]()

        def keep(number: int, snapshots: Snapshots) -> None:
            write_snapshots(_part(parts, number), snapshots, key)
            solved.append(number)

        positions = most_positions(case)
        label = f"{case.contact.scheme}: full FE"
        with whole_width_beside(case, kept) as with_whole:
            with Progress(positions, label, done=len(known), further=progress) if positions else nullcontext() as bar:
                step = bar.step if bar else lambda: None
                trained = train(case, model, estimate_errors, executor, step, known, keep, started, mesh, kept)
            asked(trained.basis)
            basis = with_whole(trained.basis)
        write_basis(path, basis, trained.force, overwrite)
        remove_working_folder(parts)
    return OfflineSummary(len(solved), len(known), trained.failures, time.perf_counter() - started, basis)


def trained_on(
    case: Case, model: ElasticModel | None, executor: Executor | None = None, progress: Steps = quietly,
    mesh: MeshModel | None = None,
) -> Trained:  # fmt: skip
    """Train a case on full FE, without files; parameters as in `run_offline`."""
    if case.reduction.shapes != "line_loads" and model is None:
        model = solved_bodies(case, mesh or mesh_model(case))
    with stage(training_words(case, model is not None)):
        return train(case, model, estimate_errors, executor, lambda: progress(1), mesh=mesh)


def solved_bodies(case: Case, mesh: MeshModel) -> ElasticModel:
    """Solve for the compliance of the flanks of meshed gears, which the log says."""
    with stage(BODIES):
        return elastic_model(case, mesh)


def training_words(case: Case, solved: bool = False) -> str:
    """Say what the training of a case solves, whose gears may be solved already, for its progress."""
    if positions := most_positions(case):
        return f"{case.contact.scheme}: training, full FE at {positions} positions"
    return f"{case.contact.scheme}: compliance of the flanks, error bar of the mesh" if solved else BODIES


def parts_of(path: Path) -> Path:
    """Return the folder where the snapshots for a basis file are kept until it is written."""
    return path.with_name(path.name + ".parts")


def _kept(case: Case, model: ElasticModel | None, parts: Path) -> dict[int, Snapshots]:
    """Read the snapshots of an interrupted run: written by us, of this case, mesh and position."""
    written, greedy, found = listed(parts), case.offline.sampling == "greedy", dict[int, Snapshots]()
    if not written or model is None:
        return found
    planned = () if greedy else planned_positions(case.offline, model.mesh.meshed.pair)
    for number in range(most_positions(case)):
        path = _part(parts, number)
        ours = origin_in(written.get(path.name, {}), path) is not None
        snapshots = read_snapshots(path, basis_key(case)) if ours else None
        fits = snapshots is not None and snapshots.force.shape[3] == model.pinion.compliance.shape[1]
        if snapshots is None or not fits:
            if greedy:
                break  # each was chosen by those before it
            continue
        snapshots = replace(snapshots, conditions=on_trained_flanks(case, snapshots.conditions))
        as_planned = greedy or TrainingPosition(snapshots.phi, snapshots.conditions) == planned[number]
        # A solve that failed is tried again: the program may have learnt to do it.
        if as_planned and (greedy or snapshots.converged.all()):
            found[number] = snapshots
    return found


def _part(parts: Path, number: int) -> Path:
    return parts / f"angle_{number:05d}.h5"
