"""Pictures of a run: mesh, pressure on the flanks, root stress, conditions, reduced models beside each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.report.chart import COLOURS, Chart, Field, Panel, panels
from pmor.report.page import Picture
from pmor.report.summary import ms_per_position
from pmor.report.sweep_figures import MOST_PANELS, angle_axes, curve_of, few_torques, periodic, say_which, spread
from pmor.results.root_stress import GEARS, RootStress
from pmor.results.sweep import SteSweep, peak_to_peak_um
from pmor_online.compare import Comparison
from pmor_online.conditions import ConditionSweep
from pmor_online.contact_pattern import ContactPattern
from pmor_online.run import OnlineResult

LOADED_FLANK_COLOUR = "#D55E00"
# Of a curved edge.
CHORDS = 6


def mesh_figure(nodes_xy_mm: FloatArray, quads: IntArray, flank_nodes_xy_mm: FloatArray) -> Chart:
    """Transverse section of one tooth sector, the loaded flank highlighted, with a close-up of flank and fillet.

    Parameters
    ----------
    nodes_xy_mm : (n, 2)
    quads : (m, 4) or (m, 8) int
        Nodes around the elements' section: corners, or corners and the middles of the edges between them in turn.
    flank_nodes_xy_mm : (k, 2)
        Nodes of the loaded flank, in order along the profile.
    """
    with panels(2, 8.2, 5.2) as (figure, (whole, zoom)):
        x, y = flank_nodes_xy_mm.T
        for axes, width in ((whole, 0.35), (zoom, 0.6)):
            _draw_mesh(axes, nodes_xy_mm, quads, width)
            axes.plot(x, y, color=LOADED_FLANK_COLOUR, lw=2.2, label="loaded flank")
            axes.set(aspect="equal", xlabel="x [mm]", ylabel="y [mm]", grid=False)
        whole.set(title=f"One tooth sector: {len(quads)} elements, {len(np.unique(quads))} nodes")
        zoom.plot(x, y, "o", ms=3, color=LOADED_FLANK_COLOUR)
        zoom.set(title="Loaded flank and root fillet")
        low, high = flank_nodes_xy_mm.min(axis=0), flank_nodes_xy_mm.max(axis=0)
        size = 1.5 * float((high - low).max())
        # The fillet lies on the axis' side of the flank, so the window is moved towards the axis.
        middle = 0.5 * (low + high)
        centre = middle - 0.12 * size * middle / np.linalg.norm(middle)
        corner = centre - size / 2
        zoom.set(xlim=(corner[0], corner[0] + size), ylim=(corner[1], corner[1] + size))
        frame = corner + size * np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]])
        whole.plot(frame[:, 0], frame[:, 1], "--", color="#777777", lw=0.8)
    return figure


def _draw_mesh(axes: Panel, nodes: FloatArray, quads: IntArray, line_width: float) -> None:
    axes.polygons(_outlines(nodes[quads]), facecolor="#eef3f7", edgecolor="#44525c", lw=line_width)


def _outlines(around: FloatArray) -> FloatArray:
    """Points around sections of elements, (m, points, 2); edges with a node in their middle are parabolas."""
    if around.shape[1] == 4:
        return around
    start, middle = around[:, ::2, None], around[:, 1::2, None]
    end, t = np.roll(start, -1, axis=1), np.linspace(0.0, 1.0, CHORDS, endpoint=False)[:, None]
    points = (1.0 - t) * (1.0 - 2.0 * t) * start + 4.0 * t * (1.0 - t) * middle + t * (2.0 * t - 1.0) * end
    return np.asarray(points.reshape(len(around), -1, 2))


def contact_pattern_figure(patterns: Sequence[ContactPattern]) -> Chart:
    """Contact pressure on the unrolled flanks, a panel per tooth pair, one scale for all."""
    n = len(patterns)
    if n == 0:
        raise ValueError("no tooth pair to show a contact pattern for")
    with panels(n, 1.6 + 3.0 * n, 4.2) as (figure, columns):
        top = float(np.nanmax([1.0, *(pattern.largest for pattern in patterns)]))
        at_edge = any(pattern.at_edge for pattern in patterns)
        for panel, pattern in zip(columns, patterns, strict=True):
            loaded = np.where(pattern.pressure > 0.0, pattern.pressure, np.nan)
            label = "Contact pressure [MPa]"
            panel.field(
                Field(pattern.width, np.degrees(pattern.roll_angle), loaded, 0.0, top, label, beyond=at_edge)
            )
            title = f"{GEARS[pattern.gear].capitalize()} flank, {100 * pattern.share:.0f} % of torque\n"
            at_most = "a sharp edge carries all" if np.isnan(pattern.largest) else f"largest {pattern.largest:.0f} MPa"
            title += at_most if pattern.pressure.any() else "no contact"
            panel.set(title=title, xlabel="Position over face width [mm]", ylabel="Roll angle [deg] (root to tip)")
        if at_edge:
            figure.note = "Beyond the scale: a sharp tip edge carries, at which the pressure has no bound"
    return figure


LINES = ("-", "--")


def fillet_figure(stress: RootStress, torque: int, nominal_MPa: tuple[float | None, float | None]) -> Chart:
    """Largest stress along the fillets over the mesh cycle and the width, at one torque.

    Parameters
    ----------
    torque : int
        Its place.
    nominal_MPa : two float
        ISO 6336-3, of pinion and wheel; None where it does not hold.
    """
    with panels(2, 7.6, 3.8) as (figure, (tension, compression)):
        for gear, envelope in enumerate(stress.envelope):
            look: dict[str, Any] = {"color": COLOURS[gear], "ls": LINES[gear]}
            pulled = envelope.max_principal_MPa[torque, 0].max(axis=1)
            pressed = envelope.von_mises_MPa[torque, 1].max(axis=1)
            tension.plot(envelope.arc_mm, pulled, label=GEARS[gear], **look)
            compression.plot(envelope.arc_mm, pressed, **look)
            if (nominal := nominal_MPa[gear]) is not None:
                tension.axhline(nominal, color=COLOURS[gear], ls=":", lw=1.0)
        figure.note = "" if nominal_MPa == (None, None) else "Dotted: ISO 6336-3:2019, nominal"
        along = "Along the fillet, from the involute [mm]"
        tension.set(title="Tension side: largest principal stress", xlabel=along,
                    ylabel="Root stress [MPa]")  # fmt: skip
        compression.set(title="Compression side: von Mises stress", xlabel=along, ylabel="Root stress [MPa]")
        for axes in (tension, compression):
            axes.set_ylim(0.0, max(tension.limits("y")[1], compression.limits("y")[1]))
        figure.heading = f"{stress.torque_Nm[torque]:g} N m"
    return figure


def cycle_figure(stress: RootStress, pitch_rad: float, nominal: int) -> Chart:
    """Largest principal stress of a tooth on its loaded side while it rolls through the mesh, a colour per torque.

    Parameters
    ----------
    pitch_rad : float
        Of the pinion.
    nominal : int
        Place of the nominal torque.
    """
    rolls = stress.phi_rad[:, None] + pitch_rad * stress.pair_index
    order = np.argsort(rolls, axis=None)
    torques = spread(len(stress.torque_Nm), MOST_PANELS, nominal)
    with panels(1, 7.6, 4.0) as (figure, (axes,)):
        for colour, torque in zip(COLOURS, torques, strict=False):
            for gear, name in enumerate(GEARS):
                values = stress.max_principal_MPa[torque, :, gear, :, 0].ravel()[order]
                label = f"{name}, {stress.torque_Nm[torque]:g} N m"
                axes.plot(np.degrees(rolls.ravel()[order]), values, color=colour, ls=LINES[gear], label=label)
        axes.set(xlabel="Pinion angle from where the tooth is on the line of centres [deg]",
                 ylabel="Root stress, largest principal [MPa]")  # fmt: skip
        axes.set_ylim(bottom=0.0)
        say_which(figure, stress.torque_Nm[torques], len(stress.torque_Nm))
    return figure


# Letters of a name that a legend has room for.
LONGEST_NAME = 28
# The last colour, black, is that of the case's own condition.
MOST_COLOURED = len(COLOURS) - 1


def conditions_figure(own: SteSweep, nominal: int, conditions: Sequence[ConditionSweep]) -> Chart:
    """Peak-to-peak STE over the torque, and STE over the angle at each one's own torque, a colour per condition.

    Of more conditions than there are colours those with the least peak-to-peak at their own torque are in colour, and
    the others grey.

    Parameters
    ----------
    own : SteSweep
        Of the case's own condition, drawn dashed.
    nominal : int
        Index of its torque.
    """
    with panels(1, 7.6, 6.4, rows=2) as (figure, (over_torque, over_angle)):
        coloured = _least(conditions, MOST_COLOURED)
        # The coloured ones on top of the others.
        for number in sorted(range(len(conditions)), key=coloured.__contains__):
            drawn: dict[str, Any] = {"color": "#bbbbbb", "lw": 0.7}
            if number in coloured:
                drawn = {"color": COLOURS[coloured.index(number)], "label": _label(conditions[number].name)}
            _draw(over_torque, over_angle, conditions[number].sweep, conditions[number].own, drawn)
        _draw(over_torque, over_angle, own, nominal, {"color": "black", "ls": "--", "label": "the case's own"})
        over_torque.set_ylim(bottom=0.0)
        over_torque.set(xlabel="Pinion torque [N m]", ylabel="STE peak-to-peak [µm]")
        over_angle.set(xlabel="Pinion angle [deg]", ylabel="STE at own torque [µm]")
        over_angle.set(tight=True)
        title = "Condition"
        if len(coloured) < len(conditions):
            title += f" (the {len(coloured)} with the least peak-to-peak of {len(conditions)})"
        figure.key_title = title
    return figure


def _draw(over_torque: Panel, over_angle: Panel, sweep: SteSweep, torque: int, drawn: dict[str, Any]) -> None:
    over_torque.plot(sweep.torque_Nm, peak_to_peak_um(sweep), marker="o", ms=3.5, **drawn)
    over_angle.plot(*periodic(sweep, sweep.ste_um[torque]), **drawn)


def _least(conditions: Sequence[ConditionSweep], most: int) -> list[int]:
    """Numbers of at most so many conditions, in their order: those with the least peak-to-peak at their own torque."""
    spans = [float(peak_to_peak_um(condition.sweep)[condition.own]) for condition in conditions]
    return sorted(np.argsort(spans, kind="stable")[:most].tolist())  # NaN comes last


def _label(name: str) -> str:
    return (name if len(name) <= LONGEST_NAME else f"{name[: LONGEST_NAME - 1]}…")


#: names of the pictures
MODEL_PICTURES = ("models", "error_time")
#: sweep and comparison of each model, by its name
Compared = Mapping[str, tuple[SteSweep, Comparison]]
STYLES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)))
MARKERS = "os^Dv"


def model_pictures(result: OnlineResult) -> list[Picture]:
    """Return the pictures of the models that a case compares; none where it compares its own alone."""
    models: Compared = {
        str(model.case.contact.scheme): (model.sweep, model.comparison)
        for model in result.models
        if isinstance(model, OnlineResult) and model.comparison is not None
    }
    if not models:
        return []
    curves = "Static transmission error of all models (lines), each beside full FE of its own contact scheme (markers)."
    errors = (
        "Error of each model against full FE of its own contact scheme over the time for a position: the largest, and "
        "down to the root mean square. Full FE, without error, stands on the lower edge."
    )
    return [
        Picture("models.svg", curves, _curves(models, result.sweep, result.case.torque_Nm)),
        Picture("error_time.svg", errors, _error_over_time(models)),
    ]


def _curves(models: Compared, sweep: SteSweep, nominal_Nm: float) -> Chart:
    shown = few_torques(sweep, MOST_PANELS, nominal_Nm)
    count = len(shown.torque_Nm)
    with panels(1, 7.6, 1.4 + 2.3 * count, rows=count) as (figure, rows):
        for panel, torque in zip(rows, shown.torque_Nm.tolist(), strict=True):
            for i, (name, (swept, comparison)) in enumerate(models.items()):
                full = comparison.full
                phi, ste, _ = curve_of([swept], torque)
                panel.plot(np.degrees(phi), ste, color=COLOURS[i], ls=STYLES[i], label=name)
                for there in full.ste_um[full.torque_Nm == torque]:
                    panel.plot(np.degrees(full.phi_rad), there, MARKERS[i], ms=5, mfc="none", mec=COLOURS[i], mew=0.9)
            panel.set(ylabel=f"STE at {torque:g} N m [µm]")
            angle_axes(panel, shown)
        _legend(figure, rows[0])
        say_which(figure, shown.torque_Nm, len(sweep.torque_Nm))
    return figure


def _error_over_time(models: Compared) -> Chart:
    errors = [100.0 * np.array([c.rms_relative_error, c.max_relative_error]) for _, c in models.values()]
    known = [error for error in np.ravel(errors) if error > 0.0]
    floor, top = 0.1 * min(known, default=1.0), 3.0 * max(known, default=1.0)
    with panels(1, 7.6, 4.2) as (figure, (axes,)):
        for i, ((name, (sweep, comparison)), error) in enumerate(zip(models.items(), errors, strict=True)):
            rms, largest = np.maximum(error, floor)
            time_ms, full_ms = ms_per_position(sweep), ms_per_position(comparison.full)
            axes.plot([time_ms, time_ms], [rms, largest], color=COLOURS[i])
            axes.plot(time_ms, largest, MARKERS[i], ms=8, color=COLOURS[i], label=name)
            axes.plot(full_ms, floor, MARKERS[i], ms=8, mfc="none", mec=COLOURS[i], clip_on=False)
        axes.set(xscale="log", yscale="log", xlabel="Time of a position [ms]", ylabel="Error of the STE [%]")
        axes.set_ylim(floor, top)
        _legend(figure, axes)
    return figure


def _legend(figure: Chart, axes: Panel) -> None:
    axes.plot([], [], "o", ms=6, mfc="none", mec="#555555", label="full FE")
    figure.key_title = "Model"
