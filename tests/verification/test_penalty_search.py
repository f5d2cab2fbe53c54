"""Penalty contact of a pair of flanks: windows over the pitch, gaps, areas and forces, and what goes wrong in words."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor.penalty.solve
from pmor.case import change_case, load_case
from pmor.core.errors import ConvergenceError
from pmor.gear.condition import ALIGNED, PLAIN, Condition, at_torques
from pmor.gear.kernels.types import Motion
from pmor.pair.conditions import nominal_condition
from pmor.pair.model import mesh_model
from pmor.penalty.elasticity import ReducedElasticity
from pmor.penalty.equilibrium import solve_equilibrium
from pmor.penalty.kernels.nodal import search_pair
from pmor.penalty.kernels.search import facing_flanks, search_workspace
from pmor.penalty.kernels.state import Feet
from pmor.penalty.kernels.windows import place_windows
from pmor.penalty.position import active_patches, overshoot, relative_motion
from pmor.penalty.search import search_contact
from pmor.penalty.solve import solve_position, surface_error, window_depth
from tests.support.gear_models import MODULE, WIDTH, gear_pair, helical_pair, meshed_pair, tooth
from tests.support.loaded_pair import DEPTH, NEWTON, PAIRS, SAME_STATE, TORQUE, Model, every_pair, rigid_advance
from tests.support.small_case import full_fe
from tests.support.surfaces import random_rotation


def all_penetrations(meshed, position, turn):
    """Gaps, stiffnesses and weights of pair 0 when the frames of both teeth are turned by the same rotation."""
    pair, patches, p = position.kernel_pair, position.patches, position.pair_index.tolist().index(0)
    rotation, shift = relative_motion(meshed, position.phi, 2e-3, ALIGNED)
    workspace, penalty = search_workspace(pair, patches), np.full(meshed.extents[0].shape[1], pair.scheme.penalty)
    turned = Motion(np.ascontiguousarray(turn @ rotation @ turn.T), turn @ shift)
    facing = facing_flanks(pair, patches, p, 0, workspace)._replace(motion=turned, penalty=penalty, clear=1.0)
    feet, points = Feet(workspace.feet.element[p, 0], workspace.feet.guess[p, 0]), workspace.points
    nodes = np.ascontiguousarray(position.nodes @ turn.T)
    listed, smallest, _ = search_pair(pair.scheme, facing, nodes, 0.0, feet, 0, points)
    index, weight, gap, stiffness = (values[:listed] for values in (points.node, points.weight, points.gap,
                                                                    points.stiffness))  # fmt: skip
    return index, weight @ turn, gap, stiffness, smallest


@pytest.mark.parametrize("helix_deg", [0.0, 15.0])
@pytest.mark.parametrize("projection", ["patch", "facet"])
def test_penetrations_do_not_depend_on_the_orientation_of_the_flanks(helix_deg, projection, rng):
    pair = gear_pair(tooth(17, 0.2, helix_deg), tooth(21, 0.0, -helix_deg))
    meshed = meshed_pair(pair, 4, 2, projection=projection, lodm_profile=2)
    position = active_patches(meshed, 0.4 * sum(pair.roll_position_range), 0.1)
    expected = all_penetrations(meshed, position, np.eye(3))
    assert len(expected[2]) > 3
    found = all_penetrations(meshed, position, random_rotation(rng))
    assert np.array_equal(found[0], expected[0])
    for a, b in zip(found[1:], expected[1:], strict=True):
        assert_allclose(a, b, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("lodm_profile", [1, 4])
@pytest.mark.parametrize("lodm_width", [1, 3])
@pytest.mark.parametrize("helix_deg", [0.0, 30.0])
def test_areas_of_the_refined_points_add_up_to_the_flank(helix_deg, lodm_profile, lodm_width):
    """So that refining the surface does not stiffen the contact, nor a helix, whose rows and columns are askew."""
    pair = gear_pair(tooth(17, 0.2, helix_deg), tooth(21, 0.0, -helix_deg))
    meshed = meshed_pair(pair, 8, 2, lodm_profile=lodm_profile, lodm_width=lodm_width)
    flank, extents = meshed.pinion, meshed.extents[0]
    area = (extents[..., 0] + extents[..., 1]) * (extents[..., 2] + extents[..., 3])
    first, last = flank.roll_angle[[0, -1]]
    exact = 0.5 * pair.pinion.base_radius * (last**2 - first**2) * 20.0 / math.cos(pair.base_helix_angle)
    assert_allclose(area.sum(), exact, rtol=2e-3)  # chords instead of arcs
    assert np.all(extents[0, :, 0] == 0.0)
    assert np.all(extents[-1, :, 1] == 0.0)
    assert_allclose(extents[1:, :, 0], extents[:-1, :, 1])
    assert_allclose(extents[:, 1:, 2], extents[:, :-1, 3])


@pytest.mark.parametrize("surface", ["hermite", "facet"])
def test_gap_changes_by_its_lever_when_the_pinion_turns(surface):
    """`lever` is the derivative of the gap by the rotation: finite differences, point by point."""
    pair = gear_pair(tooth(17, 0.2), tooth(21))
    meshed = meshed_pair(pair, 4, 2, surface=surface, lodm_profile=2, slave="both")
    position = active_patches(meshed, 0.5 * sum(pair.roll_position_range), 0.1)
    advance, step = 4e-3, 1e-8
    one, two = (search_contact(meshed, position, np.zeros_like(position.nodes), advance + d) for d in (0.0, step))
    assert np.array_equal(one.place, two.place)
    assert set(one.slave) == {0, 1}
    assert_allclose((two.gap - one.gap) / step, one.lever, rtol=1e-4)


def test_gap_changes_by_its_weights_when_facet_nodes_move(rng):
    """On facets the paper's bilinear transfer is the exact gradient of the gap."""
    pair = gear_pair(tooth(17, 0.2), tooth(21))
    meshed = meshed_pair(pair, 4, 2, surface="facet", lodm_profile=2, slave="pinion")
    position = active_patches(meshed, 0.5 * sum(pair.roll_position_range), 0.1)
    shape = position.nodes.shape
    start, step = 1e-4 * rng.normal(size=shape), 1e-7 * rng.normal(size=shape)
    one, two = (search_contact(meshed, position, start + d, 4e-3) for d in (0.0, step))
    assert np.array_equal(one.place, two.place)
    assert len(one.gap) > 3
    # The gap is below 0.1 mm: turning the facet under it changes the gap by 1e-2 of the displacement at most.
    assert_allclose(two.gap - one.gap, one.gap_change(step), rtol=0, atol=2e-2 * np.abs(step).max())


@every_pair
def test_pairs_in_reach_are_those_of_the_kinematics(pair):
    meshed = Model(pair).meshed
    margin = overshoot(meshed, DEPTH)
    for phi in np.linspace(-pair.pitch, pair.pitch, 9):
        position = active_patches(meshed, phi, DEPTH)
        assert position.pair_index.tolist() == pair.touching_pairs(phi, margin).tolist()
        assert len(position.pair_index) <= meshed.tooth_pair_count


def test_kernels_never_count_more_tooth_pairs_than_there_is_memory_for():
    """Contact ratios within 1e-12 of integers, at the angles where a pair comes and another one leaves.

    Beyond the rows that the windows of a position have, a kernel would write into foreign memory.
    """
    rng, plain = np.random.default_rng(3), helical_pair(MODULE, (21, 33), 20.0, 0.0, WIDTH)
    kernel = meshed_pair(plain, 6, 2).for_kernels(PLAIN)
    per_width = plain.overlap_ratio / WIDTH
    counted = set()
    for total in np.repeat([2.0, 3.0, 4.0], 40):
        width = (total + rng.uniform(-1e-12, 1e-12) - plain.contact_ratio) / per_width
        pair = replace(plain, face_width=width)
        kinematics = meshed_pair(pair, 6, 2).kinematics(ALIGNED)
        first, last = (end + side * 0.5 * pair.pitch for end, side in zip(pair.meshing_range, (-1, 1), strict=True))
        for end in (first, last):
            phi = end + pair.pitch * rng.integers(-40, 40)
            patches, _ = place_windows(phi, 10.0 * MODULE, 1.0, 12, kinematics, kernel.gears, kernel.limits)
            assert patches.pairs <= pair.most_touching_pairs == pair.neighbouring_teeth + 1
            assert len(pair.touching_pairs(phi, 0.5 * pair.pitch)) <= pair.most_touching_pairs
            counted.add(pair.most_touching_pairs - patches.pairs)
    assert 0 in counted, "the angles are those of the largest number"


@pytest.mark.parametrize(("name", "count"), [("paper", 13), ("unequal, wide", 3)])
def test_rigid_pair_has_no_transmission_error(name, count):
    """64 Hermite elements in roll-angle spacing, gaps only: below 0.02 um over a pitch."""
    pair = PAIRS[name]
    meshed = meshed_pair(pair, 64, 1, lodm_profile=8)
    phi = pair.roll_position_range[0] + pair.pitch * np.linspace(0.0, 1.0, count)
    advance = [rigid_advance(meshed, angle) for angle in phi]
    assert np.abs(advance).max() * pair.pinion.base_radius * 1e3 < 0.02


@pytest.mark.parametrize(("elements", "most_um"), [(6, 5.0), (8, 1.5), (16, 0.4)])
def test_without_load_coarse_patches_miss_the_involute_by_what_the_readme_says(elements, most_um):
    case = load_case(Path(__file__).parents[2] / "cases" / "small_spur.toml")
    meshed = mesh_model(change_case(case, mesh={"profile_elements": elements})).meshed
    advance = [rigid_advance(meshed, meshed.pair.pitch * share) for share in np.arange(32) / 32]
    ste_um = np.array(advance) * meshed.pair.pinion.base_radius * 1e3
    assert 0.5 * most_um < np.abs(ste_um).max() < most_um


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
