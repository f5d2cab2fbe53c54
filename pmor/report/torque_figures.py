"""Picture over the torque: Harris map, peak-to-peak and first orders of the mesh."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.report.panels import panels
from pmor.report.style import COLOURS
from pmor.report.sweep_figures import UNLOADED, angle_axes, periodic, spread
from pmor.results.sweep import SteSweep, mesh_orders, peak_to_peak_um

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Orders of the mesh that are drawn over the torque.
N_ORDERS = 3
# Most curves that a legend names where they do not lie above each other.
MOST_NAMED = 6
COLOUR_MAP = "viridis"
ORDER_LINES = ("-", "--", ":")


def harris_figure(
    sweep: SteSweep, nominal_Nm: float | None = None, case: SteSweep | None = None, about_mean: bool = False
) -> Figure:
    """Harris map: transmission error over the angle, a curve for each torque; over torque, its peak-to-peak and orders.

    Parameters
    ----------
    sweep : SteSweep
    nominal_Nm : float, optional
        Torque that is marked.
    case : SteSweep, optional
        At the torques of the case, whose peak-to-peak is marked too.
    about_mean : bool
        Draw each curve about its mean.
    """
    from matplotlib import colormaps

    with panels(2, 9.6, 4.4, width_ratios=(3, 2)) as (figure, (curves, spans)):
        torque, span = sweep.torque_Nm, peak_to_peak_um(sweep)
        colours = colormaps[COLOUR_MAP](np.linspace(0.0, 0.92, len(torque)))
        named = spread(len(torque), MOST_NAMED)
        for place, (colour, ste) in enumerate(zip(colours, sweep.ste_um, strict=True)):
            name = f"{torque[place]:g} N m" if about_mean and place in named else ""
            curves.plot(
                *periodic(sweep, ste - (np.nanmean(ste) if about_mean else 0.0)), color=colour, lw=1.2, label=name
            )
        if not about_mean:
            _name_curves(curves, math.degrees(sweep.phi_rad[0] + sweep.span_rad), torque, sweep.ste_um[:, 0])
        spans.plot(torque, span, "o-", ms=4, color=COLOURS[0], label="peak-to-peak")
        orders = np.array([mesh_orders(sweep, d, N_ORDERS) for d in range(len(torque))])
        for k, amplitude in enumerate(orders.T):
            spans.plot(torque, amplitude, lw=1.2, ls=ORDER_LINES[k], color=COLOURS[1], label=f"order {k + 1}")
        if case is not None:
            spans.plot(
                case.torque_Nm, peak_to_peak_um(case), "o", ms=9, mfc="none", mec=COLOURS[0], label="of the case"
            )
        if sweep.unloaded_um is not None:
            unloaded = sweep.unloaded_um[0]
            shown = unloaded - (unloaded.mean() if about_mean else 0.0)
            curves.plot(*periodic(sweep, shown), label="no load, rigid", **UNLOADED)
            spans.plot([0.0, torque[0]], [np.ptp(unloaded), span[0]], color=COLOURS[0], ls=":")
            span = np.append(span, np.ptp(unloaded))
        if curves.get_legend_handles_labels()[0]:
            curves.legend(loc="best", fontsize=8)
        spans.legend(loc="best", fontsize=8)
        angle_axes(curves, sweep)
        curves.set_ylabel("STE about its mean [µm]" if about_mean else "Static transmission error [µm]")
        if nominal_Nm is not None:
            spans.axvline(nominal_Nm, color="#555555", lw=1.0, ls=":")
            spans.annotate(
                "nominal", (nominal_Nm, 0.0), xycoords=("data", "axes fraction"), xytext=(-4, 4),
                textcoords="offset points", ha="right", va="bottom", rotation=90, fontsize=9, color="#555555",
            )  # fmt: skip
        most = float(torque[-1])
        if case is not None:
            most, span = max(most, float(case.torque_Nm.max())), np.append(span, peak_to_peak_um(case))
        spans.set(xlim=(0.0, 1.05 * most), ylim=(0.0, 1.1 * float(np.nanmax(span))),
                  xlabel="Pinion torque [N m]", ylabel="STE, peak-to-peak and orders [µm]")  # fmt: skip
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
