"""Training: from a case and its full FE to a basis, in memory. Files and progress are left to the caller."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial

from pmor.case import Case
from pmor.core.arrays import FloatArray
from pmor.core.errors import ConvergenceError
from pmor.core.threads import in_order, one_thread
from pmor.pair.model import ElasticModel, MeshModel, elastic_model, mesh_model
from pmor.reduction.basis import Basis, Snapshots
from pmor.storage.gear_store import KeptGear, not_kept
from pmor_offline.adaptive import ErrorEstimate, greedy_snapshots
from pmor_offline.gather import make_basis, no_forces
from pmor_offline.gears import line_basis
from pmor_offline.sampling import on_flanks_of, planned_positions
from pmor_offline.snapshots import solve_snapshots

# Takes the number of a position in the sampling, and its solution.
Keep = Callable[[int, Snapshots], None]


@dataclass(frozen=True)
class Trained:
    """Result of a training.

    Parameters
    ----------
    force : ndarray, shape (M, T, 2, f)
        Nodal forces of full FE, N (`pmor_offline.gather.make_basis`).
    failures : tuple of str
        Angle and torque of each full solve that did not converge.
    """

    basis: Basis
    force: FloatArray
    failures: tuple[str, ...]


@one_thread()
def train(
    case: Case, model: ElasticModel | None = None, estimate: ErrorEstimate | None = None,
    executor: Executor | None = None, progress: Callable[[], None] = lambda: None,
    known: Mapping[int, Snapshots] | None = None, keep: Keep = lambda number, snapshots: None,
    started: float | None = None, mesh: MeshModel | None = None, kept: KeptGear = not_kept,
) -> Trained:  # fmt: skip
    """Solve full FE over the training set of a case and make a basis of it; line loads take the gears alone.

    Parameters
    ----------
    model : ElasticModel, optional
        Line loads do without.
    estimate : callable, optional
        Error estimate for a greedy sampling (`pmor_offline.adaptive`).
    executor : concurrent.futures.Executor, optional
        Solves several positions, and estimates several errors, at a time. The basis does not depend on it.
    progress : callable
        Called after each position that was solved, for progress.
    known : mapping of int to Snapshots, optional
        Positions that are solved already, by their number in the sampling; of a greedy one the unbroken beginning.
    keep : callable
        Given each solution as soon as it is there, with its number.
    started : float, optional
        ``time.perf_counter()`` at the start of the offline stage, when meshing and finite elements shall count.
    mesh, kept
        As of `pmor_offline.gears.line_basis`, for line loads.

    Raises
    ------
    ConvergenceError
        When no full solve converged at all.
    """
    started = time.perf_counter() if started is None else started
    if case.reduction.shapes == "line_loads":
        mesh = mesh or (model.mesh if model else mesh_model(case))
        return Trained(line_basis(case, kept, mesh, model, started), no_forces(mesh), ())
    model = model or elastic_model(case, mesh or mesh_model(case))
    if not case.reduction.trained:
        snapshots: list[Snapshots] = []
    elif case.offline.sampling == "greedy":
        snapshots = _chosen(case, model, estimate, executor, progress, known or {}, keep)
    else:
        snapshots = _planned(case, model, executor, progress, known or {}, keep)
    failures = tuple(failure for s in snapshots for failure in s.failures)
    if failures and len(failures) == sum(len(s.converged) for s in snapshots):
        raise ConvergenceError(f"no full solve converged, first: {failures[0]}", [])
    basis, force = make_basis(case, model, snapshots, time.perf_counter() - started)
    return Trained(basis, force, failures)


def _planned(
    case: Case, model: ElasticModel, executor: Executor | None, progress: Callable[[], None],
    known: Mapping[int, Snapshots], keep: Keep,
) -> list[Snapshots]:  # fmt: skip
    """Solve all positions of a sampling that is known beforehand."""
    positions = on_flanks_of(case, planned_positions(case.offline, model.mesh.meshed.pair))
    missing = [i for i in range(len(positions)) if i not in known]
    found = dict(known)
    solved = in_order(partial(solve_snapshots, model), [positions[i] for i in missing], executor)
    for i, snapshots in zip(missing, solved, strict=True):
        keep(i, snapshots)
        found[i] = snapshots
        progress()
    return [found[i] for i in range(len(positions))]


def _chosen(
    case: Case, model: ElasticModel, estimate: ErrorEstimate | None, executor: Executor | None,
    progress: Callable[[], None], known: Mapping[int, Snapshots], keep: Keep,
) -> list[Snapshots]:  # fmt: skip
    """Let the error estimate choose; each solution is kept as soon as it is there, in order."""
    if estimate is None:
        raise TypeError("a greedy sampling needs something that estimates errors")
    found: list[Snapshots] = []
    while len(found) in known:
        found.append(known[len(found)])
    for snapshots in greedy_snapshots(case, model, estimate, found, executor):
        keep(len(found), snapshots)
        found.append(snapshots)
        progress()
    return found
