"""Pictures and files made by several processes, where that is safe: a page's time goes into text, axes and digits."""

from __future__ import annotations

import multiprocessing
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from pathlib import Path

from pmor.report.chart import Chart
from pmor.report.page import Picture

# Threads of this process, on Linux.
THREADS = Path("/proc/self/task")
# More bring little: the pictures of a run differ in effort.
MOST_COPIES = 3


def draw(pictures: Sequence[Picture], formats: Sequence[str]) -> None:
    """Draw pictures in some formats, shared out between this process and copies of it.

    A copy has one thread, and others' locks as they are: it is made where there are no others. What it cannot do is
    done here. Charts as SVG take less time than a copy.
    """
    pictures, quick = (
        [picture for picture in pictures if (isinstance(picture.figure, Chart) and [*formats] == ["svg"]) is own]
        for own in (False, True)
    )
    _draw(quick, formats)
    shares = min(_copies() + 1, len(pictures)) if formats and pictures else 1
    copies = [_Copy(pictures[number::shares], formats) for number in range(1, shares)]
    try:
        _draw(pictures[::shares] if shares > 1 else (), formats)
        for copy in copies:
            copy.take()
    finally:
        for copy in copies:
            copy.end()
    _draw(pictures, formats)


@contextmanager
def beside(work: Callable[[], None]) -> Iterator[None]:
    """Do work in a copy of this process, where one may be made, while this one goes on; else, or if it fails, here."""
    process = multiprocessing.get_context("fork").Process(target=_do, args=(work,), daemon=True) if _copies() else None
    if process is not None:
        with suppress(OSError):
            process.start()
    try:
        yield
        if process is not None and process.pid is not None:
            process.join()
    finally:
        if process is not None and process.is_alive():
            process.kill()
            process.join()
    if process is None or process.exitcode != 0:
        work()


def _do(work: Callable[[], None]) -> None:
    try:
        work()
    except BaseException:
        os._exit(1)  # this process meets and tells the same


class _Copy:
    """A copy of this process that draws pictures; nobody waits for one that could not be made."""

    def __init__(self, pictures: Sequence[Picture], formats: Sequence[str]) -> None:
        context = multiprocessing.get_context("fork")
        self._pictures, (self._receiver, sender) = pictures, context.Pipe(duplex=False)
        self._process = context.Process(target=_send, args=(pictures, formats, sender), daemon=True)
        with suppress(OSError):
            self._process.start()
        sender.close()

    def take(self) -> None:
        """Take the pictures over, if they come."""
        with suppress(EOFError, OSError):
            for picture, drawn in zip(self._pictures, self._receiver.recv(), strict=True):
                picture.drawn.update(drawn)

    def end(self) -> None:
        """Leave no process behind."""
        self._receiver.close()
        if self._process.pid is not None:
            self._process.kill()
            self._process.join()


def _draw(pictures: Sequence[Picture], formats: Sequence[str]) -> None:
    for picture in pictures:
        for picture_format in formats:
            picture.content(picture_format)


def _send(pictures: Sequence[Picture], formats: Sequence[str], sender: Connection) -> None:
    try:
        _draw(pictures, formats)
    except BaseException:
        os._exit(1)  # this process meets and tells the same
    sender.send([picture.drawn for picture in pictures])


def _copies() -> int:
    """How many copies of this process may draw: it has a single thread, and further processors to use."""
    if sys.platform != "linux" or multiprocessing.current_process().daemon:
        return 0
    try:
        return min(len(os.sched_getaffinity(0)) - 1, MOST_COPIES) if len(list(THREADS.iterdir())) == 1 else 0
    except OSError:
        return 0
