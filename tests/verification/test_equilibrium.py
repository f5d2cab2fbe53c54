"""The loaded pair: balances, energy, and two ways to the same answer."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.core.conventions import rotation_z
from pmor.gear.condition import Condition
from pmor.penalty.elasticity import ReducedElasticity
from pmor.penalty.equilibrium import solve_equilibrium
from pmor.penalty.position import active_patches
from pmor.penalty.search import search_contact
from pmor.penalty.solve import surface_error
from tests.support.loaded_pair import PAIRS, SAME_STATE, TORQUE, Model, every_pair

FORCE_BALANCE = 1e-10  # of the load; both gears get the same nodal forces with opposite signs
# Of the torque; bilinear transfer puts a force where the facet under the patch is, up to a few um off its line.
MOMENT_BALANCE = 1e-4


# --- balances ------------------------------------------------------------------------------------------------------


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


# --- two ways to the same answer -----------------------------------------------------------------------------------


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
