"""Run times of a gearbox in motion: linear response and page, a curve of flanks that part, a run-up."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.threads import in_order, threads
from pmor.dynamics.continuation import Point
from pmor.dynamics.harmonic_balance import Balance
from pmor.dynamics.integration import integrate, run_through
from pmor.dynamics.response import Response
from pmor.dynamics.response import response as periodic_motion
from pmor.dynamics.whine.nonlinear import PartingMachine
from pmor.dynamics.whine.parting import BELOW, NOTHING, least_forces, machine_of
from pmor.dynamics.whine.respond import respond
from pmor.dynamics.whine.response import RPM, LoadResponse
from pmor.dynamics.whine.result import MotionResult
from pmor.dynamics.whine.run import ANGLES, speeds_of
from pmor.machine.coupled import SolvedLoad, solve_load
from pmor.machine.load_settings import LoadCase
from pmor.machine.loader import GearboxFile
from pmor.machine.run import meshes_and_trains
from pmor_online.model import keeping_sections

SPEEDS, HARMONICS = 2000, 6
# Of the torques of the first load.
SHARES = (0.6, 0.7, 0.8, 0.9, 1.0)
REPEATS = 3
# Damping ratio with which flanks of stiff boxes part, and how far motion is followed around the speed where they do.
DAMPING, AROUND = 5e-4, 0.01
# Of the run-up; of shorter steps cycles that are compared, and steps of a sample.
MODES, CYCLES, FEW_CYCLES, FINE_STEPS = 20, 100_000, 200, 16

Found = TypeVar("Found")


def motion_times(file: GearboxFile, jobs: int) -> dict[str, list[float]]:
    """Return run times, ms, by what was done, with so many threads."""
    sections, first = file.model.sections, file.model.sections.loads[0]
    motion = replace(sections.dynamics, speeds=SPEEDS, harmonics=HARMONICS)
    loads = tuple(_scaled(first, share) for share in SHARES)
    file = replace(file, model=replace(file.model, sections=replace(sections, dynamics=motion, loads=loads)))
    speeds, (trained, trains) = speeds_of(file), meshes_and_trains(file)
    pairs = {name: keeping_sections(reduced) for name, reduced in trained.items()}
    with threads(jobs) as executor:

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
    # Beside threads no picture is drawn by a copy of the process.
    with tempfile.TemporaryDirectory() as folder:
        _, page = _timed(lambda: MotionResult(file, tuple(found), ()).write(Path(folder) / "out"))
    few = 0.5 * float(found[0].modes.frequency_Hz[: MODES + 1][-1])
    ringing = replace(motion, damping_ratio=DAMPING)
    slow = replace(ringing, highest_frequency_Hz=min(few, motion.highest_frequency_Hz))
    size = f"{len(found[0].machine.mass)} unknowns, {SPEEDS} speeds, {HARMONICS} harmonics, {len(loads)} torques"
    return {
        f"motion: equilibria of {len(loads)} torques": [statics],
        f"motion: linear, {size}, {jobs} threads": linear,
        "motion: page, pictures, files": [page],
        **_curve(respond(file.model, at_rest[0], trained, ringing, speeds)),
        **_run_up(respond(file.model, at_rest[0], trained, slow, speeds)),
    }


def _parting(response: LoadResponse) -> tuple[PartingMachine, int, float]:
    """The machine whose mesh with the least force in the linear answer parts, its number, and the speed there, rpm.

    Gyroscopic moments are left out, as motion over time has it.
    """
    least = least_forces(response)
    speed, number = np.unravel_index(least.argmin(), least.shape)
    at_rpm = float(response.speeds_rpm[speed])
    return machine_of(response, [int(number)], [np.inf]), int(number), at_rpm


def _curve(response: LoadResponse) -> dict[str, list[float]]:
    """Return the times of motion over the speed around where flanks part, with its folds and stability."""
    (machine, number, speed), table = _timed(lambda: _parting(response))
    machine = machine.spun(response.receptance, RPM * response.machine.sense * speed)
    rate = RPM * response.machine.mesh_rate(number) * speed

    def follow() -> Response:
        return periodic_motion(machine.oscillator, machine.law, ((1.0 - AROUND) * rate, (1.0 + AROUND) * rate))

    follow()  # compiles
    found, ms = _timed(follow)
    apart = max(_apart(machine, branch.balance, point) for branch in found.branches for point in branch.points)
    points = sum(len(branch.points) for branch in found.branches)
    size = f"{machine.oscillator.size} modes, {found.branches[0].balance.harmonics} harmonics, {points} points"
    told = f"{size}, damping {DAMPING:.2%}, flanks apart for up to {apart:.0%} of a cycle"
    return {"motion: table of a mesh that parts": [table], f"motion: curve of one mesh that parts, {told}": [ms]}


def _apart(machine: PartingMachine, balance: Balance, point: Point) -> float:
    force, _ = machine.law.mesh_forces(balance.phase, np.ascontiguousarray(balance.displacement(point.unknowns)))
    return float((abs(force[0]) <= NOTHING * machine.law.meshes.load[0]).mean())


def _run_up(response: LoadResponse) -> dict[str, list[float]]:
    """Return the time of a run-up at the steps of the program, and by how much shorter steps change its end."""
    machine, number, speed = _parting(response)
    rate = RPM * response.machine.mesh_rate(number) * speed

    def run_up() -> FloatArray:
        start = np.zeros(2 * machine.oscillator.size)
        for piece in run_through(machine.oscillator, machine.law, start, (BELOW * rate, rate), CYCLES):
            last = piece.states[-1]
        return last

    state, ms = _timed(run_up)
    start = machine.oscillator, machine.law, state, (rate, rate), FEW_CYCLES
    both = [integrate(*start, steps=steps) for steps in (None, FINE_STEPS)]
    coarse, fine = (motion.displacement[:, 0].std() for motion in both)
    force, _ = machine.law.mesh_forces(both[0].phase, np.ascontiguousarray(both[0].displacement.T))
    apart = float((abs(force[0]) <= NOTHING * machine.law.meshes.load[0]).mean())
    told = f"{CYCLES} mesh cycles, {machine.oscillator.size} modes; with shorter steps rms {fine / coarse - 1.0:+.1e}"
    return {f"motion: run-up, {told}, flanks apart for {apart:.0%} of the cycles there": [ms]}


def _scaled(load: LoadCase, share: float) -> LoadCase:
    torques = tuple(
        one if one.torque_Nm == "balance" else replace(one, torque_Nm=share * one.torque_Nm) for one in load.torques
    )
    return replace(load, name=f"{100.0 * share:g} %", torques=torques)


def _timed(work: Callable[[], Found]) -> tuple[Found, float]:
    began = time.perf_counter()
    return work(), 1e3 * (time.perf_counter() - began)
