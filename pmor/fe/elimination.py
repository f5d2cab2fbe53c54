"""Dense elimination of unknowns row by row: each row is coupled to the next one and to retained unknowns only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from pmor.arrays import FloatArray, IntArray


@dataclass(frozen=True)
class EliminatedRow:
    """Factor of one eliminated row: its unknowns follow from `rest` by back-substitution.

    Parameters
    ----------
    dofs, rest : ndarray of int
        Unknowns of the row, and the not yet eliminated unknowns that it is coupled to.
    factor : ndarray
        Lower Cholesky factor of the row's block.
    coupling : ndarray
        ``factor^-1 K[dofs, rest]``.
    """

    dofs: IntArray
    rest: IntArray
    factor: FloatArray
    coupling: FloatArray


def eliminate_chain(
    stiffness: sp.csr_array, chain: list[IntArray], retained: IntArray, kept: list[EliminatedRow] | None
) -> tuple[IntArray, FloatArray]:
    """Eliminate all but the last row of a chain; return the coupled unknowns and what they receive.

    Unknowns that belong neither to the chain nor to `retained` are held.
    """
    is_retained = np.zeros(stiffness.shape[0], dtype=bool)
    is_retained[retained] = True
    border = np.empty(0, dtype=np.int64)
    carried = np.zeros((len(chain[0]), len(chain[0])))
    for row, following in zip(chain[:-1], chain[1:], strict=True):
        touched = np.unique(stiffness[row].indices)
        fresh = np.setdiff1d(touched[is_retained[touched]], border, assume_unique=True)
        rest = np.concatenate([following, border, fresh])
        both = np.concatenate([row, rest])
        front = np.zeros((len(both), len(both)))
        old = np.concatenate([np.arange(len(row)), len(row) + len(following) + np.arange(len(border))])
        front[np.ix_(old, old)] = carried
        front[: len(row)] += submatrix(stiffness, row, both)
        rest, update = eliminate(row, rest, front, kept)
        border, carried = rest[len(following) :], update
    return rest, carried


def in_twos(rows: list[IntArray]) -> list[IntArray]:
    """Join rows of quadratic elements, coupled to the next two, so that each is coupled to the next one only.

    Parameters
    ----------
    rows : list of ndarray of int
        The last row before the first, and the first after the last, are held or handled with what is left over.

    Returns
    -------
    list of ndarray of int
    """
    return [np.concatenate(rows[first : first + 2]) for first in range(0, len(rows), 2)]


def eliminate(
    row: IntArray, rest: IntArray, front: FloatArray, kept: list[EliminatedRow] | None
) -> tuple[IntArray, FloatArray]:
    """Eliminate the leading block of a front; return `rest` and the Schur complement on it."""
    size = len(row)
    factor = la.cholesky(front[:size, :size], lower=True, check_finite=False)
    coupling = la.solve_triangular(factor, front[:size, size:], lower=True, check_finite=False)
    if kept is not None:
        kept.append(EliminatedRow(row, rest, factor, coupling))
    return rest, front[size:, size:] - coupling.T @ coupling


def submatrix(stiffness: sp.csr_array, rows: IntArray, columns: IntArray) -> FloatArray:
    """Return a dense block of a sparse matrix."""
    return np.asarray(stiffness[rows][:, columns].toarray())
