"""POD of snapshots in the energy inner product, and the alignment of its modes along the roll positions."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.core.errors import ConvergenceError
from pmor.reduction.pod import (
    global_modes,
    local_modes,
    own_displacement,
    principal_combinations,
)

ROUND_OFF = 1e-11  # of numbers near 1: products of a few dozen terms, two eigenvalue decompositions
UNKNOWNS, POSITIONS, STATES = 9, 6, 4


class Body:
    """A tooth with any compliance."""

    def __init__(self, rng):
        root = rng.normal(size=(UNKNOWNS, UNKNOWNS))
        self.compliance = root @ root.T + 0.1 * np.eye(UNKNOWNS)

    def tooth_compliance(self, offset):
        assert offset == 0, "energy is that of the loaded teeth"
        return self.compliance


@pytest.fixture
def bodies(rng):
    return Body(rng), Body(rng)


@pytest.fixture
def force(rng):
    """Snapshots that turn slowly with the position; the states fall off by a factor of eight from one to the next."""
    fixed, turning = rng.normal(size=(2, STATES, 2, UNKNOWNS))
    angle = 0.3 * np.arange(POSITIONS)[:, None, None, None]
    states = np.cos(angle) * fixed + np.sin(angle) * turning
    mixing = np.tril(np.ones((STATES, STATES))) * 8.0 ** -np.arange(STATES)
    return 100.0 * np.einsum("st,ktgf->ksgf", mixing, states)


def products(bodies, one, two):
    """Energy products of force fields over both gears, by the compliance itself."""
    return sum(one[..., g, :] @ bodies[g].compliance @ np.swapaxes(two[..., g, :], -1, -2) for g in range(2))


def missed(bodies, snapshots, modes):
    """Mean share of the snapshots' energy that no combination of the modes has, by least squares."""
    roots = [np.linalg.cholesky(body.compliance) for body in bodies]

    def columns(fields):
        return np.concatenate([fields[:, g] @ roots[g] for g in range(2)], axis=1).T

    wanted = columns(snapshots)
    wanted /= np.linalg.norm(wanted, axis=0)
    coordinates, *_ = np.linalg.lstsq(columns(modes), wanted, rcond=None)
    return np.mean(np.sum((wanted - columns(modes) @ coordinates) ** 2, axis=0))


def test_displacement_is_that_of_both_loaded_teeth(bodies, force):
    moved = own_displacement(bodies, force)
    for gear in range(2):
        assert_allclose(moved[2, 1, gear], bodies[gear].compliance @ force[2, 1, gear], rtol=1e-12)


@pytest.mark.parametrize("tolerance", [0.5, 1e-2, 1e-4, 1e-6, 1e-8])
def test_no_more_energy_is_discarded_than_the_tolerance(tolerance, bodies, force):
    modes = local_modes(bodies, force, tolerance)
    shares = [missed(bodies, snapshots, m) for snapshots, m in zip(force, modes, strict=True)]
    assert max(shares) <= tolerance
    everywhere = global_modes(bodies, force, tolerance)
    assert missed(bodies, force.reshape(-1, 2, UNKNOWNS), everywhere) <= tolerance


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5])
def test_one_mode_less_would_discard_more(tolerance, bodies, force):
    """At the position that needs most; what is left out by POD is the least that so many shapes can leave out."""
    size = local_modes(bodies, force, tolerance).shape[1]
    assert 1 < size < STATES
    fewer = []
    for snapshots in force:
        energy, combination = principal_combinations(products(bodies, snapshots, snapshots))
        modes = np.einsum("sm,sgf->mgf", combination[:, : size - 1], snapshots)
        fewer.append(missed(bodies, snapshots, modes))
        assert_allclose(fewer[-1], 1.0 - energy[: size - 1].sum(), rtol=1e-6)
    assert max(fewer) > tolerance


@pytest.mark.parametrize("tolerance", [1e-2, 1e-12])
def test_modes_are_orthonormal_in_energy(tolerance, bodies, force):
    modes = local_modes(bodies, force, tolerance)
    identity = np.broadcast_to(np.eye(modes.shape[1]), (POSITIONS, *2 * modes.shape[1:2]))
    assert_allclose(products(bodies, modes, modes), identity, rtol=0.0, atol=ROUND_OFF)


def test_dependent_and_idle_snapshots_give_no_modes(bodies, force):
    force = force[:, [0, 1, 0, 1, 2]]
    force[:, 1] *= 0.0
    force[2] = 0.0
    modes = local_modes(bodies, force, 1e-12)
    exist = modes.any(axis=(2, 3))
    rank = [np.linalg.matrix_rank(f.reshape(len(f), -1), tol=1e-9 * np.abs(force).max()) for f in force]
    assert exist.sum(axis=1).tolist() == rank
    assert rank[2] == 0
    assert (np.diff(exist.astype(int), axis=1) <= 0).all(), "the first ones exist"


def test_without_load_there_is_nothing_to_decompose(bodies, force):
    for modes in (local_modes, global_modes):
        with pytest.raises(ConvergenceError, match="no training state loads a flank"):
            modes(bodies, 0.0 * force, 1e-6)


# --- alignment -------------------------------------------------------------------------------------------------------


def assert_positive_symmetric(matrix):
    assert_allclose(matrix, matrix.T, rtol=0.0, atol=ROUND_OFF)
    assert np.linalg.eigvalsh(0.5 * (matrix + matrix.T)).min() > -ROUND_OFF


def test_bases_of_unequal_size_and_gaps_are_aligned_too(bodies, force):
    force[0, 1:], force[1, 2:], force[3], force[5, 1:] = 0.0, 0.0, 0.0, 0.0
    modes = local_modes(bodies, force, 1e-12)
    count = modes.any(axis=(2, 3)).sum(axis=1)
    assert count.tolist() == [1, 2, 4, 0, 4, 1]
    for k, after in ((0, 1), (1, 2), (2, 4), (4, 5)):
        shared = min(count[k], count[after])
        assert_positive_symmetric(products(bodies, modes[k, :shared], modes[after, :shared]))
