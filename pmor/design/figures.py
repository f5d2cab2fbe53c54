"""Pictures of a design: the front, the objective about the best, transmission error over torque, sensitivities."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.design.harris import HarrisRule
from pmor.design.in_gearbox import CASE, InGearbox
from pmor.design.readings import Contour
from pmor.design.settings import RESULTS_OF_MOTION, Goal
from pmor.design.variables import limits
from pmor.design.variants import Found
from pmor.report.chart import COLOURS, Chart, Field, Panel, panels, plot_share_below
from pmor.report.parameter_words import parameter_words
from pmor.results.flank_maps import cell_edges
from pmor.results.quantities import OF_DESIGNS, TABLE
from pmor.sets.lost import known

#: names of results in pictures and tables
#: results of designs as readers see them, by their keys in the table of quantities
WORDS = {
    name: TABLE[key].head
    for name, key in {**OF_DESIGNS, **dict(zip(RESULTS_OF_MOTION, RESULTS_OF_MOTION, strict=True))}.items()
}
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


def front_figure(outcome: Found) -> Chart:
    """All variants in the plane of the objective and the result weighed against it, and the Pareto front."""
    design, kept = outcome.design, outcome.kept
    objective, against = outcome.variants.objective, outcome.against
    with panels(1, 7.2, 4.8) as (figure, (axes,)):
        if not kept.all():
            axes.plot(objective[~kept], against[~kept], ".", color="#cccccc", ms=2.5, label="breaks a constraint")
        axes.plot(objective[kept], against[kept], ".", color=COLOURS[4], ms=2.5, label="variants")
        front = outcome.front
        axes.plot(objective[front], against[front], "o-", color=COLOURS[0], ms=4.5, label="Pareto front")
        if outcome.best is not None:
            axes.plot(objective[outcome.best], against[outcome.best], "*", color=COLOURS[1], ms=13, label="best")
        # Designs that break a constraint do not stretch the axes.
        shown = kept if kept.any() else np.ones_like(kept)
        _limit_to_bulk(axes, objective[shown], against[shown])
        axes.set(xlabel=VALUES[design.objective.value] + words_of(design.objective.key) + ", mean over torques",
                 ylabel=WORDS[design.pareto.against])  # fmt: skip
    return figure


def contour_figure(outcome: Found, contours: Sequence[Contour]) -> Chart:
    """The objective as drawn over each two variables about the best, with the ellipse of 95 % of the gears made."""
    assert outcome.best is not None
    best, columns = outcome.variants.x[outcome.best], min(3, len(contours))
    rows = -(-len(contours) // columns)
    with panels(columns, 4.2 * columns, 3.7 * rows, rows=rows) as (figure, places):
        for axes, contour in zip(places, contours, strict=False):
            _contour(axes, outcome, contour, best)
        for axes in places[len(contours) :]:
            axes.shown = False
    return figure


def _contour(axes: Panel, outcome: Found, contour: Contour, best: FloatArray) -> None:
    design, first, second = outcome.design, contour.first, contour.second
    along, across, values = contour.along, contour.across, contour.objective
    low, high = limits(design.variables)
    # Even steps would all lie on the slopes, and none in the valley.
    known = values[np.isfinite(values)] if np.isfinite(values).any() else np.zeros(1)
    least, most = max(float(known.min()), 1e-3), max(float(known.max()), 2e-3)
    label = words_of(design.objective.key) + ", mean"
    axes.field(Field(cell_edges(along), cell_edges(across), values, least, most, label, logarithmic=True, steps=LEVELS))
    axes.plot(
        best[first], best[second], color=COLOURS[1], ms=13, mec="white", label="best", ls="", marker="*", zorder=5
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


def torque_figure(outcome: Found, torques_Nm: FloatArray, curves: Mapping[str, FloatArray]) -> Chart:
    """Peak-to-peak STE over torque of the flanks of the file and of chosen variants."""
    base = outcome.file.words.base
    with panels(1, 7.2, 4.6) as (figure, (axes,)):
        for number, (name, curve) in enumerate(curves.items()):
            wide = {"lw": 2.6} if name == "best" else {"lw": 1.2, "ls": "--" if name == base else "-"}
            axes.plot(torques_Nm, curve, color=COLOURS[number % len(COLOURS)], label=name, **wide)
        for torque in outcome.design.load.torques_Nm:
            axes.axvline(torque, color=GREY, lw=1.0, ls=":")
        axes.set(xlabel=f"{outcome.file.words.torque} [N m]; dotted: those of the design",
                 ylabel=WORDS["peak_to_peak_um"], ylim=(0.0, None))  # fmt: skip
    return figure


def ste_figure(outcome: Found, curves: Mapping[str, Sequence[FloatArray]]) -> Chart:
    """STE over its period under the design's torques of each chosen variant, a row for each mesh solved by itself."""
    solvers, count = outcome.judge.solvers, len(curves)
    rows = len(solvers)
    with panels(count, 3.4 * count, 2.8 * rows, rows=rows) as (figure, axes):
        for row, solver in enumerate(solvers):
            for place, (name, of_meshes) in zip(axes[row * count :], curves.items(), strict=False):
                for number, (label, curve) in enumerate(zip(outcome.design.load.labels, of_meshes[row], strict=True)):
                    whole = np.append(curve, curve[0]) - known(np.mean, curve)
                    place.plot(solver.pitches * np.arange(len(whole)) / len(curve), whole,
                               color=COLOURS[number % len(COLOURS)], label=label)  # fmt: skip
                title = f"{name}, {solver.name}" if rows > 1 else name
                place.set(title=title, xlabel=outcome.file.words.angle, ylabel="STE about its mean [µm]")
            of_row = axes[row * count : (row + 1) * count]
            limits = [place.limits("y") for place in of_row]
            for place in of_row:
                place.set_ylim(min(low for low, _ in limits), max(high for _, high in limits))
    return figure


def face_load_figure(box: InGearbox) -> Chart:
    """Line load over the face of each mesh under each load, the gearbox solved anew with each flank."""
    labels, meshes = box.elements.file.design.load.labels, box.elements.file.meshes
    columns = min(3, len(labels))
    rows = -(-len(labels) // columns)
    with panels(columns, 3.6 * columns, 2.6 * rows * len(meshes), rows=rows * len(meshes)) as (figure, axes):
        for place in axes:
            place.shown = False
        for first, mesh in enumerate(meshes):
            z = box.elements.pairs[mesh].layered.sections.z
            for number, (place, label) in enumerate(zip(axes[first * rows * columns :], labels, strict=False)):
                place.shown = True
                for colour, flank in zip(COLOURS, box.flanks, strict=False):
                    style = "--" if flank.name == CASE else "-"
                    place.plot(z, flank.face_load_N_per_mm[mesh][number], style, color=colour, label=flank.name)
                title = label if len(meshes) == 1 else f"{mesh}, {label}"
                place.set(title=title, xlabel="z from mid width [mm]", ylim=(0.0, None),
                          ylabel="Line load, mean over the mesh cycle [N/mm]")  # fmt: skip
    return figure


def sensitivity_figure(rates: Mapping[str, float], objective: Goal) -> Chart:
    """By how much the objective changes per unit of each parameter of the modifications."""
    names = sorted(rates, key=lambda name: abs(rates[name]))
    with panels(1, 7.2, 0.9 + 0.24 * len(names)) as (figure, (axes,)):
        places = np.arange(len(names))
        axes.bar(places, [rates[name] for name in names], 0.7, lying=True, color=COLOURS[0])
        axes.axvline(0.0, color=GREY, lw=0.8)
        unit, goal = objective.unit or "1", words_of(objective.key).partition(" [")[0]
        axes.set(yticks=places, yticklabels=[parameter_words(name) for name in names], ylim=(-0.6, len(names) - 0.4),
                 row_px=26.0, xlabel=f"d objective / d parameter [{unit} per µm, °, mm or %]; {goal}")  # fmt: skip
    return figure


def harris_figure(rules: Sequence[HarrisRule]) -> Chart:
    """Peak-to-peak STE over tip relief from the highest point of single contact, and the amount by the rule."""
    with panels(1, 7.2, 4.4) as (figure, (axes,)):
        for number, rule in enumerate(rules):
            colour = COLOURS[number % len(COLOURS)]
            axes.plot(rule.amount_um, rule.peak_to_peak_um, color=colour, label=f"{rule.torque_Nm:g} N m")
            axes.axvline(rule.rule_um, color=colour, lw=1.0, ls="--")
        axes.set(xlabel="Tip relief of both gears, from the highest point of single contact [µm]; dashed: the rule",
                 ylabel=WORDS["peak_to_peak_um"], xlim=(0.0, None), ylim=(0.0, None))  # fmt: skip
    return figure


def scatter_figure(objectives: Mapping[str, FloatArray], design_words: str, made: str) -> Chart:
    """Share of the pairs or sets made that stay below an objective, of chosen variants."""
    with panels(1, 7.2, 4.0) as (figure, (axes,)):
        for number, (name, values) in enumerate(objectives.items()):
            plot_share_below(axes, values, COLOURS[number % len(COLOURS)], name)
        axes.axhline(95.0, color=GREY, lw=1.0, ls=":")
        axes.set(xlabel=f"{design_words}, mean over torques; dashed: 95 % stay below",
                 ylabel=f"{made.capitalize()} made that stay below [%]", ylim=(0.0, 100.0))  # fmt: skip
    return figure


def _limit_to_bulk(axes: Panel, x: FloatArray, y: FloatArray) -> None:
    """Show where most variants are: few that are very bad would press the rest together."""
    for values, name in ((x, "xlim"), (y, "ylim")):
        known = values[np.isfinite(values)]
        if not len(known):
            continue
        low, high = known.min(), float(np.percentile(known, 97.0))
        margin = 0.05 * max(high - low, 1e-3 * abs(high))
        axes.set(**{name: (low - margin, high + margin)})
