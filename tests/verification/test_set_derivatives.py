"""Exact derivatives of figures of sets against difference quotients: of movements, of forces, over all mesh cycles."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.design.elements import elements_of
from pmor.design.judge import Judge
from pmor.design.loader import load
from tests.support.small_sets import NO_STRESS, SMALL_DESIGN, SMALL_SET, written_design

# Of the largest derivative: round-off and curvature of quotients with steps of 1e-4 um, deg or %.
QUOTIENT, STEP = 1e-6, 1e-4
# Under the lower torque the pin that stands ahead unloads its planet: its meshes carry nothing.
MORE = """
[[variables]]
key = "helix_slope_um"
gear = "ring"
range = [-6.0, 6.0]
[[variables]]
key = "profile_slope_um"
gear = "planet"
flank = "drive"
range = [-6.0, 6.0]
"""


SCATTER = """
[objective]
value = "percentile_95"
[scatter]
profile_slope_um = 2.0
draws = 8
"""


def judge_of(folder, base=SMALL_SET, more="", renamed=("", "")):
    text = SMALL_DESIGN.replace(*renamed).replace(
        "torques_Nm = [300.0]", "torques_Nm = [100.0, 300.0]\nweights = [1.0, 2.0]"
    )
    file = load(written_design(folder, text.replace("[load]", f"{MORE}{more}[load]"), base + NO_STRESS))
    return Judge(elements_of(file))


@pytest.fixture(scope="module")
def judge(tmp_path_factory):
    return judge_of(tmp_path_factory.mktemp("judge"))


def check_gradient(judge, rng):
    low, high = np.array([v.range for v in judge.design.variables]).T
    x = low + rng.uniform(0.2, 0.8, len(low)) * (high - low)
    value, exact, _ = judge.smooth(x, 5.0)
    assert np.isfinite(value)
    ends = [[judge.smooth(x + sign * STEP * one, 5.0)[0] for sign in (1.0, -1.0)] for one in np.eye(len(x))]
    quotient = np.array([(above - below) / (2.0 * STEP) for above, below in ends])
    assert_allclose(exact, quotient, rtol=0.0, atol=QUOTIENT * np.abs(exact).max())
    return exact


@pytest.mark.parametrize("minimise", ["peak_to_peak_um", "order_2_um", "k_gamma", "k_h_beta"])
def test_gradients_are_difference_quotients(judge, minimise, rng):
    judge = judge.alike(replace(judge.design, objective=replace(judge.design.objective, minimise=minimise)))
    exact = check_gradient(judge, rng)
    assert np.count_nonzero(exact) == len(exact)


@pytest.mark.slow
def test_gradients_know_all_mesh_cycles(tmp_path, rng):
    """Over two of the cycles that an eccentric sun makes differ."""
    wobbling = SMALL_SET.replace("angles_per_pitch = 6", "angles_per_pitch = 6\npitches = 2")
    wobbling += "[eccentricity]\nsun_um = 6.0\n"
    judge = judge_of(tmp_path, wobbling)
    assert judge.phi.shape == (16,)
    check_gradient(judge, rng)


@pytest.mark.slow
def test_gradients_of_percentiles_are_difference_quotients(tmp_path, rng):
    """Flanks and pins scatter: a gear's flank is the same in all its meshes, each planet has its own."""
    judge = judge_of(tmp_path, f"{SMALL_SET}[tolerances]\npins_tangential_um = 8.0\n", SCATTER)
    check_gradient(judge, rng)
    draws = judge.drawn(1024)
    slopes = np.array([[(d.pinion["profile_slope_um"], d.wheel["profile_slope_um"]) for d in draw.meshes]
                       for draw in draws]).reshape(1024, 3, 2, 2)  # fmt: skip
    of_sun, towards_the_sun, towards_the_ring, of_ring = np.moveaxis(slopes.reshape(1024, 3, 4), 2, 0)
    assert (of_sun == of_sun[:, :1]).all()
    assert (of_ring == of_ring[:, :1]).all()
    each = np.column_stack([of_sun[:, :1], of_ring[:, :1], towards_the_sun, towards_the_ring])
    # Independent of each other: 1,024 of a Sobol sequence leave correlations of less than 0.05.
    assert_allclose(np.cov(each.T), 4.0 * np.eye(8), atol=0.2)
    moved = np.array([draw.displacement.reshape(-1, 6)[2, :2] for draw in draws])
    # The first planet, 10 um off as filed, in the sense in which the torque turns the sun, -x.
    assert_allclose(moved[:, 0].mean(), -0.01, atol=1e-4)
    assert_allclose(moved[:, 0].std(), 0.008, rtol=0.02)
    assert_allclose(moved[:, 1], 0.0, atol=1e-15)


def test_what_was_solved_before_changes_no_digit(judge):
    x = np.array([5.0, 70.0, 2.0, 1.0, 0.5, -1.0])
    fresh = Judge(judge.elements)
    (other,) = judge.solve(judge.assembly(np.array([20.0, 60.0, 6.0, 4.0, 6.0, 6.0])))
    first, second = (one.solve(one.assembly(x))[0].solution.found.force for one in (fresh, judge))
    assert np.array_equal(first, second)
    assert not np.array_equal(first, other.solution.found.force)
