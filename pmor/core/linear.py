"""Small dense systems: Cholesky factor and triangular solves, in place."""

from __future__ import annotations

import numpy as np

from pmor.core.compiling import compiled


@compiled
def cholesky(matrix, size, factor):
    """Fill the upper Cholesky factor of a symmetric matrix; its upper half is read.

    All inner loops run along rows of known beginning, without sums: vector registers can take them.
    """
    for i in range(size):
        row, source = factor[i, i:size], matrix[i, i:size]
        for k in range(size - i):
            row[k] = source[k]
    for j in range(size):
        pivot = factor[j, j:size]
        inverse = 1.0 / np.sqrt(pivot[0])
        for k in range(size - j):
            pivot[k] *= inverse
        for i in range(1, size - j):
            row, value, rest = factor[j + i, j + i : size], pivot[i], pivot[i:]
            for k in range(size - j - i):
                row[k] -= value * rest[k]


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
