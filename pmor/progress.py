"""Progress of long loops on the terminal."""

import sys
import time
from collections.abc import Callable
from types import TracebackType
from typing import TextIO

SECONDS_BETWEEN_UPDATES = 0.1


class Progress:
    """One line on stderr with count, rate and time left; silent where stderr is no terminal.

    Parameters
    ----------
    total : int
        Number of steps.
    label : str
        What the steps are, such as "full contact".
    stream : TextIO, optional
        Where to write; stderr by default.
    clock : callable, optional
        Gives the time in seconds.

    Examples
    --------
    >>> with Progress(3, "positions") as progress:
    ...     for _ in range(3):
    ...         progress.advance()
    """

    def __init__(
        self, total: int, label: str, stream: TextIO | None = None, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.total = total
        self.label = label
        self.done = 0
        self._stream = sys.stderr if stream is None else stream
        self._clock = clock
        self._start = clock()
        self._last_update = -float("inf")
        self._width = 0
        self._open = self._stream.isatty()

    def advance(self, n: int = 1) -> None:
        """Count `n` more steps as done."""
        self.done += n
        now = self._clock()
        if self._open and (self.done >= self.total or now - self._last_update >= SECONDS_BETWEEN_UPDATES):
            self._last_update = now
            self._write(self._line(now - self._start))

    def close(self) -> None:
        """End the line with the time taken; further calls do nothing."""
        if self._open:
            self._write(f"{self.label}: {self.done}/{self.total} in {format_time(self._clock() - self._start)}")
            self._stream.write("\n")
            self._stream.flush()
            self._open = False

    def __enter__(self) -> "Progress":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _line(self, elapsed: float) -> str:
        line = f"{self.label}: {self.done}/{self.total}"
        if self.done > 0 and elapsed > 0.0:
            rate = self.done / elapsed
            left = max(self.total - self.done, 0) / rate
            line += f", {rate:.3g}/s, {format_time(left)} left"
        return line

    def _write(self, line: str) -> None:
        # Blanks wipe what a longer line left behind.
        self._stream.write("\r" + line.ljust(self._width))
        self._stream.flush()
        self._width = len(line)


def format_time(seconds: float) -> str:
    """Write a duration the way people say it: `4.2 s`, `3 min 05 s`, `2 h 10 min`."""
    if seconds < 59.95:
        return f"{seconds:.1f} s"
    whole = round(seconds)
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"
