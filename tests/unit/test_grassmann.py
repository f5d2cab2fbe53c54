"""Interpolation of subspaces along geodesics: its ends, its length, its weights in the family of shapes."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.penalty.kernels.shapes import shape_weights
from pmor.penalty.kernels.state import PositionShapes
from pmor.reduction.alignment import procrustes
from pmor.reduction.contact_shapes import ContactShapes
from pmor.reduction.grassmann import geodesic_weights, geodesics

ROUND_OFF = 1e-12
SIZE, MODES = 12, 3


def basis(rng):
    return np.linalg.qr(rng.normal(size=(SIZE, MODES)))[0]


def aligned(one, two):
    return two @ procrustes(one.T @ two)


@pytest.fixture
def ends(rng):
    one = basis(rng)
    return one, aligned(one, basis(rng))


def on_the_way(ends, fraction):
    path = geodesics((ends[0].T @ ends[1])[None], np.ones((2, MODES), dtype=bool))
    weights = geodesic_weights(path.turn[0], path.angle[0], fraction)
    return np.einsum("afs,ast->ft", np.stack(ends), weights)


def angles_between(one, two):
    """Principal angles, from their sines: exact where they are small."""
    return np.arcsin(np.clip(np.linalg.svd(two - one @ (one.T @ two), compute_uv=False), 0.0, 1.0))


def test_both_ends_are_reproduced(ends):
    for fraction, end in zip((0.0, 1.0), ends, strict=True):
        assert_allclose(on_the_way(ends, fraction), end, rtol=0.0, atol=ROUND_OFF)


@pytest.mark.parametrize("fraction", [0.1, 0.5, 0.9])
def test_what_lies_on_the_way_is_orthonormal(fraction, ends):
    found = on_the_way(ends, fraction)
    assert_allclose(found.T @ found, np.eye(MODES), rtol=0.0, atol=ROUND_OFF)
    chord = (1.0 - fraction) * ends[0] + fraction * ends[1]
    assert np.abs(chord.T @ chord - np.eye(MODES)).max() > 0.01, "linear interpolation is not"


@pytest.mark.parametrize("fraction", [0.1, 0.5, 0.9])
def test_the_angles_grow_in_proportion(fraction, ends):
    """A geodesic: all principal angles to its beginning are that fraction of those to its end."""
    whole = angles_between(*ends)
    assert_allclose(angles_between(ends[0], on_the_way(ends, fraction)), fraction * whole, rtol=1e-9)
    assert_allclose(angles_between(ends[1], on_the_way(ends, fraction)), (1.0 - fraction) * whole, rtol=1e-9)


def test_equal_subspaces_stay(rng):
    one = basis(rng)
    other = aligned(one, one @ np.linalg.qr(rng.normal(size=(MODES, MODES)))[0])
    assert_allclose(other, one, rtol=0.0, atol=ROUND_OFF)
    for fraction in (0.0, 0.3, 1.0):
        assert_allclose(on_the_way((one, other), fraction), one, rtol=0.0, atol=ROUND_OFF)


def test_subspaces_at_right_angles_are_joined_too(rng):
    both = np.linalg.qr(rng.normal(size=(SIZE, 2 * MODES)))[0]
    found = on_the_way((both[:, :MODES], both[:, MODES:]), 0.5)
    assert_allclose(found, np.sqrt(0.5) * (both[:, :MODES] + both[:, MODES:]), rtol=0.0, atol=ROUND_OFF)


# --- in the family of shapes -----------------------------------------------------------------------------------------

LOADED = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 1), (1, 1, 1), (1, 1, 0), (0, 0, 0)], dtype=bool)
FIRST, STEP = 0.1, 0.05


@pytest.fixture
def family(rng):
    """Shapes with products of aligned bases, some modes missing at some positions."""
    count = len(LOADED)
    gram = np.zeros((1, count, 2, 2, MODES, MODES))
    modes = [basis(rng)]
    for _ in range(count - 1):
        modes.append(aligned(modes[-1], basis(rng)))
    for k in range(count - 1):
        both = LOADED[k] & LOADED[k + 1]
        gram[0, k, 0, 1] = np.where(np.outer(both, both), modes[k].T @ modes[k + 1], 0.0)
    displacement = np.zeros((count, MODES, 2, 1, 1))
    return ContactShapes(FIRST + STEP * np.arange(count), 3, LOADED, displacement, gram, geodesic=True)


def test_modes_at_both_ends_are_mixed_and_the_others_stand_alone(family):
    k, found = family.combination(FIRST + 2.25 * STEP)
    assert k == 2
    path = family.geodesics
    assert_allclose(found, geodesic_weights(path.turn[2], path.angle[2], 0.25), rtol=0.0, atol=ROUND_OFF)
    assert np.abs(found[0] - np.diag(np.diag(found[0]))).max() > 0.01
    _, found = family.combination(FIRST + 3.25 * STEP)
    assert_allclose(found[:, 2], [[0.0, 0.0, 1.0], [0.0, 0.0, 0.0]], rtol=0.0, atol=ROUND_OFF)
    assert_allclose(found[:, :, 2], [[0.0, 0.0, 1.0], [0.0, 0.0, 0.0]], rtol=0.0, atol=ROUND_OFF)
    _, found = family.combination(FIRST + 0.25 * STEP)
    assert_allclose(found, [np.zeros((3, 3)), np.diag([1.0, 0.0, 0.0])], rtol=0.0, atol=ROUND_OFF)


@pytest.mark.parametrize("k", range(len(LOADED)))
def test_on_the_grid_a_training_position_stands_alone(k, family):
    below, found = family.combination(FIRST + k * STEP)
    at = np.zeros((len(LOADED) + 2, MODES, MODES))
    at[below : below + 2] = found
    expected = np.zeros_like(at)
    expected[k] = np.diag(LOADED[k].astype(float))
    assert np.array_equal(at, expected)


@pytest.mark.parametrize("place", [-0.5, 0.0, 0.5, 1.0, 1.3, 2.0, 2.5, 2.999, 3.25, 4.6, 5.0, 5.5])
@pytest.mark.parametrize("geodesic", [True, False])
def test_the_compiled_weights_are_those_of_the_slow_twin(geodesic, place, family):
    shapes = family if geodesic else ContactShapes(**{**vars(family), "geodesic": False})
    path = shapes.geodesics
    positions = PositionShapes(FIRST, STEP, LOADED, shapes.displacement, shapes.gram, path.turn, path.angle)
    found = np.zeros((2, MODES, MODES))
    k = shape_weights(positions, FIRST + place * STEP, found)
    below, expected = shapes.combination(FIRST + place * STEP)
    assert k == below
    assert_allclose(found, expected, rtol=0.0, atol=ROUND_OFF)
