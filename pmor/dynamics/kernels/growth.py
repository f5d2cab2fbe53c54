"""Growth of a small disturbance of periodic motion over one period."""

from __future__ import annotations

from pmor.core.compiling import compiled


@compiled
def _drift(rows, matrix, workspace):
    """Carry the columns of a matrix through the motion between two impulses of the mesh."""
    n, columns = matrix.shape
    for i in range(n):
        for j in range(columns):
            total = 0.0
            for k in range(n):
                total += rows[i, k] * matrix[k, j]
            workspace[i, j] = total
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
    lever, push : ndarray, shape (n,)
        Displacement along the line of action per displacement; change of the velocities per impulse of the mesh.
    slope : ndarray, shape (steps,)
        Integral of dF/dx over each step.
    matrix, workspace : ndarray, shape (2n, columns)
        Overwritten with the result; work space.
    seen : ndarray, shape (steps, columns)
        Filled: the displacement along the line of action in the middle of each step.
    """
    n = len(lever)
    for step in range(len(slope)):
        _drift(half_drift, matrix, workspace)
        for j in range(matrix.shape[1]):
            along = 0.0
            for k in range(n):
                along += lever[k] * matrix[k, j]
            seen[step, j] = along
            for k in range(n):
                matrix[n + k, j] += push[k] * slope[step] * along
        _drift(half_drift, matrix, workspace)
