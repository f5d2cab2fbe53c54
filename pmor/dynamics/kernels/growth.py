"""Growth of a small disturbance of periodic motion over one period."""

from __future__ import annotations

from pmor.core.compiling import compiled


@compiled
def _drift(rows, matrix, workspace):
    """Carry the columns of a matrix through the motion between two impulses of the mesh; modes are by themselves."""
    n, columns = matrix.shape
    for i in range(n):
        for j in range(columns):
            workspace[i, j] = 0.0
        for k in range(n):
            if rows[i, k] != 0.0:
                for j in range(columns):
                    workspace[i, j] += rows[i, k] * matrix[k, j]
    for i in range(n):
        for j in range(columns):
            matrix[i, j] = workspace[i, j]


@compiled
def grow(half_drift, lever, push, slope, matrix, workspace, seen):
    """Carry the columns of a matrix of displacements and velocities through a period, step by step.

    A step is half a drift without the mesh, the kick of the mesh, and another half: second order, time-reversible.

    Parameters
    ----------
    half_drift : ndarray, shape (2n, 2n)
        Exponential of half a step of the motion without the mesh.
    lever : ndarray, shape (r, n)
        Coordinates of the mesh per displacement.
    push : ndarray, shape (n, r)
        Change of the velocities per impulse of the mesh.
    slope : ndarray, shape (steps, r, r)
        Integral of dF/dx over each step.
    matrix, workspace : ndarray, shape (2n, columns)
        Overwritten with the result; work space.
    seen : ndarray, shape (steps, r, columns)
        Filled: the coordinates in the middle of each step.
    """
    r, n = lever.shape
    for step in range(len(slope)):
        _drift(half_drift, matrix, workspace)
        for j in range(matrix.shape[1]):
            for a in range(r):
                along = 0.0
                for k in range(n):
                    along += lever[a, k] * matrix[k, j]
                seen[step, a, j] = along
            for b in range(r):
                force = 0.0
                for a in range(r):
                    force += slope[step, b, a] * seen[step, a, j]
                for k in range(n):
                    matrix[n + k, j] += push[k, b] * force
        _drift(half_drift, matrix, workspace)
