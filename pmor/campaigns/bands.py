"""What each key does to each result where one key differs at a time, and which one decides."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from pmor.campaigns.campaign import Span
from pmor.campaigns.columns import Columns
from pmor.core.arrays import FloatArray


@dataclass(frozen=True)
class Band:
    """A result over all designs; NaN where none has it.

    Parameters
    ----------
    key : str
        Of the result.
    base : float
        Of the first design.
    spans : dict of str to (float, float)
        Least and largest value with each key that differs, the base among them.
    """

    key: str
    base: float
    spans: dict[str, tuple[float, float]]

    @property
    def least(self) -> float:
        """Over all keys."""
        return min(low for low, _ in self.spans.values())

    @property
    def most(self) -> float:
        """Over all keys."""
        return max(high for _, high in self.spans.values())

    @property
    def decides(self) -> str:
        """Key with the widest span."""
        return max(self.spans, key=lambda name: self.spans[name][1] - self.spans[name][0])


def bands_of(result: Columns) -> list[Band]:
    """Return the band of each result that is known in the base and differs; none with another method."""
    if result.campaign.sections.designs.method != "one_at_a_time":
        return []
    found = []
    for key, values in result.results.items():
        spans = {name: _span(np.append(values[0], values[own])) for name, own in _designs(result)}
        if np.isfinite(values[0]) and any(low < high for low, high in spans.values()):
            found.append(Band(key, float(values[0]), spans))
    return found


def _designs(result: Columns) -> Iterator[tuple[str, slice]]:
    """Yield each key, and the designs in which it alone differs."""
    start = 1
    for variable in result.campaign.variables:
        assert not isinstance(variable.values, Span)
        yield variable.name, slice(start, start := start + len(variable.values) - 1)


def _span(values: FloatArray) -> tuple[float, float]:
    known = values[np.isfinite(values)]
    return (float(known.min()), float(known.max())) if len(known) else (np.nan, np.nan)
