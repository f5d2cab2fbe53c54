"""Everything that a study leaves in its folder, and the summary on the screen."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

from pmor.lab.study.figures import study_pictures
from pmor.lab.study.page import study_blocks
from pmor.lab.study.run import StudyParts
from pmor.lab.study.table import StudyTable
from pmor.work.results import Report
from pmor.work.table import Columns, percent, table, text_lines

#: what `write_study` may leave
FILES = (
    "study.json", "study.md", "report.html", "figure5.png", "error_run_time.png", "cost.png", "ladder.png",
    "error_over_angle.png", "curves.png", "overlap.png",
)  # fmt: skip


def write_study(parts: StudyParts, found: StudyTable, out: Path) -> None:
    """Write `study.json`, `study.md`, `report.html` and the pictures.

    Raises
    ------
    OutputError
    """
    study = parts.study
    data = {"study": study.name, "title": study.title} | asdict(found)
    blocks = study_blocks(study, found, study_pictures(parts, found))
    Report("study", data, study.title, blocks, measured_on=found.machine).write(out)


def study_text(parts: StudyParts, found: StudyTable) -> str:
    """Return the short summary for the screen: error and run time of every cell."""
    fast = {row["cell"]: row for row in found.rows_of("reduced")}
    columns: Columns = {
        "cell": "cell",
        "mean, um": "ste_mean_um",
        "shape, um": "shape_error_um",
        "ripple, um": "ripple_um",
        "reduced/full max, %": lambda row: percent("rom_vs_full_ste_max_rel")(fast.get(row["cell"], {})),
        "(b) ms": "ms_per_position",
        "(c) ms": lambda row: fast.get(row["cell"], {}).get("ms_per_position"),
        "(a)/(c)": lambda row: fast.get(row["cell"], {}).get("time_ratio_conventional_to_reduced"),
    }
    claims = [f"{'confirmed' if claim['confirmed'] else 'not confirmed':<14} {claim['claim']}"
              for claim in (*found.claims, *found.time_claims)]  # fmt: skip
    lines = [*text_lines(table("", columns, found.rows_of("condensed"))), *claims]
    lines += [f"! {failure}" for failure in found.failures]
    return "\n".join([parts.study.title, *(f"  {line}" for line in lines)])
