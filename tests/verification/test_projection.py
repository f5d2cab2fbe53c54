"""The closest point on patches and facets."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.support.surfaces import FOOT, GAP, Surface, circle, cylinder, saddle


@pytest.mark.parametrize("smooth", [True, False])
def test_foot_is_perpendicular(smooth, rng):
    surface = Surface(saddle(), smooth)
    for i, k in surface.elements:
        s, t = rng.uniform(0.2, 0.8, 2)
        place, gap = surface.at(i, k, s, t)[0], rng.uniform(-0.05, 0.05)
        x = place + gap * surface.normal(i, k, s, t)
        element, guess, foot, found, tangents = surface.project(x, (i, k))
        assert element.tolist() == [i, k]
        for tangent in tangents:
            assert abs((x - foot) @ tangent) <= FOOT * (tangent @ tangent)
        assert_allclose(found, gap, atol=GAP)
        assert_allclose(guess, [s, t], atol=FOOT)
        assert_allclose(foot, place, atol=FOOT)


@pytest.mark.parametrize("smooth", [True, False])
def test_projection_walks_to_the_same_foot_from_every_patch(smooth, rng):
    """On a convex surface, to which facets alike are convex, the closest point is unique."""
    surface = Surface(circle(6, 5), smooth)
    for i, k in ((0, 0), (3, 2), (5, 3)):
        x = surface.at(i, k, 0.4, 0.6)[0] + 0.03 * surface.normal(i, k, 0.4, 0.6)
        for start in surface.elements:
            element, guess, foot, gap, _ = surface.project(x, start, rng.uniform(0.0, 1.0, 2))
            assert element.tolist() == [i, k]
            assert_allclose(guess, [0.4, 0.6], atol=FOOT)
            assert_allclose(gap, 0.03, atol=GAP)
            assert_allclose(foot, surface.at(i, k, 0.4, 0.6)[0], atol=FOOT)


def test_foot_of_a_point_over_a_patch_edge_has_the_same_gap_from_either_side():
    surface = Surface(circle(4))
    x = surface.at(1, 1, 1.0, 0.5)[0] + 0.02 * surface.normal(1, 1, 1.0, 0.5)
    gaps = [surface.project(x, start)[3] for start in ((1, 1), (2, 1), (0, 0), (3, 2))]
    assert_allclose(gaps, 0.02, atol=GAP)


@pytest.mark.parametrize("start", [(0, 0), (1, 0)])
def test_foot_on_a_convex_edge_between_facets_is_on_the_edge(start):
    roof = cylinder(lambda x: -np.abs(x), [-1.0, 0.0, 1.0], 3)
    _, _, foot, _, _ = Surface(roof, smooth=False).project(np.array([0.05, 0.4, 0.3]), start)
    assert_allclose(foot, [0.0, 0.0, 0.3], atol=FOOT)


def test_coarse_looks_from_the_last_foot_come_to_the_same_foot():
    """The reduced sweep: one step at a time, each from where the last ended; the gap is off by the step's square."""
    surface, step = Surface(circle(6, 5)), 1e-2
    x = surface.at(3, 2, 0.4, 0.6)[0] + 0.03 * surface.normal(3, 2, 0.4, 0.6)
    element, guess = np.array([3, 2]), np.array([0.4, 0.6]) + 0.7 * step * np.array([0.6, -0.4])
    gaps = []
    for _ in range(3):
        element, guess, _, gap, _ = surface.project(x, element, guess, foot_step=step)
        assert element.tolist() == [3, 2]
        gaps.append(abs(gap - 0.03))
    assert gaps[0] < step**2 * (1.0 / 6.0) ** 2, "the step's square times the element's length squared over the radius"
    assert gaps[0] > GAP
    assert gaps[-1] < GAP
    assert_allclose(guess, [0.4, 0.6], atol=FOOT)


def test_points_beyond_the_outer_edge_project_on_the_continued_surface():
    surface = Surface(cylinder(lambda x: 0.0 * x, np.linspace(0.0, 1.0, 4)))
    element, guess, foot, gap, _ = surface.project(np.array([1.1, 0.2, 1.1]))
    assert element.tolist() == [2, 2]
    assert_allclose(guess, [1.3, 1.3], atol=FOOT)
    assert_allclose(foot, [1.1, 0.0, 1.1], atol=FOOT)
    assert_allclose(gap, 0.2, atol=GAP)


def test_far_points_end_at_the_limit_of_the_continuation():
    surface = Surface(cylinder(lambda x: 0.0 * x, np.linspace(0.0, 1.0, 4)))
    element, guess, _, _, _ = surface.project(np.array([3.0, 0.2, -3.0]))
    assert element.tolist() == [2, 0]
    assert guess[0] > 1.0
    assert guess[1] < 0.0
