"""Pairs in motion: where that of the Ohio State rig jumps, time integration against harmonic balance, slow runs.

Figures of a prototype with the same finite elements, integrated over time, over the natural frequency, to two digits.
Slow, and prints what it finds: ``pytest -n 0 -m slow tests/verification/test_pairs_in_motion.py -s``.
"""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from pmor.case import load_case
from pmor.dynamics.gear_model import gear_model
from pmor.dynamics.harmonic_balance import rms, solve_at
from pmor.dynamics.integration import integrate, run_through
from pmor.dynamics.law import force_law
from pmor.dynamics.measure import at_rest, needed_harmonics, speeds_of
from pmor.dynamics.response import response
from pmor.dynamics.solution import reduced_of, task_of
from tests.support.motion import state_of

pytestmark = pytest.mark.slow
CASES = Path(__file__).parents[2] / "cases"
PLAIN, RELIEVED = "osu_dynamics", "osu_dynamics_relief"
TORQUES = 85.0, 170.0, 270.0, 340.0
# By case and damping ratio: run-up folds of the main resonance at these torques.
PUBLISHED = {
    (PLAIN, 0.02): (0.94, 0.95, 0.96, 0.97),
    (RELIEVED, 0.02): (0.87, 0.95, None, None),
    (PLAIN, 0.05): (None, None, None, None),
    (RELIEVED, 0.05): (0.88, None, None, None),
}
TWO_DIGITS = 0.0075
# Folds nearer to each other than this, over their speed, are a jump that no run in steps sees.
HAIRLINE = 5e-3
LIMITS = 0.6, 1.25
# Case, torque in N m; with the damping of their cases the first two jump at their first resonance.
JUMPING = [(PLAIN, 170.0), (RELIEVED, 85.0)]


@cache
def task_at(name, torque_Nm):
    case, reduced, law = solved(name)
    return task_of(case, gear_model(case, reduced.meshed.pair), law, torque_Nm)


@cache
def solved(name):
    case = load_case(CASES / f"{name}.toml")
    reduced = reduced_of(case)
    return case, reduced, force_law(case, reduced)[0]


@cache
def motions(name, torque_Nm):
    """The pair at rest under a torque, and its motion over the speeds of its case."""
    task = task_at(name, torque_Nm)
    rest = at_rest(task)
    limits = speeds_of(task, rest)
    return rest, response(rest.oscillator, task.law, limits, needed_harmonics(rest, limits))


@pytest.mark.parametrize(("name", "damping"), PUBLISHED)
def test_jumps_are_where_the_prototype_had_them(name, damping):
    for torque, expected in zip(TORQUES, PUBLISHED[name, damping], strict=True):
        task = task_at(name, torque)
        rest = at_rest(replace(task, damping_ratio=damping))
        limits = tuple(rest.natural * limit for limit in LIMITS)
        found = response(rest.oscillator, task.law, limits, needed_harmonics(rest, limits))
        by_kind = {f.kind: f.point.speed / rest.natural for f in found.folds}
        down, up = by_kind.get("run_down"), by_kind.get("run_up")
        print(f"\n{name}, damping {damping:g}, {torque:g} N m: down {down}, up {up}")  # noqa: T201
        if expected is None:
            # Without relief, at 5 % and 85 N m, harmonic balance finds folds 0.3 % apart, which no steps would show.
            assert up is None or up - down < HAIRLINE
        else:
            np.testing.assert_allclose(up, expected, atol=TWO_DIGITS)


@pytest.mark.parametrize(("name", "torque_Nm"), [*JUMPING, ("helical_dynamics", 200.0)])
def test_integration_over_time_finds_what_harmonic_balance_found_at_sixty_speeds(name, torque_Nm):
    rest, found = motions(name, torque_Nm)
    assert bool(found.folds) == ((name, torque_Nm) in JUMPING)
    branch = found.branches[0]
    points = [point for point, holds in zip(branch.points, found.stable[0], strict=True) if holds]
    worst = 0.0
    for place in np.linspace(0, len(points) - 1, 60).astype(int):
        point = points[place]
        start = state_of(branch.balance, point.unknowns, point.speed)
        motion = integrate(rest.oscillator, solved(name)[2], start, (point.speed, point.speed), 150)
        worst = max(worst, abs(motion.rms[-1] / rms(point.unknowns) - 1.0))
    print(f"\n{name}: {worst:.1e}")  # noqa: T201
    assert worst < 5e-4  # asked for: 5e-3; measured 3e-5, 4e-6, 3e-4


@pytest.mark.parametrize(("name", "torque_Nm"), JUMPING)
@pytest.mark.parametrize("kind", ["run_up", "run_down"])
def test_slow_runs_jump_at_the_folds_of_the_main_resonance(name, torque_Nm, kind):
    rest, found = motions(name, torque_Nm)
    fold = max(f.point.speed for f in found.folds if f.kind == kind)
    first, last = (0.97 * fold, 1.03 * fold) if kind == "run_up" else (1.05 * fold, 0.96 * fold)
    branch = found.branches[0]
    # Of the motions at the first speed the one that the run arrives on: the smaller going up, the larger going down.
    sizes = rms(branch.unknowns)
    near = np.flatnonzero(found.stable[0] & (np.abs(branch.speed / first - 1.0) < 0.02))
    near = near[sizes[near].argmin() if kind == "run_up" else sizes[near].argmax()]
    start = state_of(branch.balance, solve_at(branch.balance, first, branch.points[near].unknowns), first)
    pieces = list(run_through(rest.oscillator, solved(name)[2], start, (first, last), 20_000))
    size, speed = (np.concatenate([getattr(p, key) for p in pieces]) for key in ("rms", "cycle_speed"))
    jump = np.abs(np.diff(np.log(size[::20]))).argmax() * 20
    np.testing.assert_allclose(speed[jump], fold, rtol=1e-3)  # asked for: 5e-3; measured 3e-4
