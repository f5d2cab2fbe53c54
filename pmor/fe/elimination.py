"""Dense elimination of a mesh from within: part by part of a nested dissection, onto the nodes that are retained.

The elements of a part that is not divided further are added up in a dense matrix, its front; so are the Schur
complements of two parts in the one that holds them. The inner nodes of a front are eliminated with LAPACK, the rest is
passed on (Duff & Reid, ACM Trans. Math. Softw. 9 (1983) 302). No matrix of the whole mesh is assembled. The Schur
complement of the last front *is* the condensed matrix.

Of symmetric matrices the upper triangle counts; LAPACK, which goes by columns, sees it as the lower one.

Linear functions of a displacement, carried along while the unknowns that they need are eliminated.

A function q of the inner unknowns of a part is one of its border: without loads inside, their displacement is that of
the border times ``-K_ii^-1 K_ib``. So whatever is asked of a sector is known from its retained unknowns, at the cost of
a forward substitution for each function; no factor is kept, and parts that functions do not need cost nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.linalg as la
from scipy.linalg import blas, lapack

from pmor.core.arrays import FloatArray, IntArray
from pmor.fe.assembly import degrees_of_freedom
from pmor.fe.nested_dissection import UNDIVIDED, nested_dissection

# Rows that are mirrored at a time: a block of them fits into the cache.
MIRRORED = 128


@dataclass(frozen=True)
class EliminatedPart:
    """Factor of one front: its inner unknowns follow from those of its border by back-substitution.

    Parameters
    ----------
    inner, border : ndarray of int
        Unknowns of the mesh.
    factor : ndarray
        Upper Cholesky factor U of the inner block, which is ``U^T U``; below the diagonal is no meaning.
    coupling : ndarray
        ``U^-T K[inner, border]``.
    """

    inner: IntArray
    border: IntArray
    factor: FloatArray
    coupling: FloatArray


class _Front(NamedTuple):
    """Stiffness of a part: blocks of its inner unknowns, of them and the border, of the border."""

    inner: FloatArray
    coupling: FloatArray
    border: FloatArray


class _Left(NamedTuple):
    """Schur complement of a part: ranks of its border's nodes, and their stiffness."""

    nodes: IntArray
    stiffness: FloatArray


def condense(
    stiffness: FloatArray, elements: IntArray, places: IntArray, retained: IntArray, held: IntArray,
    visit: Callable[[EliminatedPart], None] | None = None,
) -> FloatArray:  # fmt: skip
    """Condense elements onto some of their nodes.

    Parameters
    ----------
    stiffness : ndarray, shape (n, 3 k, 3 k)
        Of each element, N/mm.
    elements : ndarray of int, shape (n, k)
        Nodes of each.
    places : ndarray of int, shape (n, 3)
        Of each, as in `pmor.fe.nested_dissection`.
    retained, held : ndarray of int
        Nodes that are kept, and those that do not move.
    visit : callable, optional
        Given each part as soon as it is eliminated.

    Returns
    -------
    ndarray, shape (3 r, 3 r)
        In the order of `retained`, x y z node by node, N/mm.
    """
    size = int(elements.max()) + 1
    elements = np.where(np.isin(np.arange(size), held)[elements], -1, elements)
    parts = nested_dissection(places, elements, retained, max(1, UNDIVIDED // stiffness.shape[1]))
    # In the order of elimination the inner nodes come first in every front, and upper triangles go to upper triangles.
    order = np.concatenate([*(part.inner for part in parts), retained])
    rank = np.full(size + 1, -1)
    rank[order] = np.arange(len(order))
    ranked, left = rank[elements], dict[int, _Left]()
    for number, part in enumerate(parts):
        inner, border = rank[part.inner], np.sort(rank[part.border])
        if part.parts:
            front = _join(inner, border, [left.pop(p) for p in part.parts])
        else:
            front = _add_up(inner, border, ranked[part.elements], stiffness[part.elements])
        _eliminate(front)
        left[number] = _Left(border, front.border)
        if visit is not None:
            unknowns = degrees_of_freedom(order[inner]), degrees_of_freedom(order[border])
            visit(EliminatedPart(*unknowns, front.inner, front.coupling))
    return _mirror(front.border)


def inverse(matrix: FloatArray) -> FloatArray:
    """Return the inverse of a symmetric positive definite matrix, which it takes the place of."""
    _factorise(matrix)
    lapack.dpotri(matrix.T, lower=1, overwrite_c=1)
    return _mirror(matrix)


def _add_up(inner: IntArray, border: IntArray, elements: IntArray, stiffness: FloatArray) -> _Front:
    """Front of a part that is not divided; `elements` holds ranks, -1 for held nodes."""
    nodes = np.concatenate([inner, border])
    # Held nodes go to the end, to be cut off.
    place = np.where(elements < 0, len(nodes), np.searchsorted(nodes, elements))
    unknowns = (3 * place[:, :, None] + np.arange(3)).reshape(len(elements), -1)
    size = 3 * len(nodes) + 3
    index = unknowns[:, :, None] * size + unknowns[:, None, :]
    added = np.bincount(index.ravel(), weights=stiffness.ravel(), minlength=size * size)
    full = np.asarray(added, dtype=np.float64).reshape(size, size)
    i = 3 * len(inner)
    return _Front(full[:i, :i].copy(), full[:i, i:-3].copy(), full[i:-3, i:-3].copy())


def _join(inner: IntArray, border: IntArray, parts: list[_Left]) -> _Front:
    """Front of a part from the Schur complements of those within it.

    Neighbours in the order of elimination mostly stay neighbours, so blocks are added where entry by entry takes ten
    times as long.
    """
    i, b = 3 * len(inner), 3 * len(border)
    front = _Front(np.zeros((i, i)), np.zeros((i, b)), np.zeros((b, b)))
    for part in parts:
        runs = _runs(inner, border, part.nodes)
        for r, (to_border, row, start, size) in enumerate(runs):
            for column_to_border, column, first, length in runs[r:]:
                target = front.border if to_border else front.coupling if column_to_border else front.inner
                target[row : row + size, column : column + length] += part.stiffness[
                    start : start + size, first : first + length
                ]
    return front


def _runs(inner: IntArray, border: IntArray, nodes: IntArray) -> list[tuple[bool, int, int, int]]:
    """Return where unknowns stay neighbours in a front: whether in its border, the first one there and here, number."""
    place = np.searchsorted(np.concatenate([inner, border]), nodes)
    starts = np.flatnonzero((np.diff(place, prepend=-2) != 1) | (place == len(inner)))
    sizes = np.diff(starts, append=len(place))
    runs = []
    for start, size in zip(starts.tolist(), sizes.tolist(), strict=True):
        beyond = int(place[start]) - len(inner)
        runs.append((beyond >= 0, 3 * (beyond if beyond >= 0 else beyond + len(inner)), 3 * start, 3 * size))
    return runs


def _eliminate(front: _Front) -> None:
    """Replace the blocks of a front by the factor, the coupling and the Schur complement, in place."""
    if not front.inner.size:
        return
    _factorise(front.inner)
    if not front.coupling.size:
        return
    blas.dtrsm(1.0, front.inner.T, front.coupling.T, side=1, lower=1, trans_a=1, overwrite_b=1)
    blas.dsyrk(-1.0, front.coupling.T, beta=1.0, c=front.border.T, lower=1, overwrite_c=1)


def _mirror(matrix: FloatArray) -> FloatArray:
    """Fill the lower triangle of a matrix from its upper one, and return it."""
    for start in range(0, len(matrix), MIRRORED):
        end = start + MIRRORED
        block = matrix[start:end, start:end]
        block[...] = np.triu(block) + np.triu(block, 1).T
        matrix[end:, start:end] = matrix[start:end, end:].T
    return matrix


def _factorise(matrix: FloatArray) -> None:
    """Replace the upper triangle of a matrix by its Cholesky factor."""
    _, info = lapack.dpotrf(matrix.T, lower=1, clean=0, overwrite_a=1)
    if info:
        raise np.linalg.LinAlgError(f"not positive definite: row {info} of {len(matrix)}")


class CarriedFunctions:
    """Functions that need the displacement at one place.

    Parameters
    ----------
    unknowns : ndarray of int, shape (k,)
        Unknowns that they need, each once.
    weights : ndarray, shape (k, m)
        Of m functions.
    size : int
        Number of unknowns in all.
    """

    def __init__(self, unknowns: IntArray, weights: FloatArray, size: int) -> None:
        self._weights = weights
        self._row = np.full(size, -1)
        self._row[unknowns] = np.arange(len(unknowns))
        self._place = np.full(size, -1)
        self._pending: list[tuple[IntArray, FloatArray]] = []

    def eliminate(self, part: EliminatedPart) -> None:
        """Replace the inner unknowns of a part by those of its border; parts come in the order of elimination."""
        needed = self._row[part.inner] >= 0
        joined, others = list[tuple[IntArray, FloatArray]](), list[tuple[IntArray, FloatArray]]()
        self._place[part.inner] = np.arange(len(part.inner))
        for left in self._pending:
            (joined if (self._place[left[0]] >= 0).any() else others).append(left)
        if needed.any() or joined:
            self._place[part.border] = len(part.inner) + np.arange(len(part.border))
            load = np.zeros((len(part.inner) + len(part.border), self._weights.shape[1]))
            load[np.flatnonzero(needed)] = self._weights[self._row[part.inner[needed]]]
            for border, weights in joined:
                load[self._place[border]] += weights
            inner, border_load = load[: len(part.inner)], load[len(part.inner) :]
            solved = la.solve_triangular(part.factor, inner, trans="T", check_finite=False)
            others.append((part.border, border_load - part.coupling.T @ solved))
            self._place[part.border] = -1
        self._place[part.inner] = -1
        self._pending = others

    def over(self, retained: IntArray) -> FloatArray:
        """Return the weights of the retained unknowns once all else is eliminated, shape (m, retained)."""
        self._place[retained] = np.arange(len(retained))
        shares = np.zeros((len(retained), self._weights.shape[1]))
        own = self._row[retained] >= 0
        shares[own] = self._weights[self._row[retained[own]]]
        for border, weights in self._pending:
            shares[self._place[border]] += weights
        return shares.T
