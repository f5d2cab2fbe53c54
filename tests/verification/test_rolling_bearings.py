"""Rolling bearings by their inner geometry: tangents and closed forms; published figures: `pmor.validation`."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.body.rolling_bearing import BallBearing, RollerBearing

BALL = {"balls": 7, "ball_diameter_mm": 11.5, "pitch_diameter_mm": 43.5, "youngs_modulus_GPa": 210.0}
ROLLER = {"rollers": 12, "roller_diameter_mm": 10.0, "effective_length_mm": 9.0, "pitch_diameter_mm": 50.0}
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
