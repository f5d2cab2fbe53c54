"""Tables from rows of plain data, and as aligned text for the screen."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from pmor.report.table import Cell, Table, format_cell

Row = Mapping[str, Any]
# A key of the row, or a function of the row.
Column = str | Callable[[Any], Cell]
Columns = Mapping[str, Column]


def table(title: str, columns: Columns, rows: Iterable[Any], note: str = "") -> Table:
    """Return a table.

    Parameters
    ----------
    columns : mapping of str to Column
        By heading.
    rows : iterable of mapping
        Of anything, where all columns are callables.
    """
    cells = [[column(row) if callable(column) else row[column] for column in columns.values()] for row in rows]
    return Table(title, tuple(columns), cells, note)


def percent(key: str) -> Callable[[Row], float | None]:
    """Return the column of a relative quantity in per cent."""
    return lambda row: None if row.get(key) is None else 100.0 * row[key]


def two_digits(value: float | None) -> float | None:
    """Round for a column in which only the order of magnitude counts."""
    return None if value is None else float(f"{value:.2g}")


def text_lines(shown: Table) -> list[str]:
    """Return heading and rows of a table as lines for the screen; all but the first column stand right."""
    rows = [list(shown.columns), *([format_cell(cell) for cell in row] for row in shown.rows)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = [[f"{row[0]:<{widths[0]}}", *map("{:>{}}".format, row[1:], widths[1:])] for row in rows]
    return ["  ".join(line).rstrip() for line in lines]
