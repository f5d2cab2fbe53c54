"""Teeth far from each other, and other flanks: against one sparse system for the whole gear."""

import math
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.body.elastic_gear import elastic_gear
from pmor.body.far_compliance import LEFT_OUT, FarTeeth
from pmor.body.fillet_stress import sector_stress
from pmor.body.root_stress import root_stress_shapes
from pmor.fe.fillet import build_fillet
from pmor.fe.sector import build_sector
from pmor.gear.tooth import Tooth
from tests.support.whole_gear import whole_gear_displacement

TEETH, STEEL = 17, (210e3, 0.3)
OFFSETS = (4, 8, 9, 12)
IMAGE = np.array([-1.0, 1.0, 1.0])
# Of the largest movement of a far tooth; several shapes are left out.
FOLLOWED = 20.0 * LEFT_OUT
# Of the largest stress in a far tooth: patterns of forces and of stress are left out below 1e-4 each.
STRESSED = 2e-3


@cache
def gear(helix_deg, element, order):
    tooth = Tooth(TEETH, 4.0, math.radians(20.0), helix_angle=math.radians(helix_deg))
    mesh = build_sector(tooth, 20.0, 20.0, 2, 2, "arc_length", "whole", 0.0, order)
    far, fillet = FarTeeth(OFFSETS, OFFSETS, OFFSETS), build_fillet(tooth, mesh)
    return mesh, elastic_gear(mesh, *STEEL, element, far=far, fillet=fillet), fillet


def forces(mesh, parts, rng):
    """Two load cases on a flank, in the components that contact forces have."""
    found = np.zeros((mesh.flank.size, 3, 2))
    found[:, :parts] = rng.standard_normal((mesh.flank.size, parts, 2))
    return found


@pytest.mark.parametrize(
    ("helix_deg", "element", "order"), [(0.0, "hex8i", 1), pytest.param(15.0, "hex20", 2, marks=pytest.mark.slow)]
)
def test_far_flanks_and_roots_of_far_teeth_give_way_as_in_the_whole_gear(helix_deg, element, order):
    """Other flanks and both fillets too: the stress there is that of the displacement of each sector."""
    mesh, body, fillet = gear(helix_deg, element, order)
    parts, shapes = 2 if helix_deg == 0.0 else 3, body.far.shapes
    load = forces(mesh, parts, np.random.default_rng(4))
    moved = whole_gear_displacement(mesh, *STEEL, element, load.reshape(-1, 2)).reshape(TEETH, -1, 3, 2)
    onto = shapes.T @ load[:, :parts].reshape(-1, 2)
    for k in OFFSETS:
        there = moved[k][mesh.flank.ravel()][:, :parts].reshape(-1, 2)
        size = np.abs(moved[OFFSETS[0]][mesh.flank.ravel()]).max()
        assert_allclose(shapes @ (body.far.flanks[k] @ onto), there, rtol=0.0, atol=FOLLOWED * size)
        there = (moved[k][mesh.back.ravel()] * IMAGE[:, None])[:, :parts].reshape(-1, 2)
        assert_allclose(shapes @ (body.far.backs[k] @ onto), there, rtol=0.0, atol=FOLLOWED * size)
    _, both = sector_stress(fillet, mesh, *STEEL)
    functions = np.concatenate([side.over(np.arange(3 * len(mesh.nodes))) for side in both])
    rim, every = root_stress_shapes(body.fillet, 3), np.arange(-(TEETH // 2), TEETH // 2 + 1)
    far = every[np.abs(every) > 1]
    expected = np.stack([functions @ moved[k].reshape(-1, 2) for k in far.tolist()])
    amplitudes = rim.rim_moved[0][far + TEETH // 2] @ (rim.rim_pattern @ load.reshape(-1, 2))
    found = np.einsum("spcta,kam->kspctm", rim.rim_stress, amplitudes).reshape(expected.shape)
    assert_allclose(found, expected, rtol=0.0, atol=STRESSED * np.abs(expected).max())


def test_the_other_flank_is_an_image_of_the_flank():
    """Spur gears have the same compliance there, helical ones that of the other hand."""
    _, spur, _ = gear(0.0, "hex8i", 1)
    for k in OFFSETS:
        assert_allclose(spur.far.images[k], spur.far.flanks[k], rtol=0.0, atol=1e-9 * np.abs(spur.far.flanks[4]).max())
    (mesh, left, _), (_, right, _) = gear(15.0, "hex20", 2), gear(-15.0, "hex20", 2)
    load = forces(mesh, 3, np.random.default_rng(5)).reshape(-1, 2)
    for k in OFFSETS:
        by_image, by_hand = (
            gear.far.shapes @ (blocks[k] @ (gear.far.shapes.T @ load))
            for gear, blocks in ((left, left.far.images), (right, right.far.flanks))
        )
        assert_allclose(by_image, by_hand, rtol=0.0, atol=FOLLOWED * np.abs(by_hand).max() * 100)
