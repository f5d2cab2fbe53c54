"""Rolling bearings by their inner geometry: tangents and closed forms; published figures: `pmor.validation`."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.body.bearing_rows import MIRROR
from pmor.body.roller_bearing import RollerBearing, SphericalRollerBearing
from pmor.body.rolling_bearing import BallBearing

BALL = {"balls": 7, "ball_diameter_mm": 11.5, "pitch_diameter_mm": 43.5, "youngs_modulus_GPa": 210.0}
ROLLER = {"rollers": 12, "roller_diameter_mm": 10.0, "effective_length_mm": 9.0, "pitch_diameter_mm": 50.0}
PAIR = {"rows": 2, "row_spacing_mm": 14.0, "contact_angle_deg": 18.0}
# Differences over steps of some nanometres: their error of the second order and round-off.
DIFFERENCES = 1e-6


@pytest.mark.parametrize(
    "bearing",
    [
        BallBearing(**BALL, clearance_mm=0.008),
        BallBearing(**BALL, contact_angle_deg=25.0),
        BallBearing(**BALL, contact_angle_deg=-40.0, first_ball_deg=11.0),
        RollerBearing(**ROLLER, clearance_mm=0.01),
        RollerBearing(**ROLLER, contact_angle_deg=14.0, first_roller_deg=7.0),
        BallBearing(**BALL, **PAIR, arrangement="back_to_back", axial_preload_mm=0.01),
        RollerBearing(**ROLLER, **PAIR, arrangement="face_to_face", axial_preload_N=900.0),
        RollerBearing(**ROLLER, **(PAIR | {"rows": 3})),
        SphericalRollerBearing(**ROLLER, contact_angle_deg=13.0, clearance_mm=0.01),
    ],
)
def test_the_tangent_is_symmetric_and_that_of_differences(bearing):
    place, step = np.array([0.02, 0.03, -0.015, 4e-4, -3e-4]), np.diag([1e-6, 1e-6, 1e-6, 1e-7, 1e-7])
    if bearing == RollerBearing(**ROLLER, clearance_mm=0.01):
        place[0] = 0.0
    state = bearing.state(place)
    assert np.count_nonzero(state.element_force) > 2
    differences = np.array([bearing.state(place + d).force - bearing.state(place - d).force for d in step])
    differences /= 2.0 * np.diag(step)[:, None]
    size = np.sqrt(np.outer(np.diag(state.stiffness), np.diag(state.stiffness)) + 1e-30)
    scale = np.where(size > 0.0, size, 1.0)
    assert_allclose((differences - state.stiffness) / scale.max(), 0.0, atol=DIFFERENCES)
    assert_allclose(state.stiffness, state.stiffness.T, rtol=0.0, atol=1e-12 * scale.max())


def test_a_roller_bearing_of_one_lamina_is_the_closed_form():
    """Palmgren's law of each roller, at its own approach."""
    bearing, radial, clearance = RollerBearing(**ROLLER, clearance_mm=0.006, laminae=1), 0.02, 0.006
    azimuth = 2.0 * math.pi * np.arange(12) / 12
    approach = np.maximum(radial * np.cos(azimuth) - 0.5 * clearance, 0.0)
    load = 35948.0 * 9.0 ** (8.0 / 9.0) * approach ** (10.0 / 9.0)
    state = bearing.state(np.array([0.3, radial, 0.0, 0.0, 0.0]))
    assert_allclose(state.element_force, load, rtol=1e-13)
    assert_allclose(state.force, [0.0, load @ np.cos(azimuth), 0.0, 0.0, 0.0], atol=1e-10 * load.max())


@pytest.mark.parametrize("count", [3, 8, 17])
def test_a_preloaded_ring_of_many_elements_is_the_sum_of_its_springs(count):
    """With preload all elements carry: K_yy is the sum of k cos^2, half of N k."""
    bearing = RollerBearing(**(ROLLER | {"rollers": count}), clearance_mm=-0.02, laminae=1)
    spring = bearing.stiffness_constant * 10.0 / 9.0 * 0.01 ** (1.0 / 9.0)
    stiffness = bearing.state(np.zeros(5)).stiffness
    assert_allclose(np.diag(stiffness)[1:3], 0.5 * count * spring, rtol=1e-12)
    assert_allclose(stiffness[1, 2], 0.0, atol=1e-9 * spring)


def test_a_tilted_roller_carries_at_its_end_and_resists():
    bearing = RollerBearing(**ROLLER)
    straight, tilted = (bearing.state(np.array([0.0, 0.02, 0.0, 0.0, tilt])) for tilt in (0.0, 1e-3))
    assert tilted.force[4] > 1e3
    assert abs(straight.force[4]) < 1e-6 * tilted.force[4]


@pytest.mark.parametrize("angle", [0.0, 15.0, 28.0, -15.0])
def test_about_the_crossing_point_of_the_normals_the_moment_of_a_tilt_is_that_of_a_cylindrical_roller_bearing(angle):
    """The line of contact is perpendicular to its normal, so that its arms about that point have any cone's length."""
    size = {"rollers": 18, "roller_diameter_mm": 8.0, "effective_length_mm": 14.0, "pitch_diameter_mm": 60.0}
    tilt, pressed, alpha = 1.5e-3, 0.02, math.radians(angle)
    bearing = RollerBearing(**size, contact_angle_deg=angle, clearance_mm=-2.0 * pressed / math.cos(alpha))
    # From the middle plane to the crossing point, whose place does not move.
    crossing = -0.5 * size["pitch_diameter_mm"] * math.tan(alpha)
    force = bearing.state(np.array([0.0, -crossing * tilt, 0.0, 0.0, tilt])).force
    azimuth = 2.0 * math.pi * np.arange(18) / 18
    place = 14.0 * ((np.arange(41) + 0.5) / 41 - 0.5)
    drop = -0.00035 * 8.0 * np.log1p(-((place / 7.0) ** 2))
    approach = pressed + tilt * np.cos(azimuth)[:, None] * place - 2.0 * drop
    load = 35948.0 * 14.0 ** (8.0 / 9.0) / 41 * np.maximum(approach, 0.0) ** (10.0 / 9.0)
    moment = float((load * np.cos(azimuth)[:, None] * place).sum())
    assert_allclose(force[4] - crossing * force[1], moment, rtol=1e-9)


SPHERICAL = SphericalRollerBearing(20, 14.0, 14.0, 100.0, contact_angle_deg=12.0, clearance_mm=0.02)


def test_a_spherical_roller_bearing_takes_no_moment_however_it_is_tilted():
    """About the middle of its sphere, to the last digit: a tilt is a roll on it."""
    place = np.array([0.01, 0.03, -0.02, 0.0, 0.0])
    straight, tilted = SPHERICAL.state(place), SPHERICAL.state(place + [0.0, 0.0, 0.0, 0.02, -0.03])
    assert np.count_nonzero(straight.element_force) > 8
    assert (straight.force == tilted.force).all()
    assert (straight.force[3:] == 0.0).all()
    assert (straight.stiffness[3:] == 0.0).all()


def test_rows_of_a_spherical_roller_bearing_share_forces_across_and_thrust_is_on_one():
    """Normals of the row at +x point there: it takes thrust along +x, to which forces across add up by statics."""
    across, along = (SPHERICAL.state(np.array(place)) for place in ([0.0, 0.03, 0, 0, 0], [0.1, 0.0, 0, 0, 0]))
    assert_allclose(across.row_force[:, 1], 0.5 * across.force[1], rtol=0.05)
    assert_allclose(across.row_force[0, 0], -across.row_force[1, 0], rtol=0.05)
    assert across.row_force[1, 0] > 0.0
    assert (along.row_force[0] == 0.0).all()
    assert_allclose(along.row_force[1, 0], along.force[0], rtol=1e-14)
    places = np.array(SPHERICAL.row_places)
    assert_allclose(places, [-50.0 * math.tan(math.radians(12.0)), 50.0 * math.tan(math.radians(12.0))], rtol=1e-14)


def test_barrels_as_round_as_their_sphere_are_pressed_alike_all_along():
    """Palmgren's law of each roller along its normal; a smaller radius lets the ends off."""
    radius = SPHERICAL.sphere_mm
    snug, round_ = (
        SphericalRollerBearing(18, 14.0, 14.0, 100.0, contact_angle_deg=12.0, profile_radius_mm=share * radius)
        for share in (1.0, 0.97)
    )
    assert_allclose(radius, 50.0 / math.cos(math.radians(12.0)) + 7.0, rtol=1e-14)
    place, alpha = np.array([0.004, 0.02, 0.0, 0.0, 0.0]), math.radians(12.0)
    psi = 2.0 * math.pi * (np.arange(18) + np.array([[0.0], [0.5]])) / 18
    approach = math.cos(alpha) * 0.02 * np.cos(psi) + np.array([[-1.0], [1.0]]) * math.sin(alpha) * 0.004
    load = 35948.0 * 14.0 ** (8.0 / 9.0) * np.maximum(approach, 0.0) ** (10.0 / 9.0)
    assert_allclose(snug.state(place).element_force, load.ravel(), rtol=1e-12)
    ends = round_.state(place).lamina_force
    assert (ends.sum(axis=2) <= load + 1e-9).all()
    assert (ends[..., 0][load > 0.0] < ends[..., 20][load > 0.0]).all()


@pytest.mark.parametrize(("arrangement", "images"), [
    ("tandem", (False, False)), ("back_to_back", (False, True)), ("face_to_face", (True, False)),
])  # fmt: skip
@pytest.mark.parametrize("kind", [BallBearing, RollerBearing])
def test_rows_of_one_bearing_are_bearings_beside_each_other(kind, arrangement, images):
    """Each at its place, half a pitch of its elements on, and the image of the other one across the axis."""
    size, first = (BALL, "first_ball_deg") if kind is BallBearing else (ROLLER, "first_roller_deg")
    whole = kind(**size, **PAIR, arrangement=arrangement, clearance_mm=0.004)
    place, force = np.array([0.02, 0.03, -0.015, 4e-4, -3e-4]), np.zeros(5)
    for number, (x, image) in enumerate(zip((-7.0, 7.0), images, strict=True)):
        half = 180.0 / size["balls" if kind is BallBearing else "rollers"]
        row = kind(**size, contact_angle_deg=18.0, clearance_mm=0.004, **{first: number * half})
        moved = place + np.array([0.0, x * place[4], -x * place[3], 0.0, 0.0])
        side = MIRROR if image else np.ones(5)
        own = side * row.state(side * moved).force
        force += own + np.array([0.0, 0.0, 0.0, -x * own[2], x * own[1]])
        assert_allclose(whole.state(place).row_force[number, :3], own[:3], rtol=1e-10)
    assert_allclose(whole.state(place).force, force, rtol=1e-10)


@pytest.mark.parametrize("arrangement", ["back_to_back", "face_to_face"])
@pytest.mark.parametrize("bearing", [BallBearing(**BALL), RollerBearing(**ROLLER, clearance_mm=0.03)])
def test_a_preload_is_what_each_row_carries_at_rest(bearing, arrangement):
    """Against each other: along the axis nothing is left."""
    pair = replace(bearing, **PAIR, arrangement=arrangement, axial_preload_N=1200.0)
    state, way = pair.state(np.zeros(5)), 1.0 if arrangement == "back_to_back" else -1.0
    assert_allclose(state.row_force[:, 0], [way * 1200.0, -way * 1200.0], rtol=1e-9)
    assert_allclose(state.force, 0.0, atol=1e-6)
    by_way = replace(pair, axial_preload_N=0.0, axial_preload_mm=pair.pushed)
    assert_allclose(by_way.state(np.zeros(5)).row_force, state.row_force, rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize("angle", [12.0, -25.0])
def test_pushing_tapered_rollers_along_the_axis_is_taking_their_clearance_off(angle):
    """s / 2 = delta tan(alpha), whichever way they take thrust; negative is play."""
    place = np.array([0.0, 0.02, 0.005, 0.0, 1e-4])
    for amount in (0.03, -0.01):
        pushed = RollerBearing(**ROLLER, contact_angle_deg=angle, axial_preload_mm=amount)
        off = -2.0 * amount * math.tan(math.radians(abs(angle)))
        tight = RollerBearing(**ROLLER, contact_angle_deg=angle, clearance_mm=off)
        assert_allclose(pushed.state(place).force, tight.state(place).force, rtol=1e-12, atol=1e-9)


# f_0 of ISO 76:2006, table 1, radial ball bearings, by D_w cos(alpha) / D_pw.
STATIC_FACTORS = {0.05: 15.7, 0.1: 16.4, 0.12: 15.9, 0.16: 14.9, 0.2: 14.0, 0.3: 11.6}


@pytest.mark.parametrize("ratio", STATIC_FACTORS)
def test_balls_reach_the_static_load_rating_at_its_pressure(ratio):
    """C_0 = f_0 Z D_w^2 and Q = 5 F_r / Z: static safety 1, to the digits of the table."""
    bearing = BallBearing(balls=9, ball_diameter_mm=10.0, pitch_diameter_mm=10.0 / ratio)
    load = 5.0 * STATIC_FACTORS[ratio] * 10.0**2
    assert_allclose(bearing.pressure(load), 4200.0, rtol=2e-3)
    approach = (load / bearing.stiffness_constant) ** (2.0 / 3.0)
    state = bearing.state(np.array([0.0, approach, 0.0, 0.0, 0.0]))
    assert_allclose(state.static_safety, 1.0, rtol=6e-3)


def test_rollers_reach_the_static_load_rating_at_its_pressure():
    """C_0 = 44 (1 - gamma) Z L_we D_we, its factor rounded."""
    bearing = RollerBearing(**ROLLER, laminae=1)
    load = 5.0 * 44.0 * (1.0 - 0.2) * 10.0
    assert_allclose(bearing.pressure(load), 4000.0, rtol=3e-3)
    approach = (load * 9.0 / bearing.stiffness_constant) ** 0.9
    assert_allclose(bearing.state(np.array([0.0, approach, 0.0, 0.0, 0.0])).static_safety, 1.0, rtol=5e-3)
