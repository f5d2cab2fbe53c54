"""Parts of a design that know no gears: smooth figures, percentiles, fronts, steps of manufacture, draws."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from pmor.case import parse_case
from pmor.design.harris import highest_single_contact
from pmor.design.loader import settings_of
from pmor.design.measures import (
    draw_weights,
    order_amplitude,
    order_rates,
    peak_to_peak,
    percentile_weights,
    smooth_peak_to_peak,
)
from pmor.design.settings import Scatter, Variable
from pmor.design.variables import AS_DRAWN, Draw, assembly_at, drawn, neighbours, spread_evenly, steps_around, to_steps
from pmor.gear.condition import PLAIN, Assembly, Misalignment
from pmor.work.front import pareto_front
from tests.support.gear_models import gear_pair, tooth
from tests.support.small_design import CASE

RELIEF = Variable(key="tip_relief_um", range=(0.0, 10.0), step=2.0)
START = Variable(key="tip_relief_start_roll_deg", gear="wheel", range=(20.0, 24.0))


def drawn_pairs(scatter, count):
    file = settings_of(
        parse_case(CASE, "small", "small"), {"variables": [{"key": "profile_slope_um", "range": [0, 1]}]}
    )
    return [draw.meshes[0] for draw in drawn(file, scatter, count)]


def quotient(function, x, h=1e-6):
    return np.array([(function(x + h * e) - function(x - h * e)) / (2.0 * h) for e in np.eye(len(x))])


def test_the_smooth_peak_to_peak_comes_from_below_within_its_bound(rng):
    curves = rng.normal(size=(20, 32))
    for sharpness in (2.0, 30.0):
        smooth, _ = smooth_peak_to_peak(curves, sharpness)
        lacks = peak_to_peak(curves) - smooth
        assert (lacks >= 0.0).all()
        assert (lacks <= 2.0 * np.log(32) / sharpness).all()
    assert_allclose(smooth_peak_to_peak(np.full((1, 8), 3.0), 1e4)[0], 0.0, atol=1e-12)


@pytest.mark.parametrize("sharpness", [1.0, 40.0])
def test_derivatives_of_figures_are_those_of_quotients(rng, sharpness):
    curve = rng.normal(size=16)
    found = smooth_peak_to_peak(curve, sharpness)[1]
    # A quotient of step 1e-6: its round-off is 1e-10, its curvature 1e-12 sharpness^2.
    assert_allclose(found, quotient(lambda c: smooth_peak_to_peak(c, sharpness)[0], curve), atol=3e-9)
    for order in (1, 3):
        found = order_rates(curve, order)[1]
        assert_allclose(found, quotient(lambda c, k=order: order_amplitude(c, k), curve), atol=1e-9)


def test_the_amplitude_of_a_cosine_is_its_own():
    angle = 2.0 * np.pi * np.arange(24) / 24
    assert_allclose(order_amplitude(1.5 * np.cos(3 * angle + 0.4) + 7.0, 3), 1.5, rtol=1e-13)
    assert_allclose(order_rates(np.zeros(24), 1)[1], 0.0, atol=0.0)


def test_the_percentile_of_many_draws_is_that_of_their_distribution(rng):
    assert_allclose(percentile_weights(64).sum(), 1.0, rtol=1e-12)
    values = rng.normal(size=4000)
    # 95 % of a normal distribution stay below 1.645; its estimate from 4,000 scatters by 0.033.
    assert_allclose(draw_weights(values, "percentile_95") @ values, 1.645, atol=0.1)
    assert_allclose(draw_weights(values, "expected") @ values, values.mean(), rtol=1e-12)


def test_nothing_beats_what_is_on_the_front(rng):
    values = rng.random((200, 2))
    values[7] = np.nan
    front = pareto_front(values)
    beaten = [any((other < one).all() for other in values) for one in values]
    assert_array_equal(np.sort(front), [n for n in range(200) if not beaten[n] and n != 7])
    assert pareto_front(np.array([[1.0, 2.0], [1.0, 2.0], [np.nan, 0.0]])).tolist() == [0]


def test_points_that_differ_by_round_off_are_one_point_of_a_front():
    values = np.array([[1.0, 828.7], [1.1, 828.7 - 1e-9], [1.2, 828.0], [3.0, 816.2]])
    assert pareto_front(values).tolist() == [0, 3], "0.7 of 828.7 is less than values are told to"


def test_neighbours_are_one_step_away_within_the_ranges():
    assert neighbours((RELIEF,), np.array([10.0])).tolist() == [[8.0]]
    near = neighbours((RELIEF, START), np.array([4.0, 22.0]))
    assert_allclose(np.abs(near - [4.0, 22.0]).max(axis=0), [2.0, 0.04])
    assert len(near) == 8
    assert len(neighbours((RELIEF, START, RELIEF), np.array([4.0, 22.0, 4.0]))) == 6


def test_flanks_as_filed_have_no_relief_that_scatters_where_none_is_said_to_begin():
    (draw,) = drawn_pairs(Scatter(tip_relief_um=2.0, tip_relief_start_roll_deg=0.1, profile_slope_um=1.0), 1)
    plain = assembly_at(PLAIN, (), (), draw).pinion
    assert (plain.tip_relief_um, plain.tip_relief_start_roll_deg) == (0.0, None)
    assert plain.profile_slope_um == draw.pinion["profile_slope_um"]


def test_values_keep_to_the_steps_of_manufacture():
    variables = (RELIEF, START)
    moved = to_steps(variables, np.array([[2.9, 21.234], [9.9, 30.0], [-3.0, 20.0]]))
    assert_allclose(moved, [[2.0, 21.234], [10.0, 24.0], [0.0, 20.0]])
    assert_allclose(steps_around(variables, np.array([4.7, 22.0])), [[4.0, 22.0], [6.0, 22.0]])
    samples = spread_evenly(variables, 100)
    assert samples.shape == (100, 2)
    assert_allclose(samples[:, 0] % 2.0, 0.0, atol=1e-9)
    assert np.histogram(samples[:, 1], 4, (20.0, 24.0))[0].tolist() == pytest.approx([25] * 4, abs=2)
    assert_array_equal(samples, spread_evenly(variables, 100))
    uneven = Variable(key="tip_relief_um", range=(0.0, 5.0), step=2.0)
    assert to_steps((uneven,), np.array([5.0])).tolist() == [4.0], "never beyond the range"


def test_a_variable_of_both_gears_is_the_same_on_both():
    assembly = assembly_at(PLAIN, (RELIEF, START), (4.0, 22.0))
    assert assembly.pinion.tip_relief_um == assembly.wheel.tip_relief_um == 4.0
    assert (assembly.pinion.tip_relief_start_roll_deg, assembly.wheel.tip_relief_start_roll_deg) == (None, 22.0)


def test_draws_have_the_deviations_that_are_asked_for():
    draws = drawn_pairs(Scatter(tip_relief_um=2.0, in_plane_um=10.0), 1024)
    of_pinion, of_wheel = (np.array([getattr(d, gear)["tip_relief_um"] for d in draws]) for gear in ("pinion", "wheel"))
    in_plane = np.array([d.misalignment.in_plane_um for d in draws])
    for values, deviation in ((of_pinion, 2.0), (of_wheel, 2.0), (in_plane, 10.0)):
        assert_allclose(values.std(), deviation, rtol=0.02)
        assert abs(values.mean()) < 0.01 * deviation
    # Independent of each other: 1,024 of a Sobol sequence leave a correlation of less than 0.01.
    assert np.abs(np.corrcoef([of_pinion, of_wheel, in_plane]) - np.eye(3)).max() < 0.03
    begun = Variable(key="tip_relief_start_roll_deg", range=(20.0, 24.0))
    assembly = assembly_at(PLAIN, (RELIEF, begun), (4.0, 22.0), draws[0])
    assert assembly.pinion.tip_relief_um == 4.0 + of_pinion[0]
    assert assembly.misalignment.in_plane_um == in_plane[0]
    assert assembly_at(PLAIN, (), ()) == assembly_at(PLAIN, (), (), AS_DRAWN) == PLAIN
    tilted, off = Assembly(Misalignment(1.0, 2.0, 3.0)), Draw(misalignment=Misalignment(10.0, 20.0, 30.0))
    assert assembly_at(tilted, (), (), off).misalignment == Misalignment(11.0, 22.0, 33.0)


def test_the_highest_point_of_single_contact_of_a_wheel_is_that_of_a_pinion_in_its_place():
    gears = tooth(17, 0.3), tooth(31)
    on_pinion, on_wheel = highest_single_contact(gear_pair(*gears))
    assert_allclose(highest_single_contact(gear_pair(*gears[::-1])), [on_wheel, on_pinion], rtol=1e-12)
