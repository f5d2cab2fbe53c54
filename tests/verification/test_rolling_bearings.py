"""Rolling bearings by their inner geometry: published displacements, tangents, closed forms."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.machine.rolling_bearing import BallBearing, RollerBearing

BALL = {"balls": 7, "ball_diameter_mm": 11.5, "pitch_diameter_mm": 43.5, "youngs_modulus_GPa": 210.0}
ROLLER = {"rollers": 12, "roller_diameter_mm": 10.0, "effective_length_mm": 9.0, "pitch_diameter_mm": 50.0}
PUBLISHED, TILTS = 1e-3, 0.02
# Differences over steps of some nanometres: their error of the second order and round-off.
DIFFERENCES = 1e-6


def displaced(bearing, force, start):
    """Displacement of the inner ring under a force, by Newton's method."""
    place = np.array(start)
    for _ in range(100):
        state = bearing.state(place)
        rest = np.array(force) - state.force
        if np.abs(rest).max() < 1e-9:
            return place
        step = np.linalg.lstsq(state.stiffness, rest, rcond=1e-12)[0]
        place = place + step / max(1.0, np.abs(step[:3]).max() / 0.02, np.abs(step[3:]).max() / 1e-3)
    raise AssertionError("no equilibrium")


def test_the_contact_stiffness_of_a_ball_is_that_of_hertz():
    assert_allclose(BallBearing(**BALL).stiffness_constant, 333375.6, rtol=1e-6)


# A public repository gives these as those of a commercial program; um and mrad.
@pytest.mark.parametrize(
    ("clearance", "force", "expected"),
    [
        (0.0, (0.0, 1e3, 0.0, 0.0, 0.0), {1: 15.1101}),
        (0.0, (1e3, 0.0, 0.0, 0.0, 0.0), {0: 133.5381}),
        (0.0, (0.0, 0.0, 0.0, 0.0, 1e3), {4: 3.6957}),
        (0.01, (0.0, 1e3, 0.0, 0.0, 0.0), {1: 21.223}),
        (0.01, (1e3, 0.0, 0.0, 0.0, 0.0), {0: 149.1717}),
        (0.01, (1e3, 1e3, 0.0, 0.0, 0.0), {1: 19.5923, 0: 146.4603, 4: 2.6872}),
    ],
)
def test_a_ball_bearing_moves_as_published(clearance, force, expected):
    start = (0.05, 0.02, 1e-3, 1e-5, 1e-5) if not force[4] else (0.0, 0.0, 0.0, 0.0, 1e-3)
    found = displaced(BallBearing(**BALL, clearance_mm=clearance), force, start)
    for place, value in expected.items():
        assert_allclose(1e3 * found[place], value, rtol=TILTS if place > 2 else PUBLISHED)


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
