"""Contact shapes by proper orthogonal decomposition (POD) of the snapshots, in the energy inner product.

With f_i the force fields that full FE found on both flanks of a tooth pair and C the compliance of the loaded teeth,
fields are measured by the work of one on the displacements of the other, <f, g> = f^T C g. Method of snapshots
(Sirovich, Quart. Appl. Math. 45 (1987) 561): with G_ij = <f_i, f_j> and its eigenpairs G v = lambda v, the modes

    f = sum_i v_i f_i / sqrt(lambda)

are orthonormal in energy, and the first r of them miss of the snapshots' energy, on average, the share that the
discarded eigenvalues have of all: no other r shapes miss less.

Snapshots are first brought to the energy 1. Their size means nothing, for each amplitude is solved for anew; raw, a
load of 180 N m would count 81 times as much as one of 20 N m, and the contact under small loads would be the
first to be discarded.

Two ways, when to use them:

* `local_modes`: a basis for each trained roll position, from its snapshots over all training states. For many states
  (torques, and other parameters): the size follows the tolerance, not their number. Between positions it is no better
  than the raw snapshots, and with a dent worse (0.31 against 0.12 %, paper's pair with Hermite patches): those of one
  torque follow the contact, while the last modes hold the small differences between torques, and turn fast.
* `global_modes`: one basis for all roll positions. The textbook way and the known bad alternative, to compare with: a
  contact that moves is not a sum of a few products of a shape and an amplitude (it is *linearly inseparable*; Blockmans
  et al., IJNME 102 (2015) 1162), so that the basis grows with the path of contact. *Measured*, same pair and tolerance
  1e-6: 43 modes where a position needs 3, and 22 where it needs 2 in line contact, which has no dent in its elements.

Alignment of the modes of neighbouring positions, so that they may be interpolated one by one.

A POD basis spans a subspace; signs, order and rotation of its modes are accidents of the eigenvalue solver and jump
from one position to the next. Interpolated as they come, they would cancel. The orthogonal Procrustes problem
(Schoenemann, Psychometrika 31 (1966) 1) turns the modes Y_1 of one position within their subspace to be as near as can
be, in energy, to the modes Y_0 of its neighbour:

    min |Y_1 R - Y_0|  over R^T R = I:      R = V U^T  with  Y_0^T C Y_1 = U S V^T,

after which Y_0^T C Y_1 R = U S U^T is symmetric and not negative.

The energy inner product of force fields: <f, g> = f^T C g, the work of one on the displacements of the other.

In it a basis is orthonormal when unit amplitudes store unit energy (twice over), each by itself.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pmor.body.elastic_gear import ElasticGear
from pmor.core.arrays import FloatArray, IntArray
from pmor.core.errors import ConvergenceError

if TYPE_CHECKING:
    from pmor.body.elastic_gear import ElasticGear


def procrustes(products: FloatArray) -> FloatArray:
    """Return the rotation of modes that brings the first of them next to their neighbours.

    Parameters
    ----------
    products : ndarray, shape (n, m)
        Products in energy of n <= m neighbours (rows) with the m modes.

    Returns
    -------
    ndarray, shape (m, m)
        The first n of the modes times it are aligned; the others are at right angles to all neighbours.
    """
    left, _, right = np.linalg.svd(products)
    rotation = right.T.copy()
    rotation[:, : len(left)] = rotation[:, : len(left)] @ left.T
    return rotation


def align_along_grid(force: FloatArray, moved: FloatArray, count: IntArray) -> FloatArray:
    """Turn the modes of each position next to those of the position before, from the middle outwards.

    Parameters
    ----------
    force : ndarray, shape (M, r, g)
        Force fields of the modes, orthonormal in energy; those that do not exist are zero.
    moved : ndarray, shape (M, r, g)
        Their displacements.
    count : ndarray of int, shape (M,)
        Modes that exist at each position, the first ones.

    Returns
    -------
    ndarray, shape (M, r, g)
        Force fields of the aligned modes, which span the same.
    """
    aligned = force.copy()
    complete = np.flatnonzero(count == count.max())
    middle = int(complete[len(complete) // 2])
    for path in (range(middle + 1, len(count)), range(middle - 1, -1, -1)):
        before = middle
        for k in path:
            if not count[k]:
                continue
            own, shared = slice(count[k]), slice(min(count[k], count[before]))
            rotation = procrustes(aligned[before, shared] @ moved[k, own].T)
            aligned[k, own] = rotation.T @ force[k, own]
            before = k
    return aligned


# Directions of a Gram matrix below this fraction of the largest are dependent to working precision.
DEPENDENCE_TOLERANCE = 1e-10


def own_displacement(bodies: tuple[ElasticGear, ElasticGear], force: FloatArray) -> FloatArray:
    """Return the displacement of the loaded teeth under forces on pinion and wheel, shape (..., 2, f), mm."""
    return np.stack([force[..., g, :] @ body.tooth_compliance(0).T for g, body in enumerate(bodies)], axis=-2)


def principal_energies(gram: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the energies of the independent principal directions of a Gram matrix, falling, and these as columns."""
    values, vectors = np.linalg.eigh(gram)
    kept = np.flatnonzero(values > DEPENDENCE_TOLERANCE * values.max(initial=0.0))[::-1]
    return values[kept], vectors[:, kept]


def local_modes(bodies: tuple[ElasticGear, ElasticGear], force: FloatArray, tolerance: float) -> FloatArray:
    """Return a POD basis for each roll position, aligned along the grid.

    All positions have as many modes as the one that needs most, where they have as many independent snapshots.

    Parameters
    ----------
    bodies, force
        As in `pmor.reduction.build.build_shapes`.
    tolerance : float
        Share of the snapshots' energy that may be discarded.

    Returns
    -------
    ndarray, shape (M, r, 2, f)
        Force fields of the modes, orthonormal in energy; zero where a position has fewer than r.

    Raises
    ------
    ConvergenceError
        When no snapshot carries load.
    """
    fields = force.reshape(*force.shape[:2], -1)
    moved = own_displacement(bodies, force).reshape(fields.shape)
    decompositions = [principal_combinations(f @ u.T) for f, u in zip(fields, moved, strict=True)]
    most = max(modes_needed(energy, tolerance) for energy, _ in decompositions)
    if not most:
        raise ConvergenceError("no training state loads a flank: there is nothing to make shapes from", [])
    count: IntArray = np.array([min(most, len(energy)) for energy, _ in decompositions])
    modes, displaced = np.zeros((2, len(force), most, fields.shape[2]))
    for k, (_, combination) in enumerate(decompositions):
        kept = combination[:, : count[k]].T
        # The last modes lose digits in the division by their energy: these are made orthonormal once more.
        factor = np.linalg.cholesky((kept @ fields[k]) @ (kept @ moved[k]).T)
        modes[k, : count[k]] = np.linalg.solve(factor, kept @ fields[k])
        displaced[k, : count[k]] = np.linalg.solve(factor, kept @ moved[k])
    return align_along_grid(modes, displaced, count).reshape(len(force), most, *force.shape[2:])


def global_modes(bodies: tuple[ElasticGear, ElasticGear], force: FloatArray, tolerance: float) -> FloatArray:
    """Return one POD basis of all snapshots, shape (r, 2, f); see `local_modes`."""
    every = force.reshape(1, -1, *force.shape[2:])
    return np.asarray(local_modes(bodies, every, tolerance)[0])


def principal_combinations(gram: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the POD of snapshots that have the Gram matrix `gram`, shape (n, n), in energy.

    Returns
    -------
    energy : ndarray, shape (m,)
        Of each mode over that of all snapshots of energy 1, falling; dependent snapshots give no mode.
    combination : ndarray, shape (n, m)
        Snapshots (as they are) times it are the modes.
    """
    size = np.sqrt(np.diag(gram))
    inverse = np.divide(1.0, size, out=np.zeros_like(size), where=size > 0.0)
    energy, directions = principal_energies(gram * np.outer(inverse, inverse))
    return energy / max(int((size > 0.0).sum()), 1), inverse[:, None] * directions / np.sqrt(energy)


def modes_needed(energy: FloatArray, tolerance: float) -> int:
    """Return how many modes leave at most the share `tolerance` of the energy to the others."""
    discarded = np.cumsum(energy[::-1])[::-1]
    return int((discarded > tolerance).sum())
