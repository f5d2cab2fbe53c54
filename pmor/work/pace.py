"""Progress of long work, in lines of the log "pmor"."""

from __future__ import annotations

import logging
import threading
import time

from pmor.core.progress import format_time

LOG = logging.getLogger("pmor")
# Least time between two lines.
EVERY_S = 2.0


class Beat:
    """When the next line may be told; shared by works that follow each other quickly."""

    next_s = 0.0

    def due(self, now: float, every_s: float) -> bool:
        """Whether a line may be told now; the next one may so much later."""
        if now < self.next_s:
            return False
        self.next_s = now + every_s
        return True


class Pace:
    """Logs the finished share of some work, and the time left; safe to share between threads.

    Parameters
    ----------
    what : str
        The items in the plural, such as "designs".
    total : int
        Number of items.
    done : int
        Items that an earlier run has finished; they do not count for the rate.
    every_s : float
        Least time between two lines, s.
    beat : Beat, optional
        That of works before this one.
    """

    def __init__(
        self, what: str, total: int, done: int = 0, *, every_s: float = EVERY_S, beat: Beat | None = None
    ) -> None:
        self._what, self._total, self._taken_over, self._done = what, total, done, done
        self._every_s, self._lock = every_s, threading.Lock()
        self._begin, self._beat = time.perf_counter(), beat or Beat()
        if done:
            LOG.info("%s: %d of %d are finished and taken over", what, done, total)

    def step(self, count: int = 1) -> None:
        """Count items as done."""
        with self._lock:
            self._done += count

    def tell(self, doing: str = "") -> None:
        """Log a line, at most one in ``every_s``.

        Parameters
        ----------
        doing : str
            Name of the item that begins.
        """
        with self._lock:
            now = time.perf_counter()
            if not self._beat.due(now, self._every_s):
                return
            fresh, passed = self._done - self._taken_over, now - self._begin
            line = f"{self._what}: {self._done} of {self._total} done"
            if fresh and passed > 0.0:
                rate = fresh / passed
                line += f", {rate:.3g} a second, {format_time((self._total - self._done) / rate)} left"
            LOG.info("%s", f"{line}; now {doing}" if doing else line)
