"""The loaded pair: balances, energy, two ways to the same answer, and contact from a cushion to rigid."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import nnls

from pmor.core.conventions import rotation_z
from pmor.core.errors import ConvergenceError
from pmor.gear.condition import Condition, at_torques
from pmor.penalty import solve
from pmor.penalty.elasticity import ReducedElasticity
from pmor.penalty.equilibrium import _unilateral, solve_equilibrium
from pmor.penalty.position import active_patches
from pmor.penalty.search import search_contact
from pmor.penalty.solve import surface_error
from tests.support.loaded_pair import PAIRS, SAME_STATE, TORQUE, Model, every_pair

FORCE_BALANCE = 1e-10  # of the load; both gears get the same nodal forces with opposite signs
# Of the torque; bilinear transfer puts a force where the facet under the patch is, up to a few um off its line.
MOMENT_BALANCE = 1e-4


def global_forces(model, position, elasticity, equilibrium):
    """Nodal forces and the deformed places they act at, in the global frame, of pinion and wheel."""
    contact, pair = equilibrium.contact, model.pair
    nodal = contact.nodal_forces(contact.force, len(position.nodes))
    places = position.nodes + elasticity.displacement(equilibrium.coordinates)
    result = []
    for gear in (0, 1):
        forces, points = [], []
        for number, index in enumerate(position.pair_index):
            own = position.phi + index * pair.pitch
            angle = own + equilibrium.advance if gear == 0 else math.pi + pair.wheel_tooth_rotation(own)
            axis = np.array([0.0, pair.centre_distance * gear, 0.0])
            window = position.window_slice(number, gear)
            forces.append(nodal[window] @ rotation_z(angle).T)
            points.append(places[window] @ rotation_z(angle).T + axis)
        result.append((np.concatenate(forces), np.concatenate(points)))
    return result


@every_pair
@pytest.mark.parametrize("share", [0.1, 0.45, 0.8])
@pytest.mark.parametrize("projection", ["patch", "facet"])
def test_forces_and_moments_balance_between_the_gears(pair, share, projection):
    model = Model(pair, projection=projection)
    solved = model.solve(model.phi(share))
    (pinion_force, pinion_place), (wheel_force, wheel_place) = global_forces(model, *solved)
    load = np.linalg.norm(pinion_force.sum(axis=0))
    assert_allclose(pinion_force.sum(axis=0) + wheel_force.sum(axis=0), 0.0, atol=FORCE_BALANCE * load)
    moment = np.cross(pinion_place, pinion_force).sum(axis=0) + np.cross(wheel_place, wheel_force).sum(axis=0)
    assert_allclose(moment, 0.0, atol=MOMENT_BALANCE * TORQUE)
    # The load is what the torque asks for on the line of action, and the nodal forces carry the torque.
    assert_allclose(load, TORQUE / pair.pinion.base_radius, rtol=0.02)
    assert_allclose(np.cross(pinion_place, pinion_force)[:, 2].sum(), -TORQUE, rtol=MOMENT_BALANCE)


@pytest.mark.parametrize("slave", ["pinion", "wheel", "both", "tip"])
def test_wheel_torque_follows_from_the_balance_of_energy(slave):
    """T_1 (d phi + d advance) = T_2 d phi z_1 / z_2 + d (elastic and penalty energy), by finite differences."""
    model, step = Model(PAIRS["paper"], slave=slave), 2e-4
    found, expected, half_slope = [], [], []
    for share in (0.08, 0.33, 0.52, 0.83):
        advance, energy = [], []
        for phi in (model.phi(share) - step, model.phi(share) + step):
            _, elasticity, equilibrium = model.solve(phi)
            advance.append(equilibrium.advance)
            penalty_energy = -0.5 * equilibrium.contact.force @ equilibrium.contact.gap
            energy.append(0.5 * elasticity.energy_norm(equilibrium.coordinates) ** 2 + penalty_energy)
        slope = (advance[1] - advance[0]) / (2.0 * step)
        found.append(model.solve(model.phi(share))[2].wheel_torque / TORQUE - 1.0)
        expected.append(slope - (energy[1] - energy[0]) / (2.0 * step) / TORQUE)
        half_slope.append(0.5 * slope)
    scale = np.abs(found).max()
    # The bilinear transfer is not quite the derivative of the smooth gap: a few per cent remain.
    assert_allclose(found, expected, rtol=0, atol=0.1 * scale)
    # Were the contact linear, half of the work of the advance would go into each. It is not, but the signs follow.
    assert np.corrcoef(found, half_slope)[0, 1] > 0.8


@pytest.mark.parametrize("share", [0.2, 0.85])
def test_identity_basis_is_the_full_model(share):
    """Shapes F = L^-T, U = C F = L for the Cholesky factor L of the compliance: primal form equals dual form."""
    model = Model(PAIRS["unequal"])
    position, full, dual = model.solve(model.phi(share))
    factor = np.linalg.cholesky(full.compliance)
    reduced = ReducedElasticity(factor.reshape(-1, 3, factor.shape[1]))
    primal = solve_equilibrium(model.meshed, position, reduced, Condition(torque=TORQUE))
    assert_allclose(primal.advance, dual.advance, rtol=SAME_STATE)
    assert_allclose(primal.wheel_torque, dual.wheel_torque, rtol=SAME_STATE)
    displacement = full.displacement(dual.coordinates)
    scale = np.abs(displacement).max()
    assert_allclose(reduced.displacement(primal.coordinates), displacement, rtol=0, atol=1e-7 * scale)
    assert_allclose(reduced.energy_norm(primal.coordinates), full.energy_norm(dual.coordinates), rtol=SAME_STATE)


@pytest.mark.parametrize("start_mm", [1.0, -1.0])
@pytest.mark.parametrize("share", [0.3, 0.9])
def test_a_start_a_millimetre_off_converges_to_the_same_state(start_mm, share):
    model = Model(PAIRS["paper"])
    position, elasticity, expected = model.solve(model.phi(share))
    start = elasticity.zero(), start_mm / model.base_radius
    found = solve_equilibrium(model.meshed, position, elasticity, Condition(torque=TORQUE), start)
    assert_allclose(found.advance, expected.advance, rtol=SAME_STATE)
    assert np.array_equal(found.contact.place, expected.contact.place)


@pytest.mark.parametrize(
    "scheme",
    [
        {},
        {"edge_normals": "average"},
        {"projection": "facet"},
        {"surface": "facet", "lodm_profile": 1},
        {"surface": "facet", "lodm_profile": 4},
    ],
    ids=str,
)
def test_search_that_ends_at_the_first_clear_row_misses_no_point(scheme):
    model = Model(PAIRS["paper"], **scheme)
    depth = 3.0 * model.meshed.expected_approach(TORQUE) + surface_error(model.meshed)
    positions = [active_patches(model.meshed, model.phi(share), depth) for share in np.linspace(0.0, 1.0, 8)]
    advances = np.array([0.005, 0.01, 0.02]) / model.base_radius

    def points(positions):
        contacts = [
            search_contact(model.meshed, p, np.zeros_like(p.nodes), advance) for p in positions for advance in advances
        ]
        return [sorted(map(tuple, np.column_stack([c.pair, c.slave, c.place[:, :2]]))) for c in contacts]

    endless = [replace(p, patches=p.patches._replace(clear=1e9)) for p in positions]
    assert points(positions) == points(endless)


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
