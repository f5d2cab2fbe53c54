"""What goes wrong in the contact of a pair is said, and windows too small are noticed."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor.penalty.solve
from pmor.case import change_case, load_case
from pmor.core.errors import ConvergenceError
from pmor.gear.condition import Condition, at_torques
from pmor.pair.conditions import nominal_condition
from pmor.penalty.elasticity import ReducedElasticity
from pmor.penalty.equilibrium import solve_equilibrium
from pmor.penalty.kernels.search import search_workspace
from pmor.penalty.position import active_patches
from pmor.penalty.search import search_contact
from pmor.penalty.solve import solve_position, surface_error, window_depth
from tests.support.gear_models import meshed_pair
from tests.support.loaded_pair import DEPTH, NEWTON, PAIRS, SAME_STATE, TORQUE, Model
from tests.support.small_case import full_fe


def test_too_few_steps_raise_with_the_history():
    model = Model(PAIRS["paper"])
    with pytest.raises(ConvergenceError, match="no equilibrium at phi = .*, torque = 100 N m after 1 Newton") as error:
        model.solve(model.phi(0.4), max_steps=1)
    assert len(error.value.history) == 2
    assert max(error.value.history[-1]) > NEWTON


def test_flanks_that_do_not_face_each_other_raise():
    model = Model(PAIRS["paper"])
    position = active_patches(model.meshed, model.phi(0.8), DEPTH)
    apart = position.nodes.copy()
    apart[position.window_slice(0, 1), 2] += 1000.0  # the wheel's flank slides along the axis
    displacement = apart - position.nodes
    assert len(position.pair_index) == 1

    class Apart(ReducedElasticity):
        def displacement(self, coordinates):
            return displacement

    elasticity = Apart(np.zeros((len(position.nodes), 3, 0)))
    with pytest.raises(ConvergenceError, match="no flank faces its mate"):
        solve_equilibrium(model.meshed, position, elasticity, Condition(torque=TORQUE))


def test_without_shapes_only_the_penalty_yields():
    model = Model(PAIRS["paper"])
    position = active_patches(model.meshed, model.phi(0.8), DEPTH)
    rigid = ReducedElasticity(np.zeros((len(position.nodes), 3, 0)))
    equilibrium = solve_equilibrium(model.meshed, position, rigid, Condition(torque=TORQUE))
    contact = equilibrium.contact
    assert_allclose(-(contact.force @ contact.lever), TORQUE, rtol=NEWTON)
    assert rigid.displacement(equilibrium.coordinates).shape == position.nodes.shape
    assert equilibrium.advance < model.solve(model.phi(0.8))[2].advance


@pytest.fixture(scope="module")
def overloaded():
    """Elements and spacing of points so small, and a torque so large, that contact leaves the smallest window."""
    model = Model(PAIRS["paper"], (16, 2), lodm_profile=8)
    return model, model.phi(0.85), 3.0 * TORQUE


def test_a_window_too_small_is_noticed(overloaded):
    model, phi, torque = overloaded
    small, large = (active_patches(model.meshed, phi, depth) for depth in (1e-5, DEPTH))
    assert small.windows[:, :, 3].max() < large.windows[:, :, 3].min()
    condition = Condition(torque=torque)
    touching = [
        solve_equilibrium(model.meshed, position, model.elasticity(position), condition).contact.touches_border
        for position in (small, large)
    ]
    assert touching == [True, False]


def test_solve_position_grows_its_windows_until_they_hold_the_contact(overloaded, monkeypatch):
    monkeypatch.setattr("pmor.penalty.solve.WINDOW_MARGIN", 1e-3)
    model, phi, torque = overloaded
    conditions = at_torques([0.5 * torque, torque])
    solved = solve_position(model.meshed, phi, conditions, model.elasticity)
    assert solved.failures == ()
    assert solved.position.depth > 2.9 * window_depth(model.meshed, conditions[1]), "it was too small at first"
    assert not solved.equilibria[1].contact.touches_border
    assert_allclose(
        [e.advance * model.base_radius * 1e3 for e in solved.equilibria],
        [model.ste_um(phi, load) for load in (0.5 * torque, torque)],
        rtol=1e-6,  # windows of another size: rows beyond the strip do not matter
    )


@pytest.mark.parametrize("surface", ["hermite", "facet"])
@pytest.mark.parametrize("far", [np.inf, pmor.penalty.solve.FAR])
def test_convergence_does_not_depend_on_the_company(surface, far, monkeypatch):
    """From a state under a ten-thousandth of the torque Newton finds no way; from none at all it does."""
    monkeypatch.setattr(pmor.penalty.solve, "FAR", far)
    model = Model(PAIRS["paper"], surface=surface)
    for share in (0.2, 0.25, 0.3):
        together, alone = (
            solve_position(model.meshed, model.phi(share), at_torques(torques), model.elasticity)
            for torques in ([1e-4 * TORQUE, TORQUE], [TORQUE])
        )
        assert together.failures == alone.failures == ()
        assert_allclose(together.equilibria[1].advance, alone.equilibria[0].advance, rtol=SAME_STATE)


def test_a_point_at_the_border_of_two_patches_stays_where_it_was_found():
    model = Model(PAIRS["paper"])
    position = active_patches(model.meshed, model.phi(0.8), DEPTH)
    workspace = search_workspace(position.kernel_pair, position.patches)
    wheel, columns = position.window_slice(0, 1), model.meshed.wheel.columns
    width = model.meshed.pair.face_width / (columns - 1)

    def columns_of(shift, **options):
        displacement = np.zeros_like(position.nodes)
        displacement[wheel, 2] = shift * width
        return search_contact(model.meshed, position, displacement, 1e-3, **options).place[:, [1, 3]].tolist()

    start, beyond = columns_of(0.0), columns_of(2e-5)
    assert start != beyond
    assert columns_of(0.0, workspace=workspace) == start
    assert columns_of(2e-5, workspace=workspace) == beyond
    assert columns_of(0.5e-5) == start
    assert columns_of(0.5e-5, workspace=workspace) == beyond


def test_points_that_would_go_to_and_fro_between_two_patches_come_to_rest():
    """One of 1,500 positions of facets."""
    contact, phi = {"scheme": "facet", "slave": "pinion", "lodm_profile": 4}, 0.15498523757709648
    changed = change_case(load_case(Path("cases/paper_spur.toml")), contact=contact, mesh={"element": "hex8i"})
    model = full_fe(changed)
    meshed, conditions = model.mesh.meshed, [nominal_condition(changed)]
    position = active_patches(meshed, phi, 3.0 * window_depth(meshed, conditions[0]))
    elasticity = model.elasticity_at(position)
    with pytest.raises(ConvergenceError, match="after 40 Newton steps"):
        solve_equilibrium(meshed, position, elasticity, conditions[0])
    solved = solve_position(meshed, phi, conditions, model.elasticity_at)
    assert solved.failures == ()
    assert max(solved.equilibria[0].history[-1]) <= NEWTON


def test_windows_of_facets_allow_for_their_sagitta():
    pair = PAIRS["paper"]
    faceted = meshed_pair(pair, 8, 1, surface="facet", lodm_profile=1)
    middle = 0.5 * (faceted.pinion.nodes[1:, 0] + faceted.pinion.nodes[:-1, 0])
    radius = np.linalg.norm(middle[:, :2], axis=1)
    roll = np.array([pair.pinion.roll_angle_at(r) for r in radius])
    half = np.array([pair.pinion.half_thickness_angle(u) for u in roll])
    sagitta = (half - np.arctan2(-middle[:, 0], middle[:, 1])) * radius * np.cos(np.arctan(roll))
    # A facet per gear; its sagitta by the radius of curvature in its middle, good to a few per cent.
    assert_allclose(surface_error(faceted), 2.0 * sagitta.max(), rtol=0.05)
    assert surface_error(meshed_pair(pair, 8, 1)) == 0.0
