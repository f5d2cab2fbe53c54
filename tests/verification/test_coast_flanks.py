"""Coast flanks, which a negative torque loads: mirrored pairs, full FE of their own, and tooth surfaces in space."""

import math
from dataclasses import replace

import numpy as np
import pytest

import pmor
from pmor.case import change_case, condition_words, parse_case, text_of
from pmor.case.capability import refuse_beyond
from pmor.pair.conditions import backs_mirror_flanks
from pmor_online.conditions import sweep_listed
from pmor_online.model import reduced_pair
from tests.support.small_case import case_text

LINES = {"contact": {"scheme": "line"}, "reduction": None, "offline": None, "compare": None}
LINES |= {"results": {"root_stress": False}}
MESH = {"profile_elements": 5, "width_elements": 2}
PINION = {"tip_relief_um": 12.0, "tip_relief_start_roll_deg": 27.0, "helix_slope_um": 6.0, "twist_um": 5.0}
WHEEL = {"helix_crowning_um": 4.0, "helix_slope_um": -3.0}
AXES = {"in_plane_um": 10.0, "out_of_plane_um": -15.0, "centre_distance_um": 5.0}
ANGLES = 12


def case_of(**changes):
    return parse_case(case_text(**LINES | {"mesh": MESH} | changes), "small", "small")


def helical(hand=1.0, axes=AXES, **changes):
    flanks = {"pinion.modification": PINION, "wheel": {"teeth": 30, "bore_radius_mm": 20.0, "face_offset_mm": 0.0},
              "wheel.modification": WHEEL}  # fmt: skip
    pair = {"module_mm": 4.0, "face_width_mm": 20.0, "helix_angle_deg": hand * 18.0}
    return case_of(pair=pair, misalignment=axes, **flanks | changes)


@pytest.fixture(scope="module")
def right_handed():
    return pmor.train(helical())


def test_equal_flanks_of_a_spur_pair_move_alike_both_ways():
    """STE(-T, phi) = -STE(T, -phi): the mirrored teeth are the teeth."""
    relief = {"tip_relief_um": 12.0, "tip_relief_start_roll_deg": 27.0, "helix_crowning_um": 4.0}
    model = pmor.train(case_of(**{"pinion.modification": relief}))
    drive, coast = (model.sweep([sign * 60.0, sign * 100.0], ANGLES) for sign in (1.0, -1.0))
    np.testing.assert_allclose(coast.ste_um, drive.ste_um, rtol=1e-12)
    assert (drive.flank, coast.flank) == ("drive", "coast")
    assert "60, 100 N m on coast flanks" in repr(coast)


def test_coast_flanks_are_the_flanks_of_the_pair_of_the_other_hand(right_handed):
    """Mirrored about the plane of the axes: the tilt across it changes its sign, nothing along the axes does."""
    image = pmor.train(helical(-1.0, AXES | {"out_of_plane_um": 15.0})).sweep([100.0], ANGLES)
    coast = right_handed.sweep([-100.0], ANGLES)
    np.testing.assert_allclose(coast.ste_um, image.ste_um, rtol=1e-9)  # finite elements of their own
    np.testing.assert_allclose(coast.line_loads.load_N_per_mm, image.line_loads.load_N_per_mm, rtol=1e-6, atol=1e-6)
    assert np.ptp(right_handed.sweep([100.0], ANGLES).ste_um - coast.ste_um) > 0.1, "the drive flanks move otherwise"


def test_coast_flanks_are_those_of_full_finite_elements(right_handed):
    full = pmor.full_model(change_case(right_handed.case, torque_Nm=-100.0, online={"torques_Nm": [-100.0]}))
    angles = np.array([0.01, 0.09, 0.2])
    found, exact = right_handed.sweep([-100.0], angles), full.sweep([-100.0], angles)
    np.testing.assert_allclose(found.ste_um, exact.ste_um, rtol=1e-9)
    assert exact.flank == "coast"


def touch_um(pair, phi, axes, slope_um):
    """Rotation of the pinion, clockwise, after which its coast flanks touch the wheel's, along the line of action.

    Points of the wheel's flanks on the clockwise side of its teeth, in space, against the pinion's at their radius; the
    pinion's helix slope moves its flank by its amount over the base radius.
    """
    pinion, wheel, width, found = pair.pinion, pair.wheel, pair.face_width, []
    width_z = np.linspace(-0.5 * width, 0.5 * width, 201)
    tilt_x, tilt_y = 1e-3 * axes.out_of_plane_um / width, 1e-3 * axes.in_plane_um / width
    u = np.linspace(wheel.form_roll_angle, pair.tip_edges[1].roll_angle, 2001)[:, None]
    for j in (-1, 0, 1):
        position = phi + j * pair.pitch
        angle = math.pi - pair.wheel_tooth_rotation(-position) + wheel.twist_per_length * width_z
        angle = angle - (wheel.base_half_angle - (u - np.arctan(u)))
        radius = wheel.base_radius * np.sqrt(1.0 + u**2)
        x, y = -radius * np.sin(angle), radius * np.cos(angle)
        z = width_z - tilt_x * x - tilt_y * y
        x, y = x + tilt_x * width_z, y + tilt_y * width_z + pair.centre_distance + 1e-3 * axes.centre_distance_um
        there = np.hypot(x, y) / pinion.base_radius
        roll = np.sqrt(np.maximum(there, 1.0) ** 2 - 1.0)
        flank = pinion.base_half_angle - (roll - np.arctan(roll)) - 1e-3 * slope_um * z / width / pinion.base_radius
        clear = position + pinion.twist_per_length * z - flank - np.arctan2(-x, y)
        inside = (roll > pinion.form_roll_angle) & (roll < pair.tip_edges[0].roll_angle) & (np.abs(z) <= 0.5 * width)
        found.append(clear[inside].min(initial=np.inf))
    return 1e3 * pinion.base_radius * min(found)


def test_coast_flanks_in_space_touch_where_the_transmission_error_without_load_says(right_handed):
    axes, angles = pmor.Misalignment(**AXES | {"out_of_plane_um": -40.0}), np.array([0.0, 0.1, 0.25])
    slope = pmor.Modification(helix_slope_um=25.0)
    found = right_handed.sweep([-1.0], angles, misalignment=axes, pinion=slope, wheel=pmor.Modification())
    pair = right_handed.reduced.meshed.pair
    exact = [touch_um(pair, -phi, axes, 25.0) for phi in angles]  # angles of coast flanks count clockwise
    # Ends of the faces, which the tilt displaces along the axis; 40 um the other way are 9 to 30 um off.
    np.testing.assert_allclose(found.unloaded_um, exact, atol=0.15)
    other = right_handed.sweep([-1.0], angles, misalignment=replace(axes, out_of_plane_um=40.0), pinion=slope,
                               wheel=pmor.Modification())  # fmt: skip
    assert (np.abs(other.unloaded_um - exact) > 9.0).all()


def test_a_case_of_coast_flanks_its_text_a_condition_and_python_agree(right_handed):
    """Keys stand in the frame of the drawing; `[pinion.coast_modification]` and conditions replace single ones."""
    own = {"pinion.coast_modification": {"tip_relief_um": 30.0}}
    listed = {"name": "coast", "torque_Nm": -80.0, "out_of_plane_um": 9.0, "wheel": {"helix_slope_um": 8.0}}
    drive = change_case(helical(**own, online={"torques_Nm": [80.0, 100.0]}), condition=[listed])
    coast = change_case(drive, torque_Nm=-100.0, online={"torques_Nm": [-100.0, -80.0]})
    (condition,) = sweep_listed(reduced_pair(replace(right_handed.basis, case=drive)))
    (other,) = sweep_listed(pmor.train(coast).reduced)
    axes = pmor.Misalignment(in_plane_um=10.0, out_of_plane_um=9.0, centre_distance_um=5.0)
    pinion, wheel = pmor.Modification(**PINION | {"tip_relief_um": 30.0}), pmor.Modification(**WHEEL | listed["wheel"])
    asked = right_handed.sweep([-80.0, -100.0], 4, misalignment=axes, pinion=pinion, wheel=wheel)
    for found in (condition, other):
        assert found.flank == "coast"
        np.testing.assert_allclose(found.sweep.ste_um, asked.ste_um, rtol=1e-9)
    for case in (coast, replace(coast, title="another")):
        assert replace(parse_case(text_of(case), "small", "small"), text=case.text) == case
    assert "torque_Nm = -100.0" in text_of(replace(coast, title="another"))
    assert (
        condition_words(drive, drive.conditions[0])[1:]
        == condition_words(coast, coast.conditions[0])[1:]
        == ["wheel helix_slope_um = 8.0"]
    )


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"load": {"torque_Nm": -100.0}}, "torques_Nm = .*sign of .*write them negative"),
        ({"online": {"torques_Nm": [-50.0, 100.0]}}, "a negative torque loads the coast flanks.*condition"),
        ({"condition": [{"torque_Nm": 0.0}]}, "must not be 0"),
    ],
)
def test_torques_of_both_signs_in_one_list_are_refused(changes, words):
    with pytest.raises(pmor.CaseError, match=words):
        change_case(case_of(), **changes)


def test_python_takes_torques_of_one_sign_at_a_time(right_handed):
    with pytest.raises(pmor.CaseError, match="one sign at a time"):
        right_handed.sweep([-50.0, 100.0], 4)


def test_what_stands_for_drive_flanks_refuses_coast_flanks_in_words():
    coast = change_case(case_of(), torque_Nm=-100.0, online={"torques_Nm": [-100.0]})
    with pytest.raises(pmor.CaseError, match="a unit for co-simulation takes drive flanks: give .* positive"):
        refuse_beyond(coast, "fmu")


def test_backs_of_teeth_with_modifications_of_their_own_are_no_images():
    relief = {"tip_relief_um": 12.0, "tip_relief_start_roll_deg": 27.0}
    same = case_of(**{"pinion.modification": relief})
    assert backs_mirror_flanks(same)
    assert not backs_mirror_flanks(change_case(same, pinion={"coast_modification": {"tip_relief_um": 5.0}}))
