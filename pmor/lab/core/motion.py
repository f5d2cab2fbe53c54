"""Run times of a gearbox in motion: statics, the linear response over speed and torque, its page."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from pmor.core.threads import in_order, threads
from pmor.dynamics.whine.respond import respond
from pmor.dynamics.whine.response import LoadResponse
from pmor.dynamics.whine.result import MotionResult
from pmor.dynamics.whine.run import ANGLES, speeds_of
from pmor.machine.coupled import SolvedLoad, solve_load
from pmor.machine.loader import GearboxFile
from pmor.machine.run import meshes_and_trains
from pmor.machine.settings import LoadCase
from pmor_online.model import keeping_sections

SPEEDS, HARMONICS = 2000, 6
# Of the torques of the first load.
SHARES = (0.6, 0.7, 0.8, 0.9, 1.0)
REPEATS = 3

Found = TypeVar("Found")


def motion_times(file: GearboxFile, jobs: int) -> dict[str, list[float]]:
    """Return run times, ms, by what was done, with so many threads."""
    sections, first = file.model.sections, file.model.sections.loads[0]
    motion = replace(sections.dynamics, speeds=SPEEDS, harmonics=HARMONICS)
    loads = tuple(_scaled(first, share) for share in SHARES)
    file = replace(file, model=replace(file.model, sections=replace(sections, dynamics=motion, loads=loads)))
    speeds, (trained, trains) = speeds_of(file), meshes_and_trains(file)
    pairs = {name: keeping_sections(reduced) for name, reduced in trained.items()}
    with threads(jobs) as executor, tempfile.TemporaryDirectory() as folder:

        def solved() -> list[SolvedLoad]:
            def about(load: LoadCase) -> SolvedLoad:
                return solve_load(file.model, load, pairs, ANGLES, trains=trains)

            return list(in_order(about, loads, executor))

        at_rest, statics = _timed(solved)

        def moving() -> list[LoadResponse]:
            return list(in_order(lambda one: respond(file.model, one, trained, motion, speeds), at_rest, executor))

        moving()  # compiles
        linear = []
        for _ in range(REPEATS):
            found, ms = _timed(moving)
            linear.append(ms)
        result = MotionResult(file, tuple(found), ())
        _, page = _timed(lambda: result.write(Path(folder) / "out"))
    size = f"{len(found[0].machine.mass)} unknowns, {SPEEDS} speeds, {HARMONICS} harmonics, {len(loads)} torques"
    return {
        f"motion: equilibria of {len(loads)} torques": [statics],
        f"motion: linear, {size}, {jobs} threads": linear,
        "motion: page, pictures, files": [page],
    }


def _scaled(load: LoadCase, share: float) -> LoadCase:
    torques = tuple(
        one if one.torque_Nm == "balance" else replace(one, torque_Nm=share * one.torque_Nm) for one in load.torques
    )
    return replace(load, name=f"{100.0 * share:g} %", torques=torques)


def _timed(work: Callable[[], Found]) -> tuple[Found, float]:
    began = time.perf_counter()
    return work(), 1e3 * (time.perf_counter() - began)
