"""Rolling bearings by their inner geometry: tangents and closed forms; published figures: `pmor.validation`."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.machine.rolling_bearing import BallBearing, RollerBearing

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


def test_laminae_without_profile_or_tilt_are_one_roller():
    place = np.array([0.0, 0.02, 0.004, 0.0, 0.0])
    one, many = (RollerBearing(**ROLLER, laminae=n, logarithmic_profile=False).state(place) for n in (1, 41))
    assert_allclose(many.force, one.force, rtol=1e-12, atol=1e-8)


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
