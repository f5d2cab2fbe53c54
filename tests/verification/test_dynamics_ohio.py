"""The pair of the Ohio State rig in motion: where it jumps with and without relief.

Figures of a prototype with the same finite elements, integrated over time, over the natural frequency, to two digits.
Slow, and prints what it finds: ``pytest -n 0 -m slow tests/verification/test_dynamics_ohio.py -s``.
"""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from pmor.case import load_case
from pmor.dynamics.gear_model import gear_model
from pmor.dynamics.law import force_law
from pmor.dynamics.measure import at_rest, needed_harmonics
from pmor.dynamics.response import response
from pmor.dynamics.solution import reduced_of, task_of

CASES = Path(__file__).parents[2] / "cases"
CASE = {False: "osu_dynamics", True: "osu_dynamics_relief"}
TORQUES = 85.0, 170.0, 270.0, 340.0
# By relief and damping ratio: run-up folds of the main resonance at these torques.
PUBLISHED = {
    (False, 0.02): (0.94, 0.95, 0.96, 0.97),
    (True, 0.02): (0.87, 0.95, None, None),
    (False, 0.05): (None, None, None, None),
    (True, 0.05): (0.88, None, None, None),
}
TWO_DIGITS = 0.0075
# Folds nearer to each other than this, over their speed, are a jump that no run in steps sees.
HAIRLINE = 5e-3
LIMITS = 0.6, 1.25


@cache
def tasks(relieved):
    case = load_case(CASES / f"{CASE[relieved]}.toml")
    reduced = reduced_of(case)
    law, _, _ = force_law(case, reduced)
    model = gear_model(case, reduced.meshed.pair)
    return [task_of(case, model, law, torque_Nm) for torque_Nm in case.dynamics.torques_Nm]


@cache
def motions(relieved, damping, torque_Nm):
    task = next(task for task in tasks(relieved) if task.torque_Nm == torque_Nm)
    rest = at_rest(replace(task, damping_ratio=damping))
    limits = tuple(rest.natural * limit for limit in LIMITS)
    return rest, response(rest.oscillator, task.law, limits, needed_harmonics(rest, limits))


def folds(relieved, damping, torque_Nm):
    """Run-down and run-up fold over the natural frequency; None, None where nothing jumps, or by a hair."""
    rest, found = motions(relieved, damping, torque_Nm)
    by_kind = {f.kind: f.point.speed / rest.natural for f in found.folds}
    down, up = by_kind.get("run_down"), by_kind.get("run_up")
    return down, up


@pytest.mark.slow
@pytest.mark.parametrize(("relieved", "damping"), PUBLISHED)
def test_jumps_are_where_the_prototype_had_them(relieved, damping):
    for torque, expected in zip(TORQUES, PUBLISHED[relieved, damping], strict=True):
        down, up = folds(relieved, damping, torque)
        print(f"\nrelief {relieved}, damping {damping:g}, {torque:g} N m: down {down}, up {up}")  # noqa: T201
        if expected is None:
            # Without relief, at 5 % and 85 N m, harmonic balance finds folds 0.3 % apart, which no steps would show.
            assert up is None or up - down < HAIRLINE
        else:
            np.testing.assert_allclose(up, expected, atol=TWO_DIGITS)
