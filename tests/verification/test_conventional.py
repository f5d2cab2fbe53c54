"""The conventional way, whole gears and a factorisation in every step, against the condensed model."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.core.conventions import rotation_z
from pmor.core.errors import CaseError, ConvergenceError
from pmor.fe.assembly import assemble, degrees_of_freedom
from pmor.fe.completion import completion, nodes_of_elements
from pmor.fe.nested_dissection import elimination_order, nested_dissection
from pmor.fe.whole_gear import assemble_arc, whole_gear_mesh
from pmor.gear.condition import Condition, at_torques
from pmor.lab.rivals.conventional import conventional_pair, solve_conventional
from pmor.pair.model import elastic_model, mesh_model
from pmor.penalty.solve import solve_position
from tests.support.gear_models import POISSON, YOUNG, sector, tooth
from tests.support.small_case import case_with

SAME_STATE = 1e-9  # two exact routes to one equilibrium; they differ by the residuals at which Newton stops
EXACT = 1e-12  # the same sums in another order
TORQUE = 1e5

CASES = {
    "identical, quadratic": {
        "pinion": {"teeth": 12, "profile_shift": 0.2, "bore_radius_mm": 10.0},
        "mesh": {"profile_elements": 2, "width_elements": 1, "width": "whole", "element": "hex20"}},
    "unequal, facets": {"pinion": {"teeth": 12, "profile_shift": 0.2, "bore_radius_mm": 10.0},
                        "wheel": {"teeth": 15, "bore_radius_mm": 12.0, "youngs_modulus_GPa": 100.0},
                        "mesh": {"profile_elements": 4, "width_elements": 1, "element": "hex8"},
                        "contact": {"scheme": "facet", "lodm_profile": 2}},
}  # fmt: skip
SMALL_WINDOWS = {"pinion": {"teeth": 12, "profile_shift": 0.2, "bore_radius_mm": 10.0},
                 "mesh": {"profile_elements": 3, "width_elements": 1, "width": "whole"}}  # fmt: skip
ONE_PAIR, TWO_PAIRS = 0.75, 0.2  # positions as shares of a pitch from where a pair enters


# Elements of second order are eliminated below as those of the first are.
ALWAYS = "unequal, facets"


@pytest.fixture(
    scope="module", params=[name if name == ALWAYS else pytest.param(name, marks=pytest.mark.slow) for name in CASES]
)
def pair(request):
    return both_ways(CASES[request.param])


def both_ways(sections):
    case = case_with(**sections)
    mesh = mesh_model(case)
    return elastic_model(case, mesh), conventional_pair(case, mesh)


def angle(pair, share):
    geometry = pair.meshed.pair
    return geometry.roll_position_range[0] + share * geometry.pitch


@pytest.mark.parametrize(("share", "loaded"), [pytest.param(ONE_PAIR, 1, marks=pytest.mark.slow), (TWO_PAIRS, 2)])
def test_conventional_solution_is_the_condensed_one(pair, share, loaded):
    condensed, whole = pair
    phi = angle(whole, share)
    position = solve_position(whole.meshed, phi, at_torques([TORQUE]), condensed.elasticity_at)
    expected = position.equilibria[0]
    assert np.count_nonzero(expected.pair_torque(len(position.position.pair_index))) == loaded
    found = solve_conventional(whole, phi, Condition(torque=TORQUE))
    assert_allclose(found.advance, expected.advance, rtol=SAME_STATE)
    assert_allclose(found.ste_um, expected.advance * whole.meshed.pair.pinion.base_radius * 1e3, rtol=SAME_STATE)
    assert found.steps <= expected.steps + 3
    assert found.steps == len(found.history) - 1
    assert 0.0 < found.factor_seconds < found.seconds


@pytest.mark.slow
def test_windows_too_small_grow_as_those_of_the_condensed_model(monkeypatch):
    condensed, whole = both_ways(SMALL_WINDOWS)  # those of facets allow for their sagitta and suffice
    monkeypatch.setattr("pmor.penalty.solve.WINDOW_MARGIN", 0.05)
    phi = angle(whole, ONE_PAIR)
    # Else windows hold a row of contact points on either side, and suffice.
    monkeypatch.setitem(whole.meshed.__dict__, "limits", whole.meshed.limits._replace(row_spacing=0.0))
    expected = solve_position(whole.meshed, phi, at_torques([TORQUE]), condensed.elasticity_at).equilibria[0]
    found = solve_conventional(whole, phi, Condition(torque=TORQUE))
    assert_allclose(found.advance, expected.advance, rtol=SAME_STATE)
    assert found.factorisations > found.steps  # those in the smaller windows count as well


def test_too_few_steps_raise_with_the_history(pair):
    _, whole = pair
    with pytest.raises(ConvergenceError, match="no equilibrium of whole gears .* after 1 Newton") as error:
        solve_conventional(whole, angle(whole, ONE_PAIR), Condition(torque=TORQUE), max_steps=1)
    assert len(error.value.history) == 2


# --- order of elimination -------------------------------------------------------------------------------------------


@pytest.fixture(scope="module", params=["hex8i", "hex20"])
def mesh(request):
    return sector(tooth(12, 0.2), 3, 2) if request.param == "hex8i" else sector(tooth(12, 0.2), 2, 1, order=2)


def assembled(mesh, element_nodes, nodes):
    return assemble(nodes, element_nodes, YOUNG, POISSON, "hex20" if mesh.order == 2 else "hex8i")


def arc_of(mesh, sectors):
    return assemble_arc(mesh, YOUNG, POISSON, "hex20" if mesh.order == 2 else "hex8i", sectors)


def test_separators_come_last_and_separate():
    grid = np.arange(9 * 4 * 3).reshape(9, 4, 3)
    places = np.stack(np.meshgrid(np.arange(8), np.arange(3), np.arange(2), indexing="ij"), axis=-1).reshape(-1, 3)
    corners = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    elements = grid[tuple(np.moveaxis(places[:, None] + corners, -1, 0))]
    retained = grid[0, 0]
    parts = nested_dissection(places, elements, retained, 1)
    order = np.concatenate([part.inner for part in parts])
    assert np.array_equal(np.sort(np.concatenate([order, retained])), np.arange(grid.size))
    assert np.array_equal(np.sort(parts[-1].inner), grid[4].ravel())  # the smallest plane that halves the block
    assert np.array_equal(parts[-1].border, retained)
    below, above = (parts[number].border for number in parts[-1].parts)
    assert set(below) == {*grid[4].ravel(), *retained}
    assert set(above) == {*grid[4].ravel()}
    assert np.array_equal(np.sort(np.concatenate([part.elements for part in parts])), np.arange(len(elements)))


def test_whole_gear_in_order_of_elimination_is_the_whole_gear(mesh, rng):
    nodes, elements, numbers = whole_gear_mesh(mesh)
    natural = assembled(mesh, elements, nodes)
    ordered, flanks = arc_of(mesh, mesh.teeth)
    dofs = degrees_of_freedom(elimination_order(mesh, numbers, mesh.teeth))
    difference = natural[dofs][:, dofs] - ordered
    assert abs(difference).max() < EXACT * abs(natural).max()
    # Shares of the middles are those of the whole sector; frames are those of the teeth.
    displacement = rng.normal(size=3 * len(nodes))
    every = np.arange(len(mesh.nodes))
    for k in (0, 5):
        vectors = displacement.reshape(-1, 3)[numbers[k]] @ rotation_z(2.0 * np.pi * k / mesh.teeth)
        filled = completion(mesh, every) @ vectors[nodes_of_elements(mesh, every)].ravel()
        expected = filled[degrees_of_freedom(mesh.flank)]
        assert_allclose(flanks[k] @ displacement[dofs], expected, rtol=0, atol=EXACT)


def test_line_contact_is_refused():
    case = case_with(contact=None)
    with pytest.raises(CaseError, match='scheme = "line".*choose'):
        conventional_pair(case, mesh_model(case))
