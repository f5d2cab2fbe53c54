"""Points of Sobol's sequence, even over a unit cube (Sobol, USSR Comput. Math. Math. Phys. 7 (1967) 86).

Direction numbers are those of Joe & Kuo (SIAM J. Sci. Comput. 30 (2008) 2635), scrambling is by random lower triangular
matrices and a shift (Matousek, J. Complexity 14 (1998) 527): to the last bit the points of `scipy.stats.qmc.Sobol`,
which takes longer to load than a search takes to its first result, and which makes those of many dimensions here too.
"""

from __future__ import annotations

import numpy as np

from pmor.core.arrays import FloatArray

# Of each dimension after the first one: primitive polynomial, coefficients as bits, and first direction numbers.
DIRECTIONS = (
    (3, (1,)),
    (7, (1, 3)),
    (11, (1, 3, 1)),
    (13, (1, 1, 1)),
    (19, (1, 1, 3, 3)),
    (25, (1, 3, 5, 13)),
    (37, (1, 1, 5, 5, 17)),
    (41, (1, 1, 5, 5, 5)),
    (47, (1, 1, 7, 11, 19)),
    (55, (1, 1, 5, 1, 1)),
    (59, (1, 1, 1, 3, 11)),
    (61, (1, 3, 5, 5, 31)),
    (67, (1, 3, 3, 9, 7, 49)),
    (91, (1, 1, 1, 15, 21, 21)),
    (97, (1, 3, 1, 13, 27, 49)),
)
BITS = 30


def sobol_points(dimensions: int, power: int, seed: int | None = None) -> FloatArray:
    """Return 2**power points, shape (2**power, dimensions), in [0, 1).

    Parameters
    ----------
    seed : int, optional
        Of the scrambling; without it the first point is 0.
    """
    if dimensions > len(DIRECTIONS) + 1:
        from scipy.stats import qmc

        sequence = qmc.Sobol(dimensions, scramble=seed is not None, seed=seed)
        return np.asarray(sequence.random_base2(power))
    numbers, shift = _numbers(dimensions), np.zeros(dimensions, dtype=np.uint32)
    if seed is not None:
        rng = np.random.default_rng(seed)
        shift = rng.integers(2, size=(dimensions, BITS), dtype=np.uint32) @ 2 ** np.arange(BITS, dtype=np.uint32)
        numbers = _scrambled(numbers, rng.integers(2, size=(dimensions, BITS, BITS), dtype=np.uint32))
    # In the order of Gray's code a point differs from the one before by the number of one bit.
    counts = np.arange(1, 2**power)
    changed = np.log2(counts & -counts).astype(int)
    points = np.vstack([shift[None], numbers.T[changed]])
    return np.bitwise_xor.accumulate(points, axis=0) * 0.5**BITS


def _numbers(dimensions: int) -> np.ndarray:
    """Direction numbers, (dimensions, BITS) uint32: the highest bit is a half."""
    found = np.ones((dimensions, BITS), dtype=np.int64)
    for own, (polynomial, first) in zip(found[1:], DIRECTIONS, strict=False):
        degree = len(first)
        own[:degree] = first
        for place in range(degree, BITS):
            value = own[place - degree]
            for k in range(degree):
                if polynomial >> (degree - 1 - k) & 1:
                    value ^= own[place - k - 1] << (k + 1)
            own[place] = value
    return (found << np.arange(BITS - 1, -1, -1)).astype(np.uint32)


def _scrambled(numbers: np.ndarray, random: np.ndarray) -> np.ndarray:
    """Multiply the bits of all numbers, the highest first, by lower triangular matrices with ones on the diagonal."""
    weights = 2 ** np.arange(BITS - 1, -1, -1, dtype=np.int64)
    bits = numbers[:, :, None] & weights > 0
    matrices = np.tril(random, -1) + np.eye(BITS, dtype=np.int64)
    return (np.einsum("dpk,djk->djp", matrices, bits) % 2 @ weights).astype(np.uint32)
