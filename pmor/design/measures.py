r"""Objectives: figures of an STE curve with their derivatives, and their values over scatter.

*Smooth peak-to-peak.* The largest of n values has a kink where two of them are equal, which is just where a good design
lies. In its place stands, with the sharpness s,

    top(x) = (1 / s) ln( (1 / n) sum_i exp(s x_i) ),    d top / d x_i = exp(s x_i) / sum_j exp(s x_j),

at most ln(n) / s below it, and peak-to-peak is top(x) + top(-x). Its derivatives are weights of the positions: with
those of the STE (`pmor.gear.deviation_rates`) they give the derivative by each parameter of the modifications. With an
infinite sharpness it is the largest value itself.

*Percentile.* Of m draws, by Harrell and Davis (Biometrika 69 (1982) 635): the mean of all sorted values under the
weights of a beta distribution, steadier than one of them, and with a derivative.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from pmor.core.arrays import ComplexArray, FloatArray

PERCENTILE = 0.95


def peak_to_peak(ste_um: FloatArray) -> FloatArray:
    """Largest minus smallest of the known ones over the last axis; NaN without any."""
    return np.asarray(np.fmax.reduce(ste_um, axis=-1) - np.fmin.reduce(ste_um, axis=-1))


def smooth_peak_to_peak(ste_um: FloatArray, sharpness: float) -> tuple[FloatArray, FloatArray]:
    """Return the smooth peak-to-peak (...,) of curves (..., n), um, and its derivatives (..., n); sharpness in 1/um."""
    top, high = smooth_top(ste_um, sharpness)
    bottom, low = smooth_top(-ste_um, sharpness)
    return np.asarray(top + bottom), np.asarray(high - low)


def smooth_top(values: FloatArray, sharpness: float) -> tuple[FloatArray, FloatArray]:
    """Return the smooth largest value (...,) of values (..., n), and its derivatives (..., n)."""
    most = values.max(axis=-1, keepdims=True)
    if np.isinf(sharpness):
        first = np.arange(values.shape[-1]) == values.argmax(axis=-1)[..., None]
        return most[..., 0], first.astype(float)
    powers = np.exp(sharpness * (values - most))
    mean = powers.mean(axis=-1)
    return most[..., 0] + np.log(mean) / sharpness, powers / (mean[..., None] * values.shape[-1])


def order_amplitude(ste_um: FloatArray, order: int) -> FloatArray:
    """Return the amplitude (...,), zero to peak, of an order of curves (..., n) over their period."""
    return np.asarray(np.abs(ste_um @ _wave(ste_um.shape[-1], order)))


def order_rates(ste_um: FloatArray, order: int) -> tuple[FloatArray, FloatArray]:
    """Return the amplitude of an order as `order_amplitude` does, and its derivatives (..., n).

    At amplitude 0 it has a kink: the derivative there is returned as 0.
    """
    wave = _wave(ste_um.shape[-1], order)
    spectrum = ste_um @ wave
    amplitude = np.abs(spectrum)
    direction = np.divide(spectrum, amplitude, out=np.zeros_like(spectrum), where=amplitude > 0.0)
    return np.asarray(amplitude), np.asarray((np.conj(direction)[..., None] * wave).real)


@lru_cache(64)
def _wave(count: int, order: int) -> ComplexArray:
    return np.asarray(2.0 / count * np.exp(-2j * np.pi * order * np.arange(count) / count))


def order_of(result: str) -> int | None:
    """Return the order that a result such as ``order_1_um`` is of; None of others."""
    return int(result.split("_")[1]) if result.startswith("order_") else None


def percentile_weights(count: int) -> FloatArray:
    """Return the weights (count,) of sorted values that make their 95th percentile."""
    from scipy.special import betainc

    shares = betainc((count + 1) * PERCENTILE, (count + 1) * (1.0 - PERCENTILE), np.arange(count + 1) / count)
    return np.asarray(np.diff(shares))


def draw_weights(values: FloatArray, kind: str) -> FloatArray:
    """Return the weights (m,) of m draws in the wanted value: its derivatives by the draws."""
    if kind != "percentile_95":
        return np.full(len(values), 1.0 / len(values))
    weights = np.empty(len(values))
    weights[np.argsort(values, kind="stable")] = percentile_weights(len(values))
    return weights
