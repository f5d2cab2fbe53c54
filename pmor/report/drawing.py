"""Pictures drawn by several processes, where that is safe: a page's time goes into text, axes and digits."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from functools import partial

from pmor.core.copies import copies, in_a_copy
from pmor.report.chart import Chart
from pmor.report.page import Picture


def draw(pictures: Sequence[Picture], formats: Sequence[str]) -> None:
    """Draw pictures in some formats, shared out between this process and copies of it.

    What a copy cannot do is done here. Charts as SVG take less time than a copy.
    """
    pictures, quick = (
        [picture for picture in pictures if (isinstance(picture.figure, Chart) and [*formats] == ["svg"]) is own]
        for own in (False, True)
    )
    _drawn(quick, formats)
    shares = min(copies() + 1, len(pictures)) if formats and pictures else 1
    with ExitStack() as stack:
        parts = [pictures[number::shares] for number in range(1, shares)]
        found = [stack.enter_context(in_a_copy(partial(_drawn, part, formats))) for part in parts]
        _drawn(pictures[::shares], formats)
        for part, drawn in zip(parts, found, strict=True):
            for picture, content in zip(part, drawn(), strict=True):
                picture.drawn.update(content)


def _drawn(pictures: Sequence[Picture], formats: Sequence[str]) -> list[dict[str, bytes]]:
    for picture in pictures:
        for picture_format in formats:
            picture.content(picture_format)
    return [picture.drawn for picture in pictures]
