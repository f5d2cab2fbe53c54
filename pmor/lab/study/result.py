"""The result of a study: its files and its summary."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path

from pmor.core.shown import brief
from pmor.lab.study.figures import study_pictures
from pmor.lab.study.measures import StudyParts
from pmor.lab.study.page import study_blocks
from pmor.lab.study.table import StudyTable
from pmor.report.table import Columns, percent, table, text_lines
from pmor.work.results import Report, writing_results

#: files that `StudyResult.write` may leave
FILES = (
    "study.json", "study.md", "report.html", "figure5.png", "error_run_time.png", "curves.png",
)  # fmt: skip


@brief
@dataclass(frozen=True)
class StudyResult:
    """Error against run time, of all cells and models."""

    parts: StudyParts  # Curves and everything else that was computed
    table: StudyTable  # The rows made of them

    @property
    def failures(self) -> tuple[str, ...]:
        """Everything that did not converge."""
        return self.table.failures

    def write(self, folder: Path | str, *, overwrite: bool = False) -> None:
        """Write `study.json`, `study.md`, `report.html` and the pictures; finished pieces stay for the next run."""
        study, result = self.parts.study, self.table
        data = {"study": study.name, "title": study.title} | asdict(result)
        blocks = study_blocks(study, result, study_pictures(self.parts, result))
        text = f"{study!r}\n{study.base.read_text(encoding='utf-8')}"
        with writing_results(folder, FILES, text, overwrite=overwrite, complete=False) as held:
            Report("study", data, study.title, blocks, measured_on=result.machine or None).write(held)

    def __str__(self) -> str:
        """Error and run time of every cell, and the claims."""
        result = self.table
        fast = {row["cell"]: row for row in result.rows_of("reduced")}
        columns: Columns = {
            "cell": "cell",
            "mean, um": "ste_mean_um",
            "shape, um": "shape_error_um",
            "numerical noise, um": "ripple_um",
            "reduced/full max, %": lambda row: percent("rom_vs_full_ste_max_rel")(fast.get(row["cell"], {})),
            "(b) ms": "ms_per_position",
            "(c) ms": lambda row: fast.get(row["cell"], {}).get("ms_per_position"),
            "(a)/(c)": lambda row: fast.get(row["cell"], {}).get("time_ratio_conventional_to_reduced"),
        }
        claims = [f"{'confirmed' if claim['confirmed'] else 'not confirmed':<14} {claim['claim']}"
                  for claim in (*result.claims, *result.time_claims)]  # fmt: skip
        lines = [*text_lines(table("", columns, result.rows_of("condensed"))), *claims]
        lines += [f"! {failure}" for failure in result.failures]
        return "\n".join([self.parts.study.title, *(f"  {line}" for line in lines)])
