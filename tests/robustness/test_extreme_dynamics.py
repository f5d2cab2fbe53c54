"""Motion of extreme pairs: found and true to the equations of motion, refused, or named as lost; never made up.

Each point that is told of is started over time, and has to come back to where it began after its period.
"""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from pmor.case import parse_case
from pmor.core.errors import ConvergenceError
from pmor.dynamics import law, solution
from pmor.dynamics.gear_model import gear_model
from pmor.dynamics.harmonic_balance import Balance, rest, solve_at
from pmor.dynamics.integration import integrate
from pmor.dynamics.measure import at_rest, needed_harmonics, speeds_of
from pmor.dynamics.response import response
from tests.support.motion import state_of
from tests.support.small_case import case_text

BEARINGS = "pinion_bearing_stiffness_N_um", "wheel_bearing_stiffness_N_um"
RELIEF = {"tip_relief_start_roll_deg": 25.0}


def six(stiffness, **more):
    return {"degrees_of_freedom": 6, **dict.fromkeys(BEARINGS, [stiffness, 2.0 * stiffness]), **more}


def twelve(stiffness, tilting, **more):
    tilts = dict.fromkeys(["pinion_tilting_stiffness_kNm_rad", "wheel_tilting_stiffness_kNm_rad"], [tilting, tilting])
    return {"degrees_of_freedom": 12, **dict.fromkeys(BEARINGS, [stiffness] * 3), **tilts, **more}


# name: (keys of [dynamics], other sections)
MATRIX = {
    "hardly any damping": ({"damping_ratio": 1e-5}, {}),
    "little damping": ({"damping_ratio": 1e-3}, {}),
    "critical damping": ({"damping_ratio": 1.0}, {}),
    "a damper that locks": ({"mesh_damping_N_s_mm": 1e6}, {}),
    "hardly any torque": ({"torques_Nm": [1e-6]}, {}),
    "little torque": ({"torques_Nm": [0.1]}, {}),
    "much torque": ({"torques_Nm": [2000.0]}, {}),
    "no backlash": ({"backlash_um": 0.0}, {}),
    "backlash of a tenth of the displacement": ({"backlash_um": 1.0}, {}),
    "backlash of the displacement": ({"backlash_um": 10.0}, {}),
    "backlash of a millimetre": ({"backlash_um": 1000.0}, {}),
    "a flywheel on the pinion": ({"pinion_inertia_kg_m2": 1e3, "wheel_inertia_kg_m2": 1e-3}, {}),
    "a flywheel on the wheel": ({"pinion_inertia_kg_m2": 1e-3, "wheel_inertia_kg_m2": 1e3}, {}),
    "gears without weight": ({"density_kg_m3": 100.0, "pinion_inertia_kg_m2": 1e-10}, {}),
    "all superharmonics": ({"mesh_frequency_ratio": [0.03, 0.3]}, {}),
    "parametric resonances": ({"mesh_frequency_ratio": [1.5, 4.0]}, {}),
    "amid the resonance": ({"mesh_frequency_ratio": [0.85, 0.97]}, {}),
    "a thousandth of the speed": ({"mesh_frequency_ratio": [0.9995, 1.0005]}, {}),
    "soft bearings": (six(0.5), {}),
    "bearings like rock": (six(1e9), {}),
    "undamped bearings": (six(200.0, bearing_damping_ratio=0.0), {}),
    "twelve degrees of freedom, spur": (twelve(200.0, 300.0), {}),
    "helical with an overlap ratio of 3": (
        twelve(200.0, 300.0), {"pair": {"helix_angle_deg": 40.0, "face_width_mm": 58.0}, "mesh": {"width_elements": 6}},
    ),
    "more relief than deflection": ({}, {"pinion.modification": {"tip_relief_um": 200.0, **RELIEF}}),
    "material added at the tips": ({}, {"pinion.modification": {"tip_relief_um": -15.0, **RELIEF}}),
}  # fmt: skip
NORMAL = ("critical damping",)


@cache
def reduced(sections):
    """By the text of the sections: most entries share one pair."""
    others = json.loads(sections)
    mesh = {"profile_elements": 5, "width_elements": 2} | others.pop("mesh", {})
    text = case_text(mesh=mesh, contact={"scheme": "line"}, reduction=None, **others)
    case = parse_case(text, "small", "small.toml")
    return case, solution.reduced_of(case)


@cache
def problem(name):
    dynamics, sections = MATRIX[name]
    case, pair = reduced(json.dumps(sections))
    text = case_text(contact={"scheme": "line"}, reduction=None, dynamics=dynamics)
    case = replace(case, dynamics=parse_case(text, "small", "small.toml").dynamics)
    table, error, _ = law.force_law(case, pair)
    return solution.task_of(case, gear_model(case, pair.meshed.pair), table, case.dynamics.torques_Nm[0]), error


@pytest.fixture(autouse=True)
def _coarser_table(monkeypatch):
    monkeypatch.setattr(law, "TOLERANCE", 2e-3)
    monkeypatch.setattr(law, "STATIC_TOLERANCE", 1e-2)
    monkeypatch.setattr(law, "CHECKED", 10)


@pytest.mark.parametrize("name", [pytest.param(n, marks=[] if n in NORMAL else [pytest.mark.slow]) for n in MATRIX])
def test_what_is_found_is_motion(name):
    task, error = problem(name)
    at = at_rest(task)
    limits = speeds_of(task, at)
    found = response(at.oscillator, task.law, limits, needed_harmonics(at, limits))
    assert error.rms < 1e-2  # a coarse table; without load teeth take over from each other at a stroke
    worst = 0.0
    for branch in found.branches:
        assert branch.ended
        for point in branch.points[:: max(1, len(branch.points) // 12)]:
            worst = max(worst, strayed(branch.balance, point))
    lost = [*found.lost, *(b.ended for b in found.branches if not b.ended.startswith(("end of", "back at")))]
    sizes = [len(b.points) for b in found.branches]
    print(f"{name}: {sizes} points, {len(found.folds)} folds, strays {worst:.1e}; {lost}")
    assert worst < 5e-2  # 20 harmonics at the tip of a resonance of no damping; made-up motion strays by its own size


def strayed(balance, point):
    """How far motion is from its start after a period, over its range; unstable motion has left by what it grows."""
    start = state_of(balance, point.unknowns, point.speed)
    motion = integrate(balance.oscillator, balance.law, start, (point.speed, point.speed), balance.cycles)
    moved = np.ptp(motion.displacement) + 1e-6 * abs(point.unknowns[0])
    lever = balance.oscillator.lever
    return abs(lever @ (motion.states[-1] - start)[: len(lever)]) / moved


@pytest.mark.parametrize("far", [0.0, 30.0, -30.0, 1e3])
def test_a_start_far_from_the_motion_comes_to_it_or_is_refused(far):
    task, _ = problem("little damping")
    at = at_rest(task)
    balance = Balance(at.oscillator, task.law, cycles=1, harmonics=10)
    start = rest(balance)
    known = solve_at(balance, 2.0 * at.natural, start)  # above the resonance there is one motion
    start[1:3] = far * start[0]
    try:
        found = solve_at(balance, 2.0 * at.natural, start)
    except ConvergenceError:
        assert far != 0.0
    else:
        np.testing.assert_allclose(found, known, atol=1e-6 * known[0])
