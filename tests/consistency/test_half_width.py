"""Half the face width in the place of the whole: the same surface, the same contact, the same answer."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.gear.condition import at_torques
from pmor.gear.meshed_pair import Flank
from pmor.penalty.kernels.surface import node_normals, prepare_surface
from pmor.penalty.pair import ContactScheme, refined_extents
from pmor.storage.basis_file import read_basis
from pmor_online.model import reduced_pair
from pmor_online.sweep import sweep_reduced_pair
from tests.support.gear_models import SCHEME, sector, tooth

ROUND_OFF = 1e-13
# With one element in the half, its outer normals come from a chord where the whole has a parabola through three nodes.
# Measured 3.6e-8, and 1e-11 with that parabola.
SAME_ANSWER = 1e-9


# --- surface ---------------------------------------------------------------------------------------------------------


def barrel(columns, rows=5):
    """A doubly curved, unevenly spaced flank, symmetric about z = 1."""
    across = np.linspace(-1.0, 1.0, columns)
    x, z = np.meshgrid(np.linspace(0.0, 1.0, rows) ** 1.3, np.sign(across) * np.abs(across) ** 0.8, indexing="ij")
    return np.ascontiguousarray(np.stack([x + 0.1 * z**2, 0.3 * np.sin(2.0 * x) - 0.2 * x * z**2, 1.0 + z], axis=-1))


def prepared(nodes, edges, parabolic, mirrored):
    normals = np.empty_like(nodes)
    node_normals(nodes, *edges, parabolic, mirrored, normals)
    surface = prepare_surface(nodes, *edges, True, parabolic, mirrored)
    return normals, surface.along_rows, surface.along_columns


@pytest.mark.parametrize("edges", [(True, True), (False, True), (False, False)], ids=str)
@pytest.mark.parametrize(("columns", "parabolic"), [(3, False), (5, False), (5, True), (9, True)])
def test_half_a_surface_is_half_of_the_whole_one(columns, parabolic, edges):
    """Normals and tangents at mid width and on the way there; parabolas over the edge need three columns.

    At an inner border of a window this holds from its elements on: the row of neighbouring nodes is for averages only.
    """
    nodes, mid = barrel(columns), columns // 2
    used = slice(0 if edges[0] else 1, len(nodes) if edges[1] else -1)
    whole = prepared(nodes, edges, parabolic, False)
    half = prepared(np.ascontiguousarray(nodes[:, : mid + 1]), edges, parabolic, True)
    assert_allclose(half[0][used], whole[0][used, : mid + 1], rtol=0.0, atol=ROUND_OFF)
    assert_allclose(half[0][:, mid, 2], 0.0, rtol=0.0, atol=ROUND_OFF)
    between = slice(used.start, len(nodes) - 1 if edges[1] else -2)
    assert_allclose(half[1][between], whole[1][between, : mid + 1], rtol=0.0, atol=ROUND_OFF)
    assert_allclose(half[2][used, :mid], whole[2][used, :mid], rtol=0.0, atol=ROUND_OFF)
    # Without the mirror, mid width would be an edge of the flank.
    cut = prepared(np.ascontiguousarray(nodes[:, : mid + 1]), edges, parabolic, False)
    assert np.abs(cut[0][used, mid] - whole[0][used, mid]).max() > 1e-3


@pytest.mark.parametrize("lodm_width", [1, 3])
def test_points_of_half_a_flank_stand_for_the_area_of_half_the_flank(lodm_width):
    mesh = sector(tooth(21), 6, 4)
    scheme = ContactScheme(**(SCHEME | {"lodm_width": lodm_width}))
    whole = refined_extents(Flank(mesh.flank_nodes, mesh.flank_roll_angle), scheme)
    half = refined_extents(Flank(np.ascontiguousarray(mesh.flank_nodes[:, :3]), mesh.flank_roll_angle), scheme, True)
    mid = 2 * lodm_width
    assert_allclose(half[:, :mid], whole[:, :mid], rtol=0.0, atol=1e-12)
    # The point in the plane of symmetry is its own image: half of its area is in the half.
    assert_allclose(half[:, mid, :3], whole[:, mid, :3], rtol=0.0, atol=1e-12)
    assert np.all(half[:, mid, 3] == 0.0)

    def area(extents):
        return ((extents[..., 0] + extents[..., 1]) * (extents[..., 2] + extents[..., 3])).sum()

    assert_allclose(2.0 * area(half), area(whole), rtol=1e-12)


# --- answer ----------------------------------------------------------------------------------------------------------

FAMILIES = [{}, {"shapes": "positions"}]


@pytest.fixture(scope="module", params=FAMILIES, ids=["flank lines", "positions"])
def pairs(request, small_basis_file):
    """Half and whole width of the small model, each solved and reduced by itself."""
    files = [small_basis_file(width, **request.param) for width in ("half", "whole")]
    return tuple(reduced_pair(read_basis(path)) for path in files)


@pytest.mark.parametrize("slave", ["tip", "both"])
def test_half_the_width_gives_the_ste_and_the_shares_of_the_whole(slave, pairs):
    sweeps = []
    for reduced in pairs:
        meshed = replace(reduced.meshed, scheme=replace(reduced.meshed.scheme, slave=slave))
        phi = meshed.pair.pitch * np.arange(8) / 8
        conditions = at_torques([60e3, 100e3])
        sweeps.append(sweep_reduced_pair(replace(reduced, meshed=meshed), phi, conditions, tolerance=1e-9))
    half, whole = sweeps
    assert half.converged.all()
    assert whole.converged.all()
    assert_allclose(half.ste_um, whole.ste_um, rtol=SAME_ANSWER)
    assert np.array_equal(half.pair_index, whole.pair_index)
    assert_allclose(half.pair_share, whole.pair_share, rtol=0.0, atol=SAME_ANSWER)
    assert (half.pair_share > 0.05).sum(axis=2).max() == 2, "two pairs shared the load somewhere"
