"""Unit forces on flank nodes: where they act, and in which directions."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.reduction.static_modes import static_mode_shapes
from tests.support.gear_models import body, sector, tooth

GEARS = tooth(17, 0.4), tooth(31, 0.1)
MESH = 5, 2
LINES, COLUMNS = MESH[0] + 1, MESH[1] + 1


@pytest.fixture(scope="module")
def shapes():
    bodies = tuple(body(gear, *MESH) for gear in GEARS)
    nodes = tuple(sector(gear, *MESH).flank_nodes for gear in GEARS)
    return static_mode_shapes(bodies, nodes)


def test_each_line_has_two_shapes_for_each_of_its_nodes(shapes):
    for gear in shapes.gears:
        assert np.array_equal(gear.start, 2 * COLUMNS * np.arange(LINES + 1))
        for line, shape in np.ndindex(LINES, 2 * COLUMNS):
            force = gear.force[gear.start[line] + shape].reshape(LINES, COLUMNS, 3)
            loaded = np.argwhere(np.linalg.norm(force, axis=2) > 1e-12)
            assert [(int(i), int(k)) for i, k in loaded] == [(line, shape // 2)]


def test_forces_are_along_the_normal_and_the_profile(shapes):
    """The normal from the involute itself; nodes give it to a hundredth."""
    for gear, lines in zip(GEARS, shapes.gears, strict=True):
        nodes = sector(gear, *MESH).flank_nodes
        force = lines.force.reshape(LINES, -1, 2, LINES, COLUMNS, 3)
        for i, k in np.ndindex(LINES, COLUMNS):
            normal = gear.flank_normal(gear.roll_angle_at(np.hypot(*nodes[i, k, :2])), 0.0)
            across, along = (f / np.linalg.norm(f) for f in force[i, k, :, i, k])
            assert abs(across @ normal) > 0.99
            assert abs(along @ normal) < 0.12
            assert_allclose([across[2], along[2], across @ along], 0.0, rtol=0.0, atol=1e-12)


def test_forces_in_the_transverse_plane_are_sums_of_them(shapes, rng):
    for lines in shapes.gears:
        wanted = rng.normal(size=(5, LINES, COLUMNS, 3)) * [1.0, 1.0, 0.0]
        wanted = wanted.reshape(5, -1)
        found, *_ = np.linalg.lstsq(lines.force.T, wanted.T, rcond=None)
        assert_allclose(lines.force.T @ found, wanted.T, rtol=0.0, atol=1e-10)
