"""Life of rolling bearings by the loads of their elements: ISO/TS 16281 is ISO 281 where its assumptions hold."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.body.bearing_equilibrium import loaded_bearing
from pmor.body.bearing_life import (
    added_up,
    dynamic_rating_N,
    hours,
    raceway_ratings_N,
    reference_life,
    stress_riser,
)
from pmor.body.bearing_readings import duty_lives, pin_bearing_data, rolling_data
from pmor.body.roller_bearing import RollerBearing, SphericalRollerBearing
from pmor.body.rolling_bearing import BallBearing

# f_c of ISO 281:2007, its tables, by D_w cos(alpha) / D_pw: radial ball and roller bearings.
BALL_FACTORS = {0.05: 46.7, 0.1: 55.5, 0.16: 59.6, 0.2: 59.9, 0.3: 56.0}
ROLLER_FACTORS = {0.05: 74.1, 0.1: 84.2, 0.16: 88.5, 0.2: 88.7, 0.3: 83.8}
# Digits of these tables, and of 0.407, 0.389, 0.378, 0.364.
DIGITS = 2e-3
# Of a sum over so many elements instead of an integral.
MANY, SUMMED = 720, 1e-4
ACROSS = np.array([0.0, 0.01, 0.0, 0.0, 0.0])


@pytest.mark.parametrize("ratio", BALL_FACTORS)
def test_the_rating_by_geometry_has_the_factors_of_the_standard(ratio):
    balls = BallBearing(9, 10.0, 10.0 / ratio)
    rollers = RollerBearing(12, 10.0, 14.0, 10.0 / ratio)
    assert_allclose(dynamic_rating_N(balls), 1.3 * BALL_FACTORS[ratio] * 9.0 ** (2.0 / 3.0) * 10.0**1.8, rtol=DIGITS)
    size = 14.0 ** (7.0 / 9.0) * 12.0**0.75 * 10.0 ** (29.0 / 27.0)
    assert_allclose(dynamic_rating_N(rollers), 1.1 * ROLLER_FACTORS[ratio] * size, rtol=DIGITS)


def test_the_rating_of_a_6205_is_that_of_its_catalogue():
    """9 balls of 7.938 mm on 38.5 mm: 14.0 kN."""
    assert_allclose(dynamic_rating_N(BallBearing(9, 7.938, 38.5)), 14.0e3, rtol=5e-3)


def integrals(exponent, powers):
    """J_r, and J of both powers, of half a circle of loads cos^exponent (Sjoevall)."""
    psi = np.linspace(-0.5 * math.pi, 0.5 * math.pi, 20001)
    load, step = np.cos(psi) ** exponent, psi[1] - psi[0]
    across = (load * np.cos(psi)).sum() * step / (2.0 * math.pi)
    return across, [((load**power).sum() * step / (2.0 * math.pi)) ** (1.0 / power) for power in powers]


@pytest.mark.parametrize(
    ("bearing", "exponent", "powers", "halves", "life"),
    [
        (BallBearing(MANY, 0.2, 60.0), 1.5, (3.0, 10.0 / 3.0), (0.407, 0.389), 3.0),
        (RollerBearing(MANY, 0.2, 0.2, 60.0, laminae=1), 10.0 / 9.0, (4.0, 4.5), (0.378, 0.364), 4.0),
    ],
    ids=["balls", "rollers"],
)
def test_half_a_circle_of_loads_without_clearance_has_the_life_of_iso_281(bearing, exponent, powers, halves, life):
    """L_10r is (C / P)^p but for the digits of J_r / J of each ring, of which it is a mean weighted by their damage."""
    state = bearing.state(ACROSS)
    rating = dynamic_rating_N(bearing) / (1.0 if life == 3.0 else 0.83)
    across, of_rings = integrals(exponent, powers)
    exact = [(across / (half * ring)) ** life for half, ring in zip(halves, of_rings, strict=True)]
    found = reference_life(bearing, state.lamina_force) / (rating / state.force[1]) ** life
    assert min(exact) * (1.0 - SUMMED) <= found <= max(exact) * (1.0 + SUMMED)
    assert_allclose(exact, 1.0, rtol=0.03)


def test_laminae_that_carry_alike_are_one_roller():
    """But for the stress riser, which is taken out."""
    one, many = (RollerBearing(9, 10.0, 12.0, 60.0, laminae=n, logarithmic_profile=False) for n in (1, 31))
    lives = [reference_life(b, b.state(ACROSS).lamina_force / stress_riser(b.laminae)) for b in (one, many)]
    assert_allclose(*lives, rtol=1e-10)


def test_a_lamina_at_the_end_counts_more_and_the_middle_as_it_is():
    riser = stress_riser(41)
    assert riser[20] == 1.0
    assert_allclose(riser, riser[::-1], rtol=1e-15)
    assert (np.diff(riser[20:]) > 0.0).all()
    assert_allclose(riser[-1], 1.0 - 0.01 / math.log(0.9925), rtol=1e-12)


@pytest.mark.parametrize(
    ("kind", "shape", "share"), [(BallBearing, 10.0 / 9.0, 0.7), (RollerBearing, 9.0 / 8.0, 7.0 / 9.0)]
)
def test_rows_survive_together(kind, shape, share):
    """Of two rows that carry alike both must live: Weibull's product of the lives of one."""
    size = (10, 10.0, 60.0) if kind is BallBearing else (10, 10.0, 12.0, 60.0)
    two = kind(*size, rows=2, row_spacing_mm=20.0, dynamic_rating_N=4e4)
    one = kind(*size, dynamic_rating_N=4e4 / 2.0**share)
    force = one.state(ACROSS).lamina_force
    alone = reference_life(one, force)
    assert_allclose(reference_life(two, np.concatenate([force, force])), alone * 2.0 ** (-1.0 / shape), rtol=1e-12)


@pytest.mark.parametrize("bearing", [BallBearing(9, 10.0, 60.0), RollerBearing(12, 10.0, 12.0, 60.0)])
def test_a_ring_that_stands_against_the_load_wears_more(bearing):
    force = bearing.state(ACROSS).lamina_force
    both, inner, outer, none = (
        reference_life(bearing, force, turns) for turns in ((True, True), (True, False), (False, True), (False, False))
    )
    assert both > inner > none
    assert both > outer > none


def test_capacities_of_both_raceways_make_the_rating():
    """C = {(0.407 Z Q_ci)^-w + (0.389 Z Q_ce)^-w}^(-1/w)."""
    bearing = BallBearing(9, 10.0, 60.0, contact_angle_deg=25.0, dynamic_rating_N=2e4)
    ratings, power, arm = raceway_ratings_N(bearing, 2e4), 10.0 / 3.0, 9.0 * math.cos(math.radians(25.0)) ** 0.7
    rings = [half * arm * rating for half, rating in zip((0.407, 0.389), ratings, strict=True)]
    assert_allclose(sum(ring**-power for ring in rings) ** (-1.0 / power), 2e4, rtol=5e-3)


def test_clearance_and_misalignment_take_life():
    rollers = {"rollers": 14, "roller_diameter_mm": 10.0, "effective_length_mm": 14.0, "pitch_diameter_mm": 60.0}
    lives = []
    for clearance, tilt in ((0.0, 0.0), (0.04, 0.0), (0.0, 1e-3)):
        bearing = RollerBearing(**rollers, clearance_mm=clearance)
        moment = bearing.state(np.array([0.0, 0.015, 0.0, 0.0, tilt])).force[4]
        state = loaded_bearing(bearing, np.array([0.0, 8e3, 0.0, 0.0, moment])).state
        lives.append(reference_life(bearing, state.lamina_force))
    assert lives[0] > lives[1]
    assert lives[0] > lives[2]


def test_a_thrust_bearing_and_one_without_load_have_no_life_in_numbers():
    thrust, loose = BallBearing(9, 10.0, 60.0, contact_angle_deg=60.0), BallBearing(9, 10.0, 60.0, clearance_mm=0.1)
    assert rolling_data(thrust, [thrust.state(ACROSS)], (True, False), 1500.0)["reference_life_1e6"] is None
    assert reference_life(loose, loose.state(ACROSS).lamina_force) == math.inf
    assert rolling_data(loose, [loose.state(ACROSS)], (True, False), 1500.0)["reference_life_h"] is None


def test_damages_of_a_duty_cycle_add_up_by_time():
    """A harmonic sum; a load under which a bearing does not turn or carries nothing does not wear it."""
    assert_allclose(added_up((100.0, 400.0), (0.25, 0.75)), 1.0 / (0.25 / 100.0 + 0.75 / 400.0), rtol=1e-15)
    assert hours(3.0, -1500.0) == pytest.approx(3e6 / 9e4)
    bearing = BallBearing(9, 10.0, 60.0)
    rows = {
        name: {**rolling_data(bearing, [bearing.state(across * ACROSS)], (True, False), rpm), "name": "A"}
        for name, across, rpm in (("full", 1.0, 1000.0), ("half", 0.5, 2000.0), ("rest", 1.0, 0.0), ("none", 0.0, 1e3))
    }
    loads, shares = [{"bearings": [row]} for row in rows.values()], (0.2, 0.5, 0.2, 0.1)
    (found,) = duty_lives(list(rows), loads, shares)
    damage = [0.2 / rows["full"]["reference_life_h"], 0.5 / rows["half"]["reference_life_h"]]
    assert_allclose(found["reference_life_h"], 1.0 / sum(damage), rtol=1e-14)
    assert found["most_damage"] == "full"
    assert_allclose(found["damage_share"], damage[0] / sum(damage), rtol=1e-14)
    unknown = [*loads[:1], {"bearings": [{**rows["half"], "bearing_rpm": None, "reference_life_h": None}]}]
    assert duty_lives(["full", "half"], unknown, (0.5, 0.5))[0]["reference_life_h"] is None


def test_states_that_follow_each_other_wear_by_the_mean_of_their_damages():
    bearing = SphericalRollerBearing(20, 14.0, 14.0, 100.0, contact_angle_deg=10.0)
    states = [bearing.state(share * ACROSS) for share in (1.0, 2.0, 3.0)]
    lives = [reference_life(bearing, state.lamina_force) for state in states]
    found = rolling_data(bearing, states, (True, False), None)
    assert_allclose(found["reference_life_1e6"], 3.0 / sum(1.0 / life for life in lives), rtol=1e-14)
    assert found["element_force_N"] == states[2].element_force.tolist()
    assert found["reference_life_h"] is None


def test_a_planet_that_is_pushed_outwards_loads_its_rollers_towards_the_axis():
    """30 degrees further around it is the same, seen from outwards on; moments turn with it."""
    rollers, found = RollerBearing(16, 8.0, 12.0, 60.0), []
    for angle in (0.0, math.radians(30.0)):
        out, around = np.array([math.cos(angle), math.sin(angle)]), np.array([-math.sin(angle), math.cos(angle)])
        load = np.concatenate([5e3 * out + 1e3 * around, 4e3 * out - 2e3 * around])[None, None]
        found.append(pin_bearing_data([rollers], load, angle, -200.0)[0])
    (row,) = found[0]["rows"]
    assert row["element_azimuth_deg"][int(np.argmax(row["element_force_N"]))] == 180.0
    assert_allclose(row["force_N"], [0.0, -5e3, -1e3], atol=1e-4)
    assert_allclose(found[0]["element_force_N"], found[1]["element_force_N"], atol=1e-4)
    assert found[0]["reference_life_h"] == pytest.approx(1e6 * found[0]["reference_life_1e6"] / (60.0 * 200.0))
    assert pin_bearing_data([None], load, 0.0, None) == [{}]


@pytest.mark.parametrize("seed", range(3))
def test_a_bearing_alone_finds_the_state_that_carries_a_force(seed):
    rng = np.random.default_rng(seed)
    bearings = [
        BallBearing(9, 10.0, 60.0, clearance_mm=rng.uniform(-0.01, 0.05)),
        BallBearing(12, 10.0, 60.0, contact_angle_deg=25.0, rows=2, row_spacing_mm=14.0, arrangement="back_to_back",
                    axial_preload_N=rng.uniform(50.0, 800.0)),
        RollerBearing(16, 8.0, 12.0, 60.0, rows=2, row_spacing_mm=15.0, clearance_mm=rng.uniform(0.0, 0.05)),
        SphericalRollerBearing(20, 14.0, 14.0, 100.0, contact_angle_deg=11.0, clearance_mm=rng.uniform(0.0, 0.05)),
    ]  # fmt: skip
    for bearing, held in zip(bearings, ((1, 1, 1), (1, 1, 1), (0, 1, 1), (1, 1, 0)), strict=True):
        force = rng.normal(size=5) * [800.0, 4e3, 4e3, 1e4, 1e4] * np.repeat(held, (1, 2, 2))
        found = loaded_bearing(bearing, force)
        assert_allclose(found.state.force, force, atol=1e-8 * np.abs(force).max())
        again = loaded_bearing(bearing, 1.1 * force, found)
        assert_allclose(again.state.force, 1.1 * force, atol=1e-8 * np.abs(force).max())
    # Nothing holds cylindrical rollers along the axis.
    assert loaded_bearing(bearings[2], np.array([500.0, 1e3, 0.0, 0.0, 0.0])) is None
