"""One shape for each line of flank nodes: where it sits, what it moves, what work it does, what it learns from.

Their displacements and energy products, and static modes: test_verify, test_reductions.
"""

from itertools import product

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.core.conventions import rotation_z
from pmor.core.errors import ConvergenceError
from pmor.penalty.elasticity import full_elasticity, shape_elasticity
from pmor.penalty.kernels.types import ELEMENT_ROWS, FIRST_ROW
from pmor.penalty.position import active_patches
from pmor.reduction.flank_lines import LEAST_LOAD, flank_line_shapes
from tests.support.gear_models import body, gear_pair, meshed_pair, sector, tooth

ROUND_OFF = 1e-12  # of the largest: products of a few hundred terms
TOLERANCE = 0.05
GEARS = tooth(17, 0.4), tooth(31, 0.1)  # unlike, so that pinion and wheel cannot be mixed up
MESH = 5, 2
LINES, COLUMNS = MESH[0] + 1, MESH[1] + 1


@pytest.fixture(scope="module")
def bodies():
    return tuple(body(gear, *MESH) for gear in GEARS)


@pytest.fixture(scope="module")
def flank_nodes():
    return tuple(sector(gear, *MESH).flank_nodes for gear in GEARS)


def normal_loads(flank_nodes, rng, states=4, unlike=0.0):
    """Forces along the normals, shape (states, 2, f); `unlike`: how much distributions of the odd lines change."""
    force = np.zeros((states, 2, LINES, COLUMNS, 3))
    for gear, (shape, nodes) in enumerate(zip(GEARS, flank_nodes, strict=True)):
        roll = np.array([shape.roll_angle_at(np.hypot(*nodes[i, 0, :2])) for i in range(LINES)])
        normal = np.array([shape.flank_normal(u, 0.0) for u in roll])
        load = rng.uniform(0.5, 1.0, (states, LINES, 1)) * rng.uniform(0.5, 1.0, (1, 1, COLUMNS))
        load[:, 1::2] += unlike * rng.uniform(0.0, 1.0, load[:, 1::2].shape)
        force[:, gear] = -100.0 * load[..., None] * normal[None, :, None]
    return force.reshape(states, 2, -1)


@pytest.fixture(scope="module")
def shapes(bodies, flank_nodes):
    """Shapes with one distribution on some lines and two on others."""
    force = normal_loads(flank_nodes, np.random.default_rng(1), unlike=1.0)
    made = flank_line_shapes(bodies, force, flank_nodes, TOLERANCE)
    for gear in made.gears:
        assert np.diff(gear.start)[::2].tolist() == [1, 1, 1]
        assert (np.diff(gear.start)[1::2] > 1).all(), "otherwise lines and shapes could be mixed up"
    return made


def by_line(gear):
    """Forces of each shape, shape (m, lines, columns, 3), and the line that it belongs to."""
    return gear.force.reshape(-1, LINES, COLUMNS, 3), np.repeat(np.arange(LINES), np.diff(gear.start))


# --- what a shape is -------------------------------------------------------------------------------------------------


def test_shapes_are_orthonormal_and_each_sits_on_its_own_line(shapes):
    for gear in shapes.gears:
        force, line = by_line(gear)
        assert_allclose(gear.force @ gear.force.T, np.eye(len(force)), rtol=0.0, atol=ROUND_OFF)
        for i, j in product(range(len(force)), range(LINES)):
            assert force[i, j].any() == (line[i] == j)


@pytest.mark.parametrize("depth", [0.02, 100.0], ids=["windows", "whole flanks"])
def test_basis_of_a_position_is_orthonormal_and_made_of_line_loads_with_their_displacements(depth, shapes, bodies):
    """Rebuilt from the full compliance of the windows: line loads, what they move, and the energy of both."""
    meshed = meshed_pair(gear_pair(*GEARS), *MESH)
    position = active_patches(meshed, meshed.pair.roll_position_range[0] + 0.1 * meshed.pair.pitch, depth)
    assert len(position.pair_index) == 2
    active_shapes = []
    for gear, lines in enumerate(shapes.gears):
        force, line = by_line(lines)
        for p in range(2):
            first, rows = position.windows[p, gear, [FIRST_ROW, ELEMENT_ROWS]]
            for member in force[(line >= first) & (line <= first + rows)]:
                embedded = np.zeros((len(position.nodes), 3))
                nodes = position.flank_nodes[p][gear]
                embedded[position.window_slice(p, gear)] = member.reshape(-1, 3)[nodes]
                assert_allclose(np.linalg.norm(embedded), 1.0, rtol=ROUND_OFF)
                active_shapes.append(embedded.ravel())
    fields = np.array(active_shapes).T
    moved = full_elasticity(*bodies, position).compliance @ fields
    basis = shape_elasticity(shapes.family, position).basis.reshape(len(moved), -1)
    assert basis.shape == fields.shape
    combination, *_ = np.linalg.lstsq(moved, basis, rcond=None)
    assert_allclose(moved @ combination, basis, rtol=0.0, atol=1e-9 * np.abs(basis).max())
    # Conditioned like the loads of neighbouring lines, which move much the same: two digits lost.
    assert_allclose((fields @ combination).T @ basis, np.eye(basis.shape[1]), rtol=0.0, atol=1e-8)


# --- what the training teaches ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(("share", "kept"), [(1.2, 2), (0.8, 1)])
def test_a_second_distribution_is_kept_from_a_share_of_the_first_on(share, kept, bodies, flank_nodes, rng):
    one, two = np.linalg.qr(rng.normal(size=(3 * COLUMNS, 2)))[0].T
    force = normal_loads(flank_nodes, rng, 2).reshape(2, 2, LINES, 3 * COLUMNS)
    force[1] = force[0]
    force[0, 0, 3], force[1, 0, 3] = 100.0 * one, 100.0 * share * TOLERANCE * two
    pinion, wheel = flank_line_shapes(bodies, force.reshape(2, 2, -1), flank_nodes, TOLERANCE).gears
    assert np.diff(pinion.start)[3] == kept
    assert np.diff(wheel.start).tolist() == [1] * LINES
    found = pinion.force[pinion.start[3] : pinion.start[4]].reshape(kept, LINES, -1)[:, 3]
    assert_allclose(found, np.array([one, two])[:kept], rtol=0.0, atol=ROUND_OFF)


@pytest.mark.parametrize("trace", [0.0, 0.5 * LEAST_LOAD])
def test_lines_that_were_hardly_loaded_borrow_from_their_neighbour_turned_with_the_flank(
    trace, bodies, flank_nodes, rng
):
    force = normal_loads(flank_nodes, rng)
    full = flank_line_shapes(bodies, force, flank_nodes, TOLERANCE)
    lines = force.reshape(*force.shape[:2], LINES, -1)
    load = np.linalg.norm(lines, axis=(0, 3)).max()
    idle = [0, 1, LINES - 1]
    lines[:, :, idle] = trace * load * rng.normal(size=lines[:, :, idle].shape) / np.sqrt(lines[:, 0, 0].size)
    made = flank_line_shapes(bodies, force, flank_nodes, TOLERANCE)
    for number, gear in enumerate(made.gears):
        force, line = by_line(gear)
        assert line.tolist() == list(range(LINES))
        expected, _ = by_line(full.gears[number])
        for i, lender in ((0, 2), (1, 2), (LINES - 1, LINES - 2)):
            turn = unit(expected[i, i].sum(axis=0))
            away = np.arccos(turn @ unit(force[lender, lender].sum(axis=0)))
            off = np.arccos(min(turn @ unit(force[i, i].sum(axis=0)), 1.0))
            # Differences of nodes, one-sided at the ends: half an element's turn is missing there.
            assert off < 0.6 * away, "along the normal of its own line"
            # Turned about the gear's axis and nothing else: the distribution is the lender's.
            angle = turn_between(force[lender, lender], force[i, i])
            assert abs(angle) > 0.4 * away
            assert_allclose(force[i, i] @ rotation_z(angle), force[lender, lender], rtol=0.0, atol=ROUND_OFF)


def unit(vector):
    return vector / np.linalg.norm(vector)


def turn_between(one, two):
    """Angle about the axis by which the resultant of `one` has to turn to become that of `two`."""
    (x1, y1, _), (x2, y2, _) = one.sum(axis=0), two.sum(axis=0)
    return np.arctan2(y2, x2) - np.arctan2(y1, x1)


@pytest.mark.parametrize("idle", [[0, 1], [1]], ids=["both", "wheel"])
def test_a_gear_without_a_loaded_state_is_refused(idle, bodies, flank_nodes, rng):
    force = normal_loads(flank_nodes, rng)
    force[:, idle] = 0.0
    with pytest.raises(ConvergenceError, match="no training state loads a flank"):
        flank_line_shapes(bodies, force, flank_nodes, TOLERANCE)
