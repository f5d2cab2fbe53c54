"""Pictures of the flanks over the mesh cycle: pressure and line load, contact pattern, load in space."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.report.style import COLOURS, panels
from pmor.results.flank_maps import FlankMap, cell_edges
from pmor.results.root_stress import GEARS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Colour of a flank map where a sharp edge carries.
NO_BOUND = "#bbbbbb"
NOMINAL_PATTERN, LIGHT_PATTERN = "#a6cee3", COLOURS[0]
# Upper limit of a map's scale over the 80th percentile.
BEYOND_MOST = 1.5
# Grid lines of a surface in space in either direction.
SURFACE_LINES = 60
# Places over the face, to which maps are interpolated.
PLACES = 161


def flank_maps_figure(maps: Sequence[FlankMap]) -> Figure:
    """Largest pressure and line load over the mesh cycle, on the flanks of pinion and wheel."""
    with panels(len(maps), 8.4, 7.2, rows=2) as (figure, drawn):
        grid: Any = np.reshape(np.array(drawn), (2, -1))
        sharp = any(np.isnan(flank.pressure_MPa).any() for flank in maps)
        rows = ("pressure_MPa", "Hertz's pressure [MPa]"), ("load_N_per_mm", "Line load [N/mm]")
        for row, (name, label) in zip(grid, rows, strict=True):
            top, beyond = _scale([getattr(flank, name) for flank in maps])
            for panel, flank in zip(row, maps, strict=True):
                image = _draw(panel, flank, getattr(flank, name), top)
                panel.set_title(f"{GEARS[flank.gear].capitalize()}, {flank.torque_Nm:g} N m")
            figure.colorbar(image, ax=list(row), label=label, shrink=0.95, pad=0.02, extend=beyond)
        for panel in grid[-1]:
            panel.set_xlabel("Position over face width [mm]")
        for panel in grid[:, 0]:
            panel.set_ylabel("Roll angle [deg]")
        if sharp:
            figure.supxlabel("Grey: a sharp tip edge carries, at which the pressure has no bound", fontsize=9)
    return figure


def _scale(values: Sequence[FloatArray]) -> tuple[float, Literal["max", "neither"]]:
    """Return the upper limit of a colour scale, and whether values exceed it, as peaks at an edge may."""
    positive = np.concatenate([map_[map_ > 0.0] for map_ in values])  # not NaN
    if not len(positive):
        return 1.0, "neither"
    most, end = float(positive.max()), BEYOND_MOST * float(np.percentile(positive, 80.0))
    return (most, "neither") if most <= end else (end, "max")


def _draw(panel: Axes, flank: FlankMap, values: FloatArray, top: float) -> Any:
    from matplotlib import colormaps

    places = np.linspace(*_ends(flank.z_mm), PLACES)
    shown = np.ma.masked_invalid([np.interp(places, flank.z_mm, row) for row in values])
    colours = colormaps["viridis"].with_extremes(bad=NO_BOUND)
    image = panel.pcolormesh(
        places, np.degrees(flank.roll_rad), shown, vmin=0.0, vmax=top, cmap=colours, shading="nearest",
        rasterized=True,
    )  # fmt: skip
    panel.set_ylim(*np.degrees(flank.roll_rad[[0, -1]]))
    panel.grid(False)
    return image


def flank_pattern_figure(nominal: Sequence[FlankMap], light: Sequence[FlankMap]) -> Figure:
    """Contact patterns of a mesh cycle under the nominal and under a light torque."""
    from matplotlib.patches import Patch

    with panels(len(nominal), 8.4, 4.2) as (figure, drawn):
        for panel, loaded, unloaded in zip(drawn, nominal, light, strict=True):
            for flank, colour in ((loaded, NOMINAL_PATTERN), (unloaded, LIGHT_PATTERN)):
                _fill(panel, flank, colour)
            shares = [f"{100 * flank.contact_share:.0f} % at {flank.torque_Nm:g} N m" for flank in (loaded, unloaded)]
            panel.set(title=f"{GEARS[loaded.gear].capitalize()}\n{', '.join(shares)}", xlim=_ends(loaded.z_mm),
                      xlabel="Position over face width [mm]", ylim=np.degrees(loaded.roll_rad[[0, -1]]))  # fmt: skip
        drawn[0].set_ylabel("Roll angle [deg]\n(root to tip)")
        handles = [
            Patch(color=NOMINAL_PATTERN, label=f"{nominal[0].torque_Nm:g} N m"),
            Patch(color=LIGHT_PATTERN, label=f"{light[0].torque_Nm:g} N m"),
        ]
        figure.legend(handles=handles, loc="outside right upper", title="Touched at")
    return figure


def _fill(panel: Axes, own: FlankMap, colour: str) -> None:
    from matplotlib.colors import ListedColormap

    panel.pcolormesh(
        cell_edges(own.z_mm), np.degrees(cell_edges(own.roll_rad)), np.ma.masked_equal(own.load_N_per_mm > 0.0, False),
        cmap=ListedColormap([colour]), rasterized=True,
    )  # fmt: skip


def _ends(z: FloatArray) -> tuple[float, float]:
    edges = cell_edges(z)
    return float(edges[0]), float(edges[-1])


def load_distribution_figure(flank: FlankMap) -> Figure:
    """Line load over the flank of a gear in space: largest value at each point over the mesh cycle."""
    with panels(1, 7.0, 5.0, subplot_kw={"projection": "3d"}) as (figure, (axes,)):
        places = np.linspace(*_ends(flank.z_mm), SURFACE_LINES)
        load = np.array([np.interp(places, flank.z_mm, row) for row in flank.load_N_per_mm])
        z, roll = np.meshgrid(places, np.degrees(flank.roll_rad))
        axes.plot_surface(
            z, roll, load, cmap="viridis", vmin=0.0, rcount=SURFACE_LINES, ccount=SURFACE_LINES, lw=0.15,
            edgecolor="#333333", antialiased=True, rasterized=True,
        )  # fmt: skip
        axes.set(xlabel="Face width [mm]", ylabel="Roll angle [deg]", zlabel="Line load [N/mm]")
        axes.set_zlim(bottom=0.0)
        figure.suptitle(f"{GEARS[flank.gear].capitalize()} flank, {flank.torque_Nm:g} N m", fontsize=11)
        fill_in_space(figure, axes)
    return figure


def fill_in_space(figure: Figure, axes: Any) -> None:
    """Enlarge axes in space to their figure; no layout engine of matplotlib does."""
    figure.set_layout_engine("none")
    axes.set_position([-0.02, 0.0, 0.96, 1.0])
    axes.view_init(elev=26.0, azim=-58.0)
    axes.set_box_aspect((1.3, 1.3, 0.85), zoom=0.98)
    axes.xaxis.labelpad = axes.yaxis.labelpad = axes.zaxis.labelpad = 6.0
