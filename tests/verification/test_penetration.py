"""Gaps, areas and force transfer between a pair of flanks, whatever their orientation."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.gear.condition import ALIGNED
from pmor.gear.kernels.types import Motion
from pmor.penalty.kernels.nodal import search_pair
from pmor.penalty.kernels.search import facing_flanks, search_workspace
from pmor.penalty.kernels.state import Feet
from pmor.penalty.position import active_patches, relative_motion
from pmor.penalty.search import search_contact
from tests.support.gear_models import gear_pair, meshed_pair, tooth
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
