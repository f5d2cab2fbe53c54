"""The error measures of a study: identities that hold whatever the curves are."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.lab.core.measures import fitted_exponent
from pmor.lab.study.measures import (
    Curve,
    break_even,
    load_share_error,
    mean_error_um,
    richardson,
    shape_error_um,
)

ROUND_OFF = 1e-12
# Observing an order divides differences of powers by each other: a few digits are lost.
ORDER = 1e-6


@pytest.fixture
def curve(rng):
    share = rng.random((30, 2))
    return Curve(5.0 + rng.random(30), share / share.sum(axis=1, keepdims=True), np.array([0, 1]))


def shifted(curve, offset):
    return Curve(curve.ste_um + offset, curve.pair_share, curve.pair_index)


def test_shape_error_is_the_amplitude_of_a_ripple(curve):
    wave = 0.2 * np.sqrt(2.0) * np.sin(2.0 * np.pi * np.arange(30) / 30)
    assert_allclose(shape_error_um(shifted(curve, wave + 3.0), curve), 0.2, rtol=ROUND_OFF)


def test_load_share_is_compared_pair_by_pair(curve):
    # The same shares, told with an idle pair more and in which the pairs are numbered alike.
    wider = Curve(curve.ste_um, np.column_stack([np.zeros(30), curve.pair_share]), np.array([-1, 0, 1]))
    assert load_share_error(wider, curve) == 0.0
    moved = Curve(curve.ste_um, curve.pair_share, np.array([1, 2]))
    assert load_share_error(moved, curve) > 0.5


def test_missing_positions_are_left_out_not_counted_as_zero(curve):
    broken = shifted(curve, 1.0)
    broken.ste_um[3] = np.nan
    broken.pair_share[3] = 0.0
    assert_allclose(mean_error_um(broken, curve), 1.0, rtol=ROUND_OFF)
    assert np.isfinite(shape_error_um(broken, curve))
    assert load_share_error(broken, Curve(curve.ste_um, broken.pair_share, curve.pair_index)) == 0.0
    nothing = shifted(curve, np.nan)
    assert math.isnan(shape_error_um(nothing, curve))
    assert math.isnan(load_share_error(nothing, curve))
    assert math.isnan(nothing.mean_um)


@pytest.mark.parametrize("order", [0.7, 1.0, 1.5, 2.0])
@pytest.mark.parametrize("sizes", [(48, 64, 96), (8, 16, 32)])
def test_richardson_recovers_order_and_error(order, sizes):
    h = [1.0 / n for n in sizes]
    value = [7.5 - 40.0 * size**order for size in h]
    found = richardson(h, [v - value[-1] for v in value[:-1]])
    assert_allclose(found.order, order, rtol=ORDER)
    assert_allclose(found.error, 40.0 * h[-1] ** order, rtol=ORDER)


def test_an_order_beyond_that_of_the_elements_is_not_trusted():
    h = [1.0 / 48, 1.0 / 64, 1.0 / 96]
    value = [size**4 for size in h]
    found = richardson(h, [v - value[-1] for v in value[:-1]])
    assert_allclose(found.order, 4.0, rtol=ORDER)
    assert_allclose(found.error, (value[1] - value[2]) / (1.5**2 - 1.0), rtol=ORDER)
    assert found.error > value[2]


@pytest.mark.parametrize("differences", [[0.3], [0.3, -0.1], [0.1, 0.3], [0.3, 0.0], [math.nan, 0.1]])
def test_without_an_observable_order_the_last_difference_stands(differences):
    found = richardson([1 / 48, 1 / 64, 1 / 96][-len(differences) - 1 :], differences)
    assert math.isnan(found.order)
    assert found.error == abs(differences[-1])


def test_exponent_of_a_power_law():
    x = [1, 2, 4, 8]
    assert_allclose(fitted_exponent(x, [3.0 * v**1.4 for v in x]), 1.4, rtol=ROUND_OFF)
    assert math.isnan(fitted_exponent([2, 2], [1.0, 2.0]))


def test_break_even_counts_whole_positions():
    assert break_even(offline_s=1.0, slow_ms=10.3, fast_ms=0.3) == 100
    assert break_even(offline_s=1.0001, slow_ms=10.3, fast_ms=0.3) == 101
    assert break_even(offline_s=1.0, slow_ms=0.3, fast_ms=0.3) is None
