"""Solve a chunk in a process of its own, and watch over it: the work of an executor.

Each thread that an executor works with, wherever that is, has one solving process beside it, which goes on from chunk
to chunk. A design that ends it, or does not answer within its time, is tried once more in a new one; then its row has
the reason. Failures are therefore the same under all executors, and harm none.
"""

from __future__ import annotations

import atexit
import json
import os
import signal
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import asdict, dataclass
from typing import Any

from pmor.campaigns.kind import Design
from pmor.campaigns.rows import Answer, Row, Task, plain_row
from pmor.campaigns.solver import FAILED
from pmor.core.errors import ExternalProgramError
from pmor.core.threads import VARIABLES
from pmor.core.version import __version__

TRIES = 2
# For a process to load its libraries, from a disk that a thousand others ask as well.
START_LIMIT_S = 300.0
# For a process to end that answers no more.
PATIENCE_S = 5.0
# Warnings of libraries are none for the error stream of a command (`pmor.app.cli`).
COMMAND = (sys.executable, "-P", "-W", "ignore", "-m", "pmor.campaigns.solver")
_OWN = threading.local()


@dataclass(frozen=True)
class Order:
    """A chunk with all that it takes to solve it: plain data, for whichever machine. Designs are numbered from 1."""

    task: Task
    designs: tuple[tuple[int, Design], ...]
    chunk: int
    version: str = __version__


class Solvers:
    """The solving processes of an executor's threads: ended together, so that the threads beside them end."""

    def __init__(self) -> None:
        self._running: set[subprocess.Popen[str]] = set()
        self._lock, self.closing = threading.Lock(), False
        atexit.register(self.close)

    def start(self) -> subprocess.Popen[str]:
        """Start a process; Ended when they are being closed."""
        one_thread = dict.fromkeys((*VARIABLES, "NUMBA_NUM_THREADS"), "1")
        # From the same folders as this process, and not from the one that it happens to be in.
        path = {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
        with self._lock:  # no process starts behind the back of `close`
            if self.closing:
                raise Ended("the work was given up")
            try:
                process = subprocess.Popen(
                    COMMAND, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, encoding="utf-8",
                    env={**os.environ, **one_thread, **path},
                    start_new_session=True,  # an interruption on the terminal is for the one that watches over it
                )  # fmt: skip
            except OSError as error:
                raise Ended(f"its process did not start ({error.strerror})") from error
            self._running.add(process)
        return process

    def end(self, process: subprocess.Popen[str]) -> str:
        """End a process and return how it ended by itself."""
        try:
            code = process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            code = None
        process.kill()
        process.wait()
        for stream in (process.stdin, process.stdout):
            assert stream is not None
            with suppress(OSError):  # for orders that it did not take any more
                stream.close()
        with self._lock:
            self._running.discard(process)
        if code is not None and code < 0:
            return f"its process was ended by the signal {signal.Signals(-code).name}"
        return f"its process ended with the exit code {code}"

    def close(self) -> None:
        """End all of them; none starts any more."""
        with self._lock:
            self.closing = True
            for process in self._running:
                process.kill()

    def forget(self) -> None:
        """Close the pipes of all, once no thread waits for them."""
        for process in list(self._running):
            self.end(process)
        atexit.unregister(self.close)


# Of threads of executors that are not of this module.
_SHARED = Solvers()


class LocalProcesses(ThreadPoolExecutor):
    """An executor of so many solving processes on this machine: threads, each with one of them."""

    def __init__(self, jobs: int) -> None:
        self.jobs, self._solvers = jobs, Solvers()
        super().__init__(jobs, "campaign", lambda: setattr(_OWN, "solvers", self._solvers))

    def __exit__(self, *raised: object) -> None:
        self._solvers.close()
        self.shutdown(wait=True, cancel_futures=True)
        self._solvers.forget()


class Ended(Exception):
    """A solving process has ended; the message is the reason."""


def solve_order(order: Order) -> Answer:
    """Return the rows of a chunk, one for each design whatever becomes of it.

    Raises
    ------
    ExternalProgramError
        When the program on this machine is another version.
    RuntimeError
        When the work was given up meanwhile (`Solvers.close`).
    """
    if order.version != __version__:
        raise ExternalProgramError(
            f"pmor {order.version} gives the work, and {__version__} is installed where it is to be done: install one"
        )
    rows, seconds, tries = list[Row](), list[float](), 0
    while len(rows) < len(order.designs):
        before = len(rows)
        try:
            _ask(order, rows, seconds)
        except Ended as ended:
            if _solvers().closing:
                raise RuntimeError("the work was given up") from ended
            tries = 1 if len(rows) > before else tries + 1
            if tries == TRIES:
                number, design = order.designs[len(rows)]
                rows.append(plain_row(order.task, number, design, "lost", f"{ended}, {TRIES} times"))
                seconds.append(0.0)
                tries = 0
    return Answer(tuple(rows), tuple(seconds))


def lost_answer(order: Order, reason: str) -> Answer:
    """Return rows that say why there is nothing else."""
    rows = (plain_row(order.task, number, design, "lost", reason) for number, design in order.designs)
    return Answer(tuple(rows), (0.0,) * len(order.designs))


def _ask(order: Order, rows: list[Row], seconds: list[float]) -> None:
    """Have the designs that have no row yet solved, by this thread's process; Ended when that does not answer."""
    process = _solver()
    assert process.stdin is not None
    try:
        process.stdin.write(json.dumps({"task": asdict(order.task), "designs": order.designs[len(rows) :]}) + "\n")
        process.stdin.flush()
        for _ in order.designs[len(rows) :]:
            answer = _answer(process, order.task.workers.time_limit_s)
            rows.append(answer["row"])
            seconds.append(answer["seconds"])
    except OSError:
        raise Ended(_solvers().end(process)) from None
    except Ended:
        raise
    except BaseException:  # its further answers would be taken for those to the next order
        process.kill()
        _solvers().end(process)
        raise


def _answer(process: subprocess.Popen[str], limit_s: float) -> dict[str, Any]:
    """The next line of a process; Ended where it does not come in time, or tells of a failure."""
    assert process.stdout is not None
    late = threading.Event()
    watch = threading.Timer(limit_s, _stop_late, (process, late))
    watch.daemon = True
    try:
        watch.start()
    except RuntimeError as error:
        process.kill()
        _solvers().end(process)
        raise Ended(f"no thread could watch over it ({error}): raise ulimit -v or -u, or lower --jobs") from error
    line = process.stdout.readline()
    watch.cancel()
    answer: dict[str, Any] = json.loads(line) if line.endswith("\n") else {FAILED: None}
    if FAILED in answer:
        how = _solvers().end(process)
        raise Ended(f"no answer within {limit_s:g} s" if late.is_set() else answer[FAILED] or how)
    return answer


def _solvers() -> Solvers:
    found: Solvers = getattr(_OWN, "solvers", _SHARED)
    return found


def _solver() -> subprocess.Popen[str]:
    """Return the solving process beside this thread, a new one where there is none."""
    process: subprocess.Popen[str] | None = getattr(_OWN, "process", None)
    if process is not None and process.poll() is None:
        return process
    if process is not None and process.stdin is not None and not process.stdin.closed:
        _solvers().end(process)  # idle for long, it has ended by itself
    _OWN.process = process = _solvers().start()
    _answer(process, START_LIMIT_S)  # that it is ready: no design is blamed for a slow disk
    return process


def _stop_late(process: subprocess.Popen[str], late: threading.Event) -> None:
    late.set()
    process.kill()
