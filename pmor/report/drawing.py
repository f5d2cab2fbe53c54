"""Pictures drawn by two processes, where that is safe: most of the time to a page goes into their text and axes."""

from __future__ import annotations

import multiprocessing
import os
import sys
from collections.abc import Sequence
from multiprocessing.connection import Connection
from pathlib import Path

from pmor.report.page import Picture

# Threads of this process, on Linux.
THREADS = Path("/proc/self/task")


def draw(pictures: Sequence[Picture], formats: Sequence[str]) -> None:
    """Draw pictures in some formats, half of them in a copy of this process.

    A copy has one thread, and others' locks as they are: it is made where there are no others. What it cannot do is
    done here.
    """
    theirs = pictures[1::2] if formats and _can_be_copied() else ()
    if theirs:
        context = multiprocessing.get_context("fork")
        receiver, sender = context.Pipe(duplex=False)
        copy = context.Process(target=_send, args=(theirs, formats, sender), daemon=True)
        try:
            copy.start()
            sender.close()
            _draw(pictures[::2], formats)
            for picture, drawn in zip(theirs, receiver.recv(), strict=False):
                picture.drawn.update(drawn)
        except (EOFError, OSError):
            pass  # no process, or one that ended
        finally:
            receiver.close()
            if copy.pid is not None:
                copy.kill()
                copy.join()
    _draw(pictures, formats)


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


def _can_be_copied() -> bool:
    """Whether this process has a single thread, and a second processor to use."""
    if sys.platform != "linux" or multiprocessing.current_process().daemon:
        return False
    try:
        return len(os.sched_getaffinity(0)) > 1 == len(list(THREADS.iterdir()))
    except OSError:
        return False
