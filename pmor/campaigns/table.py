"""The table of designs, one at a time: a million of them are never in memory together."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pmor.campaigns.campaign import Campaign, Span, Variable
from pmor.campaigns.kind import Design, Number
from pmor.core.arrays import IntArray
from pmor.core.sobol import sobol_points

# Digits that a value keeps: those of a step over a range, without its rounding.
DIGITS = 12


def designs_of(campaign: Campaign) -> Callable[[int], Design]:
    """Return the function from the number of a design, 0 to `campaign.count` - 1, to the keys that it changes."""
    variables = campaign.variables
    if campaign.sections.designs.method == "sobol":
        points = _sobol_points(len(variables), campaign.count)
        return lambda i: {v.name: _at_share(v, float(points[i, k])) for k, v in enumerate(variables)}
    if campaign.sections.designs.method == "grid":
        lengths = tuple(len(_listed(v)) for v in variables)
        return lambda i: {
            v.name: _listed(v)[int(place)] for v, place in zip(variables, np.unravel_index(i, lengths), strict=True)
        }
    if campaign.sections.designs.method == "one_at_a_time":
        alone = [(v.name, value) for v in variables for value in _listed(v)[1:]]
        base = {v.name: _listed(v)[0] for v in variables}
        return lambda i: base | dict(alone[i - 1 : i] if i else ())
    return lambda i: {v.name: _listed(v)[i] for v in variables}


def different_designs(campaign: Campaign) -> tuple[IntArray, IntArray]:
    """Return the numbers of the designs that are like none before them, (m,), and the place of each among these, (n,).

    Both count from 0. A design that stands in the table twice is solved once.
    """
    every, variables, method = np.arange(campaign.count), campaign.variables, campaign.sections.designs.method
    if method == "grid" or any(isinstance(v.values, Span) and not v.values.whole for v in variables):
        return every, every
    table = designs_of(campaign)
    values = np.array([list(table(i).values()) for i in every.tolist()], dtype=float)
    _, first, group = np.unique(values, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    return first[order], np.argsort(order)[group.ravel()]


def evenly(low: Number, high: Number, steps: int, whole: bool) -> tuple[Number, ...]:
    """Return so many values from one bound to the other; whole numbers to the nearest, each once."""
    values = np.linspace(low, high, steps)
    if whole:
        return tuple(dict.fromkeys(round(value) for value in values.tolist()))
    return tuple(_rounded(value) for value in values.tolist())


def _sobol_points(dimensions: int, count: int) -> np.ndarray:
    """Points of Sobol's sequence, shape (count, dimensions), in the middle of their cells: none on a bound.

    Without scrambling, so that they are the same with every version of scipy.
    """
    power = max(count - 1, 1).bit_length()
    points = sobol_points(dimensions, power)[:count]
    return np.asarray(points + 0.5 ** (power + 1))


def _at_share(variable: Variable, share: float) -> Number:
    values = variable.values
    if not isinstance(values, Span):
        return values[int(share * len(values))]
    if values.whole:
        return int(values.low + int(share * (values.high - values.low + 1)))
    return _rounded(values.low + share * (values.high - values.low))


def _listed(variable: Variable) -> tuple[Number, ...]:
    assert not isinstance(variable.values, Span)
    return variable.values


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
