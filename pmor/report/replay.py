"""Charts by matplotlib: figures for notebooks and files, and what is drawn into axes that a caller passes in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from pmor.report.chart import VIRIDIS, Chart, Field, Mark, Panel
from pmor.report.style import log_ticks, new_figure, plot_style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Letters of a row of the key.
ROW = 90
SPOKEN = ("title", "xlabel", "ylabel", "xscale", "yscale", "xlim", "ylim", "aspect")


def figure_of(chart: Chart) -> Figure:
    """Return a chart as a figure of matplotlib; `draw_into` takes axes that there are."""
    with plot_style():
        figure = new_figure(*chart.size_in)
        rows = max(1, len(chart.panels) // chart.columns)
        axes = list(np.ravel(figure.subplots(rows, chart.columns, squeeze=False)))
        draw_into(chart, axes)
        handles, labels = _handles(chart)
        if handles:
            longest = max(len(label) for label in labels) + 6
            columns = max(1, min(len(labels), ROW // longest))
            figure.legend(handles, labels, loc="outside lower center", ncols=columns, title=chart.key_title or None)
        if chart.heading:
            figure.suptitle(chart.heading, fontsize=10)
        if chart.note:
            figure.supxlabel(chart.note, fontsize=9)
    return figure


def draw_into(chart: Chart, axes: Sequence[Axes]) -> None:
    """Draw the panels of a chart into axes, one after the other; those left over are made invisible."""
    for place, panel in zip(axes, chart.panels, strict=False):
        place.set_visible(panel.shown)
        if panel.shown:
            _draw(panel, place)


def styled(chart: Chart, style: Mapping[str, Any]) -> Chart:
    """Return a chart whose lines and points have further style by the names of matplotlib."""
    panels = (replace(panel, marks=[replace(mark, style={**mark.style, **style}) for mark in panel.marks])
              for panel in chart.panels)  # fmt: skip
    return replace(chart, panels=list(panels))


def _draw(panel: Panel, axes: Axes) -> None:
    said = panel.said
    for mark in panel.marks:
        _mark(axes, mark)
    own = {name: said[name] for name in SPOKEN if said.get(name) is not None}
    if "title_colour" in said:
        axes.set_title(own.pop("title"), color=said["title_colour"])
    for axis in "xy":
        if (limits := own.get(f"{axis}lim")) is not None:
            own[f"{axis}lim"] = tuple(limits)
    axes.set(**own)
    if said.get("tight"):
        axes.margins(x=0.0)
    for own_axis, scale in ((axes.xaxis, "xscale"), (axes.yaxis, "yscale")):
        if said.get(scale) == "log":
            log_ticks(own_axis)
    for axis in "xy":
        if f"{axis}ticks" in said:
            getattr(axes, f"set_{axis}ticks")(said[f"{axis}ticks"], said.get(f"{axis}ticklabels"))
    if said.get("grid") is False:
        axes.grid(False)
    if said.get("frame") is False:
        axes.axis("off")
    if (second := said.get("second_x")) is not None:
        factor = second[0]
        above = axes.secondary_xaxis(
            "top", functions=(lambda x: np.asarray(x) * factor, lambda x: np.asarray(x) / factor)
        )
        above.set_xlabel(second[1])


def _mark(axes: Axes, mark: Mark) -> Any:
    """Draw one mark; return what a key shows of it."""
    style, arrays = dict(mark.style), list[Any](mark.arrays)
    if mark.kind == "line":
        return axes.plot(*arrays, **style)[0]
    if mark.kind == "area":
        return axes.fill_between(*arrays, **{"lw": 0.0, **style})
    if mark.kind == "polygon":
        return axes.fill(*arrays, **style)[0]
    if mark.kind == "polygons":
        from matplotlib.collections import PolyCollection

        found = PolyCollection(
            list(arrays[0]),
            facecolors=style["facecolor"],
            edgecolors=style.get("edgecolor", "none"),
            linewidths=style.get("lw", 0.8),
            alpha=style.get("alpha"),
        )
        axes.add_collection(found)
        axes.autoscale_view()
        return found
    if mark.kind == "bars":
        width, bottom, lying = style.pop("width"), style.pop("bottom"), style.pop("lying")
        x, height = arrays
        return axes.barh(x, height, width, bottom, **style) if lying else axes.bar(x, height, width, bottom, **style)
    if mark.kind == "segments":
        return axes.vlines(*arrays, **style)
    if mark.kind in ("v", "h"):
        return (axes.axvline if mark.kind == "v" else axes.axhline)(float(arrays[0][0]), **style)
    if mark.kind == "arrows":
        given = {"zorder": 5, **style}
        return axes.quiver(*arrays[0].T, *arrays[1].T, angles="xy", scale_units="xy", scale=1.0, width=0.004, **given)
    if mark.kind == "field":
        return _field(axes, style["field"])
    return _text(axes, mark)


def _field(axes: Axes, field: Field) -> Any:
    from matplotlib.colors import Colormap, LinearSegmentedColormap, LogNorm, Normalize

    colours: Colormap = LinearSegmentedColormap.from_list(
        "viridis", [f"#{word}" for word in VIRIDIS], field.steps or 256
    )
    if field.missing is not None:
        colours = colours.with_extremes(bad=field.missing)
    norm = (LogNorm if field.logarithmic else Normalize)(field.low, field.high)
    values = np.ma.masked_invalid(field.values)
    image = axes.pcolormesh(field.x, field.y, values, norm=norm, cmap=colours, rasterized=True)
    if axes.figure is not None and field.label:
        axes.figure.colorbar(image, ax=axes, label=field.label, extend="max" if field.beyond else "neither")
    return image


def _text(axes: Axes, mark: Mark) -> Any:
    style, (x, y) = mark.style, (float(mark.arrays[0][0]), float(mark.arrays[1][0]))
    look: dict[str, Any] = {
        "fontsize": 8,
        "ha": style.get("ha", "left"),
        "va": style.get("va", "center"),
        "color": style.get("color", "black"),
        "annotation_clip": False,
    }
    if style.get("turned"):
        look["rotation"] = 90
    if (height := style.get("column")) is not None:
        line = {"arrowstyle": "-", "lw": 0.5, "color": "#999999", "shrinkA": 1, "shrinkB": 0, "relpos": (0.0, 0.5)}
        return axes.annotate(
            style["words"], (x, y), (1.04, height), textcoords="axes fraction", arrowprops=line, **look
        )
    where = "axes fraction" if style.get("inside") else "data"
    move = {"left": 3.0, "right": -3.0}.get(look["ha"], 0.0), {"bottom": 2.0, "top": -2.0}.get(look["va"], 0.0)
    return axes.annotate(style["words"], (x, y), move, xycoords=where, textcoords="offset points", **look)


def _handles(chart: Chart) -> tuple[list[Any], list[str]]:
    """Samples and words of the key, drawn into axes that nobody sees."""
    from matplotlib.figure import Figure

    entries = chart.entries()
    unseen = Figure().subplots()
    marks = [Mark(entry.mark.kind, entry.mark.arrays, entry.mark.style) for entry in entries]
    return [_mark(unseen, mark) for mark in marks], [entry.words for entry in entries]
