"""Curves of a result, from the columns of its table: drawn into axes of the caller, and two beside each other."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.report.chart import COLOURS, Panel
from pmor.report.style import legend_label, new_figure, plot_style
from pmor.results.quantities import TABLE
from pmor.results.tabular import Tabular

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# What tells curves apart, and what does where none of these is there.
NAMES, LOAD = ("load", "part", "curve"), "torque_Nm"
# Of the columns of forces in motion.
FORCES = ", rms_N"


@dataclass(frozen=True)
class Curves:
    """Curves over one axis.

    Parameters
    ----------
    curves : mapping of str to (ndarray, ndarray)
        Both coordinates of each, by its load.
    parts : mapping of str to str
        What each is of, by the same names; empty where there is one part alone.
    periodic : bool
        Whether the first value follows the last one: angles over whole mesh cycles.
    """

    x_words: str
    y_words: str
    curves: Mapping[tuple[str, str], tuple[FloatArray, FloatArray]]
    periodic: bool = False


def curves_of(columns: Mapping[str, Any]) -> Curves | None:
    """Return the curves of a table: transmission error over the angle, or motion over speed; None of any other one.

    They are named by load and part.
    """
    if "ste_um" in columns and "phi_rad" in columns:
        found = _by_name(columns, np.degrees(_numbers(columns["phi_rad"])), {"": columns["ste_um"]})
        return Curves("angle of the first gear [deg]", TABLE["ste_um"].head, found, periodic=True)
    if "dte_rms_um" in columns:
        found = _by_name(columns, _numbers(columns["mesh_frequency_Hz"]), {"": columns["dte_rms_um"]})
        return Curves("mesh frequency [Hz]", "dynamic transmission error, rms [µm]", found)
    forces = {key.removesuffix(FORCES): columns[key] for key in columns if key.endswith(FORCES)}
    if forces and "load" in columns and "speed_rpm" in columns:
        found = _by_name(columns, _numbers(columns["speed_rpm"]), forces)
        return Curves("speed [rpm]", "dynamic force, rms [N]", found)
    return None


def _numbers(values: Any) -> FloatArray:
    """Return a column as numbers; what is not known is NaN."""
    return np.array([np.nan if value is None or value == "" else float(value) for value in values])


def _by_name(
    columns: Mapping[str, Any], x: FloatArray, every: Mapping[str, Any]
) -> dict[tuple[str, str], tuple[FloatArray, FloatArray]]:
    count = len(x)
    loads = columns.get("load", [f"{float(torque):g} N m" for torque in columns.get(LOAD, [])] or [""] * count)
    kinds = [str(kind).replace("_", " ") for kind in columns.get("curve", [""] * count)]  # run_up
    parts = [", ".join(filter(None, of)) for of in zip(
        columns.get("part", [""] * count), kinds, strict=True)]  # fmt: skip
    names = list(zip(map(str, loads), parts, strict=True))
    found = dict[tuple[str, str], tuple[FloatArray, FloatArray]]()
    for words, values in every.items():
        y = _numbers(values)
        for name in dict.fromkeys(names):
            rows = [row for row, own in enumerate(names) if own == name]
            found[name[0], ", ".join(filter(None, (name[1], words)))] = x[rows], y[rows]
    return found


def joined(tables: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Return the columns that hold the curves of several results as those of one, each by its name."""
    keys = [key for key in (*NAMES[:2], LOAD, "phi_rad", "ste_um") if all(key in one for one in tables.values())]
    found: dict[str, Any] = {key: np.concatenate([one[key] for one in tables.values()]) for key in keys}
    return found | {"curve": [name for name, one in tables.items() for _ in one["phi_rad"]]}


def plot_curves(axes: Axes, shown: Curves, label: str = "", **style: Any) -> None:
    """Draw all curves into axes with their names and a label; `style` goes to `matplotlib.axes.Axes.plot`."""
    for (load, part), (x, y) in shown.curves.items():
        words = ", ".join(filter(None, (part, load, label if label else "")))
        axes.plot(x, y, label=legend_label(words), **style)
    axes.set(xlabel=shown.x_words, ylabel=shown.y_words)
    if len(shown.curves) > 1 or label or style:
        axes.legend()


def plot_beside(axes: Panel, pairs: Sequence[tuple[str, tuple[str, str], Any, Any]]) -> None:
    """Draw two curves of each load, solid and dashed in one colour.

    Parameters
    ----------
    pairs : sequence of (str, (str, str), curve, curve)
        Load, names and coordinates of both.
    """
    for number, (load, names, *both) in enumerate(pairs):
        colour = COLOURS[number % len(COLOURS)]
        for name, (x, y), dashes in zip(names, both, ("-", "--"), strict=True):
            axes.plot(x, y, dashes, color=colour, label=f"{name}, {load}" if load and len(pairs) > 1 else name)


class Drawn(Tabular):
    """A result with curves or points, which are drawn into axes of the caller too."""

    def plot(self, ax: Axes | None = None, **style: Any) -> Axes:
        """Draw the result: transmission error over the angle, motion over the speed, designs by two of their figures.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            To draw into; those of a new figure by default.
        **style
            Of `matplotlib.axes.Axes.plot`, such as ``ls="--"``; ``label`` stands behind the name of each curve.

        Returns
        -------
        matplotlib.axes.Axes
            ``.figure`` is a notebook's picture.

        Raises
        ------
        ValueError
            Of a result without curves.
        """
        return self._plotted(ax, lambda axes: self._draw(axes, style))

    def _plotted(self, ax: Axes | None, draw: Callable[[Axes], None]) -> Axes:
        """Draw into axes of the caller, or into those of a new figure."""
        if ax is not None:
            draw(ax)
            return ax
        with plot_style():
            own: Axes = new_figure().subplots()
            draw(own)
        return own

    def _draw(self, axes: Axes, style: Mapping[str, Any]) -> None:
        curves = curves_of(self._drawn())
        if curves is None:
            raise ValueError(f"{self!r}: has no curves")
        plot_curves(axes, curves, **style)

    def _drawn(self) -> Mapping[str, Any]:
        """Columns that hold the curves."""
        return self.columns()
