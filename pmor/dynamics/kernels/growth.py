"""Growth of a small disturbance of periodic motion over one period.

A step is half a drift without the mesh, the kick of the mesh, and another half, at once with the half of the next step:
second order, time-reversible.
"""

from __future__ import annotations

from pmor.core.compiling import allocating, compiled


@allocating
def grow(half, whole, lever, push, slope, start, seen):
    """Carry columns of displacements and velocities through a period; return what they become.

    Parameters
    ----------
    half, whole : ndarray, shape (2n, 2n)
        Exponentials of half a step and of a step of the motion without the mesh.
    lever : ndarray, shape (r, n)
        Coordinates of the mesh per displacement.
    push : ndarray, shape (n, r)
        Change of the velocities per impulse of the mesh.
    slope : ndarray, shape (steps, r, r)
        Integral of dF/dx over each step.
    start : ndarray, shape (2n, columns)
    seen : ndarray, shape (steps, r, columns)
        Filled: the coordinates in the middle of each step.
    """
    r, n = lever.shape
    matrix = half @ start
    for step in range(len(slope)):
        for a in range(r):
            seen[step, a] = 0.0
            for k in range(n):
                for j in range(matrix.shape[1]):
                    seen[step, a, j] += lever[a, k] * matrix[k, j]
        for b in range(r):
            for a in range(r):
                for k in range(n):
                    kick = push[k, b] * slope[step, b, a]
                    for j in range(matrix.shape[1]):
                        matrix[n + k, j] += kick * seen[step, a, j]
        matrix = (half if step == len(slope) - 1 else whole) @ matrix
    return matrix


@compiled
def grow_by_modes(half, whole, lever, push, slope, real, imaginary, seen):
    """Carry columns of m complex amplitudes, which move by themselves, through a period.

    Parameters
    ----------
    half, whole : ndarray of complex, shape (m,)
        What amplitudes become in half a step and in a step without the mesh.
    lever : ndarray of complex, shape (r, m)
        Of which the real part is the coordinates of the mesh.
    push : ndarray of complex, shape (m, r)
        Change of the amplitudes per impulse of the mesh.
    real, imaginary : ndarray, shape (m, columns)
        Overwritten with the result.
    slope, seen
        As in `grow`; seen is 0 before.
    """
    (m, columns), r, last = real.shape, len(lever), len(slope) - 1
    for k in range(m):
        _turn(half[k], real[k], imaginary[k])
        for a in range(r):
            _see(lever[a, k], real[k], imaginary[k], seen[0, a])
    for step in range(last + 1):
        for k in range(m):
            for a in range(r):
                kick = 0j
                for b in range(r):
                    kick += push[k, b] * slope[step, b, a]
                for j in range(columns):
                    real[k, j] += kick.real * seen[step, a, j]
                    imaginary[k, j] += kick.imag * seen[step, a, j]
            _turn(half[k] if step == last else whole[k], real[k], imaginary[k])
            if step < last:
                for a in range(r):
                    _see(lever[a, k], real[k], imaginary[k], seen[step + 1, a])


@compiled
def _turn(by, real, imaginary):
    for j in range(len(real)):
        one, other = real[j], imaginary[j]
        real[j] = by.real * one - by.imag * other
        imaginary[j] = by.imag * one + by.real * other


@compiled
def _see(lever, real, imaginary, seen):
    for j in range(len(real)):
        seen[j] += lever.real * real[j] - lever.imag * imaginary[j]
