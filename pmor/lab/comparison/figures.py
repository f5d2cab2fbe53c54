"""Pictures of the comparison: error over run time, error over solves, estimate over error."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.lab.comparison.curves import SAMPLINGS, Curves
from pmor.lab.comparison.measure import WANTED_EFFECTIVITY, Row
from pmor.report.chart import COLOURS
from pmor.report.style import log_log, name_points, panels
from pmor.work.states import SMALLEST_ERROR_UM

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SAMPLING_COLOURS = dict(zip((*SAMPLINGS, "grid", "none"), COLOURS, strict=False))
SAMPLING_MARKERS = {"greedy": "o", "sobol": "s", "grid": "^", "none": "D"}
SAMPLING_NAMES = {"greedy": "greedy", "sobol": "Sobol sequence", "grid": "full-factorial grid", "none": "no training"}
# One more than colours, so that no pair of the two comes twice.
MARKERS = "osv^D<>P"
# Errors and estimates of less are drawn here, um.
FLOOR_UM = 1e-6


def run_time_figure(entries: Sequence[Row]) -> Figure:
    """Largest STE error over the time of a position, one named marker per reduction."""
    trained = [entry["ste_error_max_percent"] for entry in entries if entry["solves"]]
    # Static modes are exact: to scale they would squeeze all others into a corner.
    floor = 0.3 * min(trained)
    points = [(entry["online_ms"], max(entry["ste_error_max_percent"], floor), entry) for entry in entries]
    with panels(1, 9.6, 5.2, legend=4) as (figure, (axes,)):
        for sampling, marker in SAMPLING_MARKERS.items():
            own = [(ms, error) for ms, error, entry in points if entry["sampling"] == sampling]
            if own:
                axes.plot(*zip(*own, strict=True), marker, ms=7, mec="white", mew=0.6,
                          color=SAMPLING_COLOURS[sampling], label=SAMPLING_NAMES[sampling])  # fmt: skip
        axes.margins(x=0.08, y=0.08)
        log_log(axes)
        name_points(axes, [(ms, error, _run_time_label(entry, floor)) for ms, error, entry in points])
        axes.set(xlabel="Run time per position, error estimate included [ms]",
                 ylabel="Largest STE error over the unseen states [%]")  # fmt: skip
    return figure


def _run_time_label(entry: Row, floor: float) -> str:
    label, error = entry["label"], entry["ste_error_max_percent"]
    return f"{label}: {error:.1g} %, below the axis" if error < floor else str(label)


def decay_figure(curves: Curves) -> Figure:
    """Largest and root-mean-square STE error over the number of full solves, for each sampling."""
    titles = {"max_percent": "largest", "rms_percent": "root mean square"}
    with panels(2, 9.6, 4.9, legend=3, sharey=True) as (figure, shown):
        for axes, (key, title) in zip(shown, titles.items(), strict=True):
            for sampling, points in curves.points.items():
                solves, error = np.array([(p["solves"], p[key]) for p in points], dtype=float).T
                style = {"color": SAMPLING_COLOURS[sampling], "marker": SAMPLING_MARKERS[sampling], "ms": 4.5}
                axes.plot(solves, error, label=SAMPLING_NAMES[sampling], **style)  # type: ignore[arg-type]
            axes.set(title=f"STE error, {title}", xlabel="Full solves [-]")
        if curves.estimate:
            shown[0].plot(*zip(*curves.estimate, strict=True), ":", color=SAMPLING_COLOURS["greedy"],
                          label="greedy: its own estimate")  # fmt: skip
        shown[0].axhline(curves.target_percent, color="black", lw=0.9, ls="--", label=f"{curves.target_percent:g} %")
        for axes in shown:
            log_log(axes)
        shown[0].set_ylabel("STE error over the unseen states [%]")
    return figure


def estimate_figure(entries: Sequence[Row]) -> Figure:
    """Estimated over true error of all states: flank lines, and the other reductions."""
    drawn = [entry for entry in entries if entry["effectivity"]["states"]]
    groups = [
        ("Flank lines", [entry for entry in drawn if entry["shapes"] == "flank_lines"]),
        ("Other reductions", [entry for entry in drawn if entry["shapes"] != "flank_lines"]),
    ]
    largest = max((float(np.nanmax(np.abs(_array(entry["ste_error_um"])))) for entry in drawn), default=1.0)
    ends = np.array([FLOOR_UM, 5.0 * largest])
    with panels(2, 9.6, 7.4, sharex=True, sharey=True) as (figure, shown):
        for axes, (title, group) in zip(shown, groups, strict=True):
            for i, entry in enumerate(group):
                error, estimate = (np.maximum(np.abs(_array(entry[key])), FLOOR_UM)
                                   for key in ("ste_error_um", "estimate_um"))  # fmt: skip
                axes.plot(error, estimate, MARKERS[i % len(MARKERS)], ms=3.5, mew=0, alpha=0.6,
                          color=COLOURS[i % len(COLOURS)], label=entry["label"])  # fmt: skip
            _guide_lines(axes, ends)
            axes.set(title=title, xlabel="|STE error| [µm]", xlim=ends, ylim=ends)
            log_log(axes)
            if group:
                axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), markerscale=2.0)
        shown[0].set_ylabel("|Estimate of the STE error| [µm]")
    return figure


def _guide_lines(axes: Axes, ends: FloatArray) -> None:
    """Diagonal, the wanted range about it, and the error above which it counts; the caption explains them."""
    axes.plot(ends, ends, color="black", lw=0.9)
    for factor in WANTED_EFFECTIVITY:
        axes.plot(ends, factor * ends, color="black", lw=0.8, ls="--")
    axes.axvline(SMALLEST_ERROR_UM, color="#888888", lw=0.9, ls=":")


def _array(values: Sequence[float | None]) -> FloatArray:
    return np.array(values, dtype=float)
