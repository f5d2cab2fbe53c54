"""The offline stage as a job: full solves over angles, saved one by one, resumed, gathered into a basis file."""

from __future__ import annotations

import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

from pmor.case import Case, basis_key
from pmor.errors import ConvergenceError
from pmor.pair.model import ElasticModel
from pmor.progress import Progress
from pmor.reduction.snapshots import Snapshots
from pmor.storage.atomic import ensure_folder, refuse_existing, remove_abandoned, remove_folder
from pmor.storage.basis_file import write_basis
from pmor.storage.lock import only_writer_of_file
from pmor.storage.snapshot_file import read_snapshots, write_snapshots
from pmor_offline.adaptive import ErrorEstimate, greedy_snapshots
from pmor_offline.gather import make_basis
from pmor_offline.sampling import TrainingPosition, grid_positions, sobol_positions
from pmor_offline.snapshots import solve_snapshots


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
    started: float | None = None, estimate: ErrorEstimate | None = None,
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
    estimate : callable, optional
        What a greedy sampling asks for errors (`pmor_offline.adaptive`).

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
        return _run(case, model, path, jobs, resume, overwrite, started, estimate)


def _run(
    case: Case, model: ElasticModel, path: Path, jobs: int, resume: bool, overwrite: bool, started: float,
    estimate: ErrorEstimate | None,
) -> OfflineSummary:  # fmt: skip
    remove_abandoned(path.parent, path.name)
    parts = path.with_name(path.name + ".parts")
    if parts.exists() and not resume:
        remove_folder(parts)
    remove_abandoned(ensure_folder(parts))
    if not case.reduction.trained:
        snapshots, resumed = list[Snapshots](), 0
    elif case.offline.sampling == "greedy":
        snapshots, resumed = _sample_greedily(case, model, parts, estimate)
    else:
        snapshots, resumed = _solve_positions(case, model, parts, jobs)
    failed = tuple(failure for s in snapshots for failure in s.failures)
    if failed and len(failed) == sum(len(s.converged) for s in snapshots):
        raise ConvergenceError(f"no full solve converged, first: {failed[0]}", [])
    basis, force = make_basis(case, model, snapshots, time.perf_counter() - started)
    write_basis(path, basis, force, overwrite)
    remove_folder(parts)
    return OfflineSummary(len(snapshots) - resumed, resumed, failed, time.perf_counter() - started)


def _solve_positions(case: Case, model: ElasticModel, parts: Path, jobs: int) -> tuple[list[Snapshots], int]:
    """Solve all positions of a sampling that is known beforehand; return them and how many were there already."""
    pair, offline = model.mesh.meshed.pair, case.offline
    if offline.sampling == "grid":
        positions = grid_positions(offline, pair)
    else:
        positions = sobol_positions(offline, pair, offline.solves)
    key = basis_key(case)
    files = [_part(parts, i) for i in range(len(positions))]
    # A solve that failed is tried again: the program may have learnt to do it.
    kept = ((i, read_snapshots(file, key)) for i, file in enumerate(files))
    found = {i: s for i, s in kept if s is not None and s.converged.all()}
    resumed = len(found)
    with Progress(len(positions), "full FE", done=resumed) as progress:
        missing = [i for i in range(len(positions)) if i not in found]
        for i, snapshots in _solve_all(model, positions, missing, jobs):
            write_snapshots(files[i], snapshots, key)
            found[i] = snapshots
            progress.advance()
    return [found[i] for i in range(len(positions))], resumed


def _solve_all(
    model: ElasticModel, positions: tuple[TrainingPosition, ...], missing: list[int], jobs: int
) -> Iterator[tuple[int, Snapshots]]:
    """Solve in threads: compiled kernels and linear algebra run outside Python's lock, and nothing is copied."""
    with ThreadPoolExecutor(max_workers=jobs) as pool:
        futures = {pool.submit(solve_snapshots, model, positions[i]): i for i in missing}
        try:
            for future in as_completed(futures):
                yield futures[future], future.result()
        finally:
            pool.shutdown(cancel_futures=True)


def _sample_greedily(
    case: Case, model: ElasticModel, parts: Path, estimate: ErrorEstimate | None
) -> tuple[list[Snapshots], int]:
    """Let the error estimate choose; each solution is kept as soon as it is there, in order."""
    if estimate is None:
        raise TypeError("a greedy sampling needs something that estimates errors")
    key, known = basis_key(case), list[Snapshots]()
    while (snapshots := read_snapshots(_part(parts, len(known)), key)) is not None:
        known.append(snapshots)
    resumed = len(known)
    with Progress(case.offline.solves, "full FE", done=resumed) as progress:
        for snapshots in greedy_snapshots(case, model, estimate, known):
            write_snapshots(_part(parts, len(known)), snapshots, key)
            known.append(snapshots)
            progress.advance()
    return known, resumed


def _part(parts: Path, number: int) -> Path:
    return parts / f"angle_{number:05d}.h5"
