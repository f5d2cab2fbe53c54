"""Designs to look through on a page: scatter, filters over parallel axes, Pareto front of any two results.

The section carries its data and its script: it works from a file, without a network. Numbers travel as decimals of
seven digits rather than as binary ones: a bound typed as it reads then takes the design in that has this very value.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal
from urllib.parse import unquote, urlsplit

import numpy as np

from pmor.report.chart import COLOURS

#: significant digits of numbers on the page
DIGITS = 7


@dataclass(frozen=True, eq=False)
class Column:
    """One quantity of all designs.

    Parameters
    ----------
    key : str
        With the unit in it, as in result files: heads the column of the CSV that the page gives.
    label, unit : str
        Of the axis; the unit is empty where there is none, and um is shown as µm.
    values : ndarray, shape (n,)
        Numbers, NaN where there is none, or text for categories.
    kind : {"input", "result"}
        Chosen, or found; fronts are of results.

    Raises
    ------
    ValueError
        The kind is another, or the values are neither numbers nor text.
    """

    key: str
    label: str
    unit: str
    values: np.ndarray
    kind: Literal["input", "result"]

    def __post_init__(self) -> None:
        """Refuse data that the page cannot show."""
        if self.kind not in ("input", "result"):
            raise ValueError(f"column {self.key!r}: kind {self.kind!r} is neither 'input' nor 'result'")
        if self.values.ndim != 1 or self.values.dtype.kind not in "fiuU":
            raise ValueError(f"column {self.key!r}: {self.values.dtype} of shape {self.values.shape}, not (n,) of "
                             "numbers or text")  # fmt: skip

    def data(self) -> dict[str, Any]:
        """Return the data of the script: values, or levels in alphabetical order and the number of each design's."""
        shown = {"key": self.key, "label": self.label, "unit": self.unit.replace("um", "µm"), "kind": self.kind}
        if self.values.dtype.kind == "U":
            levels, of = np.unique(self.values, return_inverse=True)
            return shown | {"levels": levels.tolist(), "values": of.tolist()}
        return shown | {"values": [_decimal(value) for value in self.values.tolist()]}


@dataclass(frozen=True, eq=False)
class Designs:
    """Designs of a page: a block of `pmor.report.page.write_page`.

    Parameters
    ----------
    columns : iterable of Column
        At least one, n values each, in the order of the axes.
    names : ndarray of str, shape (n,)
    links : ndarray of str, shape (n,)
        Relative URL of a file of the design, quoted; empty where there is none.
    reasons : ndarray of str, shape (n,)
        Why a design is infeasible; empty where it is not.

    Raises
    ------
    ValueError
        Lengths differ, keys occur twice, or a link leaves the folder of the page.
    """

    columns: Iterable[Column]
    names: np.ndarray
    links: np.ndarray
    reasons: np.ndarray

    def __post_init__(self) -> None:
        """Refuse data that the page cannot show."""
        object.__setattr__(self, "columns", tuple(self.columns))
        keys = [column.key for column in self.columns]
        if not keys or len(set(keys)) != len(keys):
            raise ValueError(f"designs need columns, and each key once: {keys}")
        lengths = {"links": len(self.links), "reasons": len(self.reasons)}
        lengths |= {column.key: len(column.values) for column in self.columns}
        for name, length in lengths.items():
            if length != len(self.names):
                raise ValueError(f"designs have {len(self.names)} names, but {length} {name}")
        for link in self.links:
            parts = urlsplit(link.replace("\\", "/"))
            if parts.scheme or parts.netloc or parts.path.startswith("/") or ".." in unquote(parts.path).split("/"):
                raise ValueError(f"link {str(link)!r} leaves the folder of the page")

    def data(self) -> dict[str, Any]:
        """Return the data of the script."""
        reasons, of = np.unique(np.concatenate([[""], self.reasons]), return_inverse=True)
        return {
            "columns": [column.data() for column in self.columns], "names": self.names.tolist(),
            "links": self.links.tolist(), "reasons": reasons.tolist(), "reason": of[1:].tolist(), "colours": COLOURS
        }  # fmt: skip


def _decimal(value: float) -> float | None:
    """A number as the page carries it; none where it is not finite."""
    return float(f"{value:.{DIGITS}g}") if math.isfinite(value) else None
