"""Threads: of the linear algebra library, and of those who share out the same work for many items.

Nothing here may import numpy: the libraries read their variables once, when numpy loads them.
"""

from __future__ import annotations

import multiprocessing
import os
import threading
import warnings
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import BrokenExecutor, Executor, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from typing import Any, TypeVar

from pmor.core.errors import CaseError, ExternalProgramError

Item = TypeVar("Item")
Result = TypeVar("Result")

VARIABLES = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")


def use_one_thread() -> None:
    """Ask for one thread, so that run times of models compare, unless the environment says otherwise; before numpy."""
    if not any(name in os.environ for name in VARIABLES):
        os.environ.update(dict.fromkeys(VARIABLES, "1"))


def linear_algebra_threads() -> str:
    """Threads of linear algebra during a run, for the report."""
    return next((os.environ[name] for name in VARIABLES if name in os.environ), "1")


class _Limit:
    """Limit on the threads of linear algebra, which the whole process shares: it goes when nobody holds it."""

    def __init__(self) -> None:
        self._lock, self._holders = threading.Lock(), 0
        self._before: Any = None

    def hold(self) -> None:
        """Set one thread unless it is set."""
        from threadpoolctl import threadpool_limits

        with self._lock:
            self._holders += 1
            if self._holders == 1:
                self._before = threadpool_limits(1, "blas")

    def release(self) -> None:
        """Set what was there before the first holder, after the last one."""
        with self._lock:
            self._holders -= 1
            if self._holders == 0:
                self._before.restore_original_limits()


_LIMIT = _Limit()


@contextmanager
def one_thread() -> Iterator[None]:
    """One thread of linear algebra inside, unless the environment says otherwise; a context, or a decorator.

    Its matrices are small: threads that wait for each other took 5 to 10 times as long on a loaded machine.
    """
    if any(name in os.environ for name in VARIABLES):
        yield
        return
    _LIMIT.hold()
    try:
        yield
    finally:
        _LIMIT.release()


def cores() -> int:
    """Return how many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def in_order(
    work: Callable[[Item], Result],
    items: Iterable[Item],
    executor: Executor | None = None,
    progress: Callable[[], None] = lambda: None,
) -> Iterator[Result]:
    """Do a piece of work for each item.

    Compiled kernels and linear algebra run outside Python's lock: threads suffice, and nothing is copied.

    Parameters
    ----------
    work : callable
        Independent of earlier calls.
    items : iterable
    executor : concurrent.futures.Executor, optional
        By default the work is done in the calling thread.
    progress : callable
        Called after each item, for progress.

    Yields
    ------
    object
        Results in the order of the items.
    """
    with executor_errors(executor, work):
        for result in (map if executor is None else executor.map)(work, items):
            progress()
            yield result


@contextmanager
def executor_errors(executor: Executor | None, work: Callable[..., object]) -> Iterator[None]:
    """Name the defect of an executor that cannot do some work, or whose workers ended.

    Raises
    ------
    CaseError
        When the work is for threads, and the executor one of processes.
    ExternalProgramError
        When the executor does no more work.
    """
    while isinstance(work, partial):
        work = work.func
    if "<locals>" in work.__qualname__:
        refuse_processes(executor)
    try:
        yield
    except BrokenExecutor as error:
        raise ExternalProgramError(
            f"the executor does no more work ({type(error).__name__}): a script with an executor of processes makes "
            "its calls below 'if __name__ == \"__main__\":'; else see what became of its workers"
        ) from error


def refuse_processes(executor: Executor | None) -> None:
    """Raise CaseError for an executor of processes, before work whose last part is for threads."""
    if isinstance(executor, ProcessPoolExecutor):
        raise CaseError("executor: is one of processes, and this work is for threads: pass a ThreadPoolExecutor")


@contextmanager
def threads(count: int) -> Iterator[Executor | None]:
    """Give an executor of so many threads; none for one, whose work is done where it is asked for.

    Raises
    ------
    CaseError
        When there is no such number.
    """
    if _checked(count) == 1:
        yield None
        return
    with ThreadPoolExecutor(max_workers=count) as executor:
        yield executor


@contextmanager
def processes(count: int) -> Iterator[Executor | None]:
    """Give an executor of so many processes, for work that holds Python's lock; none for one, as `threads`."""
    if _checked(count) == 1:
        yield None
        return
    # Warnings of libraries are none for the error stream of a command (`pmor.app.cli`).
    quiet = partial(warnings.simplefilter, "ignore")
    with ProcessPoolExecutor(count, multiprocessing.get_context("spawn"), initializer=quiet) as executor:
        yield executor


def _checked(count: int) -> int:
    if not isinstance(count, int) or count < 1:
        raise CaseError(f"{count!r} workers: must be a whole number of at least 1")
    return count
