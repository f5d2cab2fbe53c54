"""Peaks of the response over the speed: where, how large, which order excites which mode."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from pmor.dynamics.measure import Data

# Least height of a peak over the higher of the valleys beside it, over the peak.
PROMINENCE = 0.05
# Modes with less of their strain energy in the mesh are not excited by it.
EXCITED = 0.01
# Peaks of two branches that are nearer to each other, over their speed, are the same motion.
SAME = 1e-3


def peaks_of(response: Data) -> list[Data]:
    """Return the peaks of the stable dynamic transmission error of a response to one torque, by rising speed.

    The mode is the one whose natural frequency is nearest to the order of the largest amplitude times the mesh
    frequency; where flanks part, a peak lies below it.

    Returns
    -------
    list of dict
        `mesh_frequency_Hz`, `dte_rms_um`, `dte_peak_to_peak_um`, `dynamic_factor`, `order`, `order_um` (its amplitude,
        zero to peak), `mode` (number in `modes`, from 1), `over_natural` (order times mesh frequency, over that of the
        mode).
    """
    found = [_peak(point, response["modes"]) for branch in response["branches"] for point in _tops(branch)]
    found.sort(key=lambda peak: (peak["mesh_frequency_Hz"], peak["dte_rms_um"]))
    return [peak for peak, before in zip(found, [None, *found], strict=False) if not _same(peak, before)]


def _tops(branch: Sequence[Data]) -> list[Data]:
    """Return the stable local maxima of the transmission error along a branch; its ends are none."""
    from scipy.signal import find_peaks

    size = np.array([point["dte_rms_um"] for point in branch])
    places, found = find_peaks(size, prominence=0.0)
    high = found["prominences"] >= PROMINENCE * size[places]
    return [branch[place] for place in places[high] if branch[place]["stable"]]


def _peak(point: Data, modes: Sequence[Data]) -> Data:
    frequency, order = point["mesh_frequency_Hz"], point["dominant_order"]
    excited = [n for n, mode in enumerate(modes) if mode["mesh_strain_energy_share"] >= EXCITED]
    ratios = {n: order * frequency / modes[n]["natural_frequency_Hz"] for n in excited}
    mode = min(ratios, key=lambda n: abs(math.log(ratios[n])))
    return {
        **{key: point[key] for key in ("mesh_frequency_Hz", "dte_rms_um", "dte_peak_to_peak_um", "dynamic_factor")},
        "order": order, "order_um": point["dominant_order_um"], "mode": mode + 1, "over_natural": ratios[mode],
    }  # fmt: skip


def _same(peak: Data, other: Data | None) -> bool:
    keys = "mesh_frequency_Hz", "dte_rms_um"
    return other is not None and all(abs(peak[key] - other[key]) <= SAME * peak[key] for key in keys)
