"""Everything that a study leaves in its folder, and the summary on the screen."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

from pmor.lab.study.content import study_blocks
from pmor.lab.study.figures import study_figures
from pmor.lab.study.run import StudyParts
from pmor.lab.study.table import StudyTable
from pmor.report.data_files import write_summary_json
from pmor.report.markdown import write_markdown
from pmor.report.page import write_page
from pmor.report.style import save_png
from pmor.report.table import format_cell


def write_study(parts: StudyParts, table: StudyTable, out: Path) -> None:
    """Write `study.json`, `study.md`, `report.html` and the pictures.

    Raises
    ------
    OutputError
    """
    study = parts.study
    write_summary_json(out / "study.json", {"study": study.name, "title": study.title} | asdict(table))
    figures = study_figures(parts, table)
    for name, _, figure in figures:
        save_png(figure, out / name)
    blocks = study_blocks(parts, table, figures)
    write_page(out / "report.html", study.title, blocks)
    write_markdown(out / "study.md", study.title, blocks)


def study_text(parts: StudyParts, table: StudyTable) -> str:
    """Return the short summary for the screen: error and run time of every cell."""
    name = max(len(cell.label) for cell in parts.cases.cells)
    lines = [
        parts.study.title,
        f"  {'cell':<{name}}    mean    shape    ripple   reduced/full   (b) ms   (c) ms   (a)/(c)",
        f"  {'':<{name}}      um       um        um         max, %",
    ]
    for cell in parts.cases.cells:
        full, reduced = table.row(cell, "condensed"), table.row(cell, "reduced")
        if full is None:
            continue
        fast = reduced or {}
        largest = fast.get("rom_vs_full_ste_max_rel")
        values = (
            full["ste_mean_um"], full["shape_error_um"], full["ripple_um"],
            None if largest is None else 100.0 * largest,
            full["ms_per_position"], fast.get("ms_per_position"), fast.get("time_ratio_conventional_to_reduced"),
        )  # fmt: skip
        widths = (8, 9, 10, 15, 9, 9, 10)
        numbers = "".join(f"{format_cell(value):>{width}}" for value, width in zip(values, widths, strict=True))
        lines.append(f"  {cell.label:<{name}}{numbers}")
    for claim in (*table.claims, *table.time_claims):
        lines.append(f"  {'confirmed' if claim['confirmed'] else 'not confirmed':<14} {claim['claim']}")
    return "\n".join([*lines, *(f"  ! {failure}" for failure in table.failures)])
