"""Picture of rolling bearings: the load of each element around the axis, row by row."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pmor.body.bearing_readings import rolling_bearings
from pmor.report.page import Picture
from pmor.report.style import COLOURS, legend_label, panels
from pmor.report.table import format_cell

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ACROSS, MOST = 4, 16
# Of the pitch of the elements.
BAR = 0.8


def element_pictures(load: Mapping[str, Any], when: str) -> dict[str, list[Picture]]:
    """Return the picture of the rolling bearings by inner geometry that carry under a load, by theme, or nothing."""
    rows = [(bearing, row) for bearing in rolling_bearings(dict(load)) for row in bearing["rows"]
            if any(row["element_force_N"])]  # fmt: skip
    if not rows:
        return {}
    left = f" {len(rows) - MOST} further rows are left out." * (len(rows) > MOST)
    if any(bearing["turn_positions"] > 1 for bearing, _ in rows):
        left = f" Each bearing where an element of it carries most in a turn of the carrier.{left}"
    words = (
        f"Forces of the rolling elements of each row {when}, N, where they stand: 0° is y, 90° z; of planets outwards, "
        f"and counter-clockwise.{left}"
    )
    return {"Shafts and bearings": [Picture("bearings.png", words, element_figure(rows[:MOST]), "svg")]}


def element_figure(rows: Sequence[tuple[Mapping[str, Any], Mapping[str, Any]]]) -> Figure:
    """Draw the forces of the elements of rows of bearings as bars around their axes."""
    across = min(ACROSS, len(rows))
    down = -(-len(rows) // across)
    with panels(across, 2.4 * across, 2.7 * down, rows=down, subplot_kw={"projection": "polar"}) as (figure, each):
        for number, (axes, (bearing, row)) in enumerate(zip(each, rows, strict=False)):
            force = np.array(row["element_force_N"])
            width = BAR * 2.0 * np.pi / len(force)
            axes.bar(np.radians(row["element_azimuth_deg"]), force, width, color=COLOURS[number % len(COLOURS)])
            name = legend_label(bearing["name"])
            place = bearing["rows"].index(row) + 1
            axes.set_title(f"{name}, row {place}" if len(bearing["rows"]) > 1 else name, fontsize=9)
            axes.set_xticks(np.radians([0, 90, 180, 270]), ["0°", "90°", "180°", "270°"], fontsize=7)
            top = float(force.max())
            axes.set_ylim(0.0, top)
            axes.tick_params(axis="y", labelsize=6)
            axes.set_yticks([0.5 * top, top], ["", format_cell(float(f"{top:.3g}"))])
        for axes in each[len(rows) :]:
            axes.remove()
    return figure
