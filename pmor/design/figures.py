"""Pictures of a design: the front, the objective about the best, transmission error over torque, sensitivities."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.design.harris import HarrisRule
from pmor.design.in_gearbox import CASE, InGearbox
from pmor.design.readings import Contour
from pmor.design.settings import RESULTS_OF_MOTION, Goal
from pmor.design.variables import limits
from pmor.design.variants import Found
from pmor.report.parameter_words import parameter_words
from pmor.report.style import COLOURS, legend_label, new_figure, panels, plot_share_below, plot_style
from pmor.results.quantities import TABLE
from pmor.sets.lost import known

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: names of results in pictures and tables
#: results of designs as readers see them, by their keys in the table of quantities
WORDS = {
    name: TABLE[key].head
    for name, key in {
        "peak_to_peak_um": "ste_peak_to_peak_um", "pressure_MPa": "flank_pressure_max_MPa", "k_h_beta": "k_h_beta",
        "tip_edge_load_N_per_mm": "tip_edge_load_N_per_mm", "root_stress_MPa": "root_stress_max_MPa",
        "k_gamma": "k_gamma", **{f"order_{k}_um": f"ste_order_{k}_um" for k in (1, 2, 3)},
        **dict(zip(RESULTS_OF_MOTION, RESULTS_OF_MOTION, strict=True)),
    }.items()
}  # fmt: skip
VALUES = {"nominal": "", "expected": "expected ", "percentile_95": "95 % below: "}
# Contour levels.
LEVELS = 16
# Of the two-dimensional normal distribution: within so many standard deviations are 95 % of the gears made.
ELLIPSE = math.sqrt(-2.0 * math.log(0.05))
GREY = "#555555"


def words_of(key: str) -> str:
    """Return a result in words, of a mesh with its name."""
    mesh, _, plain = key.rpartition(".")
    return f"{mesh}: {WORDS[plain]}" if mesh else WORDS[plain]


def front_figure(outcome: Found) -> Figure:
    """All variants in the plane of the objective and the result weighed against it, and the Pareto front."""
    design, kept = outcome.design, outcome.kept
    objective, against = outcome.variants.objective, outcome.against
    with plot_style():
        figure = new_figure(7.2, 4.8)
        axes = figure.subplots()
        if not kept.all():
            axes.plot(objective[~kept], against[~kept], ".", color="#cccccc", ms=2.5, label="breaks a constraint")
        axes.plot(objective[kept], against[kept], ".", color=COLOURS[4], ms=2.5, label="variants", rasterized=True)
        front = outcome.front
        axes.plot(objective[front], against[front], "o-", color=COLOURS[0], ms=4.5, label="Pareto front")
        if outcome.best is not None:
            axes.plot(objective[outcome.best], against[outcome.best], "*", color=COLOURS[1], ms=13, label="best")
        _limit_to_bulk(axes, objective, against)
        axes.set_xlabel(VALUES[design.objective.value] + words_of(design.objective.key) + ", mean over torques")
        axes.set_ylabel(WORDS[design.pareto.against])
        figure.legend(loc="outside lower center", ncols=4)
    return figure


def contour_figure(outcome: Found, contours: Sequence[Contour]) -> Figure:
    """The objective as drawn over each two variables about the best, with the ellipse of 95 % of the gears made."""
    assert outcome.best is not None
    best, columns = outcome.variants.x[outcome.best], min(3, len(contours))
    rows = -(-len(contours) // columns)
    with plot_style():
        figure = new_figure(4.2 * columns + (1.6 if columns == 1 else 0.6), 3.7 * rows + (0.6 if rows == 1 else 0.0))
        places = list(np.atleast_1d(figure.subplots(rows, columns, squeeze=False)).flat)
        for axes, contour in zip(places, contours, strict=False):
            _contour(axes, outcome, contour, best)
        for axes in places[len(contours) :]:
            axes.set_visible(False)
        shown = {
            label: handle for axes in places for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
        }
        figure.legend(shown.values(), shown.keys(), loc="outside lower center", ncols=3)
    return figure


def _contour(axes: Axes, outcome: Found, contour: Contour, best: FloatArray) -> None:
    design, first, second = outcome.design, contour.first, contour.second
    along, across, values = contour.along, contour.across, contour.objective
    low, high = limits(design.variables)
    # Even steps would all lie on the slopes, and none in the valley.
    known = values[np.isfinite(values)] if np.isfinite(values).any() else np.zeros(1)
    levels = np.geomspace(max(float(known.min()), 1e-3), max(float(known.max()), 2e-3), LEVELS)
    shown = axes.contourf(along, across, np.ma.masked_invalid(values), levels=levels, cmap="viridis", extend="min")
    axes.contour(along, across, np.ma.masked_invalid(values), levels=levels, colors="white", linewidths=0.3)
    axes.figure.colorbar(shown, ax=axes, label=words_of(design.objective.key) + ", mean", format="%.2g")
    axes.plot(
        best[first], best[second], "*", color=COLOURS[1], ms=13, mec="white", label="best", clip_on=False, zorder=5
    )
    other = outcome.best_at(range(len(design.load.labels))) if design.scatters else None
    if other is not None:
        x = outcome.variants.x[other]
        axes.plot(x[first], x[second], "D", color="white", ms=5, mec=GREY, label="best without scatter")
    sizes = [design.scatter.modifications.get(design.variables[n].key, 0.0) for n in (first, second)]
    if any(sizes):
        angle = np.linspace(0.0, 2.0 * np.pi, 100)
        axes.plot(best[first] + ELLIPSE * sizes[0] * np.cos(angle), best[second] + ELLIPSE * sizes[1] * np.sin(angle),
                  color=COLOURS[1], lw=1.4, ls="--", label="95 % of the gears made")  # fmt: skip
    axes.set(xlim=(low[first], high[first]), ylim=(low[second], high[second]),
             xlabel=parameter_words(design.variables[first].name),
             ylabel=parameter_words(design.variables[second].name))  # fmt: skip
    axes.grid(False)


def torque_figure(outcome: Found, torques_Nm: FloatArray, curves: Mapping[str, FloatArray]) -> Figure:
    """Peak-to-peak STE over torque of the flanks of the file and of chosen variants."""
    base = outcome.file.words.base
    with plot_style():
        figure = new_figure(7.2, 4.6)
        axes = figure.subplots()
        for number, (name, curve) in enumerate(curves.items()):
            wide = {"lw": 2.6} if name == "best" else {"lw": 1.2, "ls": "--" if name == base else "-"}
            axes.plot(torques_Nm, curve, color=COLOURS[number % len(COLOURS)], label=name, **wide)
        for torque in outcome.design.load.torques_Nm:
            axes.axvline(torque, color=GREY, lw=1.0, ls=":")
        axes.set(xlabel=f"{outcome.file.words.torque} [N m]; dotted: those of the design",
                 ylabel=WORDS["peak_to_peak_um"], ylim=(0.0, None))  # fmt: skip
        figure.legend(loc="outside lower center", ncols=4)
    return figure


def ste_figure(outcome: Found, curves: Mapping[str, Sequence[FloatArray]]) -> Figure:
    """STE over its period under the design's torques of each chosen variant, a row for each mesh solved by itself."""
    solvers, count = outcome.judge.solvers, len(curves)
    rows = len(solvers)
    with panels(count, 2.7 * count + 0.8, 2.8 * rows + 0.8, legend=6, rows=rows, sharey="row") as (figure, axes):
        for row, solver in enumerate(solvers):
            for place, (name, of_meshes) in zip(axes[row * count :], curves.items(), strict=False):
                for number, (label, curve) in enumerate(zip(outcome.design.load.labels, of_meshes[row], strict=True)):
                    whole = np.append(curve, curve[0]) - known(np.mean, curve)
                    place.plot(solver.pitches * np.arange(len(whole)) / len(curve), whole,
                               color=COLOURS[number % len(COLOURS)], label=legend_label(label))  # fmt: skip
                title = f"{name}, {solver.name}" if rows > 1 else name
                place.set(title=title, xlabel=outcome.file.words.angle)
            axes[row * count].set_ylabel("STE about its mean [µm]")
    return figure


def face_load_figure(box: InGearbox) -> Figure:
    """Line load over the face of each mesh under each load, the gearbox solved anew with each flank."""
    labels, meshes = box.elements.file.design.load.labels, box.elements.file.meshes
    columns = min(3, len(labels))
    rows = -(-len(labels) // columns)
    height = 2.6 * rows * len(meshes) + 0.9
    with panels(columns, 3.0 * columns + 1.2, height, legend=4, rows=rows * len(meshes), sharex=len(meshes) == 1) as (
        figure, axes,
    ):  # fmt: skip
        for place in axes:
            place.set_visible(False)
        for first, mesh in enumerate(meshes):
            z = box.elements.pairs[mesh].layered.sections.z
            for number, (place, label) in enumerate(zip(axes[first * rows * columns :], labels, strict=False)):
                place.set_visible(True)
                for colour, flank in zip(COLOURS, box.flanks, strict=False):
                    style = "--" if flank.name == CASE else "-"
                    place.plot(z, flank.face_load_N_per_mm[mesh][number], style, color=colour, label=flank.name)
                title = legend_label(label) if len(meshes) == 1 else f"{mesh}, {legend_label(label)}"
                place.set(title=title, xlabel="z from mid width [mm]", ylim=(0.0, None))
                if number % columns == 0:
                    place.set_ylabel("Line load, mean over\nthe mesh cycle [N/mm]")
    return figure


def sensitivity_figure(rates: Mapping[str, float], objective: Goal) -> Figure:
    """By how much the objective changes per unit of each parameter of the modifications."""
    names = sorted(rates, key=lambda name: abs(rates[name]))
    with plot_style():
        figure = new_figure(7.2, 0.9 + 0.24 * len(names))
        axes = figure.subplots()
        words = [parameter_words(name) for name in names]
        axes.barh(words, [rates[name] for name in names], color=COLOURS[0], height=0.7)
        axes.axvline(0.0, color=GREY, lw=0.8)
        unit, goal = objective.unit or "1", words_of(objective.key).partition(" [")[0]
        # Below the whole picture: long names of parameters leave the axes narrower than this.
        figure.supxlabel(f"d objective / d parameter [{unit} per µm, °, mm or %]; {goal}", fontsize=9)
        axes.tick_params(axis="y", labelsize=8)
    return figure


def harris_figure(rules: Sequence[HarrisRule]) -> Figure:
    """Peak-to-peak STE over tip relief from the highest point of single contact, and the amount by the rule."""
    with plot_style():
        figure = new_figure(7.2, 4.4)
        axes = figure.subplots()
        for number, rule in enumerate(rules):
            colour = COLOURS[number % len(COLOURS)]
            axes.plot(rule.amount_um, rule.peak_to_peak_um, color=colour, label=f"{rule.torque_Nm:g} N m")
            axes.axvline(rule.rule_um, color=colour, lw=1.0, ls="--")
        axes.set(xlabel="Tip relief of both gears, from the highest point of single contact [µm]; dashed: the rule",
                 ylabel=WORDS["peak_to_peak_um"], xlim=(0.0, None), ylim=(0.0, None))  # fmt: skip
        figure.legend(loc="outside lower center", ncols=6)
    return figure


def scatter_figure(objectives: Mapping[str, FloatArray], design_words: str, made: str) -> Figure:
    """Share of the pairs or sets made that stay below an objective, of chosen variants."""
    with plot_style():
        figure = new_figure(7.2, 4.0)
        axes = figure.subplots()
        for number, (name, values) in enumerate(objectives.items()):
            plot_share_below(axes, values, COLOURS[number % len(COLOURS)], name)
        axes.axhline(95.0, color=GREY, lw=1.0, ls=":")
        axes.set(xlabel=f"{design_words}, mean over torques; dashed: 95 % stay below",
                 ylabel=f"{made.capitalize()} made that stay below [%]", ylim=(0.0, 100.0))  # fmt: skip
        figure.legend(loc="outside lower center", ncols=3)
    return figure


def _limit_to_bulk(axes: Axes, x: FloatArray, y: FloatArray) -> None:
    """Show where most variants are: few that are very bad would press the rest together."""
    for values, limit in ((x, axes.set_xlim), (y, axes.set_ylim)):
        known = values[np.isfinite(values)]
        if not len(known):
            continue
        low, high = known.min(), float(np.percentile(known, 97.0))
        margin = 0.05 * max(high - low, 1e-3 * abs(high))
        limit(low - margin, high + margin)
