"""Style of pictures, and their files.

Pictures are `matplotlib.figure.Figure`s without pyplot, which is slow to import, keeps every figure alive and asks for
a screen. They start from matplotlib's own defaults, so neither a user's matplotlibrc nor MPLBACKEND changes them.
matplotlib itself is imported on first use.
"""

from __future__ import annotations

import base64
import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pmor.storage.atomic import atomic_path

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Okabe and Ito's colours without yellow, distinguishable for colour-blind readers and in print
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000")

# Colours of a PNG's palette.
PALETTE = 256

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
    """Return a picture with a palette, which takes at most a third of the bytes of true colour."""
    from PIL import Image  # comes with matplotlib

    small = io.BytesIO()
    # The other methods drop colours of scales that few pixels have.
    palette = (
        Image.fromarray(pixels).convert("RGB").quantize(PALETTE, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    )
    palette.save(small, format="png", dpi=(dpi, dpi))
    return small.getvalue()
