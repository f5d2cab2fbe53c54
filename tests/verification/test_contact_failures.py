"""What goes wrong in the contact of a pair is said, and windows too small are noticed."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.contact.condition import Condition, at_torques
from pmor.contact.elasticity import ReducedElasticity
from pmor.contact.equilibrium import solve_equilibrium
from pmor.contact.position import active_patches
from pmor.contact.solve import solve_position, surface_error, window_depth
from pmor.errors import ConvergenceError
from tests.gear_models import meshed_pair
from tests.loaded_pair import DEPTH, NEWTON, PAIRS, TORQUE, Model


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
    assert equilibrium.lead < model.solve(model.phi(0.8))[2].lead


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
    monkeypatch.setattr("pmor.contact.solve.WINDOW_MARGIN", 1e-3)
    model, phi, torque = overloaded
    conditions = at_torques([0.5 * torque, torque])
    solved = solve_position(model.meshed, phi, conditions, model.elasticity)
    assert solved.failures == ()
    assert solved.position.depth > 2.9 * window_depth(model.meshed, conditions[1]), "it was too small at first"
    assert not solved.equilibria[1].contact.touches_border
    assert_allclose(
        [e.lead * model.base_radius * 1e3 for e in solved.equilibria],
        [model.ste_um(phi, load) for load in (0.5 * torque, torque)],
        rtol=1e-6,  # windows of another size: rows beyond the strip do not matter
    )


def test_solve_position_reports_what_failed_and_goes_on(monkeypatch):
    def never(meshed, position, elasticity, condition, start=None):
        if condition.torque > TORQUE:
            raise ConvergenceError("too much", [(1.0, 1.0)])
        return solve_equilibrium(meshed, position, elasticity, condition, start)

    monkeypatch.setattr("pmor.contact.solve.solve_equilibrium", never)
    model = Model(PAIRS["paper"])
    solved = solve_position(model.meshed, model.phi(0.8), at_torques([2.0 * TORQUE, TORQUE]), model.elasticity)
    assert solved.equilibria[0] is None
    assert solved.equilibria[1] is not None
    assert solved.failures == ("too much",)


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
