"""Pictures of the comparison: error over run time, error over solves, estimate over error."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from pmor.arrays import FloatArray
from pmor.lab.comparison.decay import SAMPLINGS, Decay
from pmor.lab.comparison.measure import Entry
from pmor.lab.comparison.measures import SMALLEST_ERROR_UM, WANTED_EFFECTIVITY
from pmor.lab.study.figures import log_log
from pmor.report.style import COLOURS, new_figure, plot_style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SAMPLING_COLOURS = dict(zip((*SAMPLINGS, "none"), COLOURS, strict=False))
SAMPLING_MARKERS = {"greedy": "o", "sobol": "s", "grid": "^", "none": "D"}
SAMPLING_NAMES = {"greedy": "greedy", "sobol": "Sobol sequence", "grid": "full-factorial grid", "none": "no training"}
# One more than colours, so that no pair of the two comes twice.
MARKERS = "osv^D<>P"
# Errors and estimates of less are drawn here, um.
FLOOR_UM = 1e-6


def run_time_figure(entries: Sequence[Entry], online_ms: Sequence[tuple[float, float]]) -> Figure:
    """Largest STE error over the time of a position, one named marker per reduction."""
    trained = [entry.errors.max_percent for entry in entries if entry.solves]
    # Static modes are exact: to scale they would squeeze all others into a corner.
    floor = 0.3 * min(trained)
    points = [(ms, max(entry.errors.max_percent, floor), entry)
              for (ms, _), entry in zip(online_ms, entries, strict=True)]  # fmt: skip
    with plot_style():
        figure = new_figure(9.6, 5.2)
        axes = figure.add_subplot()
        for sampling, marker in SAMPLING_MARKERS.items():
            own = [(ms, error) for ms, error, entry in points if entry.sampling == sampling]
            if own:
                axes.plot(*zip(*own, strict=True), marker, ms=7, mec="white", mew=0.6,
                          color=SAMPLING_COLOURS[sampling], label=SAMPLING_NAMES[sampling])  # fmt: skip
        axes.margins(x=0.08, y=0.08)
        log_log(axes)
        _name_beside(axes, [(ms, error, _run_time_label(entry, floor)) for ms, error, entry in points])
        axes.set_xlabel("Run time per position, error estimate included [ms]")
        axes.set_ylabel("Largest STE error over the unseen states [%]")
        figure.legend(loc="outside lower center", ncols=4)
    return figure


def _run_time_label(entry: Entry, floor: float) -> str:
    below = entry.errors.max_percent < floor
    return f"{entry.label}: {entry.errors.max_percent:.1g} %, below the axis" if below else entry.label


def _name_beside(axes: Axes, points: Sequence[tuple[float, float, str]]) -> None:
    """Name points (time, error, name) in a column right of the axes, in the order of the errors, a line to each."""
    ordered = sorted(points, key=lambda point: (point[1], -point[0]))
    line = {"arrowstyle": "-", "lw": 0.5, "color": "#999999", "shrinkA": 1, "shrinkB": 4, "relpos": (0.0, 0.5)}
    for height, (x, y, name) in zip(np.linspace(0.01, 0.99, len(ordered)), ordered, strict=True):
        axes.annotate(name, (x, y), (1.02, height), textcoords="axes fraction", fontsize=8, ha="left", va="center",
                      arrowprops=line)  # fmt: skip


def decay_figure(decay: Decay) -> Figure:
    """Largest and root-mean-square STE error over the number of full solves, for each sampling."""
    with plot_style():
        figure = new_figure(9.6, 4.9)
        panels = figure.subplots(1, 2, sharey=True)
        for axes, key, title in zip(panels, ("max_percent", "rms_percent"), ("largest", "root mean square"),
                                    strict=True):  # fmt: skip
            for sampling, points in decay.points.items():
                solves, error = np.array([(p.solves, getattr(p, key)) for p in points]).T
                style = {"color": SAMPLING_COLOURS[sampling], "marker": SAMPLING_MARKERS[sampling], "ms": 4.5}
                if sampling == "grid":
                    axes.plot(solves, error, ls="", alpha=0.45, label="grids, each", **style)  # type: ignore[arg-type]
                    best = np.minimum.accumulate(error)
                    axes.plot(solves, best, color=style["color"], label="grids, best so far")
                else:
                    axes.plot(solves, error, label=SAMPLING_NAMES[sampling], **style)  # type: ignore[arg-type]
            axes.set_title(f"STE error, {title}")
            axes.set_xlabel("Full solves [-]")
        if decay.estimate:
            panels[0].plot(*zip(*decay.estimate, strict=True), ":", color=SAMPLING_COLOURS["greedy"],
                           label="greedy: its own estimate")  # fmt: skip
        panels[0].axhline(decay.target_percent, color="black", lw=0.9, ls="--", label=f"{decay.target_percent:g} %")
        for axes in panels:
            log_log(axes)
        panels[0].set_ylabel("STE error over the unseen states [%]")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


def estimate_figure(entries: Sequence[Entry]) -> Figure:
    """Estimated over true error of all states: flank lines, and the other reductions."""
    drawn = [entry for entry in entries if entry.errors.effectivity.states]
    groups = [
        ("Flank lines", [entry for entry in drawn if entry.shapes == "flank_lines"]),
        ("Other reductions", [entry for entry in drawn if entry.shapes != "flank_lines"]),
    ]
    largest = max((float(np.nanmax(np.abs(entry.errors.error_um))) for entry in drawn), default=1.0)
    ends = np.array([FLOOR_UM, 5.0 * largest])
    with plot_style():
        figure = new_figure(9.6, 7.4)
        panels = figure.subplots(1, 2, sharex=True, sharey=True)
        for axes, (title, group) in zip(panels, groups, strict=True):
            for i, entry in enumerate(group):
                error, estimate = (np.maximum(np.abs(v), FLOOR_UM)
                                   for v in (entry.errors.error_um, entry.errors.estimate_um))  # fmt: skip
                axes.plot(error, estimate, MARKERS[i % len(MARKERS)], ms=3.5, mew=0, alpha=0.6,
                          color=COLOURS[i % len(COLOURS)], label=entry.label)  # fmt: skip
            _guide_lines(axes, ends)
            axes.set(title=title, xlabel="|STE error| [µm]", xlim=ends, ylim=ends)
            log_log(axes)
            axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), markerscale=2.0)
        panels[0].set_ylabel("|Estimate of the STE error| [µm]")
    return figure


def _guide_lines(axes: Axes, ends: FloatArray) -> None:
    """Diagonal, the wanted range about it, and the error above which it counts; the caption says what is what."""
    axes.plot(ends, ends, color="black", lw=0.9)
    for factor in WANTED_EFFECTIVITY:
        axes.plot(ends, factor * ends, color="black", lw=0.8, ls="--")
    axes.axvline(SMALLEST_ERROR_UM, color="#888888", lw=0.9, ls=":")
