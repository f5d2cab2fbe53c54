"""Exact first derivatives of the transmission error by each parameter of a flank modification.

The advance depends on a deviation of the flanks only through the gaps of the sections, and its derivative by each gap
follows from the solution (`pmor.line.kernels.loads`, equation 2):

    d STE / d parameter = sum_n (d STE / d e_n) (d e_n / d parameter).

They hold while the active set does not change; a peak-to-peak value follows the positions of its extremes, and has a
kink where two maxima are equal.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.shown import brief
from pmor.results.load_distribution import line_states
from pmor.results.sweep import SteSweep


@brief
@dataclass(frozen=True, eq=False)
class Sensitivities:
    """Derivatives of the STE by K parameters, in um per unit of each.

    Attributes
    ----------
    parameter : tuple of str
        Such as ``pinion.tip_relief_um``: gear and key of the case file, whose unit it is per.
    ste : (K, n_torques, n_angles)
        NaN where not converged.
    mean, peak_to_peak : (K, n_torques)
        Of mean and peak-to-peak STE over the sweep.
    """

    parameter: tuple[str, ...]
    ste: FloatArray
    mean: FloatArray
    peak_to_peak: FloatArray


def sensitivities(sweep: SteSweep, rates: Mapping[str, FloatArray]) -> Sensitivities:
    """Return the derivatives of a recorded sweep of line loads.

    Parameters
    ----------
    rates : mapping of str to ndarray, shape (A, P, S)
        d e_n / d parameter in um per unit (`pmor.gear.deviation_rates`).
    """
    lines = line_states(sweep)
    torques, angles = sweep.ste_um.shape
    by_section = lines.sensitivity.reshape(torques, angles, -1)
    stacked = np.stack([rate.reshape(angles, -1) for rate in rates.values()])
    ste = np.einsum("dan,kan->kda", by_section, stacked)
    ste[:, ~sweep.converged] = np.nan
    known = sweep.converged & np.isfinite(sweep.ste_um)
    mean, span = np.full((2, len(ste), torques), np.nan)
    for d in range(torques):
        if known[d].any():
            mean[:, d] = ste[:, d, known[d]].mean(axis=1)
            span[:, d] = ste[:, d, np.nanargmax(sweep.ste_um[d])] - ste[:, d, np.nanargmin(sweep.ste_um[d])]
    return Sensitivities(tuple(rates), ste, mean, span)
