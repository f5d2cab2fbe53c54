"""Axes of pictures: panels, logarithmic scales, names of points."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.report.style import new_figure, plot_style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

# Of the axes' height.
NAME_HEIGHT = 0.04


@contextmanager
def panels(
    columns: int, width_in: float, height_in: float, legend: int = 0, rows: int = 1, **options: Any
) -> Iterator[tuple[Figure, list[Any]]]:
    """Give a figure with panels, row by row.

    Parameters
    ----------
    legend : int
        Columns of a legend below all panels, with the entries of the first; 0: none.
    options
        Of `matplotlib.figure.Figure.subplots`.
    """
    with plot_style():
        figure = new_figure(width_in, height_in)
        axes = list(np.ravel(figure.subplots(rows, columns, squeeze=False, **options)))
        yield figure, axes
        if legend:
            figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=legend)


def plot_share_below(axes: Axes, values: FloatArray, colour: str, label: str) -> None:
    """Draw the share of values that stay below, in per cent, dashed the one that 95 % do; NaN are left out."""
    known = np.sort(values[np.isfinite(values)])
    if not len(known):
        return
    axes.plot(known, 100.0 * (np.arange(len(known)) + 0.5) / len(known), color=colour, label=label)
    axes.axvline(float(np.percentile(known, 95.0)), color=colour, lw=0.8, ls="--")


def log_log(axes: Axes, ticks: Sequence[int] = ()) -> None:
    """Logarithmic axes with plain numbers; `ticks` are the only ones below, if given."""
    from matplotlib.ticker import FixedLocator, NullLocator

    axes.set(xscale="log", yscale="log")
    for axis in (axes.xaxis, axes.yaxis):
        log_ticks(axis)
    if ticks:
        axes.xaxis.set_major_locator(FixedLocator(ticks))
        axes.xaxis.set_major_formatter("{x:g}")
        axes.xaxis.set_minor_locator(NullLocator())


def log_ticks(axis: Axis) -> None:
    """Ticks of a logarithmic axis at powers of ten, within two decades at 2 and 5 as well, with plain numbers."""
    from matplotlib.ticker import LogLocator, NullFormatter

    low, high = axis.get_view_interval()
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 100.0 * low else (1.0,)))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(NullFormatter())


def name_points(axes: Axes, points: Sequence[tuple[float, float, str]], left: bool = False) -> None:
    """Name points (x, y, name) on logarithmic axes in a column beside them, a line to each, no name on another.

    Parameters
    ----------
    points : sequence of (float, float, str)
    left : bool
        Left of all that is drawn, for which the axes are widened; otherwise right of the axes.
    """
    ordered = sorted(points, key=lambda point: (point[1], -point[0]))
    low, high = np.log10(axes.get_ylim())
    heights = (np.log10([y for _, y, _ in ordered]) - low) / (high - low)
    for _ in range(200):  # neighbours that are too close push each other apart
        overlap = np.maximum(NAME_HEIGHT - np.diff(heights), 0.0)
        heights[:-1] -= 0.5 * overlap
        heights[1:] += 0.5 * overlap
    if left:
        first, last = np.log10(axes.get_xlim())
        axes.set_xlim(left=10.0 ** (first - 0.2 * (last - first)))
    line = {"arrowstyle": "-", "lw": 0.5, "color": "#999999", "shrinkA": 1, "shrinkB": 4,
            "relpos": (1.0 if left else 0.0, 0.5)}  # fmt: skip
    column, side = (0.12, "right") if left else (1.02, "left")
    for height, (x, y, name) in zip(heights, ordered, strict=True):
        axes.annotate(name, (x, y), (column, height), textcoords="axes fraction", fontsize=8, ha=side, va="center",
                      arrowprops=line)  # fmt: skip
