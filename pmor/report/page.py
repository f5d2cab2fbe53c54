"""Self-contained HTML pages, made of blocks: paragraphs, headings, warnings, tables, pictures, and a live model.

Styles are inline and pictures are data URIs: a page can be mailed, archived and printed without anything beside it.
What it looks like is in `templates`.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from pmor.report.live.section import LiveSection
from pmor.report.style import data_uri, picture_bytes
from pmor.report.table import Table, format_cell
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
    """A picture, the name of its file where it is written beside the page, and how the page itself shows it.

    File and page share what was drawn: drawing takes longer than most of what it shows.
    """

    file_name: str
    caption: str
    figure: Figure
    shown_as: str = "png"
    drawn: dict[str, bytes] = field(default_factory=dict, repr=False, compare=False)

    def content(self, picture_format: str) -> bytes:
        """Return what a file of a format holds."""
        if picture_format not in self.drawn:
            self.drawn[picture_format] = picture_bytes(self.figure, picture_format)
        return self.drawn[picture_format]


#: what a page is made of; text is a paragraph
Block = str | Heading | Warning | Table | Picture


def write_page(path: Path, title: str, blocks: Iterable[Block | LiveSection]) -> None:
    """Write a page; the target is replaced only when it is complete.

    Raises
    ------
    OutputError
    """
    page = page_html(title, blocks)
    with atomic_path(path) as temporary:
        temporary.write_text(page, encoding="utf-8")


def page_html(title: str, blocks: Iterable[Block | LiveSection]) -> str:
    """Return a page as text. Tables without rows are left out with their titles."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("pmor.report"), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True, keep_trailing_newline=True,
    )  # fmt: skip
    environment.filters.update(format_cell=format_cell, data_uri=data_uri, json_text=_json_text)
    template = environment.get_template("page.html")
    named = [(type(block).__name__, block) for block in blocks]
    return template.render(title=title, blocks=named, kinds={name for name, _ in named})


def _json_text(data: object) -> str:
    """Data for a script: no tag ends or begins in it."""
    text = json.dumps(data, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c")
