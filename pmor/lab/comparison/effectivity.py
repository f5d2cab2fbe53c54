"""How good an error estimate is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.work.states import SMALLEST_ERROR_UM

# Effectivities that serve an engineer: the right order of magnitude, rather too large than too small.
WANTED_EFFECTIVITY = (0.3, 5.0)


@dataclass(frozen=True)
class Effectivity:
    """An error estimate against the true error; None where there is nothing to compare."""

    states: int  # With a true error above `SMALLEST_ERROR_UM`; the numbers below are theirs, but for the last
    # Quantiles (2.5, 50, 97.5 %) of abs(estimate / error)
    low: float | None = None
    median: float | None = None
    high: float | None = None
    wanted_share: float | None = None  # Share of the states within `WANTED_EFFECTIVITY`
    # Spearman's, of the magnitudes, over all states; None too where no error is above `SMALLEST_ERROR_UM`
    rank_correlation: float | None = None


def effectivity(error_um: FloatArray, estimate_um: FloatArray) -> Effectivity:
    """Compare an estimate with the true error, arrays of the same shape (n,), NaN where not converged."""
    known = np.isfinite(error_um) & np.isfinite(estimate_um)
    true, estimate = np.abs(error_um[known]), np.abs(estimate_um[known])
    counted = true > SMALLEST_ERROR_UM
    if not counted.any():
        return Effectivity(0)
    ratio = estimate[counted] / true[counted]
    low, high = WANTED_EFFECTIVITY
    first, median, last = np.quantile(ratio, (0.025, 0.5, 0.975)).tolist()
    wanted = float(np.mean((ratio >= low) & (ratio <= high)))
    return Effectivity(int(counted.sum()), first, median, last, wanted, rank_correlation(true, estimate))


def rank_correlation(first: FloatArray, second: FloatArray) -> float | None:
    """Return Spearman's rank correlation; None where one of the two does not vary."""
    from scipy.stats import spearmanr  # takes half a second to load

    if min(np.ptp(first), np.ptp(second)) == 0.0:
        return None
    return float(spearmanr(first, second).statistic)
