"""Self-contained HTML pages, made of blocks: text, warnings, tables, pictures, a live model, designs to explore.

Styles are inline and pictures are data URIs: a page can be mailed, archived and printed without anything beside it.
The layout is in `templates`.
"""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from pmor.report.live.section import LiveSection
from pmor.report.style import picture_bytes
from pmor.report.table import Table
from pmor.report.template import html_template
from pmor.storage.atomic import atomic_path

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from pmor.report.explorer import Designs


@dataclass(frozen=True)
class Heading:
    """A section's heading."""

    text: str


@dataclass(frozen=True)
class Warning:
    """A warning beside the numbers."""

    text: str


@dataclass(frozen=True)
class Picture:
    """A picture, the name of its file beside the page, and the format that the page itself shows.

    File and page share the drawing, which takes longer than most results.
    """

    file_name: str
    caption: str
    figure: Figure
    shown_as: str = "png"
    drawn: dict[str, bytes] = field(default_factory=dict, repr=False, compare=False)

    def content(self, picture_format: str) -> bytes:
        """Return the content of a file of a format."""
        if picture_format not in self.drawn:
            self.drawn[picture_format] = picture_bytes(self.figure, picture_format)
        return self.drawn[picture_format]


# Those that run: data are of another type.
SCRIPT = re.compile("<script>(.*?)</script>", re.DOTALL)
#: parts of a page; text is a paragraph
Block = str | Heading | Warning | Table | Picture


def write_page(path: Path, title: str, blocks: Iterable[Block | LiveSection | Designs]) -> None:
    """Write a page; the target is replaced only when it is complete; OutputError where it cannot be."""
    page = page_html(title, blocks)
    with atomic_path(path) as temporary:
        temporary.write_text(page, encoding="utf-8")


def page_html(title: str, blocks: Iterable[Block | LiveSection | Designs]) -> str:
    """Return a page as text. Tables without rows are left out with their titles.

    Its policy of content security lets no script run but its own, told by their hashes, and nothing be fetched.
    """
    named = [(type(block).__name__, block) for block in blocks]
    page = html_template("page.html").render(title=title, blocks=named, kinds={name for name, _ in named})
    hashes = {base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in SCRIPT.findall(page)}
    allowed = " ".join(f"'sha256-{value}'" for value in sorted(hashes)) or "'none'"
    return page.replace("SCRIPTS", allowed, 1)
