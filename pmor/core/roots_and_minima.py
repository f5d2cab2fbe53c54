"""Where a function of one number is nought, and where one of a few numbers is least.

scipy.optimize has the same: to load it takes a sixth of a run of a spur pair.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from typing import Any

import numpy as np

from pmor.core.arrays import FloatArray

_EPS = sys.float_info.epsilon


def root(function: Callable[[float], Any], low: float, high: float, tolerance: float = 1e-12) -> float:
    """Return where a function changes its sign between two places, by Chandrupatla's method.

    Parabolas through three points where these are monotonic, else halves (Adv. Eng. Software 28 (1997) 145).

    Parameters
    ----------
    tolerance : float
        Of the place, beside round-off.

    Raises
    ------
    ValueError
        When it has the same sign at both places.
    """
    a, b = low, high
    f_a, f_b = float(function(a)), float(function(b))
    if not f_a * f_b <= 0.0:
        raise ValueError(f"no change of sign between {low!r} ({f_a!r}) and {high!r} ({f_b!r})")
    share = 0.0 if f_a == 0.0 else 0.5
    while True:
        x = a + share * (b - a)
        f = float(function(x))
        c, f_c = (a, f_a) if (f > 0.0) == (f_a > 0.0) else (b, f_b)
        if c != a:
            b, f_b = a, f_a
        a, f_a = x, f
        best, f_best = (a, f_a) if abs(f_a) < abs(f_b) else (b, f_b)
        least = (tolerance + 2.0 * _EPS * abs(best)) / abs(b - a) if a != b else math.inf
        if f_best == 0.0 or least > 0.5:
            return best
        xi, phi = (a - b) / (c - b), (f_a - f_b) / (f_c - f_b)
        share = 0.5
        if phi**2 < xi and (1.0 - phi) ** 2 < 1.0 - xi:
            ahead = (c - a) / (b - a) * f_a / (f_c - f_a) * f_b / (f_c - f_b)
            share = min(max(f_a / (f_b - f_a) * f_c / (f_b - f_c) + ahead, least), 1.0 - least)


def least_between(function: Callable[[float], float], low: float, high: float, tolerance: float) -> float:
    """Return where a function with one minimum between two places is least, by golden section."""
    golden = 0.5 * (math.sqrt(5.0) - 1.0)
    left, right = high - golden * (high - low), low + golden * (high - low)
    f_left, f_right = function(left), function(right)
    while high - low > tolerance:
        if f_left < f_right:
            high, right, f_right = right, left, f_left
            left = high - golden * (high - low)
            f_left = function(left)
        else:
            low, left, f_left = left, right, f_right
            right = low + golden * (high - low)
            f_right = function(right)
    return left if f_left < f_right else right


class _Spent(Exception):
    """No evaluation is left."""


def least_by_simplexes(
    function: Callable[[FloatArray], float], simplex: FloatArray, low: FloatArray, high: FloatArray, evaluations: int,
    tolerances: tuple[float, float],
) -> FloatArray:  # fmt: skip
    """Return where a function of n numbers is least within bounds, by simplexes (Nelder & Mead 1965).

    Parameters
    ----------
    simplex : ndarray, shape (n + 1, n)
        The first one.
    evaluations : int
        At most, more than n.
    tolerances : (float, float)
        Of the places and of the values in a simplex: it is the last one where both are reached.
    """
    left = evaluations

    def at(place: FloatArray) -> float:
        nonlocal left
        if left <= 0:
            raise _Spent
        left -= 1
        return function(place)

    places = np.clip(simplex, low, high)
    values = np.array([at(place) for place in places])
    while True:
        order = np.argsort(values)
        places, values = places[order], values[order]
        near = np.abs(places[1:] - places[0]).max() <= tolerances[0] and values[-1] - values[0] <= tolerances[1]
        if near or left <= 0:
            return np.asarray(places[0])
        try:
            _replace_worst(at, places, values, low, high)
        except _Spent:
            continue


def _replace_worst(
    at: Callable[[FloatArray], float], places: FloatArray, values: FloatArray, low: FloatArray, high: FloatArray
) -> None:
    """Move the worst corner of a sorted simplex through the middle of the others, or all towards the best one."""
    middle = places[:-1].mean(axis=0)

    def beyond(factor: float) -> tuple[float, FloatArray]:
        place = np.clip((1.0 + factor) * middle - factor * places[-1], low, high)
        return at(place), place

    found = beyond(1.0)
    if found[0] < values[0]:
        further = beyond(2.0)
        found = further if further[0] < found[0] else found
    elif not found[0] < values[-2]:
        outside = found[0] < values[-1]
        bound, found = found[0], beyond(0.5 if outside else -0.5)
        if not (found[0] <= bound if outside else found[0] < values[-1]):
            for corner in range(1, len(places)):
                places[corner] = np.clip(places[0] + 0.5 * (places[corner] - places[0]), low, high)
                values[corner] = at(places[corner])
            return
    values[-1], places[-1] = found
