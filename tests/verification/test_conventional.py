"""The conventional way, whole gears and a factorisation in every step, against the condensed model."""

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose

from pmor.case import parse_case
from pmor.contact.condition import Condition, at_torques
from pmor.contact.flank import MeshedPair
from pmor.contact.solve import solve_position
from pmor.errors import CaseError, ConvergenceError
from pmor.fe.assembly import assemble
from pmor.fe.nested_dissection import elimination_order, nested_dissection, sector_grid
from pmor.fe.sparse_direct import assemble_arc, factorise
from pmor.fe.whole_gear import whole_gear_mesh
from pmor.lab.rivals.conventional import conventional_pair, solve_conventional
from pmor.lab.rivals.conventional_cost import GearCost, StepEstimate, newton_step_seconds
from pmor.pair.model import elastic_model, mesh_model
from tests.gear_models import POISSON, YOUNG, sector, tooth
from tests.small_case import case_text

SAME_STATE = 1e-9  # two exact routes to one equilibrium; they differ by the residuals at which Newton stops
EXACT = 1e-12  # the same sums in another order
TORQUE = 1e5

CASES = {
    "identical": {"pinion": {"teeth": 12, "profile_shift": 0.2, "bore_radius_mm": 10.0},
                  "mesh": {"profile_elements": 3, "width_elements": 2, "width": "whole"}},
    "unequal, facets": {"pinion": {"teeth": 12, "profile_shift": 0.2, "bore_radius_mm": 10.0},
                        "wheel": {"teeth": 15, "bore_radius_mm": 12.0, "youngs_modulus_GPa": 100.0},
                        "mesh": {"profile_elements": 4, "width_elements": 1, "element": "hex8"},
                        "contact": {"scheme": "facet", "lodm_profile": 2}},
}  # fmt: skip
ONE_PAIR, TWO_PAIRS = 0.75, 0.2  # positions as shares of a pitch from where a pair enters


@pytest.fixture(scope="module", params=list(CASES))
def pair(request):
    case = parse_case(case_text(**CASES[request.param]), "small", "small case")
    mesh = mesh_model(case)
    return elastic_model(case, mesh), conventional_pair(case, mesh)


def angle(pair, share):
    geometry = pair.meshed.pair
    return geometry.roll_position_range[0] + share * geometry.pitch


@pytest.mark.parametrize(("share", "loaded"), [(ONE_PAIR, 1), (TWO_PAIRS, 2)])
def test_conventional_solution_is_the_condensed_one(pair, share, loaded):
    condensed, whole = pair
    phi = angle(whole, share)
    position = solve_position(whole.meshed, phi, at_torques([TORQUE]), condensed.elasticity_at)
    expected = position.equilibria[0]
    assert np.count_nonzero(expected.pair_torque(len(position.position.pair_index))) == loaded
    found = solve_conventional(whole, phi, Condition(torque=TORQUE))
    assert_allclose(found.lead, expected.lead, rtol=SAME_STATE)
    assert_allclose(found.ste_um, expected.lead * whole.meshed.pair.pinion.base_radius * 1e3, rtol=SAME_STATE)
    assert found.steps <= expected.steps + 3
    assert found.steps == len(found.history) - 1
    assert 0.0 < found.factor_seconds < found.seconds


@pytest.mark.parametrize("pair", ["identical"], indirect=True)  # those of facets allow for their sagitta and suffice
def test_windows_too_small_grow_as_those_of_the_condensed_model(pair, monkeypatch):
    condensed, whole = pair
    monkeypatch.setattr("pmor.contact.solve.WINDOW_MARGIN", 0.05)
    phi = angle(whole, ONE_PAIR)
    genuine = MeshedPair.kinematics

    def without_rows(meshed, axes):
        # Else windows hold a row of contact points on either side, and suffice.
        return genuine(meshed, axes)._replace(row_spacing=0.0)

    monkeypatch.setattr(MeshedPair, "kinematics", without_rows)
    expected = solve_position(whole.meshed, phi, at_torques([TORQUE]), condensed.elasticity_at).equilibria[0]
    found = solve_conventional(whole, phi, Condition(torque=TORQUE))
    assert_allclose(found.lead, expected.lead, rtol=SAME_STATE)
    assert found.factorisations > found.steps  # those in the smaller windows count as well


def test_too_few_steps_raise_with_the_history(pair):
    _, whole = pair
    with pytest.raises(ConvergenceError, match="no equilibrium of whole gears .* after 1 Newton") as error:
        solve_conventional(whole, angle(whole, ONE_PAIR), Condition(torque=TORQUE), max_steps=1)
    assert len(error.value.history) == 2


def test_pair_has_all_free_unknowns_and_the_rotation(pair):
    condensed, whole = pair
    free = 0
    for mesh in (condensed.mesh.pinion, condensed.mesh.wheel):
        nodes, _, numbers = whole_gear_mesh(mesh)
        free += 3 * (len(nodes) - len(np.unique(numbers[:, mesh.bore])))
    assert whole.unknowns == free + 1
    assert whole.stiffness[-1:].nnz == whole.stiffness[:, -1:].nnz == 0


# --- order of elimination -------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def mesh():
    return sector(tooth(12, 0.2), 3, 2)


def test_nodes_of_an_element_are_neighbours_on_the_grid(mesh):
    grid = sector_grid(mesh)
    assert len(np.unique(grid, axis=0)) == len(grid)
    assert np.ptp(grid[mesh.elements], axis=1).max() == 1


def test_separators_come_last_and_separate():
    grid = np.stack(np.meshgrid(np.arange(9), np.arange(4), np.arange(3), indexing="ij"), axis=-1).reshape(-1, 3)
    order = nested_dissection(grid)
    assert np.array_equal(np.sort(order), np.arange(len(grid)))
    assert np.all(grid[order[-12:], 0] == 4)  # the plane with the fewest nodes that halves the block
    below, above = grid[order[:48], 0], grid[order[48:96], 0]
    assert below.max() < 4 < above.min()


@pytest.mark.parametrize("sectors", [1, 3, 12])
def test_elimination_order_holds_the_free_nodes_once(mesh, sectors):
    _, _, numbers = whole_gear_mesh(mesh)
    order = elimination_order(mesh, numbers, sectors)
    expected = np.setdiff1d(numbers[:sectors], numbers[:, mesh.bore])
    assert np.array_equal(np.sort(order), expected)


def test_whole_gear_in_order_of_elimination_is_the_whole_gear(mesh):
    nodes, elements, numbers = whole_gear_mesh(mesh)
    natural = assemble(nodes, elements, YOUNG, POISSON, "hex8i")
    ordered, flank = assemble_arc(mesh, YOUNG, POISSON, "hex8i", mesh.teeth)
    nodes_in_order = elimination_order(mesh, numbers, mesh.teeth)
    dofs = (3 * nodes_in_order[:, None] + np.arange(3)).ravel()
    difference = natural[dofs][:, dofs] - ordered
    assert abs(difference).max() < EXACT * abs(natural).max()
    assert np.array_equal(dofs[flank], 3 * numbers[:, mesh.flank.ravel()])


def test_ring_is_cut_open_at_the_face_that_comes_last(mesh):
    _, _, numbers = whole_gear_mesh(mesh)
    order = elimination_order(mesh, numbers, mesh.teeth)
    assert set(order[-len(mesh.right) :]) == set(numbers[0, mesh.right])


@pytest.mark.parametrize("sectors", [2, 12])
def test_nested_dissection_fills_less_than_the_order_of_the_mesh(mesh, sectors):
    ordered, _ = assemble_arc(mesh, YOUNG, POISSON, "hex8i", sectors)
    nodes, elements, numbers = whole_gear_mesh(mesh)
    free = np.setdiff1d(numbers[:sectors], numbers[:, mesh.bore])
    dofs = (3 * free[:, None] + np.arange(3)).ravel()
    arc = elements.reshape(mesh.teeth, -1)[:sectors].reshape(-1, 8)
    natural = sp.csc_array(assemble(nodes, arc, YOUNG, POISSON, "hex8i")[dofs][:, dofs])
    assert ordered.shape == natural.shape
    assert factorise(ordered).nnz < 0.7 * factorise(natural).nnz


# --- extrapolated cost ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", CASES)
def test_arcs_foretell_the_cost_of_the_whole_pair(name):
    case = parse_case(case_text(**CASES[name]), "small", "small case")
    mesh = mesh_model(case)
    whole = conventional_pair(case, mesh)
    estimate = newton_step_seconds(case, mesh)
    assert estimate.unknowns == whole.unknowns
    assert estimate.sectors == (2, 4, 8)
    for gear in (estimate.pinion, estimate.wheel):
        first, second = np.diff(gear.entries) / np.diff(gear.sectors)
        assert_allclose(first, second, rtol=0.1)  # linear, but for the separators at the top
    regular = whole.stiffness + sp.coo_array(([1.0], ([whole.unknowns - 1], [whole.unknowns - 1]))).tocsc()
    assert_allclose(estimate.factor_entries, factorise(regular).nnz, rtol=0.1)


def test_each_tooth_costs_what_a_further_sector_adds():
    pinion = GearCost(teeth=10, unknowns=300, sectors=(2, 4, 8), seconds=(1.0, 3.1, 7.0), entries=(100, 300, 700))
    wheel = GearCost(teeth=20, unknowns=900, sectors=(2, 4), seconds=(2.0, 3.0), entries=(400, 600))
    estimate = StepEstimate(pinion, wheel)
    assert_allclose(estimate.seconds, 10 * 1.0 + 20 * 0.5)
    assert_allclose(estimate.factor_entries, 10 * 100 + 20 * 100)
    assert estimate.unknowns == 300 + 900 + 1


def test_arcs_stay_within_the_memory_but_are_two_at_least():
    case = parse_case(case_text(**CASES["identical"]), "small", "small case")
    assert newton_step_seconds(case, mesh_model(case), memory_bytes=1.0).sectors == (2, 4)


def test_line_contact_is_refused():
    case = parse_case(case_text(contact=None), "line", "line case")
    with pytest.raises(CaseError, match='scheme = "line".*choose'):
        conventional_pair(case, mesh_model(case))
