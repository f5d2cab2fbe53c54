"""Ferguson patches and facets over a grid of nodes, and the closest point on them."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.contact import kernel
from pmor.contact.flank import FOOT_STEP
from pmor.contact.position import active_patches, relative_motion
from pmor.contact.search import search_contact
from pmor.mesh.outline import tooth_outline
from tests.gear_models import gear_pair, meshed_pair, tooth

ROUND_OFF = 1e-13  # mm or 1, for surfaces of size 1
# The projection stops when a step is below FOOT_STEP of an element; the foot is that far off, the gap by its square.
FOOT = 2.0 * FOOT_STEP
GAP = 1e-11
DIFFERENCES = 1e-8  # central differences of a cubic, step 1e-5


class Surface:
    """A grid of nodes with everything that the kernel prepares for it."""

    def __init__(self, nodes, smooth=True, parabolic=True, edges=(True, True), mirrored=False):
        self.nodes, self.smooth = np.ascontiguousarray(nodes, dtype=float), smooth
        shape = (*self.nodes.shape[:2], 2, 3)
        self.along_rows, self.along_columns = np.zeros(shape), np.zeros(shape)
        self.normals = np.empty_like(self.nodes)
        kernel.node_normals(self.nodes, *edges, parabolic, mirrored, self.normals)
        kernel.prepare_surface(
            self.nodes, *edges, smooth, parabolic, mirrored, self.along_rows, self.along_columns
        )

    @property
    def parts(self):
        return self.nodes, self.along_rows, self.along_columns, self.smooth

    @property
    def elements(self):
        return [(i, k) for i in range(self.nodes.shape[0] - 1) for k in range(self.nodes.shape[1] - 1)]

    def at(self, i, k, s, t):
        point, tangent_s, tangent_t = np.empty(3), np.empty(3), np.empty(3)
        kernel.surface_point(*self.parts, i, k, s, t, point, tangent_s, tangent_t)
        return point, tangent_s, tangent_t

    def normal(self, i, k, s, t):
        _, tangent_s, tangent_t = self.at(i, k, s, t)
        normal = np.cross(tangent_t, tangent_s)
        return normal / np.linalg.norm(normal)

    def project(self, x, start=(0, 0), guess=(0.5, 0.5), foot_step=FOOT_STEP):
        """Element, parameters, foot and signed gap."""
        element, guess = np.array(start, dtype=np.int64), np.array(guess, dtype=float)
        tangent_s, tangent_t, foot = np.empty(3), np.empty(3), np.empty(3)
        kernel.project(
            *self.parts, 0, self.nodes.shape[0] - 1, np.asarray(x, float), element, guess, tangent_s, tangent_t, foot,
            foot_step,
        )  # fmt: skip
        normal = np.cross(tangent_t, tangent_s)
        return element, guess, foot, float((x - foot) @ normal / np.linalg.norm(normal)), (tangent_s, tangent_t)


def cylinder(profile, x, columns=4, width=1.0):
    """Nodes of a surface (x, profile(x), z): rows along x, columns along z, outward normal +y... -y by the profile."""
    z = np.linspace(0.0, width, columns)
    x = np.asarray(x, dtype=float)
    return np.stack(np.broadcast_arrays(x[:, None], profile(x)[:, None], z[None]), axis=-1)


def circle(elements, columns=4, radius=1.0, angle=1.0):
    turn = np.linspace(0.0, angle, elements + 1)
    z = np.linspace(0.0, 1.0, columns)
    return np.stack(np.broadcast_arrays(radius * np.sin(turn)[:, None], radius * np.cos(turn)[:, None], z[None]), -1)


def saddle(rows=5, columns=6):
    """A smooth doubly curved, unevenly spaced grid."""
    x, z = np.linspace(0.0, 1.0, rows) ** 1.3, np.linspace(0.0, 1.5, columns) ** 0.9
    x, z = np.meshgrid(x, z, indexing="ij")
    return np.stack([x, 0.3 * np.sin(2.0 * x) * np.cos(1.5 * z) - 0.2 * x * z, z], axis=-1)


def random_rotation(rng):
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return turn * np.sign(np.linalg.det(turn))


def orders(errors):
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


# --- continuity ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("smooth", [True, False])
def test_surface_passes_through_its_nodes(smooth):
    surface = Surface(saddle(), smooth)
    for i, k in surface.elements:
        for s in (0, 1):
            for t in (0, 1):
                assert_allclose(surface.at(i, k, s, t)[0], surface.nodes[i + s, k + t], atol=ROUND_OFF)


@pytest.mark.parametrize("smooth", [True, False])
def test_patches_meet_along_their_edges(smooth):
    surface = Surface(saddle(), smooth)
    rows, columns = surface.nodes.shape[:2]
    for a in np.linspace(0.0, 1.0, 5):
        for i, k in surface.elements:
            if i + 2 < rows:
                assert_allclose(surface.at(i, k, 1.0, a)[0], surface.at(i + 1, k, 0.0, a)[0], atol=ROUND_OFF)
            if k + 2 < columns:
                assert_allclose(surface.at(i, k, a, 1.0)[0], surface.at(i, k + 1, a, 0.0)[0], atol=ROUND_OFF)


@pytest.mark.parametrize("parabolic", [True, False])
def test_all_patches_have_the_shared_normal_at_a_node(parabolic):
    surface = Surface(saddle(), parabolic=parabolic)
    for i, k in surface.elements:
        for s in (0, 1):
            for t in (0, 1):
                assert_allclose(surface.normal(i, k, s, t), surface.normals[i + s, k + t], atol=ROUND_OFF)


def test_tangent_planes_agree_all_along_an_edge_of_a_cylinder():
    x = np.linspace(0.0, 1.0, 6) ** 1.4
    surface = Surface(cylinder(np.sin, x))
    for i, k in surface.elements:
        if i + 2 < len(x):
            for t in (0.0, 0.3, 0.8):
                assert_allclose(surface.normal(i, k, 1.0, t), surface.normal(i + 1, k, 0.0, t), atol=ROUND_OFF)


def test_kink_along_edges_of_a_doubly_curved_surface_vanishes_with_refinement():
    """Zero twist leaves a small kink between the nodes; facets have one of first order."""
    kinks, facet_kinks = [], []
    for refinement in (1, 2, 4):
        for smooth, found in ((True, kinks), (False, facet_kinks)):
            surface = Surface(saddle(4 * refinement + 1, 5 * refinement + 1), smooth)
            i, k = 2 * refinement, 2 * refinement
            found.append(np.linalg.norm(surface.normal(i, k, 1.0, 0.5) - surface.normal(i + 1, k, 0.0, 0.5)))
    assert np.all(orders(kinks) > 1.7)
    assert np.all(orders(facet_kinks) < 1.4)
    assert kinks[-1] < 0.02 * facet_kinks[-1]


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
    kernel.refine(*surface.parts, first, count, 4, 3, points)
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
        kernel.surface_point(nodes, rows, columns, True, 0, 0, s, t, point, tangent_s, tangent_t)
        assert_allclose(point, value(f, s) + value(g, t), atol=1e-12)
        assert_allclose(tangent_s, value(f, s, True), atol=1e-12)
        assert_allclose(tangent_t, value(g, t, True), atol=1e-12)


@pytest.mark.parametrize("parabolic", [True, False])
@pytest.mark.parametrize("smooth", [True, False])
def test_plane_is_reproduced(smooth, parabolic, rng):
    x, z = np.meshgrid(np.linspace(0, 1, 5) ** 1.5, np.linspace(0, 1, 4) ** 0.8, indexing="ij")
    turn = random_rotation(rng)
    surface = Surface(np.stack([x, 0.3 * x - 0.5 * z, z], axis=-1) @ turn.T, smooth, parabolic)
    normal = turn @ (np.array([-0.3, 1.0, 0.5]) / math.sqrt(1.34))
    assert_allclose(surface.normals, np.broadcast_to(normal, surface.normals.shape), atol=ROUND_OFF)
    for i, k in surface.elements:
        for s, t in ((0.2, 0.9), (0.6, 0.5)):
            assert_allclose(surface.at(i, k, s, t)[0] @ normal, 0.0, atol=ROUND_OFF)
            assert_allclose(surface.normal(i, k, s, t), normal, atol=ROUND_OFF)


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


def test_facets_of_a_circle_are_second_order():
    errors = shape_errors(circle, lambda p: math.hypot(p[0], p[1]) - 1.0, inside, smooth=False)
    assert_allclose(orders(errors), 2.0, atol=0.05)
    assert_allclose(errors, 1.0 - np.cos(0.5 / np.array([4, 8, 16])), rtol=1e-9)  # the sagitta


@pytest.mark.parametrize("rows", [inside, ends])
def test_patches_of_a_circle_are_fourth_order(rows):
    errors = shape_errors(circle, lambda p: math.hypot(p[0], p[1]) - 1.0, rows)
    assert_allclose(orders(errors), 4.0, atol=0.1)


@pytest.mark.parametrize("rows", [inside, ends])
def test_patches_of_a_parabola_are_third_order(rows):
    # Its curvature changes, so node normals from chords are of second order, and times the element's length that is 3.
    errors = shape_errors(
        lambda n: cylinder(np.square, np.linspace(0.0, 1.0, n + 1)), lambda p: p[1] - p[0] ** 2, rows, sizes=(8, 16, 32)
    )
    assert np.all(orders(errors) > 2.9)


def test_averaged_edge_normals_are_only_second_order():
    errors = shape_errors(circle, lambda p: math.hypot(p[0], p[1]) - 1.0, ends, parabolic=False)
    assert_allclose(orders(errors), 2.0, atol=0.1)


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


@pytest.mark.parametrize("rows", [inside, ends])
def test_patches_of_the_involute_are_third_order(rows):
    errors = [flank_error(GEAR, Surface(flank_grid(GEAR, n, 4)), rows(n)) for n in (8, 16, 32)]
    assert np.all(orders(errors) > 2.7)
    assert errors[0] < 5e-4  # 8 elements: below half a micrometre, where facets miss by ten


def test_patches_of_a_helicoid_are_second_order():
    # The grid of a helical flank does not follow its lines of curvature: zero twist costs an order there.
    errors = [flank_error(HELICAL, Surface(flank_grid(HELICAL, n, n + 1)), inside(n)) for n in (8, 16, 32)]
    assert np.all(orders(errors) > 1.9)
    assert errors[0] < 5e-4


def test_parabolic_normals_beat_averaged_ones_at_the_tip():
    for n in (8, 16):
        parabolic, average = (Surface(flank_grid(GEAR, n, 4), parabolic=p) for p in (True, False))
        assert flank_error(GEAR, parabolic, [n - 1]) < 0.1 * flank_error(GEAR, average, [n - 1])
        exact = GEAR.flank_normal(tooth_outline(GEAR, n, "roll_angle").flank_roll_angle, 0.0)
        turn = [np.linalg.norm(surface.normals[:, 1] - exact, axis=1) for surface in (parabolic, average)]
        assert turn[0][-1] < 0.1 * turn[1][-1]
        assert turn[0][0] < 0.5 * turn[1][0]


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


def test_two_by_two_nodes_have_chords_for_tangents():
    nodes = np.array([[[0.0, 0, 0], [0, 0, 1]], [[1, 0, 0], [1, 0.2, 1]]])
    surface = Surface(nodes)
    for i, k in ((0, 0), (0, 1), (1, 0), (1, 1)):
        expected = np.cross(nodes[i, 1] - nodes[i, 0], nodes[1, k] - nodes[0, k])
        assert_allclose(surface.normals[i, k], expected / np.linalg.norm(expected), atol=ROUND_OFF)


# --- projection ----------------------------------------------------------------------------------------------------


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


@pytest.mark.parametrize("smooth", [True, False])
def test_gap_does_not_depend_on_the_orientation_of_the_surface(smooth, rng):
    straight = Surface(saddle(), smooth)
    points = [straight.at(i, k, 0.3, 0.6)[0] + 0.02 * straight.normal(i, k, 0.3, 0.6) for i, k in straight.elements]
    for _ in range(3):
        turn, shift = random_rotation(rng), rng.normal(size=3)
        turned = Surface(straight.nodes @ turn.T + shift, smooth)
        for (i, k), x in zip(straight.elements, points, strict=True):
            expected, found = straight.project(x, (i, k)), turned.project(turn @ x + shift, (i, k))
            assert_allclose(found[3], expected[3], atol=GAP)
            assert_allclose(found[1], expected[1], atol=FOOT)
            assert found[0].tolist() == expected[0].tolist()


# --- a pair of flanks in any orientation ---------------------------------------------------------------------------


def all_penetrations(meshed, position, turn):
    """Gaps, stiffnesses and weights of one pair when the frames of both teeth are turned by the same rotation."""
    scheme, windows = meshed.kernel_scheme, position.windows[0]
    roll_position = position.phi + position.pair_index[0] * meshed.pair.pitch
    rotation, shift = relative_motion(meshed, roll_position, 2e-3)
    room = 4000
    lists = (np.zeros((room, 8), dtype=np.int64), np.zeros((room, 8, 3)), *(np.zeros(room) for _ in range(4)),
             np.zeros((room, 4), dtype=np.int64))  # fmt: skip
    first = position.first_row[0, 0] * scheme[0]
    extents = meshed.pinion.extents[first : first + windows[0, 3] * scheme[0] + 1]
    memory = (*extents.shape[:2], 2)
    count, smallest, _ = kernel.search_pair(
        position.nodes @ turn.T, windows[0], meshed.pinion.columns, windows[1], meshed.wheel.columns, extents,
        *scheme[:6], np.ascontiguousarray(turn @ rotation @ turn.T), turn @ shift, True, scheme[6], 0,
        position.centre[0, 0] - position.first_row[0, 0], position.centre[0, 1] - position.first_row[0, 1],
        1.0, 0.0, scheme[7], np.full(memory, -1), np.empty(memory), lists,
    )  # fmt: skip
    index, weight, gap, stiffness = (values[:count] for values in lists[:4])
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
def test_areas_of_the_refined_points_add_up_to_the_flank(lodm_profile, lodm_width):
    """So that refining the surface does not stiffen the contact."""
    pair = gear_pair(tooth(17, 0.2), tooth(21))
    flank = meshed_pair(pair, 8, 2, lodm_profile=lodm_profile, lodm_width=lodm_width).pinion
    area = (flank.extents[..., 0] + flank.extents[..., 1]) * (flank.extents[..., 2] + flank.extents[..., 3])
    first, last = flank.roll_angle[[0, -1]]
    exact = 0.5 * pair.pinion.base_radius * (last**2 - first**2) * 20.0
    assert_allclose(area.sum(), exact, rtol=2e-3)  # chords instead of arcs
    assert np.all(flank.extents[0, :, 0] == 0.0)
    assert np.all(flank.extents[-1, :, 1] == 0.0)
    assert_allclose(flank.extents[1:, :, 0], flank.extents[:-1, :, 1])
    assert_allclose(flank.extents[:, 1:, 2], flank.extents[:, :-1, 3])


@pytest.mark.parametrize("surface", ["hermite", "facet"])
def test_gap_changes_by_its_lever_when_the_pinion_turns(surface):
    """`lever` is the derivative of the gap by the rotation: finite differences, point by point."""
    pair = gear_pair(tooth(17, 0.2), tooth(21))
    meshed = meshed_pair(pair, 4, 2, surface=surface, lodm_profile=2, slave="both")
    position = active_patches(meshed, 0.5 * sum(pair.roll_position_range), 0.1)
    lead, step = 4e-3, 1e-8
    one, two = (search_contact(meshed, position, np.zeros_like(position.nodes), lead + d) for d in (0.0, step))
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
