"""The same work for many items, one after the other or by an executor; the results do not depend on which."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")


def in_order(
    work: Callable[[Item], Result],
    items: Iterable[Item],
    executor: Executor | None = None,
    advance: Callable[[], None] = lambda: None,
) -> Iterator[Result]:
    """Do a piece of work for each item.

    Compiled kernels and linear algebra run outside Python's lock: threads suffice, and nothing is copied.

    Parameters
    ----------
    work : callable
        Independent of what was done before it.
    items : iterable
    executor : concurrent.futures.Executor, optional
        By default the work is done in the calling thread.
    advance : callable
        Called after each item, for progress.

    Yields
    ------
    object
        Results in the order of the items.
    """
    for result in (map if executor is None else executor.map)(work, items):
        advance()
        yield result


@contextmanager
def threads(count: int) -> Iterator[Executor | None]:
    """Give an executor of so many threads; none for one, whose work is done where it is asked for."""
    if count == 1:
        yield None
        return
    with ThreadPoolExecutor(max_workers=count) as executor:
        yield executor
