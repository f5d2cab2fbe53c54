"""The report of a study: one list of blocks, written as a self-contained HTML page and as Markdown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from pmor.report.report import Table, figure_html, format_cell, page_html, table_html
from pmor.storage.atomic import atomic_path

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Heading:
    """A section's heading."""

    text: str


@dataclass(frozen=True)
class Warning:
    """What the reader must know before the numbers."""

    text: str


@dataclass(frozen=True)
class Picture:
    """A picture; the Markdown refers to it by its file name."""

    file_name: str
    caption: str
    figure: Figure


Block = str | Heading | Warning | Table | Picture


def write_study_report(folder: Path, title: str, blocks: Sequence[Block]) -> None:
    """Write `report.html` and `study.md`.

    Raises
    ------
    OutputError
    """
    for name, text in (("report.html", study_html(title, blocks)), ("study.md", study_markdown(title, blocks))):
        with atomic_path(folder / name) as temporary:
            Path(temporary).write_text(text, encoding="utf-8")


def study_html(title: str, blocks: Sequence[Block]) -> str:
    """The page as text, with everything in it."""
    return page_html(title, map(_html, blocks))


def study_markdown(title: str, blocks: Sequence[Block]) -> str:
    """The same as Markdown, with the pictures beside it."""
    return "\n\n".join([f"# {title}", *map(_markdown, blocks)]) + "\n"


def _html(block: Block) -> str:
    if isinstance(block, Heading):
        return f"<h2>{escape(block.text)}</h2>"
    if isinstance(block, Warning):
        return f'<p class="warning"><strong>Warning:</strong> {escape(block.text)}</p>'
    if isinstance(block, Table):
        return table_html(block, level=3)
    if isinstance(block, Picture):
        return figure_html(block.caption, block.figure)
    return f"<p>{escape(block)}</p>"


def _markdown(block: Block) -> str:
    if isinstance(block, Heading):
        return f"## {block.text}"
    if isinstance(block, Warning):
        return f"> **Warning:** {block.text}"
    if isinstance(block, Table):
        return _table_markdown(block)
    if isinstance(block, Picture):
        return f"![{block.caption}]({block.file_name})\n\n*{block.caption}*"
    return block


def _table_markdown(table: Table) -> str:
    lines = [f"### {table.title}", "", _line(table.columns), _line(["---"] * len(table.columns))]
    lines += [_line([format_cell(cell) for cell in row]) for row in table.rows]
    return "\n".join([*lines, *(["", table.note] if table.note else [])])


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
