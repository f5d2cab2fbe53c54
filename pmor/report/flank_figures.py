"""Pictures of the flanks over the mesh cycle: pressure and line load, contact pattern."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.report.chart import COLOURS, Chart, Field, panels
from pmor.results.flank_maps import FlankMap, cell_edges
from pmor.results.root_stress import GEARS

# Colour of a flank map where a sharp edge carries.
NO_BOUND = "#bbbbbb"
NOMINAL_PATTERN, LIGHT_PATTERN = COLOURS[4], COLOURS[0]
# Upper limit of a map's scale over the 80th percentile.
BEYOND_MOST = 1.5
# Places over the face, to which maps are interpolated.
PLACES = 161


def flank_maps_figure(maps: Sequence[FlankMap]) -> Chart:
    """Largest pressure and line load over the mesh cycle, on the flanks of pinion and wheel."""
    with panels(len(maps), 8.4, 7.2, rows=2) as (figure, drawn):
        rows = ("pressure_MPa", "Hertz's pressure [MPa]"), ("load_N_per_mm", "Line load [N/mm]")
        for row, (name, label) in enumerate(rows):
            top, beyond = _scale([getattr(flank, name) for flank in maps])
            for panel, flank in zip(drawn[row * len(maps) :], maps, strict=False):
                panel.field(_field(flank, getattr(flank, name), top, beyond, label))
                panel.set(
                    title=f"{GEARS[flank.gear].capitalize()}, {flank.torque_Nm:g} N m",
                    xlabel="Position over face width [mm]",
                    ylabel="Roll angle [deg]",
                    ylim=np.degrees(flank.roll_rad[[0, -1]]),
                )
        if any(np.isnan(flank.pressure_MPa).any() for flank in maps):
            figure.note = "Grey: a sharp tip edge carries, at which the pressure has no bound"
    return figure


def _scale(values: Sequence[FloatArray]) -> tuple[float, bool]:
    """Return the upper limit of a colour scale, and whether values exceed it, as peaks at an edge may."""
    positive = np.concatenate([map_[map_ > 0.0] for map_ in values])  # not NaN
    if not len(positive):
        return 1.0, False
    most, end = float(positive.max()), BEYOND_MOST * float(np.percentile(positive, 80.0))
    return (most, False) if most <= end else (end, True)


def _field(flank: FlankMap, values: FloatArray, top: float, beyond: bool, label: str) -> Field:
    places = np.linspace(*_ends(flank.z_mm), PLACES)
    shown = np.array([np.interp(places, flank.z_mm, row) for row in values])
    edges = cell_edges(places), np.degrees(cell_edges(flank.roll_rad))
    return Field(*edges, shown, 0.0, top, label, beyond=beyond, missing=NO_BOUND)


def flank_pattern_figure(nominal: Sequence[FlankMap], light: Sequence[FlankMap]) -> Chart:
    """Contact patterns of a mesh cycle under the nominal and under a light torque."""
    with panels(len(nominal), 8.4, 4.2) as (figure, drawn):
        for panel, loaded, unloaded in zip(drawn, nominal, light, strict=True):
            for flank, colour in ((loaded, NOMINAL_PATTERN), (unloaded, LIGHT_PATTERN)):
                panel.polygons(_touched(flank), facecolor=colour, label=f"touched at {flank.torque_Nm:g} N m", lw=0.0)
            shares = [f"{100 * flank.contact_share:.0f} % at {flank.torque_Nm:g} N m" for flank in (loaded, unloaded)]
            panel.set(
                title=f"{GEARS[loaded.gear].capitalize()}: {', '.join(shares)}",
                xlim=_ends(loaded.z_mm),
                xlabel="Position over face width [mm]",
                ylim=np.degrees(loaded.roll_rad[[0, -1]]),
                ylabel="Roll angle [deg] (root to tip)",
            )
    return figure


def _touched(flank: FlankMap) -> FloatArray:
    """Rectangles (n, 4, 2), mm and deg, of what is touched: neighbours over the face are one."""
    x, y = cell_edges(flank.z_mm), np.degrees(cell_edges(flank.roll_rad))
    found = list[list[tuple[float, float]]]()
    for row, touched in enumerate(flank.load_N_per_mm > 0.0):
        change = np.flatnonzero(np.diff(np.concatenate([[0], touched.astype(int), [0]])))
        for first, last in zip(x[change[::2]], x[change[1::2]], strict=True):
            found.append([(first, y[row]), (last, y[row]), (last, y[row + 1]), (first, y[row + 1])])
    return np.array(found).reshape(-1, 4, 2)


def _ends(z: FloatArray) -> tuple[float, float]:
    edges = cell_edges(z)
    return float(edges[0]), float(edges[-1])
