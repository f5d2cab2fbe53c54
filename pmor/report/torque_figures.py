"""Pictures over the torque: Harris map, and the orders of the mesh as a waterfall."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.report.flank_figures import fill_in_space
from pmor.report.panels import panels
from pmor.report.style import COLOURS
from pmor.report.sweep_figures import UNLOADED, angle_axes, periodic
from pmor.results.sweep import SteSweep, mesh_orders, peak_to_peak_um

if TYPE_CHECKING:
    from matplotlib.figure import Figure

N_ORDERS = 10
# Rows of the waterfall that its axis names.
MOST_NAMED = 6
COLOUR_MAP = "viridis"


def harris_figure(sweep: SteSweep, nominal_Nm: float | None = None) -> Figure:
    """Harris map: transmission error over the angle, a curve for each torque, and its peak-to-peak over torque."""
    from matplotlib import colormaps

    with panels(2, 9.6, 4.4, width_ratios=(3, 2)) as (figure, (curves, spans)):
        torque, span = sweep.torque_Nm, peak_to_peak_um(sweep)
        colours = colormaps[COLOUR_MAP](np.linspace(0.0, 0.92, len(torque)))
        for colour, ste in zip(colours, sweep.ste_um, strict=True):
            curves.plot(*periodic(sweep, ste), color=colour, lw=1.2)
        _name_curves(curves, math.degrees(sweep.phi_rad[0] + sweep.span_rad), torque, sweep.ste_um[:, 0])
        if sweep.unloaded_um is not None:
            unloaded = sweep.unloaded_um[0]
            curves.plot(*periodic(sweep, unloaded), label="no load, rigid", **UNLOADED)
            curves.legend(loc="best")
            torque, span = np.insert(torque, 0, 0.0), np.insert(span, 0, np.ptp(unloaded))
        angle_axes(curves, sweep)
        curves.set_ylabel("Static transmission error [µm]")
        spans.plot(torque, span, "o-", ms=4, color=COLOURS[0])
        if nominal_Nm is not None:
            spans.axvline(nominal_Nm, color="#555555", lw=1.0, ls=":")
            spans.annotate(
                "nominal", (nominal_Nm, 0.0), xycoords=("data", "axes fraction"), xytext=(-4, 4),
                textcoords="offset points", ha="right", va="bottom", rotation=90, fontsize=9, color="#555555",
            )  # fmt: skip
        spans.set(xlim=(0.0, 1.05 * float(torque[-1])), ylim=(0.0, 1.1 * float(np.nanmax(span))),
                  xlabel="Pinion torque [N m]", ylabel="Peak-to-peak STE [µm]")  # fmt: skip
    return figure


def _name_curves(axes: Any, end: float, torque: FloatArray, at_end: FloatArray) -> None:
    """Write torques beside the right ends of curves, as many as do not overlap."""
    low, high = axes.get_ylim()
    last = -np.inf
    for value, ste in zip(torque, at_end, strict=True):
        if np.isfinite(ste) and ste - last > 0.05 * (high - low):
            axes.annotate(
                f"{value:g} N m", (end, ste), xytext=(3, 0), textcoords="offset points", va="center", fontsize=8,
                annotation_clip=False,
            )  # fmt: skip
            last = ste


def waterfall_figure(sweep: SteSweep) -> Figure:
    """Amplitudes of the orders of the mesh, a row of bars for each torque."""
    from matplotlib import colormaps

    with panels(1, 7.0, 5.0, subplot_kw={"projection": "3d"}) as (figure, (axes,)):
        amplitude = np.array([mesh_orders(sweep, d, N_ORDERS) for d in range(len(sweep.torque_Nm))])
        orders = np.flatnonzero(np.isfinite(amplitude).any(axis=0)) + 1
        place = np.arange(len(sweep.torque_Nm))
        colours = colormaps[COLOUR_MAP](np.linspace(0.0, 0.92, len(place)))
        for row in place[::-1]:  # the rear ones first
            height = np.nan_to_num(amplitude[row, orders - 1])
            axes.bar(orders, height, zs=row, zdir="y", width=0.55, color=colours[row], alpha=0.9)
        axes.set_xticks(orders)
        named = place[:: 1 + len(place) // MOST_NAMED]
        axes.set_yticks(named, [f"{torque:g}" for torque in sweep.torque_Nm[named]])
        axes.set(xlabel="Order of the mesh frequency [-]", ylabel="Pinion torque [N m]",
                 zlabel="STE amplitude, zero to peak [µm]")  # fmt: skip
        fill_in_space(figure, axes)
    return figure
