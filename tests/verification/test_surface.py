"""Ferguson patches and facets over a grid of nodes: continuity, what they reproduce, and the closest point on them."""

import math
from itertools import product

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.fe.outline import tooth_outline
from pmor.penalty.kernels.state import Surface as KernelSurface
from pmor.penalty.kernels.surface import refine, surface_point
from tests.support.gear_models import tooth
from tests.support.surfaces import FOOT, GAP, ROUND_OFF, Surface, circle, cylinder, saddle

DIFFERENCES = 1e-8  # central differences of a cubic, step 1e-5


def orders(errors):
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


# --- continuity ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("smooth", [True, False])
def test_surface_passes_through_its_nodes(smooth):
    surface = Surface(saddle(), smooth)
    for (i, k), s, t in product(surface.elements, (0, 1), (0, 1)):
        assert_allclose(surface.at(i, k, s, t)[0], surface.nodes[i + s, k + t], atol=ROUND_OFF)


@pytest.mark.parametrize("smooth", [True, False])
@pytest.mark.parametrize("place", [(0.0, 0.0), (0.3, 0.7), (1.0, 0.4), (1.2, -0.1)])
def test_tangents_are_the_derivatives_of_the_point(smooth, place):
    surface, h = Surface(saddle(), smooth), 1e-5
    s, t = place
    for i, k in ((0, 0), (2, 3)):
        _, tangent_s, tangent_t = surface.at(i, k, s, t)
        by_s = (surface.at(i, k, s + h, t)[0] - surface.at(i, k, s - h, t)[0]) / (2 * h)
        by_t = (surface.at(i, k, s, t + h)[0] - surface.at(i, k, s, t - h)[0]) / (2 * h)
        assert_allclose(tangent_s, by_s, atol=DIFFERENCES)
        assert_allclose(tangent_t, by_t, atol=DIFFERENCES)


@pytest.mark.parametrize("smooth", [True, False])
@pytest.mark.parametrize(("first", "count"), [(0, 4), (1, 2)])
def test_refined_points_are_points_of_the_surface(smooth, first, count):
    surface = Surface(saddle(), smooth)
    points = np.empty((count * 4 + 1, 5 * 3 + 1, 3))
    refine(surface.prepared, first, count, 4, 3, points)
    for row in range(points.shape[0]):
        for column in range(points.shape[1]):
            i, k = min(row // 4, count - 1), min(column // 3, 4)
            expected = surface.at(first + i, k, row / 4 - i, column / 3 - k)[0]
            assert_allclose(points[row, column], expected, atol=ROUND_OFF)


# --- what a patch reproduces ---------------------------------------------------------------------------------------


def test_patch_with_exact_tangents_reproduces_a_cubic(rng):
    """Twist-free bicubics f(s) + g(t) are in the span of the Ferguson patch."""
    f, g = rng.normal(size=(2, 4, 3))

    def value(coefficients, x, derivative=False):
        powers = np.array([0.0, 1.0, 2 * x, 3 * x * x]) if derivative else x ** np.arange(4)
        return powers @ coefficients

    nodes, rows, columns = np.empty((2, 2, 3)), np.empty((2, 2, 2, 3)), np.empty((2, 2, 2, 3))
    for s in (0, 1):
        for t in (0, 1):
            nodes[s, t] = value(f, s) + value(g, t)
            rows[0, t, s], columns[s, 0, t] = value(f, s, True), value(g, t, True)
    point, tangent_s, tangent_t = np.empty(3), np.empty(3), np.empty(3)
    for s, t in rng.uniform(-0.2, 1.2, (10, 2)):
        surface_point(KernelSurface(nodes, rows, columns, True), 0, 0, s, t, point, tangent_s, tangent_t)
        assert_allclose(point, value(f, s) + value(g, t), atol=1e-12)
        assert_allclose(tangent_s, value(f, s, True), atol=1e-12)
        assert_allclose(tangent_t, value(g, t, True), atol=1e-12)


def shape_errors(make, residual, rows_of_interest, smooth=True, parabolic=True, sizes=(4, 8, 16)):
    """Largest residual over some rows of patches, for refined grids."""
    errors = []
    for n in sizes:
        surface = Surface(make(n), smooth, parabolic)
        errors.append(
            max(abs(residual(surface.at(i, 1, s, 0.4)[0])) for i in rows_of_interest(n) for s in np.linspace(0, 1, 9))
        )
    return np.array(errors)


def inside(n):
    return range(1, n - 1)


def ends(n):
    return 0, n - 1


def off_circle(point):
    return math.hypot(point[0], point[1]) - 1.0


@pytest.mark.parametrize(("rows", "parabolic", "order"), [(inside, True, 4.0), (ends, True, 4.0), (ends, False, 2.0)])
def test_patches_of_a_circle_are_fourth_order_and_with_averaged_edge_normals_second(rows, parabolic, order):
    errors = shape_errors(circle, off_circle, rows, parabolic=parabolic)
    assert_allclose(orders(errors), order, atol=0.1)


GEAR = tooth(21)
HELICAL = tooth(21, 0.0, 20.0)


def flank_grid(gear, elements, columns, spacing="roll_angle"):
    roll = tooth_outline(gear, elements, spacing).flank_roll_angle
    return gear.flank_point(roll[:, None], np.linspace(-10.0, 10.0, columns)[None])


def flank_error(gear, surface, rows):
    """Distance of a surface from the involute along the normal, mm."""
    worst = 0.0
    for i in rows:
        for s in np.linspace(0.0, 1.0, 7):
            x, y, z = surface.at(i, 1, s, 0.3)[0]
            radius, angle = math.hypot(x, y), math.atan2(-x, y) - gear.twist_per_length * z
            roll = gear.roll_angle_at(radius)
            along_normal = radius * math.cos(math.atan(roll))
            worst = max(worst, abs(angle - gear.half_thickness_angle(roll)) * along_normal)
    return worst


@pytest.mark.parametrize(
    ("gear", "rows", "order"), [(GEAR, inside, 2.7), (GEAR, ends, 2.7), (HELICAL, inside, 1.9)],
    ids=["inside", "ends", "helical"],
)  # fmt: skip
def test_patches_of_the_involute_are_third_order_and_of_a_helicoid_second(gear, rows, order):
    """The grid of a helical flank does not follow its lines of curvature: zero twist costs an order there."""
    columns = {GEAR: lambda n: 4, HELICAL: lambda n: n + 1}[gear]
    errors = [flank_error(gear, Surface(flank_grid(gear, n, columns(n))), rows(n)) for n in (8, 16, 32)]
    assert np.all(orders(errors) > order)
    assert errors[0] < 5e-4  # 8 elements: below half a micrometre, where facets miss by ten


def test_averaged_normal_is_the_mean_of_the_concurrent_facets():
    """A slow, obvious twin of the kernel."""
    nodes = saddle()
    rows, columns = nodes.shape[:2]
    expected = np.zeros_like(nodes)
    for i in range(rows):
        for k in range(columns):
            for ei in range(max(i - 1, 0), min(i + 1, rows - 1)):
                for ek in range(max(k - 1, 0), min(k + 1, columns - 1)):
                    a, b = nodes[ei + 1, ek + 1] - nodes[ei, ek], nodes[ei, ek + 1] - nodes[ei + 1, ek]
                    normal = np.cross(b, a)
                    expected[i, k] += normal / np.linalg.norm(normal)
    expected /= np.linalg.norm(expected, axis=-1, keepdims=True)
    assert_allclose(Surface(nodes, parabolic=False).normals, expected, atol=ROUND_OFF)
    # Parabolic normals differ at the edges of the flank only; inner borders of a window keep the average.
    partly = Surface(nodes, parabolic=True, edges=(False, True)).normals
    assert_allclose(partly[:-1, 1:-1], expected[:-1, 1:-1], atol=ROUND_OFF)
    assert np.linalg.norm(partly[-1] - expected[-1], axis=-1).min() > 1e-4


# --- the closest point -----------------------------------------------------------------------------------------------


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
