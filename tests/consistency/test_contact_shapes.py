"""The shapes at trained positions: what a basis is made of, interpolation weights, smaller and redundant bases.

Energy products of all families: test_verify.
"""


import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.penalty.elasticity import full_elasticity, shape_elasticity
from pmor.penalty.kernels.shapes import shape_weights
from pmor.penalty.position import active_patches
from pmor.reduction.contact_shapes import ContactShapes

WHOLE_FLANK = 100.0  # mm: an approach so large that the windows hold the whole flanks


@pytest.mark.parametrize("fraction", [0.0, 0.3, 0.75], ids=["on the grid", "between", "nearer to the next"])
def test_basis_is_orthonormal_and_made_of_force_fields_with_their_displacements(
    fraction, whole_model, forces, reduced_by
):
    _, model = whole_model
    reduced = reduced_by("positions, whole width")
    shapes, meshed = reduced.basis.shapes, reduced.meshed
    step = shapes.roll_position[1] - shapes.roll_position[0]
    phi = float(reduced.basis.training.phi[2] + fraction * step)
    position = active_patches(meshed, phi, WHOLE_FLANK)
    # Rebuilt from the stored forces alone: the active shapes of each pair, interpolated by hand.
    active_shapes = []
    for p, index in enumerate(position.pair_index):
        place = (phi + index * meshed.pair.pitch - shapes.roll_position[0]) / step
        below = int(np.floor(place + 1e-6))
        for t in range(shapes.loaded.shape[1]):
            weights = {below: 1.0 - fraction, below + 1: fraction}
            weights = {k: w for k, w in weights.items() if w > 0.0 and forces[k, t].any()}
            if not weights:
                continue
            force = np.zeros((len(position.nodes), 3))
            for k, w in weights.items():
                for gear in range(2):
                    nodes = position.flank_nodes[p][gear]
                    share = w / sum(weights.values())
                    force[position.window_slice(p, gear)] += share * forces[k, t, gear].reshape(-1, 3)[nodes]
            active_shapes.append(force.ravel())
    fields = np.array(active_shapes).T
    moved = full_elasticity(model.pinion, model.wheel, position).compliance @ fields
    basis = shape_elasticity(shapes.family, position).basis.reshape(len(moved), -1)
    assert basis.shape == fields.shape, "none of the active_shapes depends on the others here"
    combination, *_ = np.linalg.lstsq(moved, basis, rcond=None)
    assert_allclose(moved @ combination, basis, rtol=0.0, atol=1e-9 * np.abs(basis).max())
    energy = (fields @ combination).T @ basis
    assert_allclose(
        energy, np.eye(len(energy)), rtol=0.0, atol=1e-8
    )  # active shapes are nearly parallel: two digits lost


# --- weights ---------------------------------------------------------------------------------------------------------


def shapes_for_weights(stencil=2, loaded=((0, 0), (0, 1), (1, 1), (1, 1), (1, 0), (0, 0))):
    count, grid = len(loaded), 0.1 + 0.05 * np.arange(len(loaded))
    gram = np.zeros((2, count, stencil, stencil, 2, 2))
    return ContactShapes(grid, 3, np.array(loaded, dtype=bool), np.zeros((count, 2, 2, 3, 1)), gram)


def weights_at(shapes, roll_position):
    """First grid position of the stencil, and the weights, (S, T)."""
    weights = np.full((shapes.stencil, shapes.loaded.shape[1]), np.nan)
    return shape_weights(shapes.family.positions, roll_position, weights), weights


@pytest.mark.parametrize(
    ("place", "below", "expected"),
    [
        (2.25, 2, [[0.75, 0.75], [0.25, 0.25]]),  # linear between two loaded positions
        (1.25, 1, [[0.0, 0.75], [1.0, 0.25]]),  # idle below at the first torque: the position above alone
        (3.75, 3, [[0.25, 1.0], [0.75, 0.0]]),  # idle above at the second torque: the position below alone
        (0.5, 0, [[0.0, 0.0], [0.0, 1.0]]),  # idle on both sides: nothing
        (-0.5, 0, [[0.0, 0.0], [0.0, 0.0]]),  # outside of what was trained: nothing
        (5.5, 4, [[0.0, 0.0], [0.0, 0.0]]),
    ],
)
def test_weights_are_linear_and_skip_idle_positions(place, below, expected):
    shapes = shapes_for_weights()
    k, weights = weights_at(shapes, 0.1 + 0.05 * place)
    assert k == below
    assert_allclose(weights, expected, rtol=0.0, atol=1e-12)  # round-off of the division by the step


def on_the_grid(shapes, roll_position):
    """Weights of all grid positions, shape (M, T)."""
    below, weights = weights_at(shapes, roll_position)
    count = len(shapes.roll_position)
    found = np.zeros((count, 2))
    for a, weight in enumerate(weights):
        if 0 <= below + a < count:
            found[below + a] = weight
        else:
            assert not weight.any(), "beyond the grid"
    return found


@pytest.mark.parametrize("place", [2.0, 2.25, 2.9, 3.5])
def test_cubic_weights_are_exact_for_cubics(place):
    weights = on_the_grid(shapes_for_weights(4, [(0, 0), *6 * [(1, 1)], (0, 0)]), 0.1 + 0.05 * place)
    for power in range(4):
        assert_allclose(np.arange(8.0) ** power @ weights, place**power, rtol=1e-12)


@pytest.mark.parametrize("torque", [0, 1])
@pytest.mark.parametrize("place", [-0.5, 0.5, 1.25, 3.75, 4.5, 6.5, 7.5])
def test_cubic_weights_are_linear_where_one_of_the_four_is_idle(place, torque):
    loaded = [(0, 0), (0, 1), (1, 1), (1, 1), (0, 0), (1, 1), (1, 1), (0, 0)]
    cubic, linear = (on_the_grid(shapes_for_weights(stencil, loaded), 0.1 + 0.05 * place) for stencil in (4, 2))
    assert np.array_equal(cubic[:, torque], linear[:, torque])


# --- smaller and redundant bases -------------------------------------------------------------------------------------
