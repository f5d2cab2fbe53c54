"""Tables as an engineer reads them: cells of text and numbers, four significant digits."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pmor.report.verdict import verdict_text
from pmor.results.quantities import TABLE

#: content of a cell; None is shown as a dash, a float in four significant digits
Cell = str | float | int | bool | None
#: cells of a column from a row: by a key of it, or a function of it
Column = str | Callable[[Any], Cell]
#: by their heads
Columns = Mapping[str, Column]
# Letters of a cell beyond which a phone has no room for a further column.
LONG_TEXT = 30
# Numbers that are written out, with the decimals that their reader expects.
DECIMAL = re.compile(r"-?\d+(\.\d+)?")


@dataclass(frozen=True)
class Table:
    """A table of a page; every row has as many cells as ``columns``. A folded one shows its title until opened."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    note: str = ""
    folded: bool = False

    def __post_init__(self) -> None:
        """A short row would shift numbers under the wrong heading."""
        for row in self.rows:
            if len(row) != len(self.columns):
                raise ValueError(f"table {self.title!r}: row {tuple(row)} does not have {len(self.columns)} cells")

    def wordy(self) -> bool:
        """Return whether cells behind the first hold sentences: on a phone its rows become lists."""
        return any(isinstance(cell, str) and len(cell) > LONG_TEXT for row in self.rows for cell in row[1:])

    def numeric_columns(self) -> list[bool]:
        """Return for each column whether it holds numbers and gaps alone: aligned to the right."""
        return [_is_numeric(row[i] for row in self.rows) for i in range(len(self.columns))]


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


def _is_numeric(cells: Iterable[Cell]) -> bool:
    present = [cell for cell in cells if cell is not None]
    return bool(present) and all(map(_is_number, present))


def _is_number(cell: Cell) -> bool:
    """Whether a cell is a number, or text of one with its decimals."""
    return DECIMAL.fullmatch(cell) is not None if isinstance(cell, str) else not isinstance(cell, bool)


def aligned_lines(columns: Sequence[str], rows: Sequence[Sequence[Cell]]) -> list[str]:
    """Return a table in lines of text for the screen, its numbers aligned to the right."""
    numeric = Table("", columns, rows).numeric_columns()
    cells = [list(columns), *([format_cell(cell) for cell in row] for row in rows)]
    widths = [max(len(row[i]) for row in cells) for i in range(len(columns))]
    return [
        "  ".join(f"{cell:>{width}}" if right else f"{cell:<{width}}"
                  for cell, width, right in zip(row, widths, numeric, strict=True)).rstrip()
        for row in cells
    ]  # fmt: skip


def table(title: str, columns: Columns, rows: Iterable[Any], note: str = "") -> Table:
    """Return a table of rows of plain data, or of anything where all columns are functions."""
    cells = [[column(row) if callable(column) else row[column] for column in columns.values()] for row in rows]
    return Table(title, tuple(columns), cells, note)


def heads(*keys: str) -> dict[str, Column]:
    """Return columns of quantities by their keys, with heads and units as the table of quantities has them."""
    return {TABLE[key].head: percent(key) if TABLE[key].percent else key for key in keys}


def percent(key: str) -> Callable[[Mapping[str, Any]], float | None]:
    """Return the column of a relative quantity in per cent."""
    return lambda row: None if row.get(key) is None else 100.0 * row[key]


def two_digits(value: float | None) -> float | None:
    """Round for a column in which only the order of magnitude counts."""
    return None if value is None else float(f"{value:.2g}")


def text_lines(shown: Table) -> list[str]:
    """Return heads and rows of a table as lines for the screen."""
    return aligned_lines(shown.columns, shown.rows)


def told_tables(data: Mapping[str, Any]) -> list[Table]:
    """Return what data of a machine leave out, and what was assumed, as tables; none where there is nothing."""
    heads = {"left_out": ("Left out", "what, and why"),
             "assumptions": ("Assumptions", "what the file does not say, and what was taken")}  # fmt: skip
    told = ((title, head, data.get(key)) for key, (title, head) in heads.items())
    return [Table(title, (head,), [[text] for text in texts]) for title, head, texts in told if texts]


def screen_text(title: str, tables: Iterable[Table], data: Mapping[str, Any], warnings: Iterable[str]) -> str:
    """Return what a command prints of a machine: its tables, what is left out and assumed, and warnings."""
    lines = [title, *verdict_text(data["verdict"])]
    for shown in tables:
        lines += [f"  {shown.title}", *(f"    {line}" for line in text_lines(shown))]
    lines += [f"  left out: {text}" for text in data["left_out"]]
    lines += [f"  note: {text}" for text in data["assumptions"]]
    return "\n".join([*lines, *(f"  ! {sentence}" for sentence in warnings)])
