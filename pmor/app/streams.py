"""Standard streams that cannot take all output: closed ones, broken pipes, encodings of few characters.

Results are in files: a command must not stop because nobody reads its output, nor lose words for their letters.
"""

from __future__ import annotations

import errno
import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, TextIO


@contextmanager
def usable_streams() -> Iterator[None]:
    """Give a command an output and an error stream that it can write to, whatever it was started with.

    Errors go to the output where the error stream is closed. A write that fails for want of space raises OSError once.
    """
    before = sys.stdout, sys.stderr
    _occupy_closed()
    output = _usable(sys.stdout) or _nowhere()
    errors = _usable(sys.stderr) or output
    sys.stdout, sys.stderr = output, errors
    try:
        yield
    finally:
        for stream in (output, errors):
            with suppress(OSError):  # reported already, where possible
                stream.flush()
        sys.stdout, sys.stderr = before


def _occupy_closed() -> None:
    """Keep the numbers of closed streams from the files that are opened next: libraries write errors to number 2."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)


def _nowhere() -> TextIO:
    return io.TextIOWrapper(io.BytesIO(), encoding="utf-8")


def _usable(stream: TextIO | None) -> Any:
    """The same stream, forgiving; None for one that was closed."""
    if stream is None:
        return None
    try:
        number = stream.fileno()
    except (AttributeError, OSError, ValueError):
        return stream  # a notebook's
    stream.flush()
    outlet = io.BufferedWriter(_Outlet(number, "w", closefd=False))
    by_line = bool(getattr(stream, "line_buffering", False))
    return io.TextIOWrapper(outlet, stream.encoding, "backslashreplace", line_buffering=by_line)


class _Outlet(io.FileIO):
    """A descriptor whose reader may leave; later output is dropped."""

    _open = True

    def write(self, data: Any) -> int:
        if self._open:
            try:
                return super().write(data)
            except OSError as error:
                self._open = False
                if error.errno != errno.EPIPE:
                    raise
        return len(data)
