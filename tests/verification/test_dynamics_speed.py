"""What motion costs on the pair of the Ohio State rig: a response, a long run-up, many responses in parallel.

Times are told, not judged: ``pytest -n 0 -m slow tests/verification/test_dynamics_speed.py -s`` on a quiet machine.
"""

import time
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from pmor.case import change_case, load_case
from pmor.core.threads import processes
from pmor.dynamics.gear_model import gear_model
from pmor.dynamics.law import force_law
from pmor.dynamics.measure import RUN_UP, at_rest, needed_harmonics, solve
from pmor.dynamics.response import response
from pmor.dynamics.solution import reduced_of, run_dynamics, task_of

CASE = Path(__file__).parents[2] / "cases" / "osu_dynamics.toml"
CURVES, JOBS = 64, 2


@cache
def reduced():
    case = load_case(CASE)
    return case, reduced_of(case)


@cache
def task_at(torque_Nm):
    case, pair = reduced()
    law, _, _ = force_law(case, pair)
    return task_of(case, gear_model(case, pair.meshed.pair), law, torque_Nm)


@pytest.mark.slow
def test_a_response_of_150_points_and_a_run_up_of_100_000_cycles():
    task = task_at(270.0)
    rest = at_rest(task)
    limits = 0.6 * rest.natural, 1.4 * rest.natural
    response(rest.oscillator, task.law, limits)  # loads the kernels
    begun = time.process_time()
    found = response(rest.oscillator, task.law, limits, needed_harmonics(rest, limits))
    seconds = time.process_time() - begun
    points = sum(len(branch.points) for branch in found.branches)
    print(f"\nresponse: {points} points, {len(found.folds)} folds, with stability: {seconds:.2f} s of CPU")  # noqa: T201
    assert points > 120
    assert {fold.kind for fold in found.folds} == {"run_up", "run_down"}
    cycles = 100_000
    begun = time.process_time()
    run = solve(replace(task, run_cycles=cycles), RUN_UP)
    seconds = time.process_time() - begun
    print(f"run-up: {cycles} mesh cycles with spectra: {seconds:.1f} s of CPU")  # noqa: T201
    assert run["lost"] == []
    sizes = np.array([point["dte_rms_um"] for point in run["run_up"]])
    ratio = np.array([point["mesh_frequency_Hz"] for point in run["run_up"]]) * 2.0 * np.pi / rest.natural
    jump = ratio[np.abs(np.diff(np.log(sizes)) * (ratio[1:] > 0.8)).argmax()]
    folds = [fold.point.speed / rest.natural for fold in found.folds if fold.kind == "run_up"]
    np.testing.assert_allclose(jump, folds[-1], rtol=5e-3)  # points of the run are 0.3 % apart


@pytest.mark.slow
def test_many_responses_in_processes_are_those_of_one_process(tmp_path):
    case, pair = reduced()
    torques = [round(85.0 + 4.0 * i, 3) for i in range(CURVES)]
    case = change_case(case, dynamics={"torques_Nm": torques, "run_cycles": 0, "mesh_frequency_ratio": [0.6, 1.3]})
    walls, found = {}, {}
    for jobs in (1, JOBS):
        begun = time.perf_counter()
        with processes(jobs) as executor:
            found[jobs] = run_dynamics(case, pair, tmp_path / str(jobs), executor=executor).responses
        walls[jobs] = time.perf_counter() - begun
    share = walls[1] / (JOBS * walls[JOBS])
    print(f"\n{CURVES} responses: {walls[1]:.1f} s in one process, {walls[JOBS]:.1f} s in {JOBS}: {share:.0%}")  # noqa: T201
    assert found[1] == found[JOBS]
    assert len(found[1]) == CURVES
