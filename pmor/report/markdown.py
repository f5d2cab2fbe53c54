"""Blocks of a page as Markdown, with its pictures in files beside it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from pmor.report.page import Block, Heading, Picture, Warning
from pmor.report.table import Table, format_cell
from pmor.storage.atomic import atomic_path


def write_markdown(path: Path, title: str, blocks: Iterable[Block]) -> None:
    """Write a page as Markdown; the target is replaced only when it is complete; OutputError where it cannot be."""
    with atomic_path(path) as temporary:
        temporary.write_text(page_markdown(title, blocks), encoding="utf-8")


def page_markdown(title: str, blocks: Iterable[Block]) -> str:
    """Return the page as text; pictures are referred to by their file names."""
    return "\n\n".join([f"# {title}", *filter(None, map(_markdown, blocks))]) + "\n"


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
    if not table.rows:
        return ""
    lines = [f"### {table.title}", "", _line(table.columns), _line(["---"] * len(table.columns))]
    lines += [_line([format_cell(cell) for cell in row]) for row in table.rows]
    return "\n".join([*lines, *(["", table.note] if table.note else [])])


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
