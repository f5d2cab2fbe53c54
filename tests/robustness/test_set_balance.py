"""States of sets that say converged are in balance, whatever lifts off: forces and moments of each free movement."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.support.random_sets import FREE, TEETH, balance_of, random_set

# Over the forces of all meshes, and their moments.
BALANCED = 1e-6
# Of shares: teeth that carry at their corners meet off the line of action.
OFF_LINE = 2e-3
# Of each of 25 kinds of sets: 20,000 in all.
MANY = 800
# A scatter of pins with which two of five planets are off load under 188 N m, a hub of the sun that nothing holds; um.
PINS_UM = (4.49, -3.42, -16.37, 21.22, -10.92)


def most_share(planets):
    """Return the largest share of a planet whose mesh forces leave a free sun in balance.

    p_1 = -sum p_j cos(theta_j) <= c (1 - p_1), c the largest -cos(theta_j): 1 of an even number, else cos(pi / N).
    """
    opposite = 1.0 if planets % 2 == 0 else np.cos(np.pi / planets)
    return opposite / (1.0 + opposite)


def holds(planets, free, count):
    found = balance_of(planets, free, count, seed=38)
    assert found.converged.all()
    assert (found.left < BALANCED).all()
    if "sun" in free:
        assert (found.k_gamma < planets * most_share(planets) * (1.0 + OFF_LINE)).all()


@pytest.mark.parametrize(("planets", "free"), [(5, "sun"), pytest.param(7, "sun and carrier", marks=pytest.mark.slow)])
def test_sets_whose_planets_lift_off_are_in_balance(planets, free):
    holds(planets, free, 30)


@pytest.mark.slow
@pytest.mark.parametrize("free", FREE)
@pytest.mark.parametrize("planets", TEETH)
def test_twenty_thousand_random_sets_are_in_balance(planets, free):
    holds(planets, free, MANY)


def test_three_of_five_planets_carry_as_a_free_sun_in_balance_lets_them():
    """Statics alone: forces of three planets whose directions turn with them, without a net force."""
    plan, train = random_set(5, "sun")
    displacement = np.zeros((len(plan.bodies), 6))
    places = np.array([(body.x, body.y) for body in plan.bodies[2:]])
    around = np.stack([-places[:, 1], places[:, 0]], axis=1) / np.linalg.norm(places, axis=1)[:, None]
    displacement[2:, :2] = 1e-3 * np.array(PINS_UM)[:, None] * around
    placed = train.place(train.meshes[0].pair.meshed.pair.pitch * np.arange(6) / 6, displacement.ravel())
    found = placed.solve(188e3 * plan.load[None])
    assert found.converged.all()
    force = np.stack([found.force[0][:, one.part].sum(axis=1) for one in placed.placed], axis=1)[:, ::2]
    angle = 2.0 * np.pi * np.array([1, 2, 4]) / 5
    balance = np.stack([np.cos(angle), np.sin(angle), np.ones(3)])
    expected = np.zeros(5)
    expected[[1, 2, 4]] = np.linalg.solve(balance, [0.0, 0.0, 1.0])
    assert_allclose(force / force.sum(axis=1, keepdims=True), np.tile(expected, (6, 1)), rtol=0.0, atol=OFF_LINE)
