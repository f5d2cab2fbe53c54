"""Peaks of a response: where they are, which harmonic of the mesh makes them, and the mode that it moves."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

Data = dict[str, Any]
#: root mean square in um at a point, (branch, place), with a harmonic of the excitation switched off; None: not found
Without = Callable[[int, int, int], float | None]

# Least height of a peak over the higher of the valleys beside it, over the peak.
PROMINENCE = 0.05
# Peaks of two branches that are nearer to each other, over their speed, are the same motion.
SAME = 1e-3
# Logarithm of the frequency of a harmonic over that of a mode: harmonics that are farther from all modes are not tried.
# Where flanks part, peaks lie below modes, down to half of them.
NEAR, BELOW = 0.3, 0.75
# Without a harmonic that makes a peak at most so much of its height is left; else none does by itself.
LEFT = 1.0 - PROMINENCE
# In tables, of a peak that is as high without any harmonic.
NO_SINGLE = "no single one"
# Of motion that a harmonic makes: what is left without it. Where flanks part, it jumps back without any of several.
MADE = 0.5


def peaks_of(branches: Sequence[Sequence[Data]], modes: Sequence[Data], without: Without) -> list[Data]:
    """Return the peaks of the stable dynamic transmission error of a response to one torque, by rising speed.

    The harmonic is the one without which motion is least, of all that come near to a mode; where flanks part, and jump
    back without any of several, the one of these that moves most. Those whose amplitudes are not told are tried where
    none of the others makes the peak. The mode is the one nearest to it. Motion of several mesh cycles has the order of
    its largest amplitude, without such a proof.

    Returns
    -------
    list of dict
        `mesh_frequency_Hz`, `dte_rms_um`, `dte_peak_to_peak_um`, `dynamic_factor`, `order`, `order_um` (its amplitude,
        zero to peak; None where that is not told), `made_by_one` (whether this harmonic makes the peak by itself; None
        without a proof), `mode` (number in `modes`, from 1), `over_natural` (order times mesh frequency, over that of
        the mode), `dte_rms_without_um` (with that harmonic switched off), `further_order`, `dte_rms_without_further_um`
        (the next of them), `orders_tried`.
    """
    peaks = [
        _peak(branch[place], modes, partial(without, number, place))
        for number, branch in enumerate(branches)
        for place in _tops(branch)
    ]
    peaks.sort(key=lambda peak: (peak["mesh_frequency_Hz"], peak["dte_rms_um"]))
    return [peak for peak, before in zip(peaks, [None, *peaks], strict=False) if not _same(peak, before)]


def _tops(branch: Sequence[Data]) -> list[int]:
    """Return the stable local maxima of the transmission error along a branch; its ends are none."""
    from scipy.signal import find_peaks

    size = np.array([point["dte_rms_um"] for point in branch])
    places, properties = find_peaks(size, prominence=0.0)
    high = properties["prominences"] >= PROMINENCE * size[places]
    return [int(place) for place in places[high] if branch[place]["stable"]]


def _peak(point: Data, modes: Sequence[Data], without: Callable[[int], float | None]) -> Data:
    frequency, amplitudes = point["mesh_frequency_Hz"], point["dte_orders_um"]

    def mode_of(order: float) -> int:
        return min(range(len(modes)), key=lambda n: abs(math.log(over(order, n))))

    def over(order: float, mode: int) -> float:
        return float(order * frequency / modes[mode]["natural_frequency_Hz"])

    size, told, parted, left = point["dte_rms_um"], len(amplitudes), point["contact_loss"] > 0.0, dict[int, float]()
    low = -BELOW if parted else -NEAR
    most = math.ceil(math.exp(NEAR) * modes[-1]["natural_frequency_Hz"] / frequency)
    tried = [k for k in range(1, most + 1) if low < math.log(over(k, mode_of(k))) < NEAR]
    if point["period_mesh_cycles"] > 1:
        tried = []
    for beyond in (False, True):
        if not beyond or min(left.values(), default=size) > LEFT * size:
            rests = {order: without(order) for order in tried if (order > told) == beyond}
            left |= {order: rest for order, rest in rests.items() if rest is not None}

    def rank(order: int) -> float:
        makes = parted and order <= told and left[order] < MADE * size
        return -float(amplitudes[order - 1]) if makes else left[order]

    ranked = sorted(left, key=rank)
    order, further = (ranked[0] if ranked else point["dominant_order"]), (ranked[1] if len(ranked) > 1 else None)
    mode = mode_of(order)
    return {
        **{key: point[key] for key in ("mesh_frequency_Hz", "dte_rms_um", "dte_peak_to_peak_um", "dynamic_factor")},
        "order": order, "made_by_one": left[order] <= LEFT * size if ranked else None, "mode": mode + 1,
        "order_um": point["dominant_order_um"] if not ranked else amplitudes[order - 1] if order <= told else None,
        "over_natural": over(order, mode), "dte_rms_without_um": left.get(order), "further_order": further,
        "dte_rms_without_further_um": None if further is None else left[further], "orders_tried": sorted(left),
    }  # fmt: skip


def _same(peak: Data, other: Data | None) -> bool:
    keys = "mesh_frequency_Hz", "dte_rms_um"
    return other is not None and all(abs(peak[key] - other[key]) <= SAME * peak[key] for key in keys)
