"""One self-contained HTML page per run: settings, results, errors, run times, pictures.

Styles are inline and pictures are data URIs: the page can be mailed, archived and printed without anything beside it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from pmor.report.plots import png_base64

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: what a table cell may hold; None is shown as a dash, a float in four significant digits
Cell = str | float | int | bool | None


@dataclass(frozen=True)
class Table:
    """A table of the report; every row has as many cells as ``columns``."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    note: str = ""

    def __post_init__(self) -> None:
        """A short row would shift numbers under the wrong heading."""
        for row in self.rows:
            if len(row) != len(self.columns):
                raise ValueError(f"table {self.title!r}: row {tuple(row)} does not have {len(self.columns)} cells")


@dataclass(frozen=True)
class ReportContent:
    """Everything that the page shows, in the order in which it shows it."""

    title: str
    summary_rows: Sequence[tuple[str, Cell, str, str]]  # label, value, unit, note
    warnings: Sequence[str]
    figures: Sequence[tuple[str, Figure]]  # caption, picture
    error_table: Table
    classical_table: Table
    case_rows: Sequence[tuple[str, Cell, bool]]  # key, value, is it a default
    provenance_rows: Sequence[tuple[str, Cell]]  # versions, machine, date, case hash


_STYLE = """
:root { --ink: #1c2733; --faint: #5b6875; --line: #d5dce3; --band: #f4f7f9; }
* { box-sizing: border-box; }
body { font: 16px/1.5 system-ui, "Segoe UI", Roboto, sans-serif; color: var(--ink); margin: 0 auto;
       padding: 1rem; max-width: 62rem; }
h1 { font-size: 1.6rem; line-height: 1.25; } h2 { font-size: 1.2rem; margin-top: 2.2rem; }
h3 { font-size: 1rem; margin-top: 1.6rem; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font-size: 0.92rem; }
th, td { text-align: left; padding: 0.35rem 0.7rem; border-bottom: 1px solid var(--line); vertical-align: top; }
thead th { background: var(--band); }
td.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
th.number { text-align: right; }
.faint { color: var(--faint); font-size: 0.88rem; }
.warning { border-left: 4px solid #d55e00; background: #fdf3ec; padding: 0.5rem 0.9rem; margin: 0.5rem 0; }
figure { margin: 1.2rem 0; break-inside: avoid; } figure img { max-width: 100%; height: auto; }
figcaption { color: var(--faint); font-size: 0.9rem; }
@media print { body { font-size: 11px; max-width: none; padding: 0; }
               h2, h3 { break-after: avoid; } tr { break-inside: avoid; } }
"""


def write_report(path: Path, content: ReportContent) -> None:
    """Write the page; the target is replaced only when it is complete."""
    from pmor.storage.atomic import atomic_path

    page = report_html(content)
    with atomic_path(path) as temporary:
        Path(temporary).write_text(page, encoding="utf-8")


def report_html(content: ReportContent) -> str:
    """The page as text."""
    summary = Table("Results", ("Quantity", "Value", "Unit", "Note"), content.summary_rows)
    case = Table(
        "Case settings",
        ("Setting", "Value", "Source"),
        [(key, value, "default" if is_default else "case file") for key, value, is_default in content.case_rows],
    )
    provenance = Table("Provenance", ("Item", "Value"), content.provenance_rows)
    parts = [
        *(f'<p class="warning"><strong>Warning:</strong> {escape(text)}</p>' for text in content.warnings),
        table_html(summary),
        table_html(content.error_table),
        table_html(content.classical_table),
        "<h2>Figures</h2>" if content.figures else "",
        *(figure_html(caption, figure) for caption, figure in content.figures),
        table_html(case),
        table_html(provenance),
    ]
    return page_html(content.title, parts)


def page_html(title: str, parts: Iterable[str]) -> str:
    """A whole page around its parts, with the styles in it; empty parts are left out."""
    lines = [
        "<!DOCTYPE html>",
        '<html lang="en">',
        "<head>",
        '<meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>{escape(title)}</title>",
        f"<style>{_STYLE}</style>",
        "</head>",
        "<body>",
        f"<h1>{escape(title)}</h1>",
        *(part for part in parts if part),
        "</body>",
        "</html>",
    ]
    return "\n".join(lines) + "\n"


def format_cell(value: Cell) -> str:
    """A number as an engineer reads it: four significant digits, a dash where there is none."""
    if value is None or (isinstance(value, float) and value != value):
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    # 12345.6 keeps its integer digits; only the very large and very small go to powers of ten.
    if isinstance(value, float):
        return f"{value:.4g}" if abs(value) < 1e4 or abs(value) >= 1e7 else f"{value:.0f}"
    return str(value)


def table_html(table: Table, level: int = 2) -> str:
    """A table with its title as a heading of a level; nothing for a table without rows."""
    if not table.rows:
        return ""
    numeric = [_is_numeric(row[i] for row in table.rows) for i in range(len(table.columns))]
    head = "".join(_cell_html("th", name, right) for name, right in zip(table.columns, numeric, strict=True))
    body = "\n".join(
        "<tr>"
        + "".join(_cell_html("td", format_cell(cell), right) for cell, right in zip(row, numeric, strict=True))
        + "</tr>"
        for row in table.rows
    )
    note = f'<p class="faint">{escape(table.note)}</p>' if table.note else ""
    return (
        f'<h{level}>{escape(table.title)}</h{level}>\n<div class="scroll"><table>\n<thead><tr>{head}</tr></thead>\n'
        f"<tbody>\n{body}\n</tbody>\n</table></div>\n{note}"
    )


def _is_numeric(cells: Iterable[Cell]) -> bool:
    """A column is right-aligned when it holds numbers and nothing but numbers and gaps."""
    present = [cell for cell in cells if cell is not None]
    return bool(present) and all(isinstance(c, (int, float)) and not isinstance(c, bool) for c in present)


def _cell_html(tag: str, text: str, numeric: bool) -> str:
    return f'<{tag} class="number">{escape(text)}</{tag}>' if numeric else f"<{tag}>{escape(text)}</{tag}>"


def figure_html(caption: str, figure: Figure) -> str:
    """A picture in the page itself, with its caption."""
    return (
        f'<figure><img alt="{escape(caption, quote=True)}" src="data:image/png;base64,{png_base64(figure)}">'
        f"<figcaption>{escape(caption)}</figcaption></figure>"
    )
