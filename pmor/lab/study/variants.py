"""Page and pictures of a study of variants alone: other gears or other meshes, compared with each other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from pmor.lab.study.parts import StudyParts
from pmor.lab.study.settings import Study
from pmor.lab.study.table import Row, StudyTable
from pmor.report.page import Block, Picture
from pmor.report.panels import panels
from pmor.report.style import COLOURS
from pmor.work.table import Columns, table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MARKERS = "osv^D"


def variant_blocks(study: Study, found: StudyTable, pictures: Sequence[Picture]) -> list[Block]:
    """Return the report of a study of variants alone, in the order of reading."""
    columns: Columns = {
        "variant": "variant",
        "elements, profile x width": lambda row: f"{row['n_profile']} x {row['n_width']}",
        "contact ratio": "contact_ratio",
        "overlap ratio": "overlap_ratio",
        "STE mean, µm": "ste_mean_um",
        "peak-to-peak, µm": "ste_peak_to_peak_um",
        "of the first, %": lambda row: 100.0 * row["ste_peak_to_peak_um"] / found.rows[0]["ste_peak_to_peak_um"],
        "FE unknowns": "fe_unknowns",
    }
    text = (
        f"Full FE at nominal torque, {study.grid.angles_per_pitch} angles per pitch. STE is in micrometres along the "
        "line of action."
    )
    return [
        text,
        table("Variants", columns, found.rows),
        *pictures,
    ]


def variant_pictures(parts: StudyParts, found: StudyTable) -> list[Picture]:
    """Return the curves over the pitch, and the peak-to-peak over the overlap ratio where that is varied."""
    pictures = []
    if found.rows:
        pictures.append(Picture("curves.png", "Static transmission error over one pitch, less its mean.",
                                _curves(parts, found.rows)))  # fmt: skip
    if len({row["overlap_ratio"] for row in found.rows}) > 1:
        pictures.append(Picture("overlap.png", "Peak-to-peak and mean of the static transmission error over the "
                                "overlap ratio.", _over_overlap(found.rows)))  # fmt: skip
    return pictures


def _curves(parts: StudyParts, rows: Sequence[Row]) -> Figure:
    meshes, gears = _meshes(rows), sorted({row["overlap_ratio"] for row in rows})
    with panels(len(meshes), 3.6 * len(meshes) + 1.0, 5.0, sharey=True) as (figure, shown):
        for axes, mesh in zip(shown, meshes, strict=True):
            for i, row in enumerate(_of(rows, mesh)):
                full = parts.results[f"cell {row['cell']}"]["full"]
                ste = np.array(full["ste_um"][0], dtype=float)
                # The same gears have the same colour on all meshes.
                colour = gears.index(row["overlap_ratio"]) if len(gears) > 1 else i
                axes.plot(np.arange(len(ste) + 1) / len(ste), np.append(ste, ste[0]) - row["ste_mean_um"],
                          color=COLOURS[colour % len(COLOURS)], label=row["variant"])  # fmt: skip
            axes.set(title=f"{mesh[0]} x {mesh[1]} elements", xlabel="Pinion angle over the pitch [-]", xlim=(0.0, 1.0))
            axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16))
        shown[0].set_ylabel("STE less its mean [µm]")
    return figure


def _over_overlap(rows: Sequence[Row]) -> Figure:
    meshes = _meshes(rows)
    keys = {"ste_peak_to_peak_um": "Peak-to-peak STE [µm]", "ste_mean_um": "Mean STE [µm]"}
    with panels(2, 9.6, 4.4, legend=len(meshes)) as (figure, shown):
        for axes, (key, label) in zip(shown, keys.items(), strict=True):
            for i, mesh in enumerate(meshes):
                own = sorted((row["overlap_ratio"], row[key]) for row in _of(rows, mesh))
                # No lines: between the variants nothing was computed.
                axes.plot(*zip(*own, strict=True), MARKERS[i % len(MARKERS)], ms=6, mfc="none",
                          color=COLOURS[i % len(COLOURS)], label=f"{mesh[0]} x {mesh[1]} elements")  # fmt: skip
            axes.set(xlabel="Overlap ratio [-]", ylabel=label, ylim=(0.0, 1.08 * max(row[key] for row in rows)))
    return figure


def _meshes(rows: Sequence[Row]) -> list[tuple[int, int]]:
    """Elements over profile and width, coarse ones first."""
    return sorted({(row["n_profile"], row["n_width"]) for row in rows})


def _of(rows: Sequence[Row], mesh: tuple[int, int]) -> list[Row]:
    return [row for row in rows if (row["n_profile"], row["n_width"]) == mesh]
