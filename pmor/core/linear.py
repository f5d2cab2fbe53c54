"""Small dense systems: Cholesky factor and triangular solves, in place; places on grids."""

from __future__ import annotations

import numpy as np

from pmor.core.compiling import compiled


@compiled
def copy_vector(source, target):
    """Copy entry by entry: of slices numba compiles the words of an error about shapes too, for seconds."""
    for k in range(len(target)):
        target[k] = source[k]


@compiled
def entries_up_to(grid, x):
    """Return how many entries of an ascending grid are x or less; all of them if x is NaN."""
    low, high = 0, len(grid)
    while low < high:
        middle = (low + high) // 2
        if grid[middle] > x:
            high = middle
        else:
            low = middle + 1
    return low


@compiled
def entries_below(grid, x):
    """Return how many entries of an ascending grid are less than x; all of them if x is NaN."""
    low, high = 0, len(grid)
    while low < high:
        middle = (low + high) // 2
        if grid[middle] >= x:
            high = middle
        else:
            low = middle + 1
    return low


@compiled
def cholesky(matrix, size, factor):
    """Fill the upper Cholesky factor of a symmetric matrix; its upper half is read."""
    for i in range(size):
        row, source = factor[i, i:size], matrix[i, i:size]
        for k in range(size - i):
            row[k] = source[k]
    eliminate(factor, size, size, size)


@compiled
def eliminate(matrix, size, rows, columns):
    """Turn the upper half of a symmetric matrix into its upper factor U, in place, and take it off what is beside it.

    Columns beyond the size B become U^-T B. Rows beyond it, right of the diagonal, lose B^T M^-1 B.

    All inner loops run along rows of known beginning, without sums: vector registers can take them. Four rows are taken
    off the rest at a time, in their order: it goes through memory a quarter as often, and no digit changes.
    """
    for first in range(0, size, 4):
        last = min(first + 4, size)
        for j in range(first, last):
            pivot = matrix[j, j:columns]
            for above in range(first, j):
                _take_off(pivot, matrix[above, j], matrix[above, j:columns])
            inverse = 1.0 / np.sqrt(pivot[0])
            for k in range(columns - j):
                pivot[k] *= inverse
        if last < first + 4:
            for i in range(last, rows):
                for above in range(first, last):
                    _take_off(matrix[i, i:columns], matrix[above, i], matrix[above, i:columns])
            return
        for i in range(last, rows):
            row, one, two = matrix[i, i:columns], matrix[first, i:columns], matrix[first + 1, i:columns]
            three, four = matrix[first + 2, i:columns], matrix[first + 3, i:columns]
            a, b, c, d = one[0], two[0], three[0], four[0]
            for k in range(columns - i):
                row[k] = row[k] - a * one[k] - b * two[k] - c * three[k] - d * four[k]


@compiled
def _take_off(row, value, other):
    for k in range(len(row)):
        row[k] -= value * other[k]


@compiled
def solve_transposed(factor, size, vector):
    """Solve with the transpose of an upper factor."""
    for i in range(size):
        row = factor[i]
        vector[i] /= row[i]
        value = vector[i]
        for k in range(i + 1, size):
            vector[k] -= row[k] * value


@compiled
def solve_upper(factor, size, vector):
    """Solve with an upper factor; two rows at a time, whose sums do not wait for each other."""
    i = size - 1
    while i > 0:
        row, above, low, high = factor[i], factor[i - 1], 0.0, 0.0
        for k in range(i + 1, size):
            low += row[k] * vector[k]
            high += above[k] * vector[k]
        vector[i] = (vector[i] - low) / row[i]
        vector[i - 1] = (vector[i - 1] - high - above[i] * vector[i]) / above[i - 1]
        i -= 2
    if i == 0:
        row = factor[0]
        for k in range(1, size):
            vector[0] -= row[k] * vector[k]
        vector[0] /= row[0]


@compiled
def solve_factored(factor, size, vector):
    """Solve with a symmetric matrix whose upper factor is given."""
    solve_transposed(factor, size, vector)
    solve_upper(factor, size, vector)
