"""Kinematics of involute pairs: where flanks touch, contact ratio, backlash, which pairs are in reach."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.core.conventions import rotation_z
from pmor.core.errors import GeometryError
from pmor.gear.involute import involute_function
from pmor.gear.pair import GearPair, zero_backlash_centre_distance
from pmor.penalty.position import relative_motion
from tests.support.gear_models import WIDTH, gear_pair, helical_pair, meshed_pair
from tests.support.gear_models import tooth as gear

EXACT = 1e-12  # relative; closed forms differ by round-off only
PLACE = 1e-10  # mm, at distances of up to 200 mm: round-off
ROOT = 1e-10  # the working pressure angle comes out of a root finder


PAIRS = {
    "paper": gear_pair(gear(21), gear(21)),
    "unequal": gear_pair(gear(17), gear(31)),
    "speeding up": gear_pair(gear(31), gear(17)),
    "shifted": gear_pair(gear(17, 0.4), gear(31, 0.1)),
    "shifts cancel": gear_pair(gear(17, 0.3), gear(31, -0.3)),
    "backlash": gear_pair(gear(21), gear(33), extra_distance=0.5),
    "shifted with backlash": gear_pair(gear(17, 0.4), gear(31, 0.1), extra_distance=0.3),
    "undercut": gear_pair(gear(10), gear(30)),
    "helical tight": gear_pair(gear(21, 0.3, 20.0), gear(31, 0.2, -20.0)),
    "helical": gear_pair(gear(21, 0.0, 15.0), gear(31, 0.2, -15.0), extra_distance=0.1),
}
every_pair = pytest.mark.parametrize("pair", PAIRS.values(), ids=PAIRS.keys())


def in_global_frame(pair, roll_position, gear_number, vectors, shift):
    """Carry vectors of a pinion (0) or wheel (1) tooth's frame into the global one, by the words of `conventions`."""
    if gear_number == 0:
        return vectors @ rotation_z(roll_position).T
    turned = vectors @ rotation_z(math.pi + pair.wheel_tooth_rotation(roll_position)).T
    return turned + np.array([0.0, pair.centre_distance, 0.0]) * shift


def contact_points(pair, roll_position):
    u1, u2 = pair.contact_roll_angles(np.array(roll_position))
    for number, (tooth, u) in enumerate(((pair.pinion, u1), (pair.wheel, u2))):
        yield (
            in_global_frame(pair, roll_position, number, tooth.flank_point(u, 0.0), True),
            in_global_frame(pair, roll_position, number, tooth.flank_normal(u, 0.0), False),
        )


def roll_positions(pair, count=7):
    return np.linspace(*pair.roll_position_range, count)


# --- where the flanks touch ----------------------------------------------------------------------------------------


@every_pair
def test_flanks_touch_with_opposite_normals_at_every_roll_position(pair):
    for roll_position in roll_positions(pair):
        (point_1, normal_1), (point_2, normal_2) = contact_points(pair, roll_position)
        assert_allclose(point_1, point_2, atol=PLACE, rtol=0)
        assert_allclose(normal_1, -normal_2, atol=EXACT, rtol=0)


@every_pair
def test_relative_motion_agrees_with_the_two_global_frames(pair):
    meshed = meshed_pair(pair, 2, 1)
    points = np.array([[1.0, 40.0, -3.0], [-2.0, 45.0, 7.0], [0.0, 0.0, 0.0]])
    for roll_position in roll_positions(pair, 3):
        for advance in (0.0, 0.02):
            rotation, shift = relative_motion(meshed, roll_position, advance)
            from_pinion = points @ rotation_z(roll_position + advance).T
            from_wheel = in_global_frame(pair, roll_position, 1, points @ rotation.T + shift, True)
            assert_allclose(from_wheel, from_pinion, atol=PLACE, rtol=0)


@every_pair
def test_path_of_contact_ends_at_the_tips_or_the_form_points(pair):
    u1, u2 = pair.contact_roll_angles(roll_positions(pair, 2))
    pinion, wheel = pair.pinion, pair.wheel
    for u, tooth in ((u1, pinion), (u2, wheel)):
        assert u.min() >= tooth.form_roll_angle - EXACT
        assert u.max() <= tooth.tip_roll_angle + EXACT
    start = min(abs(u2[0] - wheel.tip_roll_angle), abs(u1[0] - pinion.form_roll_angle))
    end = min(abs(u1[1] - pinion.tip_roll_angle), abs(u2[1] - wheel.form_roll_angle))
    assert_allclose([start, end], 0.0, atol=EXACT)


# --- centre distance -----------------------------------------------------------------------------------------------


@every_pair
def test_backlash_follows_the_textbook_formula(pair):
    """ISO 21771: normal backlash 2 (r_b1 + r_b2) (inv alpha_w - inv alpha_tight); none at the distance without."""
    base = pair.pinion.base_radius + pair.wheel.base_radius
    distances = pair.centre_distance, zero_backlash_centre_distance(pair.pinion, pair.wheel)
    working, tight = (involute_function(math.acos(base / distance)) for distance in distances)
    expected = 2.0 * base * (working - tight)
    assert (expected > 1e-2) == (distances[0] - distances[1] > 0.05)
    assert_allclose(pair.backlash, expected, rtol=EXACT, atol=PLACE)
    # Seen in a mirror, the wheel tooth that touches the pinion tooth's other flank at roll position p stands at the
    # mirrored angle of the one that touches at -p: without backlash they are neighbours, exactly one pitch apart.
    for p in roll_positions(pair, 3):
        apart = -pair.wheel_tooth_rotation(-p) - pair.wheel_tooth_rotation(p)
        found = (pair.wheel.angular_pitch - apart) * pair.wheel.base_radius
        assert_allclose(found, expected, rtol=1e-9, atol=ROOT * pair.wheel.base_pitch)


# --- tooth pairs that can touch ---


@every_pair
@pytest.mark.parametrize("margin", [0.0, 0.02])
def test_pairs_in_reach_are_those_on_the_path(pair, margin):
    first, last = pair.meshing_range
    for phi in np.linspace(-3.0 * pair.pitch, 3.0 * pair.pitch, 13):
        candidates = np.arange(-12, 13)
        own = phi + candidates * pair.pitch
        expected = candidates[(own >= first - margin - 1e-12) & (own <= last + margin + 1e-12)]
        assert pair.touching_pairs(phi, margin).tolist() == expected.tolist()
        assert len(expected) >= 1


# --- pairs that cannot mesh ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("pinion", "wheel", "distance", "message"),
    [
        (gear(21), gear(21), 78.0, "below the sum of the base radii"),
        (gear(21), gear(21), 83.9, "jam below 84 mm"),
        (gear(21, 0.3), gear(21), 84.0, "jam below"),
        (gear(21), gear(21), 87.0, "contact ratio 0.904"),
        (gear(21, addendum=0.4), gear(21, addendum=0.4), 84.0, "contact ratio"),
        (gear(21, -0.5), gear(21, -0.6), 84.0, "too negative"),
    ],
)
def test_pairs_that_cannot_mesh_are_refused(pinion, wheel, distance, message):
    with pytest.raises(GeometryError, match=message):
        GearPair(pinion, wheel, WIDTH, distance)


# --- helical pairs -------------------------------------------------------------------------------------------------

# Teeth, normal module, helix angle, profile shift of both, face width and centre distance (None: no backlash) of
# drawings; working transverse pressure angle (deg), base radii, transverse contact ratio, overlap ratio.
DRAWINGS = {
    "FVA high speed": ((27, 51), 4.5, 21.0, 0.231415, 50.0, 190.0, (22.8062, 60.6275, 114.5185, 1.4705, 1.2675)),
    "FVA low speed": ((23, 34), 6.5, 10.0, 0.15074, 74.0, 190.0, (21.7751, 71.1963, 105.2467, 1.5376, 0.6293)),
    "17/43": ((17, 43), 1.0, 20.0, 0.0, 10.0, None, (21.1728, 8.4349, 21.3353, 1.4919, 1.0887)),
}
PRINTED = 5e-5  # to the last of four decimals


def drawing(name, hand=1.0):
    teeth, module, helix, shift, width, distance, expected = DRAWINGS[name]
    return helical_pair(module, teeth, hand * helix, shift, width, distance), expected


@pytest.mark.parametrize("hand", [1.0, -1.0])
@pytest.mark.parametrize("name", DRAWINGS)
def test_geometry_of_helical_pairs_from_drawings(name, hand):
    pair, expected = drawing(name, hand)
    angle = math.degrees(pair.working_pressure_angle)
    found = angle, pair.pinion.base_radius, pair.wheel.base_radius, pair.contact_ratio, pair.overlap_ratio
    assert_allclose(found, expected, rtol=0.0, atol=PRINTED)
    assert_allclose(pair.total_contact_ratio, sum(expected[3:]), rtol=0.0, atol=2.0 * PRINTED)


@pytest.mark.parametrize("hand", [1.0, -1.0])
def test_a_section_of_a_helical_pair_is_the_spur_pair_at_its_own_roll_position(hand):
    pair, _ = drawing("FVA high speed", hand)
    first, last = pair.roll_position_range
    for z in (-20.0, 0.0, 13.0):
        for roll in np.linspace(first, last, 5):
            # The tooth pair whose section at z is where the spur pair is at this roll position.
            own = roll - pair.pinion.twist_per_length * z
            assert_allclose(pair.section_roll_position(own, z), roll, rtol=0.0, atol=EXACT)
            u1, u2 = pair.contact_roll_angles(np.array(roll))
            points = [
                in_global_frame(pair, own, number, tooth.flank_point(u, z), True)
                for number, (tooth, u) in enumerate(((pair.pinion, u1), (pair.wheel, u2)))
            ]
            assert_allclose(points[0], points[1], rtol=0.0, atol=PLACE)


@pytest.mark.parametrize("hand", [1.0, -1.0])
def test_a_helical_pair_is_in_mesh_over_its_total_contact_ratio(hand):
    pair, _ = drawing("FVA low speed", hand)
    pair = GearPair(pair.pinion, pair.wheel, 74.0, 190.0, (-37.0, 30.0), (-20.0, 40.0))
    assert pair.common_face == (-20.0, 30.0)
    assert_allclose(pair.overlap_ratio, 0.6292725 * 50.0 / 74.0, rtol=1e-6)
    first, last = pair.meshing_range
    assert_allclose((last - first) / pair.pitch, pair.total_contact_ratio, rtol=EXACT)
    start, end = pair.roll_position_range
    # It comes into mesh with the face end that is ahead, and leaves it with the other one.
    ahead, behind = (30.0, -20.0) if hand > 0.0 else (-20.0, 30.0)
    assert_allclose(pair.section_roll_position(first, ahead), start, rtol=0.0, atol=EXACT)
    assert_allclose(pair.section_roll_position(last, behind), end, rtol=0.0, atol=EXACT)


def test_overlap_lets_teeth_mesh_whose_profiles_alone_would_lose_contact():
    short = {"addendum": 0.5}
    with pytest.raises(GeometryError, match="contact ratio 0"):
        gear_pair(gear(21, **short), gear(21, **short))
    pair = gear_pair(gear(21, 0.0, 20.0, **short), gear(21, 0.0, -20.0, **short))
    assert pair.contact_ratio < 1.0 < pair.total_contact_ratio


@pytest.mark.parametrize(
    ("pinion", "wheel", "faces", "message"),
    [
        (gear(21, 0.0, 15.0), gear(21, 0.0, 15.0), (), "must be opposite"),
        (gear(21, 0.0, 15.0), gear(21), (), "must be opposite"),
        (gear(21), gear(21), ((0.0, 10.0), (12.0, 20.0)), "beside each other"),
    ],
)
def test_helices_and_faces_that_do_not_meet_are_refused(pinion, wheel, faces, message):
    with pytest.raises(GeometryError, match=message):
        GearPair(pinion, wheel, WIDTH, 90.0, *faces)
