"""Where compiled kernels are kept, and a word when they are compiled.

numba compares the file of a function with its kept code: an edit in another file, of a function that it calls, would go
unnoticed and the old code would run. So each state of the sources has a folder of its own, named by their hash, in the
first place that can be written to: NUMBA_CACHE_DIR, beside the sources, below the user's home, among temporary files.
A container often has none; kernels are then compiled at each start.
"""

from __future__ import annotations

import hashlib
import logging
import os
import re
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

import numba
from numba.core import event

_LOG = logging.getLogger("pmor.kernels")
# Seconds of compilation between two words about it: a run compiles a dozen kernels one after the other.
_PAUSE_S = 15.0
_PACKAGE = Path(__file__).parents[1]
_NAME, _MARKER = "pmor_kernels_{}", "compiled by pmor"
# Folders of earlier sources that stay beside the present one: who compares two versions needs both.
_EARLIER_KEPT = 3


def kernel_sources() -> list[Path]:
    """Return all files whose text kernels depend on: functions, types and constants."""
    single = (_PACKAGE / "core" / "compiling.py", _PACKAGE / "core" / "linear.py")
    return [*single, *sorted(_PACKAGE.glob("*/kernels/*.py"))]


@cache
def kernels_folder() -> Path | None:
    """Return the folder of kernels compiled from these very sources; None where nothing can be kept."""
    digest = hashlib.sha256(f"{numba.__version__} {sys.implementation.cache_tag}".encode())
    for path in kernel_sources():
        digest.update(path.relative_to(_PACKAGE).as_posix().encode())
        digest.update(path.read_bytes())
    name = _NAME.format(digest.hexdigest()[:32])
    return next((folder for place in _places() if (folder := _usable(place / name)) is not None), None)


@contextmanager
def keeping_kernels() -> Iterator[None]:
    """Let numba keep functions decorated inside in the folder of the kernels, and others in its own place."""
    before, folder = numba.config.CACHE_DIR, kernels_folder()  # type: ignore[attr-defined]
    numba.config.CACHE_DIR = before if folder is None else str(folder)  # type: ignore[attr-defined]
    try:
        yield
    finally:
        numba.config.CACHE_DIR = before  # type: ignore[attr-defined]


def is_kept(kernel: Any) -> bool:
    """Return whether a kernel was compiled before, from these very sources, and is kept; True if kernels never are."""
    # A plain function where numba is switched off.
    folder = kernel.stats.cache_path if hasattr(kernel, "stats") else None
    return folder is None or any(Path(folder).glob(f"*.{kernel.py_func.__qualname__}-*.nbi"))


def _places() -> Iterator[Path]:
    """Where to look for a folder that can be written to, best first."""
    if named := numba.config.CACHE_DIR:  # type: ignore[attr-defined]
        yield Path(named)
    yield _PACKAGE / "__pycache__"
    with suppress(RuntimeError):  # no home
        yield Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "pmor"
    if (private := _private_folder()) is not None:
        yield private


def _usable(folder: Path) -> Path | None:
    """Return a folder, made if need be, that files can be written to; None if it cannot be."""
    try:
        is_new = not folder.is_dir()
        folder.mkdir(parents=True, exist_ok=True)
        (folder / _MARKER).touch()  # its time tells when the folder was used last
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return None
    if is_new:
        _remove_earlier(folder)
    return folder


def _remove_earlier(folder: Path) -> None:
    """Remove folders of earlier sources beside a new one, but for those used last."""
    used = {}
    for other in folder.parent.glob(_NAME.format("*")):
        with suppress(OSError):
            if other != folder and re.fullmatch(_NAME.format("[0-9a-f]{32}"), other.name) and not other.is_symlink():
                used[other] = (other / _MARKER).stat().st_mtime
    for other in sorted(used, key=lambda each: used[each])[:-_EARLIER_KEPT]:
        shutil.rmtree(other, ignore_errors=True)


def _private_folder() -> Path | None:
    """A folder among temporary files that is this user's alone, since its files are run; None if there is none."""
    if not hasattr(os, "getuid"):
        return None
    try:
        folder = Path(tempfile.gettempdir()) / f"pmor_{os.getuid()}"
        folder.mkdir(mode=0o700, exist_ok=True)
        state = folder.lstat()
    except OSError:
        return None
    return folder if state.st_uid == os.getuid() and state.st_mode == 0o040700 else None


def entry_of(kernel: Any, *arguments: Any) -> Any:
    """Return the code of a kernel for arguments of these types, to be called with such alone.

    A call of the kernel itself looks up the type of each argument first: 13 us for a pair of gears.
    """
    return kernel.compile(tuple(map(numba.typeof, arguments))) if hasattr(kernel, "compile") else kernel


def _is_ours(event: Any) -> bool:
    # Functions that numba makes itself, of a user's own types for instance, have no module.
    return (event.data["dispatcher"].py_func.__module__ or "").startswith("pmor.")


class _Announcement(event.Listener):
    """Says that kernels are compiled when that begins, and later how long it has taken so far."""

    def __init__(self) -> None:
        self._depth, self._seconds, self._began, self._said = 0, 0.0, 0.0, -_PAUSE_S

    def on_start(self, event: Any) -> None:
        """Count nested compilations, and say so at the outermost one."""
        if not _is_ours(event):
            return
        self._depth += 1
        if self._depth > 1:
            return
        self._began = time.perf_counter()
        if self._seconds >= self._said + _PAUSE_S:
            self._said = self._seconds
            # Where nobody listens to the log, Python shows warnings by itself.
            _LOG.log(logging.INFO if _LOG.isEnabledFor(logging.INFO) else logging.WARNING, "%s", self._words())

    def on_end(self, event: Any) -> None:
        """Add up the time of the outermost one."""
        if not _is_ours(event):
            return
        self._depth -= 1
        if self._depth == 0:
            self._seconds += time.perf_counter() - self._began

    def _words(self) -> str:
        if self._seconds:
            return f"compiling more kernels ({self._seconds:.0f} s so far)"
        if kernels_folder() is not None:
            return "compiling the kernels of contact, once after each installation: up to two minutes in all"
        return (
            "compiling the kernels of contact, at each start: up to two minutes; they are kept where NUMBA_CACHE_DIR "
            "names a folder that can be written to"
        )


event.register("numba:compile", _Announcement())
