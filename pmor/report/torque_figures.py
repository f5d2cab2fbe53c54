"""Pictures over the torque (Harris map, peak-to-peak, orders), and over a revolution of gears whose teeth differ."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.pair.samples import Samples
from pmor.report.chart import COLOURS, Chart, Panel, colours_between, panels, plot_share_below
from pmor.report.sweep_figures import UNLOADED, angle_axes, periodic, spread
from pmor.results.quantities import TABLE
from pmor.results.shaft_orders import ShaftOrder, shaft_orders
from pmor.results.sweep import SteSweep, mesh_orders, orders_of, peak_to_peak_um

# Orders of the mesh that are drawn over the torque.
N_ORDERS = 3
# Most curves that a legend names where they do not lie above each other.
MOST_NAMED = 6
ORDER_LINES = ("-", "--", ":")


def harris_figure(
    sweep: SteSweep, nominal_Nm: float | None = None, case: SteSweep | None = None, about_mean: bool = False
) -> Chart:
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
    with panels(2, 9.6, 4.4) as (figure, (curves, spans)):
        torque, span = sweep.torque_Nm, peak_to_peak_um(sweep)
        colours = colours_between(len(torque))
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
        angle_axes(curves, sweep)
        curves.set(ylabel="STE about its mean [µm]" if about_mean else "Static transmission error [µm]")
        if nominal_Nm is not None:
            spans.axvline(nominal_Nm, color="#555555", lw=1.0, ls=":")
            spans.text(nominal_Nm, 0.0, "nominal", turned=True, dx=-4.0, va="bottom", color="#555555")
        most = float(torque[-1])
        if case is not None:
            most, span = max(most, float(case.torque_Nm.max())), np.append(span, peak_to_peak_um(case))
        spans.set(xlim=(0.0, 1.05 * most), ylim=(0.0, 1.1 * float(np.nanmax(span))),
                  xlabel="Pinion torque [N m]", ylabel="STE, peak-to-peak and orders [µm]")  # fmt: skip
    return figure


def _name_curves(axes: Panel, end: float, torque: FloatArray, at_end: FloatArray) -> None:
    """Write torques beside the right ends of curves, as many as do not overlap."""
    low, high = axes.limits("y")
    last = -np.inf
    for value, ste in zip(torque, at_end, strict=True):
        if np.isfinite(ste) and ste - last > 0.05 * (high - low):
            axes.text(end, ste, f"{value:g} N m", outside=True)
            last = ste


# Orders of the mesh that pictures reach to, decades of amplitudes below the largest, sidebands that are named,
# and orders of a spectrum.
LAST_MESH_ORDER, DECADES, NAMED, MOST_DRAWN = 3.5, 4, 6, 1000
MESH, SIDE = COLOURS[0], COLOURS[1]
# Least torques of a waterfall.
LEAST_TORQUES = 3


def revolution_figure(sweep: SteSweep, torque_index: int, teeth: tuple[int, int], holes: tuple[int, int]) -> Chart:
    """Draw STE, mean and extremes of each mesh cycle over the pitches, and below it the spectrum over shaft orders."""
    with panels(1, 8.6, 6.6, rows=2) as (figure, (curve, spectrum)):
        _over_the_pitches(curve, sweep, torque_index)
        _spectrum(spectrum, sweep, shaft_orders(sweep, torque_index, teeth, holes, MOST_DRAWN), _slow_gear(holes))
    return figure


def waterfall_figure(sweep: SteSweep, teeth: tuple[int, int], holes: tuple[int, int]) -> Chart | None:
    """Draw the orders over the torque, a spectrum each, one behind the other; None of few torques."""
    rows = [row for row in np.argsort(sweep.torque_Nm) if np.isfinite(sweep.ste_um[row]).all()]
    if len(rows) < LEAST_TORQUES:
        return None
    place = _slow_gear(holes)
    amplitudes = np.stack([orders_of(sweep, int(row)).amplitude for row in rows])
    kept = np.arange(1, amplitudes.shape[1] + 1) <= LAST_MESH_ORDER * sweep.pitches
    order = np.arange(1, amplitudes.shape[1] + 1)[kept] * teeth[place] / sweep.pitches
    amplitudes, torque = amplitudes[:, kept], sweep.torque_Nm[rows]
    floor = amplitudes.max() * 10.0**-DECADES
    levels = np.log10(np.maximum(amplitudes, floor) / floor) / DECADES
    step = float(np.diff(torque).min())
    with panels(1, 8.6, 4.8) as (figure, (axes,)):
        of_mesh = np.arange(1, amplitudes.shape[1] + 1) % sweep.pitches == 0
        for level, base in list(zip(levels, torque, strict=True))[::-1]:
            top = base + 0.85 * step * level
            for places, colour in ((~of_mesh, SIDE), (of_mesh, MESH)):
                seen = places & (level > 0.0)
                axes.vlines(order[seen], base, top[seen], color=colour, lw=1.6)
            axes.axhline(base, color="#999999", lw=0.6)
        for colour, name in ((MESH, "orders of the mesh"), (SIDE, "others, sidebands")):
            axes.plot([], [], color=colour, label=name)
        axes.set(xlabel=f"Order of the {('pinion', 'wheel')[place]} shaft [-]", ylabel="Pinion torque [N m]",
                 xlim=(0.0, LAST_MESH_ORDER * teeth[place]), yticks=torque)  # fmt: skip
        axes.set(grid=False)
    return figure


def _over_the_pitches(axes: Panel, sweep: SteSweep, row: int) -> None:
    ste = sweep.ste_um[row]
    axes.plot(*periodic(sweep, ste), color=MESH, lw=0.9, label="STE")
    if len(ste) % sweep.pitches == 0:
        cycles = ste.reshape(sweep.pitches, -1)
        phi = np.degrees(sweep.phi_rad).reshape(sweep.pitches, -1).mean(axis=1)
        named = ("mean of each mesh cycle", SIDE, "-", 1.8), ("largest and smallest of each", "#555555", "--", 1.0)
        for values, (name, colour, line, width) in zip(
            (cycles.mean(axis=1), cycles.max(axis=1), cycles.min(axis=1)), (*named, ("", *named[1][1:])), strict=True
        ):
            axes.plot(phi, values, line, color=colour, lw=width, label=name)
    axes.set(ylabel=f"STE at {sweep.torque_Nm[row]:g} N m [µm]")
    angle_axes(axes, sweep)


def _spectrum(axes: Panel, sweep: SteSweep, listed: Sequence[ShaftOrder], place: int) -> None:
    shown = [entry for entry in listed if entry.mesh_order <= LAST_MESH_ORDER]
    top = max((entry.amplitude_um for entry in shown), default=1.0)
    floor = top * 10.0**-DECADES
    for of_mesh, colour, name in ((False, SIDE, "others, sidebands"), (True, MESH, "orders of the mesh")):
        ones = [entry for entry in shown if entry.of_mesh is of_mesh and entry.amplitude_um > floor]
        orders = [(entry.pinion_order, entry.wheel_order)[place] for entry in ones]
        axes.vlines(orders, floor, [entry.amplitude_um for entry in ones], color=colour, lw=2.0, label=name)
    sides = [entry for entry in shown if not entry.of_mesh and entry.amplitude_um > floor][:NAMED]
    for entry in sides:
        order = (entry.pinion_order, entry.wheel_order)[place]
        axes.text(order, entry.amplitude_um, f"{order:.6g}", ha="center", va="bottom", color=SIDE)
    axes.set(yscale="log", ylim=(floor, 3.0 * top), xlabel=f"Order of the {('pinion', 'wheel')[place]} shaft [-]",
             ylabel="STE amplitude, zero to peak [µm]")  # fmt: skip
    axes.set_xlim(left=0.0)
    axes.set(rows_only=True)


def _slow_gear(holes: tuple[int, int]) -> int:
    """Gear whose shaft orders count: the wheel where that has holes."""
    return 1 if holes[1] else 0


def tolerance_figure(samples: Samples, shown_Nm: Sequence[float] | FloatArray) -> Chart:
    """Share of the machines within tolerances that stay below each figure, a curve for each torque."""
    known = {key: values for key, values in samples.figures.items() if np.isfinite(values).any()}
    with panels(len(known), 3.0 + 3.1 * len(known), 4.2) as (figure, all_axes):
        for axes, (key, values) in zip(all_axes, known.items(), strict=True):
            for number, torque in enumerate(shown_Nm):
                plot_share_below(axes, values[:, number], COLOURS[number % len(COLOURS)], f"{torque:g} N m")
            axes.set(xlabel=TABLE[key].head, ylabel=f"{samples.made.capitalize()} that stay below [%]",
                     ylim=(0.0, 100.0))  # fmt: skip
    return figure
