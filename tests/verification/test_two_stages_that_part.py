"""A flexible box of two stages, the first of spur gears whose flanks part: harmonic balance against motion over time.

Slow: finite elements of two pairs, and thousands of mesh cycles.
"""

from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.dynamics.harmonic_balance import Balance, rms
from pmor.dynamics.integration import SAMPLES, integrate, settle
from pmor.dynamics.response import response
from pmor.dynamics.whine.nonlinear import PHASES
from pmor.dynamics.whine.parting import BALANCE, OVER_TIME, machine_of, over_time
from pmor.dynamics.whine.run import run
from pmor.machine.loader import load
from tests.support.gearboxes import two_stages
from tests.support.motion import state_of

pytestmark = pytest.mark.slow
HZ = 2.0 * np.pi
# About the resonance of the fifth harmonic with the torsion of the input shaft; harmonics beyond all modes.
LIMITS, HARMONICS = (HZ * 2340.0, HZ * 2500.0), 20
MOTION = """
[dynamics]
speed_range_rpm = [7300.0, 8000.0]
speeds = 60
damping_ratio = 0.01
highest_frequency_Hz = 12000.0
motion = "nonlinear"
"""


@cache
def solved(helix=(0.0, 15.0), torque=60.0, high="8000.0"):
    with TemporaryDirectory() as folder:
        return run(load(two_stages(Path(folder), helix, torque, MOTION.replace("8000.0", high))))


@cache
def parted():
    """Machine, without gyroscopic moments, and its branches."""
    machine = machine_of(solved().loads[0], [0], [np.inf])
    return machine, response(machine.oscillator, machine.law, LIMITS, HARMONICS)


def test_harmonic_balance_with_loss_of_contact_is_motion_over_time():
    """Rms to 1e-3, wave to 1 %, after 400 cycles from its own state."""
    machine, found = parted()
    balance = Balance(machine.oscillator, machine.law, 1, HARMONICS)
    points = [p for p, held in zip(found.branches[0].points, found.stable[0], strict=True) if held]
    point = max(points, key=lambda p: rms(balance.by_coordinate(p.unknowns)[0]))
    force, approach = machine.law.mesh_forces(balance.phase, balance.displacement(point.unknowns))
    assert (abs(force[0]) < 1e-6).mean() > 0.1
    start = state_of(balance, point.unknowns, point.speed)
    motion = integrate(machine.oscillator, machine.law, start, (point.speed, point.speed), 400, steps=8)
    last = slice(-SAMPLES, None)
    seen = machine.law.mesh_forces(motion.phase[last], np.ascontiguousarray(motion.displacement[last].T))[1]
    print(f"rms {seen[0].std() / approach[0].std() - 1.0:.1e}")  # noqa: T201
    assert_allclose(seen[0].std(), approach[0].std(), rtol=1e-3)
    at = np.roll(np.arange(0, PHASES, PHASES // SAMPLES), -1)
    assert_allclose(seen[0], approach[0, at], atol=1e-2 * np.ptp(approach[0]))


@pytest.mark.parametrize("kind", ["run_up", "run_down"])
def test_slow_runs_jump_within_a_hertz_of_the_folds(kind):
    """0.2 mHz a cycle: a jump is late by what the speed gains meanwhile."""
    machine, found = parted()
    law, balance = replace(machine.law, steps=8), Balance(machine.oscillator, machine.law, 1, HARMONICS)
    fold = next(fold.point.speed for fold in found.folds if fold.kind == kind) / HZ
    way = 1.0 if kind == "run_up" else -1.0
    points = zip(found.branches[0].points, found.stable[0], strict=True)
    near = [p for p, held in points if held and abs(p.speed / HZ - fold + 3.0 * way) < 15.0]
    size = {"run_up": min, "run_down": max}[kind]
    start = size(near, key=lambda p: rms(balance.by_coordinate(p.unknowns)[0]))
    state, previous = state_of(balance, start.unknowns, start.speed), None
    for speed in np.linspace(start.speed / HZ, fold + 3.0 * way, 60):
        state = settle(machine.oscillator, law, state, HZ * speed, 600)
        motion = integrate(machine.oscillator, law, state, (HZ * speed, HZ * speed), 1)
        state, now = motion.states[-1], motion.displacement[:, 0].std()
        if previous and abs(np.log(now / previous)) > 0.2:
            break
        previous = now
    print(f"fold {fold:.2f} Hz, jump {speed:.2f} Hz")  # noqa: T201
    assert abs(speed - fold) < 1.0


def test_one_parting_mesh_is_followed_and_two_of_different_period_go_over_time():
    one, two = solved().loads[0].parting, solved((0.0, 0.0), 30.0, "11400.0").loads[0].parting
    assert (one.by, one.numbers) == (BALANCE, (0,))
    assert (two.by, two.numbers) == (OVER_TIME, (1, 0))  # the slower one first
    assert {kind for _, kind in one.jumps} == {"run_up", "run_down"}
    assert {course.name for course in two.courses} == {"run-up", "run-down"}
    assert all(course.meshes[..., 4].max() > 0.0 for course in two.courses)
    assert one.lost == two.lost == ()


def test_over_time_the_machine_has_the_forces_of_harmonic_balance():
    """At one speed on the stable branch, where there is one motion: of mesh and bearings, gyroscopic moments 1 %."""
    answer, found = solved().loads[0], solved().loads[0].parting
    high = float(answer.speeds_rpm[-1])
    bare, machine = replace(found, courses=()), machine_of(answer, [0], [np.inf])
    for course in over_time(answer, bare, machine, 0.97 * high, high).courses:
        branch = found.courses[0]
        outside = course.speeds_rpm > 1.005 * max(speed for speed, _ in found.jumps)
        held = np.flatnonzero(branch.stable)
        order = held[branch.speeds_rpm[held].argsort()]
        for told, known in ((course.meshes[:, 0, 0], branch.meshes[:, 0, 0]), *zip(course.bearings.T, branch.bearings.T,
                                                                                  strict=True)):  # fmt: skip
            expected = np.interp(course.speeds_rpm, branch.speeds_rpm[order], known[order])
            assert_allclose(told[outside], expected[outside], rtol=0.02, atol=5e-3 * expected.max())

