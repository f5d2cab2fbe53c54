"""Picture of rolling bearings: the load of each element around the axis, row by row."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from pmor.body.bearing_readings import rolling_bearings
from pmor.core.arrays import FloatArray
from pmor.report.chart import COLOURS, Chart, panels
from pmor.report.page import Picture
from pmor.report.table import format_cell

ACROSS, MOST = 4, 16
# Of the pitch of the elements.
BAR = 0.8
ARC, CIRCLE = 9, np.linspace(0.0, 2.0 * np.pi, 91)


def element_pictures(load: Mapping[str, Any], when: str) -> dict[str, list[Picture]]:
    """Return the picture of the rolling bearings by inner geometry that carry under a load, by theme, or nothing."""
    rows = [
        (bearing, row)
        for bearing in rolling_bearings(dict(load))
        for row in bearing["rows"]
        if any(row["element_force_N"])
    ]
    if not rows:
        return {}
    left = f" {len(rows) - MOST} further rows are left out." * (len(rows) > MOST)
    if any(bearing["turn_positions"] > 1 for bearing, _ in rows):
        left = f" Each bearing where an element of it carries most in a turn of the carrier.{left}"
    words = (
        f"Forces of the rolling elements of each row {when}, N, where they stand: 0° is y, 90° z; of planets outwards, "
        f"and counter-clockwise.{left}"
    )
    return {"Shafts and bearings": [Picture("bearings.svg", words, element_figure(rows[:MOST]))]}


def element_figure(rows: Sequence[tuple[Mapping[str, Any], Mapping[str, Any]]]) -> Chart:
    """Draw the forces of the elements of rows of bearings as bars around their axes; the circle is the largest."""
    across = min(ACROSS, len(rows))
    down = -(-len(rows) // across)
    with panels(across, 2.4 * across, 2.7 * down, rows=down, frame=False, aspect="equal") as (figure, each):
        for number, (axes, (bearing, row)) in enumerate(zip(each, rows, strict=False)):
            force, azimuth = np.array(row["element_force_N"]), np.radians(row["element_azimuth_deg"])
            top, half = float(force.max()), 0.5 * BAR * 2.0 * np.pi / len(force)
            axes.polygons(_wedges(force / top, azimuth, half), facecolor=COLOURS[number % len(COLOURS)])
            for radius in (0.5, 1.0):
                axes.plot(radius * np.cos(CIRCLE), radius * np.sin(CIRCLE), color="#999999", lw=0.8)
            for turn in range(4):
                end = 1.12 * np.array([np.cos(0.5 * np.pi * turn), np.sin(0.5 * np.pi * turn)])
                axes.text(float(end[0]), float(end[1]), f"{90 * turn}°", ha="center", color="#555555")
            place = bearing["rows"].index(row) + 1
            name = f"{bearing['name']}, row {place}" if len(bearing["rows"]) > 1 else bearing["name"]
            axes.set(title=f"{name}: circle {format_cell(float(f'{top:.3g}'))} N", xlim=(-1.3, 1.3), ylim=(-1.2, 1.2))
        for axes in each[len(rows) :]:
            axes.shown = False
    return figure


def _wedges(radius: FloatArray, azimuth: FloatArray, half: float) -> FloatArray:
    """Outlines of bars around an axis, (n, points, 2)."""
    arc = azimuth[:, None] + np.linspace(-half, half, ARC)
    outer = np.stack([radius[:, None] * np.cos(arc), radius[:, None] * np.sin(arc)], axis=-1)
    return np.concatenate([np.zeros((len(radius), 1, 2)), outer], axis=1)
