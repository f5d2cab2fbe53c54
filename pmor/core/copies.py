"""Work that a copy of this process does, where that is safe, while this one goes on."""

from __future__ import annotations

import multiprocessing
import os
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TypeVar

from pmor.core.progress import Late

# Threads of this process, on Linux.
THREADS = Path("/proc/self/task")
# More bring little: the pictures of a run differ in effort.
MOST_COPIES = 3

T = TypeVar("T")


@contextmanager
def in_a_copy(work: Callable[[], T]) -> Iterator[Callable[[], T]]:
    """Do work in a copy of this process, where one may be made, while this one goes on.

    Yields
    ------
    found : callable
        Returns what the work returned, which the copy sends. Where there is no copy, or it failed, the work is done
        then, in this process, which meets and tells the same.
    """
    if not copies():
        yield work
        return
    context = multiprocessing.get_context("fork")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_send, args=(work, sender), daemon=True)
    with suppress(OSError):
        process.start()
    sender.close()

    def found() -> T:
        try:
            sent: T = receiver.recv()
        except (EOFError, OSError):
            return work()
        return sent

    try:
        yield found
    finally:
        receiver.close()
        if process.pid is not None:
            process.kill()
            process.join()


def copies() -> int:
    """Return how many copies of this process may work: it has a single thread, and further processors to use.

    A copy has one thread, and others' locks as they are. The thread that waits to tell of long work has none.
    """
    if sys.platform != "linux" or multiprocessing.current_process().daemon:
        return 0
    late = sum(isinstance(thread, Late) for thread in threading.enumerate())
    try:
        alone = len(list(THREADS.iterdir())) == 1 + late
        return min(len(os.sched_getaffinity(0)) - 1, MOST_COPIES) if alone else 0
    except OSError:
        return 0


def _send(work: Callable[[], object], sender: Connection) -> None:
    try:
        sender.send(work())
    except BaseException:
        os._exit(1)
