"""Points of Sobol's sequence, even over a unit cube."""

from __future__ import annotations

import numpy as np

from pmor.core.arrays import FloatArray


def sobol_points(dimensions: int, power: int, seed: int | None = None) -> FloatArray:
    """Return 2**power points, shape (2**power, dimensions), in [0, 1).

    Parameters
    ----------
    seed : int, optional
        Of the scrambling; without it the first point is 0.
    """
    from scipy.stats import qmc  # takes as long to load as some commands take in all

    sequence = qmc.Sobol(dimensions, scramble=seed is not None, seed=seed)
    return np.asarray(sequence.random_base2(power))
