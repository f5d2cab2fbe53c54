"""Pictures of a sweep: transmission error, load sharing, spectrum, error of the reduced model."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from pmor.arrays import FloatArray
from pmor.report.style import COLOURS, new_figure, plot_style
from pmor.results.sweep import SteSweep, mesh_orders

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHARE_COLOURS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#000000")
N_MESH_ORDERS = 10


def ste_figure(reduced: SteSweep, full: SteSweep | None = None) -> Figure:
    """STE over one pitch, a curve per torque; the full model (any angles, some of the torques) as markers."""
    with plot_style():
        figure = new_figure(7.6, 4.4)
        axes = figure.add_subplot()
        colours = _torque_colours(reduced.torque_Nm, full.torque_Nm if full is not None else ())
        for torque, ste in zip(reduced.torque_Nm, reduced.ste_um, strict=True):
            phi, closed = _close_pitch(reduced, ste)
            axes.plot(np.degrees(phi), closed, color=colours[float(torque)], label=f"{torque:g} N m")
        if reduced.ste_error_um is not None:
            _error_band(axes, reduced, colours)
        if full is not None:
            for torque, ste in zip(full.torque_Nm, full.ste_um, strict=True):
                colour = colours[float(torque)]
                axes.plot(np.degrees(full.phi_rad), ste, "o", ms=4, mfc="white", mec=colour, mew=1.1)
        axes.set_ylabel("Static transmission error [µm]")
        _angle_axes(axes, reduced)
        _ste_legend(axes, colours, full is not None)
        missing = int(np.count_nonzero(~np.isfinite(reduced.ste_um)))
        if missing:
            axes.set_title(f"{missing} of {reduced.ste_um.size} positions did not converge (gaps)", color="#b00020")
    return figure


def load_sharing_figure(sweep: SteSweep) -> Figure:
    """Share of the torque per tooth pair over one pitch, a panel per torque."""
    with plot_style():
        n = len(sweep.torque_Nm)
        figure = new_figure(7.6, 1.2 + 1.9 * n)
        panels = np.atleast_1d(figure.subplots(n, 1, sharex=True))
        # A pair that never touches at any torque would only lengthen the legend.
        ever = np.flatnonzero((np.nan_to_num(sweep.pair_share) > 0).any(axis=(0, 1)))
        for panel, torque, share in zip(panels, sweep.torque_Nm, sweep.pair_share, strict=True):
            for colour, j in enumerate(ever):
                panel.plot(
                    np.degrees(np.append(sweep.phi_rad, sweep.phi_rad[0] + sweep.pitch_rad)),
                    100.0 * _close_share(sweep, share, int(j)),
                    color=SHARE_COLOURS[colour % len(SHARE_COLOURS)],
                    label=f"pair {sweep.pair_index[j]:+d}" if sweep.pair_index[j] else "pair 0",
                )
            panel.set_ylim(-4, 104)
            panel.set_yticks([0, 25, 50, 75, 100])
            panel.set_ylabel("Share of torque [%]")
            panel.set_title(f"{torque:g} N m", loc="left")
        _angle_axes(panels[-1], sweep, top=panels[0])
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside right upper")
    return figure


def spectrum_figure(sweep: SteSweep, n_orders: int = N_MESH_ORDERS) -> Figure:
    """Amplitudes of the orders of the mesh frequency, bars per torque on a logarithmic axis."""
    with plot_style():
        figure = new_figure(7.6, 4.0)
        axes = figure.add_subplot()
        n = len(sweep.torque_Nm)
        orders = np.arange(1, n_orders + 1)
        width = 0.8 / n
        colours = _torque_colours(sweep.torque_Nm)
        amplitudes = np.array([mesh_orders(sweep, i, n_orders) for i in range(n)])
        floor, top = _log_limits(amplitudes)
        for i, torque in enumerate(sweep.torque_Nm):
            place = orders + (i - 0.5 * (n - 1)) * width
            shown = np.where(np.isfinite(amplitudes[i]), np.maximum(amplitudes[i], floor), np.nan)
            axes.bar(place, shown - floor, width, bottom=floor, color=colours[float(torque)], label=f"{torque:g} N m")
        axes.set_yscale("log")
        axes.set_ylim(floor, top)
        axes.set_xticks(orders)
        axes.grid(False, axis="x")
        axes.set_xlabel("Order of the mesh frequency [-]")
        axes.set_ylabel("STE amplitude, zero to peak [µm]")
        if not np.isfinite(amplitudes).any():
            axes.text(0.5, 0.5, "no spectrum: positions are missing", ha="center", transform=axes.transAxes)
        figure.legend(loc="outside right upper", title="Pinion torque")
    return figure


def error_figure(
    phi_rad: ArrayLike, torque_Nm: ArrayLike, relative_error: ArrayLike, estimate: ArrayLike | None = None
) -> Figure:
    """Relative STE error of the reduced against the full model, and what the reduced model itself says of it.

    Parameters
    ----------
    phi_rad : (n_angles,)
    torque_Nm : (n_torques,)
    relative_error : (n_torques, n_angles)
        Signed or absolute, as a fraction; shown in per cent of its magnitude. NaN points are left out.
    estimate : (n_torques, n_angles), optional
        The estimated one; hollow squares.
    """
    phi, torques = np.asarray(phi_rad, float), np.atleast_1d(np.asarray(torque_Nm, float))
    percent = 100.0 * np.abs(np.atleast_2d(np.asarray(relative_error, float)))
    with plot_style():
        figure = new_figure(7.6, 3.8)
        axes = figure.add_subplot()
        colours = _torque_colours(torques)
        floor, top = _log_limits(percent, decades=6)
        for torque, row in zip(torques, percent, strict=True):
            # An error of exactly zero (an identity basis) sits on the floor instead of vanishing from the picture.
            shown = np.maximum(row, floor)
            axes.plot(
                np.degrees(phi), shown, "o-", ms=3.5, lw=0.9, color=colours[float(torque)], label=f"{torque:g} N m"
            )
        if estimate is not None:
            for torque, row in zip(torques, 100.0 * np.abs(np.asarray(estimate, float)), strict=True):
                axes.plot(np.degrees(phi), np.maximum(row, floor), "s", ms=6, mfc="none", mec=colours[float(torque)])
            axes.plot([], [], "s", ms=6, mfc="none", mec="black", label="estimated online")
        axes.set_yscale("log")
        axes.set_ylim(floor, top)
        axes.set_xlabel("Pinion roll angle [deg]")
        axes.set_ylabel("|STE reduced / full - 1| [%]")
        figure.legend(loc="outside right upper", title="Pinion torque")
    return figure


def _torque_colours(*torques: ArrayLike) -> dict[float, str]:
    """One colour per distinct torque, in rising order, the same in every figure of a sweep."""
    distinct = sorted({float(t) for group in torques for t in np.atleast_1d(np.asarray(group, float))})
    return {torque: COLOURS[i % len(COLOURS)] for i, torque in enumerate(distinct)}


def _close_pitch(sweep: SteSweep, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Repeat the first position one pitch later: the curve is periodic and should not stop short of the pitch."""
    phi = np.append(sweep.phi_rad, sweep.phi_rad[0] + sweep.pitch_rad)
    return phi, np.append(values, values[0])


def _close_share(sweep: SteSweep, share: FloatArray, j: int) -> FloatArray:
    """Share of pair column j (n_angles + 1,): one pitch on, a pair stands where its successor stood at the start."""
    successor = np.flatnonzero(sweep.pair_index == sweep.pair_index[j] + 1)
    return np.append(share[:, j], share[0, successor[0]] if successor.size else np.nan)


def _angle_axes(axes: Axes, sweep: SteSweep, top: Axes | None = None) -> None:
    """Roll angle in degrees below; the same as fraction of the pitch above."""
    pitch_deg = float(np.degrees(sweep.pitch_rad))
    axes.set_xlabel("Pinion roll angle [deg]")
    start = float(np.degrees(sweep.phi_rad[0]))
    axes.set_xlim(start, start + pitch_deg)
    carrier = axes if top is None else top
    fraction = carrier.secondary_xaxis("top", functions=(_over(pitch_deg), _over(1.0 / pitch_deg)))
    fraction.set_xlabel("Fraction of a pitch [-]")


def _over(divisor: float) -> Callable[[ArrayLike], FloatArray]:
    return lambda x: np.asarray(x, float) / divisor


def _error_band(axes: Axes, sweep: SteSweep, colours: dict[float, str]) -> None:
    """Draw the error bars of a sweep as a band about each curve; of a good basis it is no wider than the line."""
    assert sweep.ste_error_um is not None
    for torque, ste, error in zip(sweep.torque_Nm, sweep.ste_um, np.abs(sweep.ste_error_um), strict=True):
        phi, low = _close_pitch(sweep, ste - error)
        axes.fill_between(
            np.degrees(phi), low, _close_pitch(sweep, ste + error)[1], color=colours[float(torque)], alpha=0.3, lw=0.0
        )


def _ste_legend(axes: Axes, colours: dict[float, str], with_full: bool) -> None:
    """Torques by colour, models by line or marker, outside the curves."""
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], color=c, label=f"{t:g} N m") for t, c in sorted(colours.items(), reverse=True)]
    if with_full:
        handles.append(Line2D([], [], color="#555555", label="reduced"))
        handles.append(Line2D([], [], ls="", marker="o", ms=4, mfc="white", mec="#555555", label="full FE"))
    axes.get_figure().legend(handles=handles, loc="outside right upper", title="Pinion torque")  # type: ignore[union-attr]


def _log_limits(values: FloatArray, decades: int = 5) -> tuple[float, float]:
    """Whole decades around the positive finite values, at most ``decades`` below the largest."""
    positive = values[np.isfinite(values) & (values > 0)]
    if not positive.size:
        return 1e-3, 1.0
    top = 10.0 ** np.ceil(np.log10(positive.max() * 1.05))
    floor = 10.0 ** np.floor(np.log10(positive.min()))
    return float(min(max(floor, top * 10.0**-decades), top / 10.0)), float(top)
