"""Pictures of several reduced models of a pair: their curves over the angle, their error against run time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from pmor.report.page import Picture
from pmor.report.panels import log_ticks, panels
from pmor.report.style import COLOURS
from pmor.report.summary import ms_per_position
from pmor.report.sweep_figures import MOST_PANELS, angle_axes, curve_of, few_torques, say_which
from pmor.results.sweep import SteSweep
from pmor_online.compare import Comparison
from pmor_online.run import OnlineResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: names of the pictures
MODEL_PICTURES = ("models", "error_time")
#: sweep and comparison of each model, by its name
Compared = Mapping[str, tuple[SteSweep, Comparison]]
LINES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)))
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
        Picture("models.png", curves, _curves(models, result.sweep, result.case.torque_Nm)),
        Picture("error_time.png", errors, _error_over_time(models)),
    ]


def _curves(models: Compared, sweep: SteSweep, nominal_Nm: float) -> Figure:
    shown = few_torques(sweep, MOST_PANELS, nominal_Nm)
    count = len(shown.torque_Nm)
    with panels(1, 7.6, 1.4 + 2.3 * count, rows=count, sharex=True) as (figure, rows):
        for panel, torque in zip(rows, shown.torque_Nm.tolist(), strict=True):
            for i, (name, (swept, comparison)) in enumerate(models.items()):
                full = comparison.full
                phi, ste, _ = curve_of([swept], torque)
                panel.plot(np.degrees(phi), ste, color=COLOURS[i], ls=LINES[i], label=name)
                for there in full.ste_um[full.torque_Nm == torque]:
                    panel.plot(np.degrees(full.phi_rad), there, MARKERS[i], ms=5, mfc="none", mec=COLOURS[i], mew=0.9)
            panel.set_ylabel(f"STE at {torque:g} N m [µm]")
        angle_axes(rows[-1], shown, top=rows[0])
        _legend(figure, rows[0])
        say_which(figure, shown.torque_Nm, len(sweep.torque_Nm))
    return figure


def _error_over_time(models: Compared) -> Figure:
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
        axes.margins(x=0.1)
        axes.set_ylim(floor, top)
        for axis in (axes.xaxis, axes.yaxis):
            log_ticks(axis)
        _legend(figure, axes)
    return figure


def _legend(figure: Figure, axes: Axes) -> None:
    axes.plot([], [], "o", ms=6, mfc="none", mec="#555555", label="full FE")
    figure.legend(*axes.get_legend_handles_labels(), loc="outside right upper", title="Model")
