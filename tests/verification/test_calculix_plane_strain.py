"""Line contact in plane strain against CalculiX: whole rings of second-order elements, flanks that resolve the contact.

Elements on the flanks are a quarter of Hertz's half-width. CalculiX has a penalty k, by which Hertz's pressure lets the
flanks enter each other by 4 w / (pi^2 b k): that is taken off where no corner carries.

Slow: ``pytest -n 0 -m slow tests/verification/test_calculix_plane_strain.py -s``, two to five minutes each. Measured,
line contact with 16 elements over CalculiX: paper's pair +0.02, +0.02 and -0.02 %, unequal pair +0.06, +0.06 and
+0.02 %. Where a corner carries, at entry and exit: paper's pair at 100 N m -0.45 and -0.16 %, at 300 N m -0.29 and
+0.02 %, unequal pair at 30 N m -0.39 and -0.18 %, at 90 N m -0.15 and +0.06 %. Flank elements of half the length move
CalculiX by 0.02 % there, penalties of 2e7 and 1e8 differ by 0.5 %: of the -0.45 % the penalty is about 0.25.
"""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.gear.condition import Condition
from pmor.lab.rivals.calculix import PROGRAM, calculix_available
from tests.support.calculix_plane import plane_ste_um
from tests.support.small_case import case_with, full_fe
from tests.support.states import states_at

WIDTH = 20.0  # mm, of the pairs that torques are named for; 1 mm of it is solved
PENALTY_N_MM3 = 5e7
INSIDE_RTOL, CORNER_RTOL = 1.5e-3, 1e-2
PAIRS = {
    "paper": {"pair": {"face_width_mm": 1.0}},
    "unequal": {
        "pair": {"module_mm": 2.5, "face_width_mm": 1.0},
        "pinion": {"teeth": 17, "profile_shift": 0.3, "bore_radius_mm": 10.0},
        "wheel": {"teeth": 40, "bore_radius_mm": 30.0},
    },
}
# Pair, torque on 20 mm (N m), pitches since a tooth pair came into mesh: two pairs in mesh, twice, and one.
INSIDE = [
    ("paper", 100.0, 0.12), ("paper", 100.0, 0.45), ("paper", 100.0, 0.75),
    ("unequal", 30.0, 0.15), ("unequal", 30.0, 0.45), ("unequal", 30.0, 0.75),
]  # fmt: skip
# Pair, torque, where a tip corner carries, angle of the pinion beyond the path of contact (rad), CalculiX's STE (um).
CORNERS = [
    ("paper", 100.0, "entry", 0.003, 6.832), ("paper", 100.0, "exit", 0.003, 6.863),
    ("paper", 300.0, "entry", 0.003, 19.228), ("paper", 300.0, "exit", 0.003, 19.328),
    ("unequal", 30.0, "entry", 0.004, 3.716), ("unequal", 30.0, "exit", 0.004, 3.705),
    ("unequal", 90.0, "entry", 0.004, 10.436), ("unequal", 90.0, "exit", 0.004, 10.445),
]  # fmt: skip


@cache
def solved_pair(name):
    mesh = {"element": "hex20", "profile_elements": 16, "width_elements": 1, "width": "plane_strain"}
    sections = {"load": {"torque_Nm": 1.0}, "contact": {"scheme": "line"}, "reduction": None, "mesh": mesh}
    sections |= {stage: {"torques_Nm": [1.0]} for stage in ("offline", "online", "compare")}
    case = case_with(**PAIRS[name], **sections)
    return case, full_fe(case)


def solved(name, torque, phi):
    """STE (um), and for each tooth pair in contact line load and half-width."""
    _, model = solved_pair(name)
    meshed = model.mesh.meshed
    (found,) = states_at(model, phi, [Condition(torque=1e3 * torque / WIDTH)])
    load, half_width = (
        np.array([values[found.pair == p].mean() for p in np.unique(found.pair)])
        for values in (found.line_load, found.patches()[:, 0])
    )
    return 1e3 * found.advance * meshed.pair.pinion.base_radius, load, half_width


def calculix(name, torque, phi, ours_um, half_width):
    case, model = solved_pair(name)
    fine, reach = 0.25 * half_width.min(), 2.0 * half_width.max()
    given, pair = replace(case, torque_Nm=torque / WIDTH), model.mesh.meshed.pair
    return plane_ste_um(given, pair, phi, fine, reach, PENALTY_N_MM3, ours_um)


def corner_angle(name, end, beyond):
    start, stop = solved_pair(name)[1].mesh.meshed.pair.roll_position_range
    return start - beyond if end == "entry" else stop + beyond


@pytest.mark.parametrize(("name", "torque", "end", "beyond", "theirs_um"), CORNERS)
def test_line_contact_at_a_corner_gives_the_ste_that_calculix_gave(name, torque, end, beyond, theirs_um):
    """Its figures of the slow test below."""
    ours, *_ = solved(name, torque, corner_angle(name, end, beyond))
    assert_allclose(ours, theirs_um, rtol=CORNER_RTOL)


@pytest.mark.slow
@pytest.mark.skipif(not calculix_available(), reason=f"CalculiX ({PROGRAM}) is not installed")
@pytest.mark.parametrize(("name", "torque", "share"), INSIDE)
def test_line_contact_between_the_tips_gives_the_ste_of_calculix(name, torque, share):
    pair = solved_pair(name)[1].mesh.meshed.pair
    phi = pair.roll_position_range[0] + share * pair.pitch
    ours, load, half_width = solved(name, torque, phi)
    entered = 1e3 * np.sum(load / load.sum() * 4.0 * load / (math.pi**2 * half_width * PENALTY_N_MM3))
    theirs = calculix(name, torque, phi, ours, half_width) - entered
    print(f"\n{name} at {share:g}: {ours:.4f} um, CalculiX {theirs:.4f} um: {1e2 * (ours / theirs - 1.0):+.3f} %")  # noqa: T201
    assert_allclose(ours, theirs, rtol=INSIDE_RTOL)


@pytest.mark.slow
@pytest.mark.skipif(not calculix_available(), reason=f"CalculiX ({PROGRAM}) is not installed")
@pytest.mark.parametrize(("name", "torque", "end", "beyond", "known_um"), CORNERS)
def test_line_contact_at_a_corner_gives_the_ste_of_calculix(name, torque, end, beyond, known_um):
    phi = corner_angle(name, end, beyond)
    ours, _, half_width = solved(name, torque, phi)
    theirs = calculix(name, torque, phi, ours, half_width)
    print(f"\n{name}, {torque:g} N m, {end}: {ours:.4f}, CalculiX {theirs:.4f} um: {1e2 * (ours / theirs - 1):+.3f} %")  # noqa: T201
    assert_allclose(ours, theirs, rtol=CORNER_RTOL)
    assert_allclose(theirs, known_um, rtol=1e-3)
