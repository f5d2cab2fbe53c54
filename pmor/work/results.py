"""What a laboratory leaves in its folder: numbers, pictures, and the same page as HTML and as Markdown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pmor.report.data_files import write_summary_json
from pmor.report.markdown import write_markdown
from pmor.report.page import Block, Picture, write_page
from pmor.report.style import write_picture


def write_results(
    folder: Path, name: str, data: Mapping[str, Any], title: str, blocks: Sequence[Block], page: str = "report.html"
) -> None:
    """Write ``<name>.json``, ``<name>.md``, the pictures and the page.

    Parameters
    ----------
    folder : Path
    name : str
    data : mapping
        Plain data.
    title : str
    blocks : sequence of Block
        In the order of reading.
    page : str
        File name of the page.

    Raises
    ------
    OutputError
    """
    write_summary_json(folder / f"{name}.json", data)
    for block in blocks:
        if isinstance(block, Picture):
            write_picture(block.content("png"), folder / block.file_name)
    write_page(folder / page, title, blocks)
    write_markdown(folder / f"{name}.md", title, blocks)
