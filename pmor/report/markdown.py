"""Blocks of a page as Markdown, with its pictures in files beside it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from pmor.report.page import Block, Heading, Picture, Warning
from pmor.report.table import Table, format_cell
from pmor.results.verdict import Verdict
from pmor.storage.atomic import atomic_path

# Where HTML begins, or a link goes on.
MARKUP = re.compile(r"<(?=[A-Za-z/!?])|&(?=#?\w+;)|(?<=\])\(")
ENTITIES = {"<": "&lt;", "&": "&amp;", "(": "\\("}


def write_markdown(path: Path, title: str, blocks: Iterable[Block]) -> None:
    """Write a page as Markdown; the target is replaced only when it is complete; OutputError where it cannot be."""
    with atomic_path(path) as temporary:
        temporary.write_text(page_markdown(title, blocks), encoding="utf-8")


def page_markdown(title: str, blocks: Iterable[Block]) -> str:
    """Return the page as text; pictures are referred to by their file names."""
    return "\n\n".join(filter(None, [f"# {_plain(title)}", *map(_markdown, blocks)])) + "\n"


def _markdown(block: Block) -> str:
    if isinstance(block, Heading):
        return f"## {_plain(block.text)}"
    if isinstance(block, Verdict):
        return "\n".join(f"* **{head}:** {_plain(text)}" for head, text in block.lines)
    if isinstance(block, Warning):
        return f"> **Warning:** {_plain(block.text)}"
    if isinstance(block, Table):
        return _table_markdown(block)
    if isinstance(block, Picture):
        caption = _plain(block.caption)
        return f"![{caption}]({block.file_name})\n\n*{caption}*"
    return _plain(block)


def _table_markdown(table: Table) -> str:
    if not table.rows:
        return ""
    lines = [f"### {_plain(table.title)}", "", _line(table.columns), _line(["---"] * len(table.columns))]
    lines += [_line([format_cell(cell) for cell in row]) for row in table.rows]
    return "\n".join([*lines, *(["", _plain(table.note)] if table.note else [])])


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(_plain(cell).replace("|", "\\|") for cell in cells) + " |"


def _plain(text: str) -> str:
    """Text in which names that look like tags, entities or links stay what they are."""
    return MARKUP.sub(lambda found: ENTITIES[found[0]], text)
