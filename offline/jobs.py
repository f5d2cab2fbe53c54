"""The offline stage as a job: full solves over angles, saved one by one, resumed, gathered into a basis file."""

from __future__ import annotations

import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from offline.sampling import roll_position_grid, training_angles
from offline.snapshots import solve_snapshots
from pmor.case import Case, basis_key
from pmor.errors import ConvergenceError
from pmor.gear.conventions import FloatArray
from pmor.model import ElasticModel
from pmor.progress import Progress
from pmor.reduction.build import build_shapes
from pmor.reduction.half_width import mirrors_at_mid_width, symmetric_part
from pmor.storage.atomic import ensure_folder, refuse_existing, remove_abandoned, remove_folder
from pmor.storage.basis_file import Basis, Training, write_basis
from pmor.storage.lock import only_writer_of_file
from pmor.storage.snapshot_file import Snapshots, read_snapshots, write_snapshots


@dataclass(frozen=True)
class OfflineSummary:
    """What the offline stage did.

    Parameters
    ----------
    solved, resumed : int
        Angles solved now, and taken from an interrupted run.
    failed : tuple of str
        Angle and torque of each full solve that did not converge.
    seconds : float
        Wall time of this run.
    """

    solved: int
    resumed: int
    failed: tuple[str, ...]
    seconds: float


def run_offline(
    case: Case, model: ElasticModel, path: Path, jobs: int = 1, resume: bool = False, overwrite: bool = False,
    started: float | None = None,
) -> OfflineSummary:  # fmt: skip
    """Solve full FE over the training set and write the basis.

    Parameters
    ----------
    case : Case
    model : ElasticModel
    path : Path
        Of the basis file. Snapshots are kept beside it, in a folder of the same name with ``.parts``, until it is
        written.
    jobs : int
        Angles solved at a time.
    resume : bool
        Take over the snapshots that an interrupted run has left.
    overwrite : bool
        Replace an existing basis file.
    started : float, optional
        ``time.perf_counter()`` at the start of the offline stage, when meshing and finite elements shall count.

    Returns
    -------
    OfflineSummary

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
        return _run(case, model, path, jobs, resume, overwrite, started)


def _run(
    case: Case, model: ElasticModel, path: Path, jobs: int, resume: bool, overwrite: bool, started: float
) -> OfflineSummary:
    remove_abandoned(path.parent, path.name)
    parts = path.with_name(path.name + ".parts")
    if parts.exists() and not resume:
        remove_folder(parts)
    remove_abandoned(ensure_folder(parts))
    key = basis_key(case)
    angles = training_angles(model.mesh.meshed.pair, case.offline.angles_per_pitch)
    angles = angles if case.reduction.trained else angles[:0]
    torques = tuple(1e3 * t for t in case.offline.torques_Nm)
    files = [parts / f"angle_{i:05d}.h5" for i in range(len(angles))]
    # A solve that failed is tried again: the program may have learnt to do it.
    kept = ((i, read_snapshots(file, key)) for i, file in enumerate(files))
    found = {i: s for i, s in kept if s is not None and s.converged.all()}
    resumed = len(found)
    with Progress(len(angles), "full FE") as progress:
        progress.advance(resumed)
        missing = [i for i in range(len(angles)) if i not in found]
        for i, snapshots in _solve_all(model, angles, torques, missing, jobs):
            write_snapshots(files[i], snapshots, key)
            found[i] = snapshots
            progress.advance()
    ordered = [found[i] for i in range(len(angles))]
    failed = _failures(ordered, case)
    if failed and len(failed) == len(angles) * len(torques):
        raise ConvergenceError(f"no full solve converged, first: {failed[0]}", [])
    _gather(case, model, path, ordered, angles, torques, started, overwrite)
    remove_folder(parts)
    return OfflineSummary(len(missing), resumed, failed, time.perf_counter() - started)


def _solve_all(
    model: ElasticModel, angles: FloatArray, torques: tuple[float, ...], missing: list[int], jobs: int
) -> Iterator[tuple[int, Snapshots]]:
    """Solve in threads: compiled kernels and linear algebra run outside Python's lock, and nothing is copied."""
    with ThreadPoolExecutor(max_workers=jobs) as pool:
        futures = {pool.submit(solve_snapshots, model, float(angles[i]), torques): i for i in missing}
        try:
            for future in as_completed(futures):
                yield futures[future], future.result()
        finally:
            pool.shutdown(cancel_futures=True)


def _failures(snapshots: list[Snapshots], case: Case) -> tuple[str, ...]:
    return tuple(
        f"phi = {s.phi:.6g} rad, torque = {torque:g} N m"
        for s in snapshots
        for torque, ok in zip(case.offline.torques_Nm, s.converged, strict=True)
        if not ok
    )


def _gather(
    case: Case, model: ElasticModel, path: Path, snapshots: list[Snapshots], angles: FloatArray,
    torques: tuple[float, ...], started: float, overwrite: bool,
) -> None:  # fmt: skip
    meshed = model.mesh.meshed
    grid = roll_position_grid(meshed, case.offline.angles_per_pitch, max(torques))
    step = grid[1] - grid[0]
    places = len(grid) if snapshots else 0
    force = np.zeros((places, len(torques), 2, model.pinion.compliance.shape[1]))
    for s in snapshots:
        for p, index in enumerate(s.pair_index):
            place = round((s.phi + index * meshed.pair.pitch - grid[0]) / step)
            if 0 <= place < len(grid):
                force[place] = s.force[:, p]
    mesh = model.mesh
    flanks = mesh.pinion.flank_nodes, mesh.wheel.flank_nodes
    columns = flanks[0].shape[1]
    half = mirrors_at_mid_width(case)
    if half:
        force = symmetric_part(force, columns)
    shapes = build_shapes(case, (model.pinion, model.wheel), grid, force, flanks)
    if half:
        shapes = shapes.lower_half(columns)
        flanks = flanks[0][:, : columns // 2 + 1], flanks[1][:, : columns // 2 + 1]
    training = Training(
        phi=angles,
        torque=np.array(torques),
        ste_um=np.array([s.ste_um for s in snapshots], dtype=float).reshape(-1, len(torques)).T,
        converged=np.array([s.converged for s in snapshots], dtype=bool).reshape(-1, len(torques)).T,
        seconds=time.perf_counter() - started,
    )
    basis = Basis(
        case=case,
        flank_nodes=flanks,
        flank_roll_angle=(mesh.pinion.flank_roll_angle, mesh.wheel.flank_roll_angle),
        shapes=shapes,
        training=training,
    )
    write_basis(path, basis, force, overwrite)
