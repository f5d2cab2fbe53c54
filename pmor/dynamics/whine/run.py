"""The front door of a gearbox in motion: a gearbox file in, its response over the speed out."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import nullcontext
from pathlib import Path

import numpy as np

from pmor.case.capability import refuse_beyond
from pmor.core.arrays import FloatArray
from pmor.core.errors import CaseError, ConvergenceError
from pmor.core.progress import quietly, stage
from pmor.core.threads import in_order, one_thread
from pmor.dynamics.whine.output import FILES
from pmor.dynamics.whine.response import LoadResponse, respond
from pmor.dynamics.whine.result import MotionResult
from pmor.machine.coupled import solve_load
from pmor.machine.loader import GearboxFile
from pmor.machine.run import meshes_and_trains
from pmor.machine.settings import LoadCase
from pmor.storage.gear_store import kept_beside
from pmor.storage.results_folder import results_folder
from pmor_online.model import keeping_sections

# Lowest and highest speed over the largest of the loads, where no range is given.
USUAL_RANGE = 0.02, 1.2
# Angles of a pitch over which the mean transmission error of a mesh is found.
ANGLES = 32


@one_thread()
def run(
    settings: GearboxFile, *, folder: Path | str | None = None, overwrite: bool = False,
    executor: Executor | None = None, progress: Callable[[int], None] | None = None,
) -> MotionResult:  # fmt: skip
    """Find the small motion of a gearbox over its speed, about each of its loads.

    Parameters
    ----------
    folder, overwrite, progress
        As in `pmor.app.capabilities`. Gears are kept beside the folder.
    executor
        Of threads: shares out the loads.

    Raises
    ------
    CaseError
        Where no load has a speed and no range is given, or motion of such a machine is not found here.
    OutputError
    """
    speeds, step = speeds_of(settings), progress or quietly
    refuse_beyond(settings, "dynamics")
    with nullcontext() if folder is None else results_folder(Path(folder), FILES, (), overwrite, settings.inputs):
        kept = kept_beside(None if folder is None else Path(folder), overwrite)
        trained, trains = meshes_and_trains(settings, kept)
    def about(load: LoadCase) -> LoadResponse | str:
        pairs = {name: keeping_sections(reduced) for name, reduced in trained.items()}
        try:
            solved = solve_load(settings.model, load, pairs, ANGLES, trains=trains)
            return respond(settings.model, solved, trained, settings.model.sections.dynamics, speeds)
        except ConvergenceError as error:
            return f"load {load.name}: {error}"

    with stage("motion about the loads"):
        found = list(in_order(about, settings.model.sections.loads, executor, lambda: step(1)))
    responses = tuple(one for one in found if not isinstance(one, str))
    return MotionResult(settings, responses, tuple(one for one in found if isinstance(one, str)))


def speeds_of(file: GearboxFile) -> FloatArray:
    """Return the speeds that a gearbox file asks for, rpm."""
    motion, loads = file.model.sections.dynamics, file.model.sections.loads
    largest = max((abs(load.speed_rpm or 0.0) for load in loads), default=0.0)
    if motion.speed_range_rpm is None and not largest:
        raise CaseError(
            f"{file.name}: [dynamics] speed_range_rpm: no load has a speed: give the lowest and the highest speed of "
            "the shaft of the first torque, as in [100.0, 3000.0]"
        )
    low, high = motion.speed_range_rpm or (USUAL_RANGE[0] * largest, USUAL_RANGE[1] * largest)
    return np.linspace(low, high, motion.speeds)
