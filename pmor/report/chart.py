"""Pictures as what is drawn into their panels, apart from how: the page draws them as SVG, matplotlib on request.

A panel takes the names and abbreviations of matplotlib (`plot`, `fill_between`, `color`, `lw`, ...). `pmor.report.svg`
draws a chart in milliseconds, `pmor.report.replay` by matplotlib: as a figure, as PNG and PDF, into axes of a caller.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from pmor.core.arrays import FloatArray

#: Okabe and Ito's colours without yellow, distinguishable for colour-blind readers and in print
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000")
#: of the colour map viridis, evenly from its low to its high end
VIRIDIS = (
    "440154",
    "48186a",
    "472d7b",
    "424086",
    "3b528b",
    "33638d",
    "2c728e",
    "26828e",
    "21918c",
    "1fa088",
    "28ae80",
    "3fbc73",
    "5ec962",
    "84d44b",
    "addc30",
    "d8e219",
    "fde725",
)
# Of a range: beyond the outermost points.
MARGIN = 0.05
#: what a panel can hold
Kind = Literal["line", "area", "polygon", "polygons", "bars", "segments", "v", "h", "field", "text", "arrows"]
Style = dict[str, Any]


@dataclass(frozen=True)
class Mark:
    """One thing in a panel: its arrays, and its style by the names of matplotlib."""

    kind: Kind
    arrays: tuple[FloatArray, ...]
    style: Style


@dataclass(frozen=True)
class Field:
    """Values (y, x) of cells between edges, in colours from `low` to `high`.

    Parameters
    ----------
    label : str
        Of the scale of colours.
    logarithmic : bool
    beyond : bool
        Whether values exceed the scale.
    missing : str, optional
        Colour of NaN; none: they are left blank.
    steps : int, optional
        Of the scale; none: it is even.
    """

    x: FloatArray
    y: FloatArray
    values: FloatArray
    low: float
    high: float
    label: str
    logarithmic: bool = False
    beyond: bool = False
    missing: str | None = None
    steps: int | None = None


@dataclass
class Panel:
    """Axes with what is drawn into them."""

    marks: list[Mark] = field(default_factory=list)
    said: Style = field(default_factory=dict)
    shown: bool = True
    key: bool = False

    def plot(self, x: ArrayLike, y: ArrayLike, line: str = "", **style: Any) -> None:
        """Draw a line or markers through points; `line` is one of matplotlib's styles or markers."""
        if line:
            style |= {"ls": line} if line in ("-", "--", "-.", ":") else {"marker": line, "ls": ""}
            if line in ("o-", ".-"):
                style |= {"marker": line[0], "ls": "-"}
        style.setdefault("color", COLOURS[sum(mark.kind == "line" for mark in self.marks) % len(COLOURS)])
        points = np.atleast_1d(np.asarray(x, float)), np.atleast_1d(np.asarray(y, float))
        self.marks.append(Mark("line", points, style))

    def fill_between(self, x: ArrayLike, low: ArrayLike, high: ArrayLike, **style: Any) -> None:
        """Fill what is between two courses."""
        self._add(
            "area", np.broadcast_arrays(np.asarray(x, float), np.asarray(low, float), np.asarray(high, float)), style
        )

    def fill(self, x: ArrayLike, y: ArrayLike, **style: Any) -> None:
        """Fill a polygon; of `facecolor`, `edgecolor`."""
        self._add("polygon", (x, y), style)

    def polygons(self, outlines: FloatArray, **style: Any) -> None:
        """Fill polygons of as many corners each, (n, corners, 2)."""
        self._add("polygons", (outlines,), style)

    def bar(
        self, x: ArrayLike, height: ArrayLike, width: float, *, bottom: float = 0.0, lying: bool = False, **style: Any
    ) -> None:
        """Draw bars about places, to the right where they are `lying`."""
        x, height = np.asarray(x, float), np.asarray(height, float)
        self._add("bars", (x, height), {"width": width, "bottom": bottom, "lying": lying, **style})

    def vlines(self, x: ArrayLike, low: ArrayLike, high: ArrayLike, **style: Any) -> None:
        """Draw upright lines."""
        x = np.asarray(x, float)
        self._add("segments", tuple(np.broadcast_arrays(x, np.asarray(low, float), np.asarray(high, float))), style)

    def axvline(self, x: float, **style: Any) -> None:
        """Draw a line over the whole height."""
        self._add("v", ([x],), style)

    def axhline(self, y: float, **style: Any) -> None:
        """Draw a line over the whole width."""
        self._add("h", ([y],), style)

    def field(self, values: Field) -> None:
        """Colour cells; the scale stands below."""
        self.marks.append(Mark("field", (values.x, values.y), {"field": values}))
        self.said["grid"] = False

    def arrows(self, points: FloatArray, ways: FloatArray, **style: Any) -> None:
        """Draw arrows from points, (n, 2) each."""
        self._add("arrows", (points, ways), style)

    def text(self, x: float, y: float, words: str, **style: Any) -> None:
        """Write at a point, or at a share of the axes (`inside=True`); `left`, `right` or `center` (`ha`) of it.

        A `line` from (x, y) leads to words that stand `at` another point, x as a share of the axes.
        """
        self._add("text", ([x], [y]), {"words": words, **style})

    def set(self, **said: Any) -> None:
        """Say labels, limits, scales, ticks, title and aspect by matplotlib's names."""
        self.said |= said

    def set_ylim(self, bottom: float | None = None, top: float | None = None) -> None:
        """Limits of the upright axis; None: as the points have it."""
        self.said["ylim"] = (bottom, top)

    def set_xlim(self, left: float | None = None, right: float | None = None) -> None:
        """Limits of the level axis; None: as the points have it."""
        self.said["xlim"] = (left, right)

    def second_x(self, factor: float, label: str) -> None:
        """Tell above what x times a factor is."""
        self.said["second_x"] = (factor, label)

    def limits(self, axis: Literal["x", "y"]) -> tuple[float, float]:
        """Return the limits of an axis: those said, or a little beyond the points."""
        said = self.said.get(f"{axis}lim")
        low, high = (None, None) if said is None else said
        logarithmic = self.said.get(f"{axis}scale") == "log"
        found = self._range(axis, logarithmic)
        return (found[0] if low is None else float(low)), (found[1] if high is None else float(high))

    def _range(self, axis: str, logarithmic: bool) -> tuple[float, float]:
        values = [np.zeros(0)]
        tight = axis == "x" and self.said.get("tight", False)
        for mark in self.marks:
            values += _extent(mark, axis)
            tight = tight or mark.kind == "field"
        known = np.concatenate([np.ravel(part) for part in values])
        known = known[np.isfinite(known) & ((known > 0.0) | (not logarithmic))]
        if not len(known):
            return (0.1, 1.0) if logarithmic else (0.0, 1.0)
        low, high = float(known.min()), float(known.max())
        if logarithmic:
            beyond = 1.0 if tight else (high / low) ** MARGIN if high > low else 2.0
            return low / beyond, high * beyond
        wide = high - low or 0.1 * abs(high) or 1.0
        beyond = 0.0 if tight and high > low else MARGIN * wide
        return low - beyond, high + beyond

    def _add(self, kind: Kind, arrays: Sequence[ArrayLike], style: Style) -> None:
        self.marks.append(Mark(kind, tuple(np.asarray(array, float) for array in arrays), style))


def _extent(mark: Mark, axis: str) -> list[FloatArray]:
    """Values of a mark along an axis that the axis has to reach."""
    place, style = "xy".index(axis), mark.style
    if mark.kind in ("line", "polygon", "field"):
        return [mark.arrays[place]]
    if mark.kind in ("area", "segments"):
        return [mark.arrays[0]] if axis == "x" else list(mark.arrays[1:])
    if mark.kind == "polygons":
        return [mark.arrays[0][..., place]]
    if mark.kind == "bars":
        x, height = mark.arrays
        if (axis == "x") is not style["lying"]:
            return [x - 0.5 * style["width"], x + 0.5 * style["width"]]
        return [np.full(1, style["bottom"]), style["bottom"] + height]
    return []


@dataclass(frozen=True)
class Entry:
    """A row of a key: its words, and the mark that it is of."""

    words: str
    mark: Mark


@dataclass
class Chart:
    """Panels, row by row, with a key of the lines of all and a heading.

    Parameters
    ----------
    size_in : (float, float)
        Width and height of the whole picture by matplotlib; a page takes from it how high a panel is.
    """

    panels: list[Panel]
    columns: int
    size_in: tuple[float, float]
    key_title: str = ""
    heading: str = ""
    note: str = ""
    keyed: bool = True

    def entries(self) -> list[Entry]:
        """Return the rows of the key: each label once."""
        found: dict[str, Entry] = {}
        for panel in self.panels:
            for mark in panel.marks:
                label = str(mark.style.get("label") or "")
                if label and panel.shown:
                    found.setdefault(label, Entry(label, mark))
        return list(found.values()) if self.keyed else []


@contextmanager
def panels(
    columns: int, width_in: float, height_in: float, *, rows: int = 1, **said: Any
) -> Iterator[tuple[Chart, list[Panel]]]:
    """Give a chart with panels, row by row, which all say the same."""
    every = [Panel(said=dict(said)) for _ in range(rows * columns)]
    yield Chart(every, columns, (width_in, height_in)), every


def plot_share_below(axes: Panel, values: FloatArray, colour: str, label: str) -> None:
    """Draw the share of values that stay below, in per cent, dashed the one that 95 % do; NaN are left out."""
    known = np.sort(values[np.isfinite(values)])
    if not len(known):
        return
    axes.plot(known, 100.0 * (np.arange(len(known)) + 0.5) / len(known), color=colour, label=label)
    axes.axvline(float(np.percentile(known, 95.0)), color=colour, lw=0.8, ls="--")


def colours_between(count: int, top: float = 0.92) -> list[str]:
    """Return so many colours of viridis, from its low end."""
    return [f"#{_hex(colour)}" for colour in palette(np.linspace(0.0, top, count))]


def palette(shares: FloatArray) -> FloatArray:
    """Return the colours of viridis at shares of its length, (n, 3), 0 to 255."""
    rgb = np.array([[int(word[place : place + 2], 16) for place in (0, 2, 4)] for word in VIRIDIS], float)
    at = np.linspace(0.0, 1.0, len(rgb))
    return np.stack([np.interp(shares, at, channel) for channel in rgb.T], axis=-1).round()


def _hex(colour: FloatArray) -> str:
    return "".join(f"{int(value):02x}" for value in colour)
