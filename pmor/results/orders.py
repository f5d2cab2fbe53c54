"""Orders of a periodic curve."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pmor.core.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Orders:
    """Harmonics of a curve over the angle of a shaft.

    The curve is ``mean + sum_k amplitude[k] cos(order[k] angle + phase[k])``: an order is a number of periods per turn
    of the shaft, an amplitude goes from zero to peak.

    Parameters
    ----------
    mean : float
        In the unit of the curve.
    order : ndarray, shape (n,)
        Ascending; multiples of 2 pi over the period.
    amplitude : ndarray, shape (n,)
        In the unit of the curve; NaN where a value was missing, as is the mean.
    phase : ndarray, shape (n,)
        rad, between -pi and pi.
    """

    mean: float
    order: FloatArray
    amplitude: FloatArray
    phase: FloatArray


def orders(angle: FloatArray, values: FloatArray, period: float) -> Orders:
    """Find all orders that a curve's samples resolve: those of fewer than half as many periods as there are samples.

    Parameters
    ----------
    angle : ndarray, shape (n,)
        They divide one period uniformly, its end excluded, rad.
    values : ndarray, shape (n,)
    period : float
        rad.
    """
    n = len(values)
    order = np.asarray(2.0 * math.pi / period * np.arange(1, (n - 1) // 2 + 1), dtype=float)
    spectrum = np.fft.rfft(values) / n
    found = 2.0 * spectrum[1 : len(order) + 1] * np.exp(-1j * order * angle[0])
    return Orders(float(spectrum[0].real), order, np.abs(found), np.angle(found))
