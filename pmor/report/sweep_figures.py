"""Pictures of a sweep: transmission error, load sharing, stiffness, spectrum, error of the reduced model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pmor.core.arrays import FloatArray, IntArray
from pmor.report.chart import COLOURS, Chart, Panel, colours_between, panels
from pmor.results.sweep import MeshStiffness, SteSweep, mesh_orders

# Tol's muted colours, apart from those of torques; lines differ as well.
SHARE_COLOURS = ("#332288", "#882255", "#999933", "#44AA99", "#661100", "#888888", "#DDCC77")
SHARE_LINES = ("-", "--", "-.", ":")
# Most torques of a picture, and of one with a panel for each.
MOST_TORQUES, MOST_PANELS = 12, 4
N_MESH_ORDERS = 10
# Style of the curve without load.
UNLOADED: dict[str, Any] = {"color": "#555555", "ls": "--", "lw": 1.2}
# Line of the nominal torque.
NOMINAL_WIDTH = 2.6
TORQUE = "Pinion torque"
# Most pitches of a picture with a line for each tooth pair.
MOST_PITCHES = 4
# Most positions over a pitch that are drawn with dots.
MOST_DOTS = 48


def ste_figure(
    reduced: SteSweep, full: SteSweep | None = None, reduced_there: SteSweep | None = None, *,
    nominal_Nm: float | None = None, about_mean: bool = False,
) -> Chart:  # fmt: skip
    """STE over one pitch, a curve per torque, and full FE as markers.

    Parameters
    ----------
    full : SteSweep, optional
        Full FE at any angles and torques.
    reduced_there : SteSweep, optional
        The reduced model at the angles and torques of `full`; the curves go through these positions as well, so that
        the chords of a coarse sweep do not look like an error.
    nominal_Nm : float, optional
        Torque that is always drawn, with a thick line.
    about_mean : bool
        Draw each curve about its mean: that of a helical pair hardly varies beside the differences between torques.
    """
    asked = len(reduced.torque_Nm)
    reduced = few_torques(reduced, MOST_TORQUES, nominal_Nm)
    full, reduced_there = (sweep and few_torques(sweep, MOST_TORQUES) for sweep in (full, reduced_there))
    sweeps = [reduced] if reduced_there is None else [reduced, reduced_there]
    with panels(1, 7.6, 4.4) as (figure, (axes,)):
        colours = torque_colours(*(sweep.torque_Nm for sweep in sweeps), () if full is None else full.torque_Nm)
        means = dict[float, float]()
        for torque, colour in sorted(colours.items(), reverse=True):
            phi, ste, error = curve_of(sweeps, torque)
            means[torque] = float(np.nanmean(ste[1:-1])) if about_mean and np.isfinite(ste[1:-1]).any() else 0.0
            ste = ste - means[torque]
            line = "-" if torque in reduced.torque_Nm else ":"  # compared positions alone
            name = f"{torque:g} N m" + (", nominal" if torque == nominal_Nm else "")
            name += f" ({means[torque]:.4g} µm)" if about_mean else ""
            axes.plot(np.degrees(phi), ste, line, color=colour, marker=_position_marker(phi), label=name,
                      lw=NOMINAL_WIDTH if torque == nominal_Nm else None)  # fmt: skip
            axes.fill_between(np.degrees(phi), ste - error, ste + error, color=colour, alpha=0.3, lw=0.0)
        if full is not None:
            for torque, ste in zip(full.torque_Nm, full.ste_um, strict=True):
                colour = colours[float(torque)]
                axes.plot(
                    np.degrees(full.phi_rad), ste - means[float(torque)], "o", ms=8, mfc="none", mec=colour, mew=1.1
                )
        if reduced.unloaded_um is not None:
            unloaded = reduced.unloaded_um[0]
            axes.plot(*periodic(reduced, unloaded - (unloaded.mean() if about_mean else 0.0)), **UNLOADED)
        axes.set(ylabel="STE about its mean [µm]" if about_mean else "Static transmission error [µm]")
        angle_axes(axes, reduced)
        title = TORQUE + ("\n(mean STE)" if about_mean else "")
        figure.key_title = title
        _name_models(axes, reduced.unloaded_um is not None, full is not None)
        say_which(figure, reduced.torque_Nm, asked)
        missing = int(np.count_nonzero(~np.isfinite(reduced.ste_um)))
        if missing:
            gaps = f"{missing} of {reduced.ste_um.size} positions did not converge (gaps)"
            axes.set(title=gaps, title_colour="#b00020")
    return figure


def load_sharing_figure(sweep: SteSweep, nominal_Nm: float | None = None) -> Chart:
    """Share of the torque per tooth pair over the angle, a panel per torque."""
    asked, sweep = len(sweep.torque_Nm), few_torques(sweep, MOST_PANELS, nominal_Nm)
    n = len(sweep.torque_Nm)
    with panels(1, 7.6, 1.2 + 1.9 * n, rows=n) as (figure, rows):
        # Pairs that never carry are left out of the legend, and those of later pitches of a long sweep.
        shown = sweep.phi_rad < sweep.phi_rad[0] + MOST_PITCHES * sweep.pitch_rad
        ever = np.flatnonzero((np.nan_to_num(sweep.pair_share[:, shown]) > 0).any(axis=(0, 1)))
        for panel, torque, share in zip(rows, sweep.torque_Nm, sweep.pair_share, strict=True):
            for colour, j in enumerate(ever):
                phi, carried = periodic(sweep, share[:, j], _share_at_end(sweep, share, int(j)))
                panel.plot(
                    phi, 100.0 * carried, marker=_position_marker(phi),
                    color=SHARE_COLOURS[colour % len(SHARE_COLOURS)], ls=SHARE_LINES[colour % len(SHARE_LINES)],
                    label=f"pair {sweep.pair_index[j]:+d}" if sweep.pair_index[j] else "pair 0"
                )  # fmt: skip
            panel.set(ylim=(-4, 104), yticks=[0, 25, 50, 75, 100], ylabel=f"Share of {torque:g} N m [%]")
        for panel in rows:
            angle_axes(panel, sweep, most=MOST_PITCHES)
        figure.key_title = "Tooth pair"
        say_which(figure, sweep.torque_Nm, asked)
    return figure


def stiffness_figure(sweep: SteSweep, stiffness: MeshStiffness, nominal_Nm: float | None = None) -> Chart:
    """Mesh stiffness over the cycle, a curve per torque: secant above, tangent below where the sweep knows it."""
    kept = _kept(sweep, MOST_TORQUES, nominal_Nm)
    shown = {"secant": stiffness.secant[kept]}
    if stiffness.tangent is not None and len(stiffness.tangent) == len(sweep.torque_Nm):
        shown["tangent"] = stiffness.tangent[kept]
    colours = torque_colours(sweep.torque_Nm[kept])
    with panels(1, 7.6, 1.2 + 2.6 * len(shown), rows=len(shown)) as (figure, rows):
        for panel, (name, values) in zip(rows, shown.items(), strict=True):
            for torque, curve in zip(sweep.torque_Nm[kept].tolist(), values, strict=True):
                nominal = torque == nominal_Nm
                panel.plot(*periodic(sweep, curve), color=colours[torque], lw=NOMINAL_WIDTH if nominal else None,
                           label=f"{torque:g} N m" + (", nominal" if nominal else ""))  # fmt: skip
            panel.set(ylabel=f"{name.capitalize()} stiffness [N/(mm µm)]")
            angle_axes(panel, sweep)
        figure.key_title = TORQUE
        say_which(figure, sweep.torque_Nm[kept], len(sweep.torque_Nm))
    return figure


def spectrum_figure(sweep: SteSweep, n_orders: int = N_MESH_ORDERS, nominal_Nm: float | None = None) -> Chart:
    """Amplitudes of the orders of the mesh frequency that the sweep resolves, bars per torque on a logarithmic axis."""
    asked, sweep = len(sweep.torque_Nm), few_torques(sweep, MOST_TORQUES, nominal_Nm)
    with panels(1, 7.6, 4.0) as (figure, (axes,)):
        n = len(sweep.torque_Nm)
        amplitudes = np.array([mesh_orders(sweep, i, n_orders) for i in range(n)])
        resolved = np.isfinite(amplitudes).any(axis=0)
        orders = np.arange(1, n_orders + 1)[resolved]
        width = 0.8 / n
        colours = torque_colours(sweep.torque_Nm)
        floor, top = _log_limits(amplitudes)
        for i, torque in enumerate(sweep.torque_Nm):
            shown = np.maximum(amplitudes[i, resolved], floor)  # a torque with gaps stays without bars
            place = orders + (i - 0.5 * (n - 1)) * width
            axes.bar(place, shown - floor, width, bottom=floor, color=colours[float(torque)], label=f"{torque:g} N m")
        _log_axis(axes, floor, top)
        axes.set(xticks=orders, xlabel="Order of the mesh frequency [-]", ylabel="STE amplitude, zero to peak [µm]")
        axes.set(rows_only=True)
        if not resolved.any():
            axes.text(0.5, 0.5, "no spectrum: positions are missing", ha="center", inside=True)
        figure.key_title = TORQUE
        say_which(figure, sweep.torque_Nm, asked)
    return figure


def error_figure(
    phi_rad: ArrayLike, torque_Nm: ArrayLike, relative_error: ArrayLike, estimate: ArrayLike | None = None
) -> Chart:
    """Relative STE error of the reduced against the full model, and its estimate by the reduced model.

    Parameters
    ----------
    phi_rad : (n_angles,)
    torque_Nm : (n_torques,)
    relative_error : (n_torques, n_angles)
        Signed or absolute, as a fraction; shown in per cent of its magnitude. NaN points are left out.
    estimate : (n_torques, n_angles), optional
        Shown as hollow squares.
    """
    phi, torques = np.asarray(phi_rad, float), np.atleast_1d(np.asarray(torque_Nm, float))
    percent = 100.0 * np.abs(np.atleast_2d(np.asarray(relative_error, float)))
    estimated = np.full_like(percent, np.nan) if estimate is None else 100.0 * np.abs(np.asarray(estimate, float))
    asked, kept = len(torques), spread(len(torques), MOST_TORQUES)
    torques, percent, estimated = torques[kept], percent[kept], estimated[kept]
    with panels(1, 7.6, 3.8) as (figure, (axes,)):
        floor, top = _log_limits(percent, estimated, decades=6)
        colours = torque_colours(torques)
        for torque, row, bars in zip(torques.tolist(), percent, estimated, strict=True):
            colour = colours[torque]
            # An error of exactly zero (an identity basis) is shown at the lower end of the axis.
            shown = np.maximum(row, floor)
            axes.plot(np.degrees(phi), shown, "o-", ms=3.5, lw=0.9, color=colour, label=f"{torque:g} N m")
            axes.plot(np.degrees(phi), np.maximum(bars, floor), "s", ms=6, mfc="none", mec=colour)
        if estimate is not None:
            axes.plot([], [], "s", ms=6, mfc="none", mec="black", label="estimated online")
        _log_axis(axes, floor, top)
        axes.set(xlabel="Pinion angle [deg]", ylabel="|STE reduced / full - 1| [%]")
        figure.key_title = TORQUE
        say_which(figure, torques, asked)
    return figure


def few_torques(sweep: SteSweep, most: int, nominal_Nm: float | None = None) -> SteSweep:
    """Return a sweep with at most so many of its torques, spread over all of them, the nominal one among them."""
    return sweep if len(sweep.torque_Nm) <= most else sweep.at_torques(_kept(sweep, most, nominal_Nm))


def _kept(sweep: SteSweep, most: int, nominal_Nm: float | None) -> IntArray:
    nominal = np.flatnonzero(sweep.torque_Nm == nominal_Nm)
    return spread(len(sweep.torque_Nm), most, int(nominal[0]) if len(nominal) else None)


def spread(count: int, most: int, kept: int | None = None) -> IntArray:
    """Indices of at most so many of `count` things: the first, the last, and one that is kept, among them."""
    places = np.linspace(0, count - 1, min(count, most)).round().astype(np.int64)
    if kept is not None and kept not in places:
        places[1 + np.abs(places[1:-1] - kept).argmin()] = kept
    return np.unique(places)


def say_which(figure: Chart, shown: ArrayLike, asked: int) -> None:
    """Write over a figure which torques it shows, where they are not all."""
    torques = np.asarray(shown, float)
    if len(torques) < asked:
        figure.heading = f"{len(torques)} of {asked} torques: {', '.join(f'{t:g}' for t in torques)} N m"


def torque_colours(*torques: ArrayLike) -> dict[float, Any]:
    """One colour per distinct torque, in rising order, the same in every figure of a sweep."""
    distinct = sorted({float(t) for group in torques for t in np.atleast_1d(np.asarray(group, float))})
    if len(distinct) <= len(COLOURS):
        return dict(zip(distinct, COLOURS, strict=False))
    return dict(zip(distinct, colours_between(len(distinct)), strict=True))


def curve_of(sweeps: Sequence[SteSweep], torque: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Angles (rad), STE and error bar (um) of all positions at a torque, continued periodically by one."""
    parts = []
    for sweep in sweeps:
        error = np.zeros_like(sweep.ste_um) if sweep.error_bar_um is None else sweep.error_bar_um
        rows = np.flatnonzero(sweep.torque_Nm == torque)
        parts += [np.stack([sweep.phi_rad, sweep.ste_um[i], error[i]]) for i in rows]
    start, span = sweeps[0].phi_rad[0], max(sweep.span_rad for sweep in sweeps)
    phi, ste, error = np.concatenate(parts, axis=1) if parts else np.empty((3, 0))
    phi = start + (phi - start) % span
    order = np.argsort(phi)
    order = np.concatenate([order[-1:], order, order[:1]])
    phi = phi[order]
    phi[:1] -= span
    phi[-1:] += span
    return phi, ste[order], error[order]


def _position_marker(phi: FloatArray) -> str:
    """Dots at the solved positions of a coarse sweep."""
    return "." if len(phi) <= MOST_DOTS else ""


def periodic(sweep: SteSweep, values: FloatArray, end: float | None = None) -> tuple[FloatArray, FloatArray]:
    """Return pinion angles (deg) and values (n_angles,) up to the end of the pitches, where the first one repeats."""
    phi = np.degrees(np.append(sweep.phi_rad, sweep.phi_rad[0] + sweep.span_rad))
    return phi, np.append(values, values[0] if end is None else end)


def _share_at_end(sweep: SteSweep, share: FloatArray, j: int) -> float:
    """Share of pair column j at the end of the pitches: a pair stands where a successor stood at the start."""
    successor = np.flatnonzero(sweep.pair_index == sweep.pair_index[j] + sweep.pitches)
    return float(share[0, successor[0]]) if successor.size else 0.0


def angle_axes(axes: Panel, sweep: SteSweep, most: int | None = None) -> None:
    """Pinion angle in degrees below; the same as fraction of the pitch above, of so many pitches at most."""
    pitches = sweep.pitches if most is None else min(sweep.pitches, most)
    pitch_deg = float(np.degrees(sweep.pitch_rad))
    start = float(np.degrees(sweep.phi_rad[0]))
    axes.set(xlabel="Pinion angle [deg]", xlim=(start, start + pitches * pitch_deg))
    axes.second_x(1.0 / pitch_deg, "Fraction of a pitch [-]" if pitches == 1 else "Pitches [-]")


def _name_models(axes: Panel, unloaded: bool, with_full: bool) -> None:
    """Name what lines and markers are, behind the torques."""
    nothing: tuple[list[float], list[float]] = ([], [])
    if unloaded:
        axes.plot(*nothing, label="no load, rigid", **UNLOADED)
    if with_full:
        axes.plot(*nothing, color="#555555", label="reduced")
        axes.plot(*nothing, "o", ms=8, mfc="none", mec="#555555", color="#555555", label="full FE")


def _log_axis(axes: Panel, floor: float, top: float) -> None:
    axes.set(yscale="log", ylim=(floor, top))


def _log_limits(*values: FloatArray, decades: int = 5) -> tuple[float, float]:
    """From a little below the smallest positive value, at most ``decades``, to a little above the largest."""
    flat = np.concatenate([array.ravel() for array in values])
    positive = flat[np.isfinite(flat) & (flat > 0)]
    if not positive.size:
        return 1e-3, 1.0
    top = 1.5 * float(positive.max())
    return max(0.6 * float(positive.min()), top * 10.0**-decades), top
