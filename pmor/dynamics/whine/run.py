"""The front door of machines in motion: a gearbox or set file in, its response over the speed out."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

from pmor.case.capability import refuse_beyond
from pmor.case.values import did_you_mean
from pmor.core.arrays import FloatArray
from pmor.core.errors import CaseError, ConvergenceError
from pmor.core.progress import Progress, quietly, stage
from pmor.core.threads import in_order, one_thread
from pmor.dynamics.whine.output import FILES, MovingFile
from pmor.dynamics.whine.parting import parting
from pmor.dynamics.whine.respond import respond, respond_set, torque_names
from pmor.dynamics.whine.response import LoadResponse, turning
from pmor.dynamics.whine.result import MotionResult
from pmor.dynamics.whine.ringing import KeptModes
from pmor.machine.coupled import solve_load
from pmor.machine.loader import GearboxFile
from pmor.machine.run import meshes_and_trains
from pmor.sets.loader import SetFile
from pmor.sets.run import first_torques_Nm, train_of
from pmor.sets.solution import solve_set
from pmor.storage.gear_store import KeptGear, kept_beside
from pmor.storage.results_folder import results_folder
from pmor_online.model import keeping_sections

# Angles of a pitch over which the mean transmission error of a mesh is found.
ANGLES = 32
# Motion about a load by its name.
About = Callable[[str], LoadResponse]


@one_thread()
def run(
    settings: MovingFile, *, folder: Path | str | None = None, overwrite: bool = False,
    executor: Executor | None = None, progress: Callable[[int], None] | None = None,
) -> MotionResult:  # fmt: skip
    """Find the small motion of a gearbox or a planetary set over its speed, about each of its loads.

    Parameters
    ----------
    folder, overwrite, progress
        As in `pmor.app.capabilities`. Gears are kept beside the folder, and in it the numbers of the loads so far.
    executor
        Of threads: shares out the loads.

    Raises
    ------
    CaseError
        Where no load has a speed and no range is given, or motion of such a machine is not found here.
    OutputError
    """
    refuse_beyond(settings, "dynamics")
    speeds, step, loads = speeds_of(settings), progress or quietly, loads_of(settings)
    with nullcontext() if folder is None else results_folder(Path(folder), FILES, (), overwrite, settings.inputs):
        kept = kept_beside(None if folder is None else Path(folder), overwrite)
        if isinstance(settings, SetFile):
            about = _of_set(settings, kept, speeds)
        else:
            about = about_loads(settings, kept, speeds)

    def found(name: str) -> LoadResponse | str:
        try:
            return about(name)
        except ConvergenceError as error:
            return f"load {name}: {error}"

    every = list[LoadResponse | str]()
    with stage("motion about the loads"), Progress(len(loads), "motion, loads", further=step) as bar:
        for one in in_order(found, loads, executor, bar.step):
            every.append(one)
            result = MotionResult(
                settings, tuple(one for one in every if not isinstance(one, str)),
                tuple(sentence for one in every for sentence in ((one,) if isinstance(one, str) else one.lost)),
            )  # fmt: skip
            if folder is not None and result.loads and len(every) < len(loads):
                result.write_numbers(folder, overwrite=overwrite)
    return result


@one_thread()
def about_first_load(file: GearboxFile) -> LoadResponse:
    """Return the motion of a gearbox about its first load at the highest speed, for what is made of its model.

    Raises as `run`, and ConvergenceError.
    """
    refuse_beyond(file, "dynamics")
    linear = replace(file.sections, dynamics=replace(file.sections.dynamics, motion="linear"))
    own = replace(file, model=replace(file.model, sections=linear))
    return about_loads(own, kept_beside(None), speeds_of(file)[-1:])(loads_of(file)[0])


def about_loads(file: GearboxFile, kept: KeptGear, speeds: FloatArray) -> About:
    """Return what finds the motion of a gearbox about a load by its name."""
    trained, trains = meshes_and_trains(file, kept)
    loads, modes = {load.name: load for load in file.sections.loads}, KeptModes()

    def about(name: str) -> LoadResponse:
        pairs = {name: keeping_sections(reduced) for name, reduced in trained.items()}
        solved = solve_load(file.model, loads[name], pairs, ANGLES, trains=trains)
        response = respond(file.model, solved, trained, file.sections.dynamics, speeds, modes)
        nonlinear = file.sections.dynamics.motion == "nonlinear"
        return replace(response, parting=parting(response, file)) if nonlinear else response

    return about


def _of_set(file: SetFile, kept: KeptGear, speeds: FloatArray) -> About:
    """Return what finds the motion of a set about a torque by its name."""
    plan, names = file.plan, torque_names(file)
    solution = solve_set(plan, train_of(file, kept), first_torques_Nm(file), file.angles_per_pitch, plan.cycle)

    def about(name: str) -> LoadResponse:
        return respond_set(file, solution, names.index(name), file.sections.dynamics, speeds)

    return about


def loads_of(file: MovingFile) -> list[str]:
    """Return the names of the loads about which a file asks for motion.

    Raises
    ------
    CaseError
        Of one that is not there.
    """
    there = torque_names(file) if isinstance(file, SetFile) else [load.name for load in file.sections.loads]
    asked = list(file.sections.dynamics.loads)
    for name in asked:
        if name not in there:
            raise CaseError(f'{file.name}: [dynamics] loads: "{name}" is no load: {did_you_mean(name, there)}')
    return asked or there


def speeds_of(file: MovingFile) -> FloatArray:
    """Return the speeds that a file asks for, rpm."""
    speeds = list[float | None]()
    if isinstance(file, SetFile):
        speeds.append(file.sections.load.speed_rpm if file.sections.load else None)
    else:
        speeds += [load.speed_rpm for load in file.sections.loads]
    found = file.sections.dynamics.over(speeds)
    if found is None:
        raise CaseError(
            f"{file.name}: [dynamics] speed_range_rpm: no load has a speed: give the lowest and the highest speed of "
            f"{turning(isinstance(file, SetFile))}, as in [100.0, 3000.0]"
        )
    return found
