"""The front door of motion: a case in, its result out."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from pathlib import Path

from pmor.case import Case
from pmor.core.threads import one_thread
from pmor.dynamics.output import FILES
from pmor.dynamics.result import DynamicsResult
from pmor.dynamics.solution import reduced_of, refuse_other_models, run_dynamics
from pmor.work.results import pieces_folder
from pmor_online.model import ReducedPair


@one_thread()
def run(
    settings: Case, *, reduced: ReducedPair | None = None, folder: Path | str | None = None, overwrite: bool = False,
    executor: Executor | None = None, progress: Callable[[int], None] | None = None,
) -> DynamicsResult:  # fmt: skip
    """Find the motion of the pair of a case over its speed, under each torque; torques without one are in `failures`.

    Parameters
    ----------
    reduced : ReducedPair, optional
        Reduced model of the pair, by line loads; by default it is made.
    folder, overwrite, executor, progress
        As in `pmor.app.capabilities`; the executor is one of processes.

    Raises
    ------
    CaseError
        Where the case has no line loads, or a torque is beyond the range of its contact.
    ConvergenceError
        Where no torque has a force law.
    OutputError
    """
    refuse_other_models(settings)
    reduced = reduced or reduced_of(settings)
    with pieces_folder(folder, FILES, overwrite=overwrite) as pieces:
        return DynamicsResult(run_dynamics(settings, reduced, pieces, executor=executor, progress=progress))
