"""Small dense systems: Cholesky factor and triangular solves, in place."""

from __future__ import annotations

import numpy as np

from pmor.core.compiling import compiled


@compiled
def cholesky(matrix, size, factor):
    """Fill the upper Cholesky factor of a symmetric matrix; its upper half is read.

    All inner loops run along rows of known beginning, without sums: vector registers can take them. Four rows are taken
    off the rest at a time, in their order: it goes through memory a quarter as often, and no digit changes.
    """
    for i in range(size):
        row, source = factor[i, i:size], matrix[i, i:size]
        for k in range(size - i):
            row[k] = source[k]
    for first in range(0, size, 4):
        last = min(first + 4, size)
        for j in range(first, last):
            pivot = factor[j, j:size]
            for above in range(first, j):
                value, rest = factor[above, j], factor[above, j:size]
                for k in range(size - j):
                    pivot[k] -= value * rest[k]
            inverse = 1.0 / np.sqrt(pivot[0])
            for k in range(size - j):
                pivot[k] *= inverse
        for i in range(last, size):
            row, one, two = factor[i, i:size], factor[first, i:size], factor[first + 1, i:size]
            three, four = factor[first + 2, i:size], factor[first + 3, i:size]
            a, b, c, d = one[0], two[0], three[0], four[0]
            for k in range(size - i):
                row[k] = row[k] - a * one[k] - b * two[k] - c * three[k] - d * four[k]


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
    """Solve with an upper factor."""
    for i in range(size - 1, -1, -1):
        for k in range(i + 1, size):
            vector[i] -= factor[i, k] * vector[k]
        vector[i] /= factor[i, i]


@compiled
def solve_factored(factor, size, vector):
    """Solve with a symmetric matrix whose upper factor is given."""
    solve_transposed(factor, size, vector)
    solve_upper(factor, size, vector)
