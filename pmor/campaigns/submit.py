"""Hand work to any executor: a limited number of pieces at a time, failed ones once more."""

from __future__ import annotations

import queue
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from typing import TypeVar

from pmor.core.errors import ExternalProgramError, PmorError

Item = TypeVar("Item")
Answer = TypeVar("Answer")

# Pieces of work that an executor has at a time: four for each of a thousand cores.
IN_FLIGHT = 4000
TRIES = 2


def submit_all(
    executor: Executor, work: Callable[[Item], Answer], items: Iterator[Item],
    keep: Callable[[Item, Answer], None], lost: Callable[[Item, str], Answer], in_flight: int = IN_FLIGHT,
) -> None:  # fmt: skip
    """Do a piece of work for each item; `keep` has each item and its answer, in the order in which they come.

    Items are asked for only when they are handed out, `in_flight` at most at a time. `lost` gives the answer for an
    item that failed twice, from the item and the reason. ExternalProgramError when the executor does no more work;
    answers by then are kept.
    """
    done: queue.SimpleQueue[tuple[Item, int, Future[Answer]]] = queue.SimpleQueue()
    again: list[tuple[Item, int]] = []
    flying: set[Future[Answer]] = set()
    try:
        while True:
            while len(flying) < in_flight:
                item, tries = again.pop() if again else (next(items, None), 1)
                if item is None:
                    break
                flying.add(_hand_out(executor, work, item, tries, done))
            if not flying:
                return
            item, tries, future = done.get()
            flying.remove(future)
            reason = _failure(future)
            if reason is None:
                keep(item, future.result())
            elif tries < TRIES:
                again.append((item, tries + 1))
            else:
                keep(item, lost(item, f"{reason}, {TRIES} times"))
    finally:
        for future in flying:
            future.cancel()


def _hand_out(
    executor: Executor, work: Callable[[Item], Answer], item: Item, tries: int,
    done: queue.SimpleQueue[tuple[Item, int, Future[Answer]]],
) -> Future[Answer]:  # fmt: skip
    try:
        future = executor.submit(work, item)
    except (RuntimeError, OSError) as error:
        raise _gave_up(error) from error
    future.add_done_callback(lambda ended: done.put((item, tries, ended)))
    return future


def _failure(future: Future[Answer]) -> str | None:
    """Why a piece of work failed; None where it did not."""
    try:
        error = future.exception()
    except CancelledError as cancelled:
        raise _gave_up(cancelled) from cancelled
    if error is None:
        return None
    if isinstance(error, BrokenExecutor | CancelledError):
        raise _gave_up(error) from error
    if isinstance(error, PmorError) or not isinstance(error, Exception):
        raise error  # no other piece would fare better
    return f"its worker failed, {type(error).__name__}: {error}".rstrip(": ")


def _gave_up(error: BaseException) -> ExternalProgramError:
    said = f"{type(error).__name__}: {error}".rstrip(": ")
    return ExternalProgramError(
        f"the executor does no more work ({said}): see what became of its workers; finished chunks are kept, and the "
        "same command goes on where it stopped"
    )
