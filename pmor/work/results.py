"""The shell of a folder of results: numbers, pictures, and the same page as HTML and as Markdown."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pmor.case import Case
from pmor.report.data_files import write_summary_json
from pmor.report.drawing import draw
from pmor.report.markdown import write_markdown
from pmor.report.page import Block, Picture, provenance, write_page
from pmor.report.style import write_picture
from pmor.storage.results_folder import remove_working_folder, results_folder, start_results
from pmor.work.pieces import PARTS


@dataclass(frozen=True)
class Report:
    """Numbers and page of a result.

    Parameters
    ----------
    name : str
        Of the files ``<name>.json`` and ``<name>.md``.
    data : mapping
        Plain data.
    blocks : sequence of Block
        In the order of reading, provenance left out.
    case : Case, optional
        Case named in the provenance.
    measured_on : mapping, optional
        As in `pmor.report.page.provenance`.
    page : str
        File name of the page.
    page_only : sequence of blocks
        Shown on the page after the others, and not in Markdown.
    """

    name: str
    data: Mapping[str, Any]
    title: str
    blocks: Sequence[Block]
    case: Case | None = None
    measured_on: Mapping[str, Any] | None = None
    page: str = "report.html"
    page_only: Sequence[Any] = ()

    def write(self, folder: Path) -> None:
        """Write ``<name>.json``, ``<name>.md``, the pictures and the page; OutputError where that fails."""
        write_summary_json(folder / f"{self.name}.json", self.data)
        pictures = [block for block in self.blocks if isinstance(block, Picture)]
        for kind in sorted({picture.picture_format for picture in pictures}):
            draw([picture for picture in pictures if picture.picture_format == kind], (kind,))
        for picture in pictures:
            write_picture(picture.content(picture.picture_format), folder / picture.file_name)
        last = provenance(self.case, self.measured_on)
        write_page(folder / self.page, self.title, [*self.blocks, *self.page_only, *last])
        write_markdown(folder / f"{self.name}.md", self.title, [*self.blocks, *last])


@contextmanager
def pieces_folder(
    folder: Path | str | None, files: Sequence[str], *, inputs: Sequence[Path] = (), overwrite: bool = False
) -> Iterator[Path]:
    """Give the folder of finished pieces, held by this process alone; OutputError where it cannot be.

    Parameters
    ----------
    folder : Path or str, optional
        Of the results; None: a temporary folder, which is removed afterwards.
    files, inputs, overwrite
        As in `pmor.storage.results_folder.results_folder`: files of others are refused now, before the work.
    """
    if folder is None:
        with tempfile.TemporaryDirectory() as temporary:
            yield Path(temporary) / PARTS
        return
    with results_folder(Path(folder), files, (PARTS,), overwrite, inputs):
        yield Path(folder) / PARTS


@contextmanager
def writing_results(
    folder: Path | str, files: Sequence[str], text: str, *,
    inputs: Sequence[Path] = (), overwrite: bool = False, working: Sequence[str] = (PARTS,), complete: bool = True,
) -> Iterator[Path]:  # fmt: skip
    """Give a folder to write results into; results of another text there are removed first.

    OutputError where that fails.

    Parameters
    ----------
    folder, files, inputs, overwrite, working
        As in `pmor.storage.results_folder.results_folder`.
    text : str
        Text that the results are made from, such as that of the case.
    complete : bool
        Remove these folders afterwards: nothing is left to resume.
    """
    with results_folder(Path(folder), files, working, overwrite, inputs) as held:
        start_results(held, text)
        yield held
        for name in working if complete else ():
            remove_working_folder(held / name)
