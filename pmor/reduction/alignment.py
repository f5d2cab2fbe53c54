"""Alignment of the modes of neighbouring positions, so that they may be interpolated one by one.

A POD basis spans a subspace; signs, order and rotation of its modes are accidents of the eigenvalue solver and jump
from one position to the next. Interpolated as they come, they would cancel. The orthogonal Procrustes problem
(Schoenemann, Psychometrika 31 (1966) 1) turns the modes Y_1 of one position within their subspace to be as near as can
be, in energy, to the modes Y_0 of its neighbour:

    min |Y_1 R - Y_0|  over R^T R = I:      R = V U^T  with  Y_0^T C Y_1 = U S V^T,

after which Y_0^T C Y_1 R = U S U^T is symmetric and not negative.
"""

from __future__ import annotations

import numpy as np

from pmor.core.arrays import FloatArray, IntArray


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
