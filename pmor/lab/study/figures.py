"""The pictures of a study."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pmor.lab.study.measures import StudyParts
from pmor.lab.study.paper import MODELS
from pmor.lab.study.settings import Cell
from pmor.lab.study.table import Row, StudyTable
from pmor.report.chart import COLOURS
from pmor.report.page import Picture
from pmor.report.style import legend_label, log_log, name_points, panels
from pmor.work.front import pareto_front

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MODEL_NAMES = {
    "conventional": "(a) conventional full FE",
    "condensed": "(b) condensed full FE",
    "reduced": "(c) reduced model",
}
MODEL_COLOURS = dict(zip(MODELS, (COLOURS[1], COLOURS[0], COLOURS[2]), strict=True))
MODEL_MARKERS = dict(zip(MODELS, ("^", "o", "s"), strict=True))
# One colour per number of elements, the same in every panel and picture.
MESH_COLOURS = ("#D55E00", "#009E73", "#0072B2", "#CC79A7", "#E69F00", "#56B4E9")
# Share of the reference's own estimated error below which an error says nothing: the reference among the cells, say.
LEAST_SHOWN = 0.1


def study_pictures(parts: StudyParts, study_table: StudyTable) -> list[Picture]:
    """Return the pictures that the parts allow."""
    study, pictures = parts.study, list[Picture]()

    def add(name: str, caption: str, figure: Figure) -> None:
        pictures.append(Picture(f"{name}.png", caption, figure))

    if study.reference is None:
        if study_table.rows:
            caption = "Static transmission error over one pitch, less its mean."
            add("curves", caption, _curves(parts, study_table.rows))
        return pictures

    solved = _solved(parts, study.grid.cells)
    levels = [cell.detail for cell in solved]
    details = [e for e in sorted(set(levels)) if levels.count(e) > 1]
    if details:
        add("figure5", "Static transmission error over one pitch at equal level of detail E = elements x LoDM (the "
            "paper's Figure 5): reduced models, elements over the profile with the LoDM in parentheses, and the "
            "reference mesh.", _ste_by_detail(parts, details))  # fmt: skip
    if any(row["ms_per_position"] is not None for row in study_table.rows):
        if len({row["cell"] for _, _, row in _timed_errors(study_table, "shape_error_um")}) > 1:
            add("error_run_time", "Error against the reference over run time per position, one marker per cell and "
                "model, with the Pareto front. Conventional and condensed full FE solve the same equations and have "
                "the same error. Offline time is not in it: see the break-even numbers. Below the dashed line the "
                "reference itself is uncertain; errors far below it are not shown.",
                _error_over_time(study_table))  # fmt: skip
    return pictures


def _curves(parts: StudyParts, rows: Sequence[Row]) -> Figure:
    gears = sorted({row["overlap_ratio"] for row in rows})
    meshes = sorted({(row["n_profile"], row["n_width"]) for row in rows})
    with panels(len(meshes), 3.6 * len(meshes) + 1.0, 5.0, sharey=True) as (figure, shown):
        for axes, mesh in zip(shown, meshes, strict=True):
            for i, row in enumerate(row for row in rows if (row["n_profile"], row["n_width"]) == mesh):
                full = parts.results[f"cell {row['cell']}"]["full"]
                ste = np.array(full["ste_um"][0], dtype=float)
                # The same gears have the same colour on all meshes.
                colour = gears.index(row["overlap_ratio"]) if len(gears) > 1 else i
                axes.plot(np.arange(len(ste) + 1) / len(ste), np.append(ste, ste[0]) - row["ste_mean_um"],
                          color=COLOURS[colour % len(COLOURS)], label=legend_label(row["variant"]))  # fmt: skip
            axes.set(title=f"{mesh[0]} x {mesh[1]} elements", xlabel="Pinion angle over the pitch [-]", xlim=(0.0, 1.0))
            axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16))
        shown[0].set_ylabel("STE less its mean [µm]")
    return figure


def _ste_by_detail(parts: StudyParts, details: Sequence[int]) -> Figure:
    sizes = sorted({cell.n_profile for cell in parts.study.reduced_cells})
    colours = {n: MESH_COLOURS[i % len(MESH_COLOURS)] for i, n in enumerate(sizes)}
    reference = parts.results.get(f"reference {parts.study.meshes[-1].label}")
    with panels(len(details), 3.4 * len(details) + 0.6, 4.3, sharey=True) as (figure, shown):
        for axes, detail in zip(shown, details, strict=True):
            for cell in sorted(cell for cell in _solved(parts, parts.study.grid.cells) if cell.detail == detail):
                phi, ste = _closed(parts.results[f"cell {cell.label}"]["reduced_curve"])
                axes.plot(phi, ste, color=colours[cell.n_profile], label=f"{cell.n_profile} ({cell.lodm}x)")
            if reference is not None:
                phi, ste = _closed(reference["full"])
                axes.plot(phi, ste, color="black", lw=1.0, ls="--", label="reference")
            axes.set(title=f"E{detail}", xlabel="Pinion angle [deg]", xlim=(0.0, float(phi[-1])))
            axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2)
        shown[0].set_ylabel("Static transmission error [µm]")
    return figure


def _floor(table: StudyTable, key: str) -> float:
    """Estimated error of the reference; 0 where there is none."""
    floor = table.reference.get(key)
    return floor if floor is not None and np.isfinite(floor) else 0.0


def _timed_errors(table: StudyTable, key: str) -> list[tuple[float, float, Row]]:
    """Run time and magnitude of an error of the cells of the grid, as far as the reference can tell it."""
    least = LEAST_SHOWN * _floor(table, key)
    return [
        (row["ms_per_position"], abs(row[key]), row)
        for row in table.rows
        if row["ms_per_position"] is not None and row["variant"] is None and abs(row[key]) > least
    ]


def _error_over_time(table: StudyTable) -> Figure:
    labels = {"shape_error_um": "Shape error of the STE [µm]", "mean_error_um": "Error of the mean STE, magnitude [µm]"}
    with panels(2, 9.6, 4.9, legend=3) as (figure, shown):
        for axes, (key, label) in zip(shown, labels.items(), strict=True):
            points, floor = _timed_errors(table, key), _floor(table, key)
            for model in MODELS:
                own = [(x, y) for x, y, row in points if row["model"] == model]
                if own:
                    axes.plot(*zip(*own, strict=True), MODEL_MARKERS[model], color=MODEL_COLOURS[model], ms=6,
                              mec="white", mew=0.6, label=MODEL_NAMES[model])  # fmt: skip
            front = [points[i] for i in pareto_front(np.array([(x, y) for x, y, _ in points]).reshape(-1, 2))]
            axes.plot([p[0] for p in front], [p[1] for p in front], color="#888888", lw=1.2, zorder=1,
                      drawstyle="steps-post", label="Pareto front")  # fmt: skip
            if floor > 0.0:
                axes.axhline(floor, color="black", lw=0.9, ls="--", label="estimated error of the reference")
            axes.margins(x=0.08, y=0.08)
            log_log(axes)
            name_points(axes, [(x, y, row["cell"]) for x, y, row in points if row["model"] == "reduced"], left=True)
            axes.set(xlabel="Run time per position [ms]", ylabel=label)
    return figure


def _closed(data: Any) -> tuple[np.ndarray, np.ndarray]:
    """Angle in degrees and STE over a whole pitch, the first position repeated at its end."""
    ste = np.array(data["ste_um"][0], dtype=float)
    phi = np.append(data["phi_rad"], data["phi_rad"][0] + data["pitch_rad"])
    return np.degrees(phi), np.append(ste, ste[0])


def _solved(parts: StudyParts, cells: Sequence[Cell]) -> list[Cell]:
    return [cell for cell in cells if f"cell {cell.label}" in parts.results]
