"""Progress of long loops on the terminal."""

from __future__ import annotations

import logging
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import Any

# Steps after the first one, below which a rate says nothing.
FEWEST_WAITS = 3
# Seconds of silence after which a stage is told of, where nobody listens to the log.
LONG_S = 2.0
_LOG = logging.getLogger("pmor")
#: progress of long work: called with the number of steps just done
Steps = Callable[[int], None]


def quietly(steps: int) -> None:
    """Take progress that nobody asked for."""


@contextmanager
def stage(what: str) -> Iterator[None]:
    """Tell of work that begins, in a line of the log; where nobody listens, on the error stream if it takes long."""
    words = f"{what} ..."
    if _LOG.isEnabledFor(logging.INFO):
        _LOG.info("%s", words)
        yield
        return
    with told_late(words):
        yield


class Late(threading.Timer):
    """Waits, with no lock that anything else takes, and tells of work that takes long."""


@contextmanager
def told_late(words: str) -> Iterator[None]:
    """Tell of work in the log once it has taken longer than anyone waits without a word."""
    # A warning is shown where nobody listens to the log; where somebody does, it is none.
    level = logging.INFO if _LOG.isEnabledFor(logging.INFO) else logging.WARNING
    late = Late(LONG_S, _LOG.log, (level, "%s", words))
    late.daemon = True
    late.start()
    try:
        yield
    finally:
        late.cancel()


class Progress:
    """A bar on stderr with count, rate and time left; silent where stderr is no terminal and there is no notebook.

    Rate and time left are told once progress is steady: a first step may compile kernels or read a model.

    Parameters
    ----------
    total : int
        Number of steps.
    label : str
        Name of the steps, such as "full FE".
    done : int
        Steps that an earlier run has done; they do not count for the rate.
    further : callable
        Called with each number of steps too.

    Examples
    --------
    >>> with Progress(3, "positions") as progress:
    ...     for _ in range(3):
    ...         progress.step()
    """

    def __init__(self, total: int, label: str, done: int = 0, further: Steps = quietly) -> None:
        self._bar, self._further = _bar(total, label, done), further

    def step(self, n: int = 1) -> None:
        """Count `n` more steps as done."""
        if self._bar is not None:
            self._bar.update(n)
        self._further(n)

    def close(self) -> None:
        """End the line; further calls do nothing."""
        if self._bar is not None:
            self._bar.close()

    def __enter__(self) -> Progress:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class SteadyRate:
    """Steps per second after the first one, the longest wait left out: some later step compiles as well.

    Parameters
    ----------
    clock : callable
        Gives seconds.
    """

    def __init__(self, clock: Callable[[], float] = time.perf_counter) -> None:
        self._clock, self._last = clock, float("nan")
        self._waits, self._steps, self._seconds = 0, 0, 0.0
        self._longest, self._steps_in_longest = 0.0, 0

    def step(self, n: int) -> None:
        """Note that `n` more steps are done."""
        now = self._clock()
        wait, self._last = now - self._last, now
        if wait != wait:  # the first step
            return
        self._waits, self._steps, self._seconds = self._waits + 1, self._steps + n, self._seconds + wait
        if wait > self._longest:
            self._longest, self._steps_in_longest = wait, n

    @property
    def per_second(self) -> float | None:
        """Return the rate; None before there are enough steps to tell."""
        seconds = self._seconds - self._longest
        if self._waits < FEWEST_WAITS or seconds <= 0.0:
            return None
        return (self._steps - self._steps_in_longest) / seconds


def format_time(seconds: float) -> str:
    """Write a duration the way people say it: `4.2 s`, `3 min 05 s`, `2 h 10 min`."""
    if seconds < 59.95:
        return f"{seconds:.1f} s"
    whole = round(seconds)
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"


def _bar(total: int, label: str, done: int) -> Any:
    """Return tqdm's bar, which is imported only where somebody looks at it; None elsewhere."""
    if "ipykernel" in sys.modules:
        from tqdm.auto import tqdm
    elif sys.stderr is not None and sys.stderr.isatty():
        from tqdm import tqdm
    else:
        return None

    rate = SteadyRate()

    class Bar(tqdm):  # type: ignore[misc]
        # tqdm's monitor would be a thread, which worker processes forked meanwhile inherit in whatever state it is.
        monitor_interval = 0

        def update(self, n: int = 1) -> Any:
            rate.step(n)
            return super().update(n)

        @property
        def format_dict(self) -> dict[str, Any]:
            # A rate of zero is shown as unknown; none would let tqdm take the average from the start.
            return {**super().format_dict, "rate": rate.per_second or 0.0}

    return Bar(total=total, desc=label, initial=done, miniters=1, dynamic_ncols=True)
