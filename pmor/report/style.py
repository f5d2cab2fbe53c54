"""Style of pictures, their axes (panels, logarithmic scales, names of points), and their files.

Pictures are `matplotlib.figure.Figure`s without pyplot, which is slow to import, keeps every figure alive and asks for
a screen. They start from matplotlib's own defaults, so neither a user's matplotlibrc nor MPLBACKEND changes them.
matplotlib itself is imported on first use.
"""

from __future__ import annotations

import base64
import io
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pmor.report.chart import COLOURS
from pmor.storage.atomic import atomic_path

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

# Colours of a PNG's palette.
PALETTE = 256
# Of words that are read on light and on dark pages: its contrast is 4 on either.
MIDDLE = "#78838e"

# Without dates, so that the same results make the same files.
UNDATED: dict[str, dict[str, Any]] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}


@contextmanager
def plot_style() -> Iterator[None]:
    """The one place that decides on fonts, colours and grids."""
    matplotlib = _matplotlib()
    from cycler import cycler

    settings: Any = {
        "font.size": 10,
        "axes.titlesize": 11,
        "axes.labelsize": 10,
        "xtick.labelsize": 9,
        "ytick.labelsize": 9,
        "legend.fontsize": 9,
        "legend.frameon": False,
        "lines.linewidth": 1.6,
        "axes.grid": True,
        "axes.axisbelow": True,
        "grid.color": "#dddddd",
        "grid.linewidth": 0.6,
        "axes.edgecolor": "#555555",
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.prop_cycle": cycler(color=COLOURS),
        "figure.dpi": 110,
        "svg.hashsalt": "pmor",
        "text.parse_math": False,  # users' names may hold dollar signs
    }
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(settings)
        yield


def _matplotlib() -> Any:
    """Import matplotlib, also where MPLBACKEND names a backend that is not installed, as in a child of Jupyter."""
    asked = None if "matplotlib" in sys.modules else os.environ.pop("MPLBACKEND", None)
    import matplotlib

    if asked is not None:
        os.environ["MPLBACKEND"] = asked
        with suppress(ValueError):
            matplotlib.rcParams["backend"] = asked
    return matplotlib


def new_figure(width_in: float = 7.2, height_in: float = 4.2) -> Figure:
    """An empty figure in constrained layout; call inside `plot_style`."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width_in, height_in), layout="constrained")
    # Notebooks ask for it: figures made without pyplot are not shown otherwise.
    figure._repr_png_ = partial(picture_bytes, figure, "png")  # type: ignore[attr-defined]
    return figure


def see_through(figure: Figure) -> None:
    """Take the ground of a figure off, with words that are read on light and on dark pages."""
    from matplotlib.text import Text

    figure.patch.set_alpha(0.0)
    for axes in figure.axes:
        axes.tick_params(colors=MIDDLE)
    for text in figure.findobj(Text):
        text.set_color(MIDDLE)


def legend_label(text: str) -> str:
    """Return a user's text as a label; matplotlib would leave one that begins with an underscore out of the legend."""
    return f" {text}" if text.startswith("_") else text


def write_picture(content: bytes, target: Path) -> None:
    """Write a picture; the target is replaced only when it is complete; OutputError where it cannot be."""
    with atomic_path(target) as temporary:
        temporary.write_bytes(content)


def data_uri(content: bytes, picture_format: str) -> str:
    """Return a picture as a data URI, for a page with nothing beside it."""
    kind = {"svg": "svg+xml"}.get(picture_format, picture_format)
    return f"data:image/{kind};base64,{base64.b64encode(content).decode('ascii')}"


def picture_bytes(figure: Figure, picture_format: str) -> bytes:
    """Draw a figure; return the content of a file of that format."""
    buffer = io.BytesIO()
    with plot_style():  # some settings are read only now
        if (engine := figure.get_layout_engine()) is not None:
            # Once: matplotlib would draw the whole figure for it before each format.
            engine.execute(figure)
            figure.set_layout_engine("none")
        if picture_format != "png":
            figure.savefig(buffer, format=picture_format, metadata=UNDATED[picture_format])
            return buffer.getvalue()
        from matplotlib.backends.backend_agg import FigureCanvasAgg

        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        return _small_png(np.asarray(canvas.buffer_rgba()), figure.dpi)


def _small_png(pixels: Any, dpi: float) -> bytes:
    """Return a picture with a palette, which takes at most a third of the bytes of true colour.

    A palette knows clear and opaque alone: what is in between stands on the colour of the words.
    """
    from PIL import Image  # comes with matplotlib

    share, small = pixels[..., 3:] / 255.0, io.BytesIO()
    clear, options = pixels[..., 3] == 0, dict[str, Any](format="png", dpi=(dpi, dpi))
    ground = np.array([int(MIDDLE[at : at + 2], 16) for at in (1, 3, 5)])
    opaque = np.where(share == 1.0, pixels[..., :3], share * pixels[..., :3] + (1.0 - share) * ground).astype(np.uint8)
    # The other methods drop colours of scales that few pixels have.
    count = PALETTE - int(clear.any())
    found = Image.fromarray(opaque).quantize(count, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    if clear.any():
        colours = (found.getpalette() or [])[: 3 * count]
        place = len(colours) // 3
        found = Image.fromarray(np.where(clear, place, np.asarray(found)).astype(np.uint8))
        found.putpalette([*colours, *ground.tolist()])
        options["transparency"] = place
    found.save(small, **options)
    return small.getvalue()


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
