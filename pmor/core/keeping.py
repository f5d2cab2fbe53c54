"""Where compiled kernels are kept, and a word when they are compiled.

numba keeps them beside the sources or, where these may not be written to, below the user's home. A container often has
neither; without a place numba refuses to compile at all.
"""

from __future__ import annotations

import logging
import os
import tempfile
import time
from functools import cache
from pathlib import Path
from typing import Any

import numba
from numba.core import event

_LOG = logging.getLogger("pmor.kernels")
# Seconds of compilation between two words about it: a run compiles a dozen kernels one after the other.
_PAUSE_S = 15.0


@cache
def can_keep() -> bool:
    """Return whether compiled kernels can be kept: where numba wants them, or else among temporary files."""
    if _numba_finds_one():
        return True
    folder = _private_folder()
    if folder is not None:
        numba.config.CACHE_DIR = str(folder)  # type: ignore[attr-defined]
    return folder is not None and _numba_finds_one()


def is_kept(kernel: Any) -> bool:
    """Return whether a kernel was compiled before, from these very sources, and is kept."""
    file = getattr(getattr(kernel, "_cache", None), "_cache_file", None)
    try:
        return file is None or bool(file._load_index())
    except OSError:
        return False


def _numba_finds_one() -> bool:
    def trial() -> None:
        """Never called."""

    try:
        numba.njit(cache=True)(trial)
    except RuntimeError:
        return False
    return True


def _private_folder() -> Path | None:
    """A folder among temporary files that is this user's alone, since what lies in it is run; None if there is none."""
    if not hasattr(os, "getuid"):
        return None
    try:
        folder = Path(tempfile.gettempdir()) / f"pmor_kernels_{os.getuid()}"
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
    except OSError:
        return None
    return folder if found.st_uid == os.getuid() and found.st_mode == 0o040700 else None


class _Announcement(event.Listener):
    """Says that kernels are compiled when that begins, and later how long it has taken so far."""

    def __init__(self) -> None:
        self._depth, self._seconds, self._began, self._said = 0, 0.0, 0.0, -_PAUSE_S

    def on_start(self, event: Any) -> None:
        """Count nested compilations, and say so at the outermost one."""
        if not event.data["dispatcher"].py_func.__module__.startswith("pmor."):
            return
        self._depth += 1
        if self._depth > 1:
            return
        self._began = time.perf_counter()
        if self._seconds >= self._said + _PAUSE_S:
            self._said = self._seconds
            _LOG.info(self._words())

    def on_end(self, event: Any) -> None:
        """Add up the time of the outermost one."""
        if not event.data["dispatcher"].py_func.__module__.startswith("pmor."):
            return
        self._depth -= 1
        if self._depth == 0:
            self._seconds += time.perf_counter() - self._began

    def _words(self) -> str:
        if self._seconds:
            return f"compiling more kernels ({self._seconds:.0f} s so far)"
        if can_keep():
            return "compiling the kernels of contact, once after each installation: up to two minutes in all"
        return (
            "compiling the kernels of contact, at each start: up to two minutes; they are kept where NUMBA_CACHE_DIR "
            "names a folder that can be written to"
        )


event.register("numba:compile", _Announcement())
