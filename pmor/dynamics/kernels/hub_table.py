"""Forces of meshes on two coordinates each, tabulated, and what the flexibility beyond the modes makes of them.

With F the forces of all meshes at approaches x, T the tangents that close the meshes in the modes of the machine and S
the flexibility that these modes leave out, modes move y and feel

    G(y) = F(x) - T (x - x_0),    x = y - S (G(y) - F_0),

x_0 and F_0 those of the state about which the machine has its modes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.compiling import allocating, compiled

PER_MESH = 2
# Newton's steps for x, and when it is found, over the size of x.
MOST_STEPS, FOUND = 40, 1e-10


class HubTable(NamedTuple):
    """Forces of one mesh at P phases of its cycle, linear between them, bicubic over both coordinates."""

    low: float  # Approach at which nothing touches
    span: float  # Approaches are low + span t^2, t even from 0 to 1
    # Second coordinates reach so far on either side of a middle
    middle: float
    tilt: float
    # shape (P, X, U, 2, 4): Both forces, their slopes by the steps over t and over the second coordinate, both slopes
    values: FloatArray
    backlash: float  # Infinite where the backs of teeth carry nothing


class ClosedMeshes(NamedTuple):
    """Meshes of a machine as its modes feel them; r coordinates in all."""

    tables: tuple[HubTable, ...]
    cycles: FloatArray  # shape (M,): Of each mesh to one of the first
    offset: FloatArray  # shape (M,): Phases of the meshes where that of the first is 0, in cycles
    tangent: FloatArray  # shape (r, r): T
    residual: FloatArray  # shape (r, r): S
    centre: FloatArray  # shape (r,): x_0
    load: FloatArray  # shape (r,): F_0


@compiled
def _hermite(t):
    """Hermite's cubics at 0 <= t <= 1: by the values and the slopes at 0 and 1; and their derivatives."""
    s = 1.0 - t
    return (
        (1.0 + 2.0 * t) * s * s, t * s * s, t * t * (3.0 - 2.0 * t), -t * t * s,
        -6.0 * t * s, s * (1.0 - 3.0 * t), 6.0 * t * s, t * (3.0 * t - 2.0),
    )  # fmt: skip


@compiled
def _cell(values, share, t, u, i, j, t_rate, u_rate, out):
    """Add a share of the forces in a cell of one phase, and of their slopes, to `out`, (2, 3)."""
    h, k = _hermite(t), _hermite(u)
    for c in range(PER_MESH):
        force = by_t = by_u = 0.0
        for a in range(2):
            value, slope, value_rate, slope_rate = h[2 * a], h[2 * a + 1], h[4 + 2 * a], h[5 + 2 * a]
            for b in range(2):
                node = values[i + a, j + b, c]
                plain, turned = k[2 * b] * node[0] + k[2 * b + 1] * node[2], k[2 * b] * node[1] + k[2 * b + 1] * node[3]
                force += value * plain + slope * turned
                by_t += value_rate * plain + slope_rate * turned
                by_u += value * (k[4 + 2 * b] * node[0] + k[5 + 2 * b] * node[2])
                by_u += slope * (k[4 + 2 * b] * node[1] + k[5 + 2 * b] * node[3])
        out[c, 0] += share * force
        out[c, 1] += share * t_rate * by_t
        out[c, 2] += share * u_rate * by_u


@compiled
def _flank_forces(table, place, x, u, out):
    """Fill forces (first column) and slopes of the flanks on one side; whether they are known there."""
    out[:] = 0.0
    phases, rows, columns = table.values.shape[:3]
    if x <= table.low:
        return True
    if not (x <= table.low + table.span and abs(u - table.middle) <= table.tilt):
        return False
    root = np.sqrt((x - table.low) / table.span)
    t, v = (rows - 1) * root, (columns - 1) * (0.5 + 0.5 * (u - table.middle) / table.tilt)
    i, j = min(int(t), rows - 2), min(int(v), columns - 2)
    t_rate, u_rate = 0.5 * (rows - 1) / (table.span * root), 0.5 * (columns - 1) / table.tilt
    before = np.floor(place)
    share = place - before
    first = int(before) % phases
    _cell(table.values[first], 1.0 - share, t - i, v - j, i, j, t_rate, u_rate, out)
    if share > 0.0:
        _cell(table.values[(first + 1) % phases], share, t - i, v - j, i, j, t_rate, u_rate, out)
    if out[0, 0] <= 0.0:  # flanks do not pull
        out[:] = 0.0
    return True


@compiled
def table_forces(table, cycle, x, u, out):
    """Fill the forces of a mesh and their slopes, (2, 3), at a place of its cycle; whether they are known there.

    Backs of teeth are the flanks after half a turn about the line of centres: they run the other way, and tilt alike.
    """
    place = table.values.shape[0] * (cycle - np.floor(cycle))
    if x > -0.5 * table.backlash:
        return _flank_forces(table, place, x, u, out)
    known = _flank_forces(table, table.values.shape[0] - place, -x - table.backlash, u, out)
    out[0, 0], out[0, 2], out[1, 1] = -out[0, 0], -out[0, 2], -out[1, 1]
    return known


@compiled
def _eliminate(matrix, size):
    """Reduce the first columns of a matrix to those of the identity, with pivots."""
    for k in range(size):
        pivot = k
        for i in range(k + 1, size):
            if abs(matrix[i, k]) > abs(matrix[pivot, k]):
                pivot = i
        for j in range(matrix.shape[1]):
            matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
        scale = 1.0 / matrix[k, k]
        for j in range(matrix.shape[1]):
            matrix[k, j] *= scale
        for i in range(size):
            if i != k:
                factor = matrix[i, k]
                for j in range(matrix.shape[1]):
                    matrix[i, j] -= factor * matrix[k, j]


@compiled
def closed_forces(meshes, cycle, y, x, one, beyond, matrix, force):
    """Fill approaches x and the forces G where modes move y; whether they are known.

    Parameters
    ----------
    cycle : float
        Of the first mesh.
    x : ndarray, shape (r,)
        A start, overwritten.
    one : ndarray, shape (2, 3)
    beyond : ndarray, shape (r, r)
        Filled: dF/dx - T.
    matrix : ndarray, shape (r, 2 r + 1)
        Filled: the last r columns are (I + S (dF/dx - T))^-1.
    force : ndarray, shape (r,)
    """
    size = len(y)
    for _ in range(MOST_STEPS):
        for a in range(size):
            force[a] = 0.0
            for b in range(size):
                beyond[a, b] = -meshes.tangent[a, b]
                force[a] -= meshes.tangent[a, b] * (x[b] - meshes.centre[b])
        for m in range(size // PER_MESH):
            a = PER_MESH * m
            place = meshes.offset[m] + cycle * meshes.cycles[m]
            if not table_forces(meshes.tables[m], place, x[a], x[a + 1], one):
                return False
            for c in range(PER_MESH):
                force[a + c] += one[c, 0]
                beyond[a + c, a] += one[c, 1]
                beyond[a + c, a + 1] += one[c, 2]
        change, scale = 0.0, 0.0
        for a in range(size):
            matrix[a, size] = y[a] - x[a]
            for b in range(size):
                matrix[a, size] -= meshes.residual[a, b] * (force[b] - meshes.load[b])
                matrix[a, b] = matrix[a, size + 1 + b] = 1.0 if a == b else 0.0
                for c in range(size):
                    matrix[a, b] += meshes.residual[a, c] * beyond[c, b]
        _eliminate(matrix, size)
        for a in range(size):
            x[a] += matrix[a, size]
            change, scale = max(change, abs(matrix[a, size])), max(scale, abs(x[a]))
        if change <= FOUND * scale:
            return True
    return change <= 1e-6 * scale  # between both sides of a kink


@allocating
def closed_forces_at(meshes, cycle, y, force, slope, x):
    """Fill forces and slopes by y at places of the cycle, and the approaches; NaN where they are not known.

    Parameters
    ----------
    cycle : ndarray, shape (n,)
    y, force, x : ndarray, shape (r, n)
    slope : ndarray, shape (r, r, n)
    """
    size = len(y)
    at, one, beyond = np.empty(size), np.empty((PER_MESH, 3)), np.empty((size, size))
    moved, pushed, matrix = np.empty(size), np.empty(size), np.empty((size, 2 * size + 1))
    for i in range(len(cycle)):
        at[:], moved[:] = y[:, i], y[:, i]
        if not closed_forces(meshes, cycle[i], at, moved, one, beyond, matrix, pushed):
            pushed[:], beyond[:] = np.nan, np.nan
        x[:, i], force[:, i] = moved, pushed
        for a in range(size):
            for b in range(size):
                slope[a, b, i] = 0.0
                for c in range(size):
                    slope[a, b, i] += beyond[a, c] * matrix[c, size + 1 + b]
