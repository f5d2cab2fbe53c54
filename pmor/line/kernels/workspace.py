"""Room for the equations of line loads (`pmor.line.kernels.loads`)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.core.compiling import allocating


class Workspace(NamedTuple):
    """Workspace of one solution with N unknowns at most, and K movements.

    Attributes
    ----------
    free, rigid, gap : ndarray, shape (N,)
        Gaps under no load at q = 0, at the present movements, and with the deflection by all that carry, mm.
    ahead : ndarray, shape (N,)
        Advance of each section, rad: the same everywhere in a mesh.
    carries : ndarray of bool, shape (N,)
    active : ndarray of int, shape (N,)
        Those that carry, in order.
    matrix : ndarray, shape (N + K, N + K + 1)
        Equations of those, with columns of levers and gaps; then the upper factor U of M, U^-T times the columns, and
        below -S and the rest of the loads.
    loaded : ndarray, shape (N,)
        New forces.
    step : ndarray, shape (K,)
    stiffness : ndarray, shape (K, K)
        S, then its upper factor.
    loose : ndarray, shape (K,)
        Work of the loads along what each movement is loose in: N mm or N; 0 where it is held.
    force_before, moved_before : ndarray, shape (N,) and (K,)
        Where a solution begins.
    """

    free: FloatArray
    rigid: FloatArray
    gap: FloatArray
    ahead: FloatArray
    carries: BoolArray
    active: IntArray
    matrix: FloatArray
    loaded: FloatArray
    step: FloatArray
    stiffness: FloatArray
    loose: FloatArray
    force_before: FloatArray
    moved_before: FloatArray


@allocating
def new_workspace(size, count):
    """Return the workspace of a solution with so many unknowns at most, and movements."""
    return Workspace(
        free=np.empty(size), rigid=np.empty(size), gap=np.empty(size), ahead=np.empty(size),
        carries=np.empty(size, dtype=np.bool_), active=np.empty(size, dtype=np.int64),
        matrix=np.empty((size + count, size + count + 1)), loaded=np.empty(size), step=np.empty(count),
        stiffness=np.empty((count, count)), loose=np.empty(count),
        force_before=np.empty(size), moved_before=np.empty(count),
    )  # fmt: skip
