"""Random gears and pairs: what holds for every involute, and outlines and meshes that can be made of them."""

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from pmor.core.errors import GeometryError, MeshError
from pmor.gear.pair import GearPair, zero_backlash_centre_distance
from pmor.gear.tooth import Tooth, involute_function
from pmor.mesh.outline import tooth_outline
from pmor.mesh.quality import mesh_quality
from pmor.mesh.sector import build_sector

EXACT = 1e-11  # relative; closed forms differ by round-off
ROOT = 1e-9  # mm in a module of 1: root finders

PARAMETERS = {
    "teeth": st.one_of(st.integers(10, 60), st.integers(6, 1000)),
    "module": st.floats(0.05, 100.0),
    "pressure_angle": st.floats(10.0, 35.0).map(math.radians),
    "profile_shift": st.one_of(st.just(0.0), st.floats(-0.6, 0.8), st.floats(-3.0, 3.0)),
    "addendum": st.one_of(st.floats(0.7, 1.3), st.floats(0.1, 3.0)),
    "dedendum": st.one_of(st.floats(1.0, 1.5), st.floats(0.1, 4.0)),
    "rack_tip_radius": st.one_of(st.floats(0.0, 0.4), st.floats(0.0, 1.0)),
}
many = settings(max_examples=60, deadline=None, database=None, derandomize=True,
                suppress_health_check=list(HealthCheck))  # fmt: skip


def check_message(error):
    assert (error.exit_code, len(str(error).splitlines())) == (2, 1), error


@st.composite
def teeth(draw, **given_values):
    """Teeth that can be made; those that cannot are refused with one line."""
    values = {name: given_values.get(name) or draw(strategy) for name, strategy in PARAMETERS.items()}
    try:
        return Tooth(**values)
    except GeometryError as error:
        check_message(error)
        assume(False)


@st.composite
def pairs(draw):
    pinion = draw(teeth())
    wheel = draw(teeth(module=pinion.module, pressure_angle=pinion.pressure_angle))
    try:
        distance = zero_backlash_centre_distance(pinion, wheel) + pinion.module * draw(
            st.one_of(st.just(0.0), st.floats(0.0, 0.5))
        )
        return GearPair(pinion, wheel, 10.0 * pinion.module, distance)
    except GeometryError as error:
        check_message(error)
        assume(False)


def polar(points):
    """Radius and angle from the centre line of the tooth, counter-clockwise."""
    return np.linalg.norm(points, axis=-1), np.arctan2(-points[..., 0], points[..., 1])


@many
@given(teeth())
def test_the_flank_is_the_involute_of_the_base_circle(tooth):
    roll = np.linspace(tooth.form_roll_angle, tooth.tip_roll_angle, 9)
    radius, angle = polar(tooth.flank_section(roll))
    assert_allclose(radius, tooth.base_radius * np.hypot(1.0, roll), rtol=EXACT)
    # inv(alpha) = roll - atan(roll), from the foot on the base circle
    assert_allclose(angle, tooth.base_half_angle - (roll - np.arctan(roll)), rtol=0, atol=EXACT)
    assert np.all(np.diff(angle) <= 0.0), "the tooth narrows towards its tip"
    assert 0.0 < angle[-1]
    assert angle[0] < math.pi / tooth.teeth, "a space is left between the teeth"
    assert_allclose(radius[-1], tooth.tip_radius, rtol=EXACT)


@many
@given(teeth())
def test_thickness_and_space_fill_the_pitch_of_the_reference_circle(tooth):
    roll = tooth.roll_angle_at(tooth.reference_radius)
    angle = tooth.half_thickness_angle(roll)
    thickness = 2.0 * tooth.reference_radius * angle
    expected = tooth.module * (0.5 * math.pi + 2.0 * tooth.profile_shift * math.tan(tooth.pressure_angle))
    assert_allclose(thickness, expected, rtol=0, atol=EXACT * tooth.reference_radius)


@many
@given(teeth())
def test_the_fillet_goes_from_the_root_circle_to_the_involute_without_turning_back(tooth):
    radius, angle = polar(tooth.root_section(np.linspace(0.0, 1.0, 301)))
    start_radius, start_angle = polar(tooth.flank_section(np.array([tooth.form_roll_angle])))
    scale = tooth.module
    assert_allclose(radius[0], start_radius[0], rtol=0, atol=ROOT * tooth.reference_radius)
    assert_allclose(angle[0], start_angle[0], rtol=0, atol=ROOT)
    assert_allclose(radius[-1], tooth.root_radius, rtol=0, atol=EXACT * tooth.reference_radius)
    assert np.diff(radius).max() <= 1e-9 * scale + EXACT * tooth.reference_radius
    assert angle.max() <= math.pi / tooth.teeth + 1e-9


@many
@given(pairs())
def test_contact_ratio_is_the_path_of_contact_over_the_base_pitch(pair):
    """By another way than the code: lengths along the line of action from circles, as in the textbooks."""
    gears = pair.pinion, pair.wheel
    tip = [math.sqrt(gear.tip_radius**2 - gear.base_radius**2) for gear in gears]
    form = [gear.base_radius * gear.form_roll_angle for gear in gears]
    length = math.sqrt(pair.centre_distance**2 - (gears[0].base_radius + gears[1].base_radius) ** 2)
    path = min(tip[0], length - form[1]) - max(form[0], length - tip[1])
    base_pitch = math.pi * pair.pinion.module * math.cos(pair.pinion.pressure_angle)
    assert_allclose(pair.contact_ratio, path / base_pitch, rtol=0, atol=1e-9 * pair.centre_distance / base_pitch)
    assert 1.0 <= pair.contact_ratio < 10.0


@many
@given(pairs())
def test_flanks_touch_on_the_line_of_action_all_along_the_path(pair):
    """Both roll angles of a contact point lie on the flanks, and their arcs add up to the line of action."""
    first, last = pair.roll_position_range
    u1, u2 = pair.contact_roll_angles(np.linspace(first, last, 7))
    total = u1 * pair.pinion.base_radius + u2 * pair.wheel.base_radius
    assert_allclose(total, pair.action_length, rtol=EXACT)
    for gear, u in ((pair.pinion, u1), (pair.wheel, u2)):
        slack = 1e-9 * pair.centre_distance / gear.base_radius
        assert u.min() >= gear.form_roll_angle - slack
        assert u.max() <= gear.tip_roll_angle + slack


@many
@given(pairs())
def test_the_working_pitch_circles_roll_on_each_other(pair):
    working = pair.working_pressure_angle
    radii = [gear.base_radius / math.cos(working) for gear in (pair.pinion, pair.wheel)]
    assert_allclose(sum(radii), pair.centre_distance, rtol=EXACT)
    assert_allclose(radii[0] / radii[1], pair.pinion.teeth / pair.wheel.teeth, rtol=EXACT)
    shift = pair.pinion.profile_shift + pair.wheel.profile_shift
    teeth_sum = pair.pinion.teeth + pair.wheel.teeth
    # inv(working) - inv(reference) = 2 tan(alpha) (x1 + x2) / (z1 + z2) without backlash, and more with it
    backlash = involute_function(working) - involute_function(pair.pinion.pressure_angle)
    assert backlash >= 2.0 * math.tan(pair.pinion.pressure_angle) * shift / teeth_sum - 1e-9


def crosses_itself(points):
    """Whether an open polygon has two edges that cross, by trying all pairs."""
    a, b = points[:-1], points[1:]

    def side(p, q, r):
        return (q[..., 0] - p[..., 0]) * (r[..., 1] - p[..., 1]) - (q[..., 1] - p[..., 1]) * (r[..., 0] - p[..., 0])

    first, second = np.triu_indices(len(a), k=2)
    straddles = side(a[first], b[first], a[second]) * side(a[first], b[first], b[second]) < 0.0
    straddled = side(a[second], b[second], a[first]) * side(a[second], b[second], b[first]) < 0.0
    return bool(np.any(straddles & straddled))


def test_a_polygon_that_crosses_itself_is_noticed():
    assert crosses_itself(np.array([[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]))
    assert not crosses_itself(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]))


def test_a_corner_in_place_of_a_fillet_is_refused():
    corner = Tooth(10, 1.0, math.radians(10.0), profile_shift=1.0, addendum=0.75, dedendum=1.0, rack_tip_radius=0.0)
    with pytest.raises(MeshError, match="rack_tip_radius = 0: leaves a corner .*; raise it"):
        tooth_outline(corner, 4, "arc_length")


@many
@given(teeth(), st.integers(2, 40), st.sampled_from(["arc_length", "roll_angle"]), st.floats(0.05, 0.95))
def test_outlines_do_not_cross_and_meshes_are_sound_or_refused(tooth, elements, spacing, bore):
    rim = tooth.root_radius - 0.5 * tooth.module
    assume(rim > 0.1 * tooth.module)
    outline = tooth_outline(tooth, elements, spacing)
    half = np.concatenate([outline.lower_fillet[:-1], outline.upper_fillet[:-1], outline.flank])
    mirrored = (half * np.array([-1.0, 1.0]))[::-1]
    try:
        mesh = build_sector(tooth, bore * rim, tooth.module, elements, 1, spacing)
        quality = mesh_quality(mesh.nodes, mesh.elements)
    except MeshError as error:
        check_message(error)
        return
    assert np.isfinite(mesh.nodes).all()
    assert not crosses_itself(np.concatenate([half, mirrored]))
    assert 0.0 < quality.min_scaled_jacobian <= 1.0 + 1e-12
