"""Contact from a cushion to rigid: the same few steps, and the law of a series spring down to the last digits."""

import itertools

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import nnls

from pmor.core.errors import ConvergenceError
from pmor.gear.condition import at_torques
from pmor.penalty import equilibrium, solve
from pmor.penalty.equilibrium import _unilateral
from tests.support.loaded_pair import PAIRS, TORQUE, Model

MOST_STEPS = 12


def solved(share, torque=TORQUE, **scheme):
    model = Model(PAIRS["paper"], **scheme)
    return solve.solve_position(model.meshed, model.phi(share), at_torques([torque]), model.elasticity).equilibria[0]


def lcp_by_trying_all(matrix, gap):
    """Naive twin: try all sets of points that carry load."""
    for chosen in itertools.product([False, True], repeat=len(gap)):
        active = np.array(chosen)
        force = np.zeros(len(gap))
        force[active] = np.linalg.solve(matrix[np.ix_(active, active)], -gap[active])
        if force.min() >= 0.0 and (gap + matrix @ force)[~active].min(initial=0.0) >= 0.0:
            return active
    raise AssertionError("no solution")


@pytest.mark.parametrize("nodes", [8, 3])
def test_points_that_carry_load_are_those_of_the_complementarity_problem(nodes, rng):
    """With fewer nodes than points the flexibility is singular but for the penalty."""
    for _ in range(20):
        shapes, gap = rng.normal(size=(8, nodes)), rng.normal(size=8)
        flexibility = shapes @ shapes.T

        def solve(active, hardness, flexibility=flexibility, gap=gap):
            give = 1e-3 / hardness
            matrix = flexibility[np.ix_(active, active)] + give * np.eye(active.sum())
            force = np.zeros(8)
            force[active] = np.linalg.solve(matrix, -gap[active])
            predicted = gap + flexibility @ force
            return force, 0.0, predicted

        found, (force, _, _) = _unilateral(solve, gap, 1e-14)
        assert np.array_equal(found & (force > 0.0), lcp_by_trying_all(flexibility + 1e-3 * np.eye(8), gap))


def test_many_points_on_few_nodes_are_sorted_by_hardening_the_penalty(rng):
    """Against an active-set method for least squares; without hardening, one in four of these has no end."""
    place, nodes = np.linspace(-1.0, 1.0, 40), np.linspace(-1.0, 1.0, 6)
    carried = np.maximum(0.0, 1.0 - np.abs(place[:, None] - nodes) / 0.4)
    flexibility = carried @ np.exp(-np.abs(nodes[:, None] - nodes) / 0.3) @ carried.T
    give = 1e-8
    for _ in range(20):
        gap = place**2 - 0.4 + 0.02 * rng.normal(size=40)

        def solve(active, hardness, gap=gap):
            force = np.zeros(40)
            matrix = flexibility[np.ix_(active, active)] + give / hardness * np.eye(active.sum())
            force[active] = np.linalg.solve(matrix, -gap[active])
            return force, 0.0, gap + flexibility @ force

        lower = np.linalg.cholesky(flexibility + give * np.eye(40))
        expected = nnls(lower.T, -np.linalg.solve(lower, gap), maxiter=5000)[0]
        found = _unilateral(solve, gap, 1e-14)[1][0]
        assert_allclose(found, expected, atol=1e-4 * expected.max())


@pytest.mark.jit
@pytest.mark.parametrize("share", [0.0, 0.3, 0.9])
def test_ste_comes_to_its_limit_as_one_over_the_penalty(share):
    limit = solved(share, penalty=1e15).advance
    above = []
    for exponent in range(2, 13):
        found = solved(share, penalty=10.0**exponent)
        assert found is not None
        assert found.steps <= MOST_STEPS
        above.append(found.advance - limit)
    above = np.array(above)
    assert np.all(np.diff(above) < 0.0)
    stiff = np.log10(above[-4:-1])  # 1e9 to 1e11: beyond, 1e-8 of the STE is left
    assert_allclose(np.diff(stiff), -1.0, atol=0.02)


STIFF = [
    {"penalty": 1e12, "lodm_profile": 16, "lodm_width": 4}, {"penalty": 1e12, "surface": "facet"},
    {"penalty": 1e12, "slave": "both"},
]  # fmt: skip


@pytest.mark.parametrize(
    ("scheme", "share"), [*itertools.product(STIFF, (0.1, 0.9)), ({"surface": "facet"}, 1 / 3)], ids=str
)
def test_more_points_than_nodes_under_a_stiff_penalty(scheme, share):
    found = solved(share, **scheme)
    assert found is not None
    assert found.steps <= MOST_STEPS
    assert_allclose(-(found.contact.force @ found.contact.lever), TORQUE, rtol=1e-6)


def test_mixing_the_last_corrections_saves_steps_under_an_extreme_load(monkeypatch):
    mixed = solved(0.625, 1e7).steps
    monkeypatch.setattr(equilibrium, "SLOW", 2.0)
    monkeypatch.setattr(equilibrium, "LINEAR", 0.0)
    plain = solved(0.625, 1e7)
    assert plain is None or plain.steps > mixed + 3


def test_a_solution_that_fails_in_a_small_window_is_sought_in_a_larger_one(monkeypatch):
    """Points on the mate but off its window come and go: no equilibrium there, however good the solver."""
    expected, genuine, depths = solved(0.9), solve.solve_equilibrium, []

    def fails_at_first(meshed, position, *rest, **more):
        depths.append(position.depth)
        if position.depth == depths[0]:
            raise ConvergenceError("points come and go", [])
        return genuine(meshed, position, *rest, **more)

    monkeypatch.setattr(solve, "solve_equilibrium", fails_at_first)
    assert_allclose(solved(0.9).advance, expected.advance, rtol=1e-6)
    assert_allclose(depths[-1], 3.0 * depths[0])
