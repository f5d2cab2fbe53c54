"""The process that solves designs: one order per line in, one row per line out. It ends with the one that started it.

    python -m pmor.campaigns.solver

Its deaths, lack of memory and endless loops are seen from outside (`pmor.campaigns.supervise`).
"""

from __future__ import annotations

import json
import logging
import os
import queue
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TextIO

# After so many seconds without an order: the campaign is over, and memory belongs to others.
IDLE_S = 120.0
# Key of an answer without a row: the reason.
FAILED = "failed"
# Reason of a process without memory, which then ends.
OUT_OF_MEMORY = "its memory did not suffice"


def main() -> None:
    """Answer orders until there are no more."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # prints of libraries are no answers
    orders: queue.SimpleQueue[str] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(orders,), daemon=True).start()
    rows_of = _ready()
    _tell(answers, {"ready": True})
    while True:
        try:
            order = json.loads(orders.get(timeout=IDLE_S))
        except queue.Empty:
            return
        _limit_memory(order["task"]["workers"]["memory_GiB"])
        for answer in rows_of(order):
            _tell(answers, answer)
            if FAILED in answer:
                os._exit(1)  # its state is unknown


def _listen(orders: queue.SimpleQueue[str]) -> None:
    """Take orders, and end this process with the one that gives them, in the middle of whatever it does."""
    for line in sys.stdin:
        orders.put(line)
    os._exit(0)


def _ready() -> Callable[[dict[str, Any]], Iterator[dict[str, Any]]]:
    """Load the libraries, before any design has to wait for them."""
    logging.getLogger("pmor").setLevel(logging.ERROR)  # stages of single designs are no news of a campaign
    from pmor.campaigns.rows import Task
    from pmor.campaigns.solve import row_of
    from pmor.core.errors import OutputError
    from pmor.storage.gear_store import GIB, Store, open_store

    def store_of(folder: Path, limit_bytes: float) -> Store:
        """The store on this machine; none where its folder holds something else."""
        try:
            return open_store(folder, limit_bytes / GIB)
        except OutputError:
            return Store(folder, 0.0)

    def rows_of(order: dict[str, Any]) -> Iterator[dict[str, Any]]:
        task = Task.from_json(order["task"])
        store = store_of(Path(task.store), task.store_bytes)
        for number, design in order["designs"]:
            started = time.process_time()
            try:
                answer: dict[str, Any] = {"row": row_of(task, number, design, store)}
            except MemoryError:
                answer = {FAILED: OUT_OF_MEMORY}
            except Exception as error:  # a defect of the program costs this design, and no other
                answer = {FAILED: f"the program failed, {type(error).__name__}: {error}"}
            yield answer | {"seconds": time.process_time() - started}

    return rows_of


def _tell(answers: TextIO, answer: dict[str, Any]) -> None:
    answers.write(json.dumps(answer) + "\n")
    answers.flush()


def _limit_memory(size_GiB: float | None) -> None:
    if size_GiB is not None and sys.platform != "win32":
        import resource

        size = int(size_GiB * 2**30)
        resource.setrlimit(resource.RLIMIT_DATA, (size, resource.getrlimit(resource.RLIMIT_DATA)[1]))


if __name__ == "__main__":
    main()
