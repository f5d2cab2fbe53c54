"""Linear functions of a displacement, carried along while the unknowns that they need are eliminated.

A function q of the inner unknowns of a part is one of its border: without loads inside, their displacement is that of
the border times ``-K_ii^-1 K_ib``. So whatever is asked of a sector is known from its retained unknowns, at the cost of
a forward substitution for each function; no factor is kept, and parts that functions do not need cost nothing.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg as la

from pmor.core.arrays import FloatArray, IntArray
from pmor.fe.elimination import EliminatedPart


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
        found = np.zeros((len(retained), self._weights.shape[1]))
        own = self._row[retained] >= 0
        found[own] = self._weights[self._row[retained[own]]]
        for border, weights in self._pending:
            found[self._place[border]] += weights
        return found.T
