"""Wheels on light blanks against CalculiX: one pair, single contact, whole blanks of second-order elements.

Slow: ``pytest -n 0 -m slow tests/verification/test_calculix_blanks.py -s``, about ten minutes each. Measured, line
contact over CalculiX, and the difference to the solid wheel: solid +0.21 %, thin web +0.41 and +0.85 %, offset web
+0.54 and +1.12 %, a hole towards the mate +0.44 and +0.83 %, the line of centres between two holes +0.51 and +0.97 %.
Asked for are 0.7 and 3 %. The blanks of CalculiX are still a bit too stiff: with two thirds of the rows and lines the
figures are 0.1 to 0.3 % larger.
"""

import math
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor
from pmor.case import make_case
from pmor.lab.rivals.calculix import PROGRAM, calculix_available
from pmor.pair.conditions import nominal_condition
from pmor.validation.machines import after_entry
from pmor_online.line_sweep import sweep_line_loads
from tests.support.calculix_blank import BlankMesh, blank_ste_um

PENALTY_N_MM3 = 5e7
WEB = {"rim_thickness_mm": 4.0, "hub_radius_mm": 13.0, "web_thickness_mm": 2.5}
HOLES = {"count": 6, "radius_mm": 4.0, "on_radius_mm": 20.5}
# Lines of elements over half the width, or over the whole of it; rows of rim, web and hub.
HALF, WHOLE = (-5.0, -3.0, -1.9, -1.25, -0.7, -0.3, 0.0), (-5.0, -1.5, 0.4, 1.25, 2.5, 3.75, 5.0)
ROWS = (4, 12, 3)
# What CalculiX gave, um.
BLANKS = {
    "solid": (WEB | {"web_thickness_mm": 10.0}, HALF, 15.9288),
    "thin web": (WEB, HALF, 22.8617),
    "offset web": (WEB | {"web_offset_mm": 2.5}, WHOLE, 24.7475),
    "hole towards the mate": (WEB | {"holes": HOLES}, HALF, 25.2715),
    "between two holes": (WEB | {"holes": HOLES | {"first_deg": 30.0}}, HALF, 26.4308),
}
SHARE = 0.75  # of a pitch since a tooth pair came into mesh: it carries alone
STE_RTOL, MORE_RTOL = 7e-3, 3e-2  # asked for: STE, and its difference to the solid wheel
RECORDED = 1e-3  # of what CalculiX gave

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not calculix_available(), reason=f"CalculiX ({PROGRAM}) is not installed"),
]


def case_of(blank):
    return make_case(
        module_mm=3.0, face_width_mm=10.0, torque_Nm=60.0, scheme="line", profile_elements=16, width_elements=8,
        width="whole", error_bar=False, results={"root_stress": False},
        pinion={"teeth": 20, "bore_radius_mm": 23.5, "profile_shift": 0.2},
        wheel={"teeth": 24, "bore_radius_mm": 9.0, "blank": blank},
    )  # fmt: skip


@cache
def ours_of(name):
    """Case, pair, pinion angle, STE (um), and line load, half-width and width of the sections that carry."""
    case = case_of(BLANKS[name][0])
    reduced = pmor.train(case).reduced
    phi = after_entry(reduced.meshed.pair, SHARE)
    swept = sweep_line_loads(reduced, np.array([phi]), [nominal_condition(case)], recorded=True)
    lines = swept.states.lines
    load, half_width = lines.load_N_per_mm[0, 0], lines.half_width_mm[0, 0]
    carries = load > 0.0
    width = np.broadcast_to(lines.width_mm, load.shape)[carries]
    return case, reduced.meshed.pair, phi, swept.ste_um[0, 0], load[carries], half_width[carries], width


@pytest.mark.parametrize("name", BLANKS)
def test_a_wheel_on_its_blank_gives_the_ste_of_calculix(name):
    _, z, known_um = BLANKS[name]
    case, pair, phi, ours, load, half_width, width = ours_of(name)
    # Flanks enter each other by CalculiX's penalty.
    entered = np.average(4.0 * load / (math.pi**2 * half_width * PENALTY_N_MM3), weights=load * width)
    fine, reach, made = 0.5 * half_width.mean(), 2.0 * half_width.max(), BlankMesh(*ROWS, z)
    theirs = blank_ste_um(case, pair, phi, fine, reach, PENALTY_N_MM3, ours, made) - 1e3 * entered
    print(f"\n{name}: {ours:.4f} um, CalculiX {theirs:.4f} um: {1e2 * (ours / theirs - 1.0):+.2f} %")  # noqa: T201
    assert_allclose(theirs, known_um, rtol=RECORDED)
    assert_allclose(ours, theirs, rtol=STE_RTOL)
    if name != "solid":
        assert_allclose(ours - ours_of("solid")[3], theirs - BLANKS["solid"][2], rtol=MORE_RTOL)
