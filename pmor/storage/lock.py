"""Let one process at a time write a file or into a folder.

`filelock` asks the operating system, which frees a lock when its process ends, however it ends: the lock file that a
killed run left behind is taken over. This module adds three things: no lock file stays in a folder of results, the
error names the process that writes, and a file system without locks does not stop the work.
"""

from __future__ import annotations

import errno
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from pmor.core.errors import OutputError
from pmor.storage.atomic import output_errors

# Errors of a file system without locks. There, two runs may do the same work twice; atomic writes still keep
# each file whole.
NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.ENOTSUP)
# Its holder may be removing a lock file at this very moment: try for a while.
PATIENCE_S, POLL_S = 0.1, 0.01


@contextmanager
def only_writer_of_file(target: Path) -> Iterator[None]:
    """Hold the lock of a file that is going to be written; its folder must exist.

    Raises
    ------
    OutputError
        When another process holds it, or the folder cannot be written to.
    """
    with _locked(target.with_name(f".{target.name}.lock"), target, "choose another name"):
        yield


@contextmanager
def only_writer_in_folder(folder: Path) -> Iterator[None]:
    """Hold the lock of a folder for results; as `only_writer_of_file`."""
    with _locked(folder / ".pmor.lock", folder, "choose another folder"):
        yield


@contextmanager
def _locked(lock_file: Path, target: Path, alternative: str) -> Iterator[None]:
    from filelock import FileLock, Timeout

    lock = FileLock(lock_file, timeout=PATIENCE_S, poll_interval=POLL_S, fallback_to_soft=False)
    with output_errors(f"write {target}", lock_file):
        lock_file.touch()  # filelock would create a folder that does not exist
        try:
            lock.acquire()
        except Timeout:
            holder = _note(lock_file) or "another process"
            raise OutputError(f"{target}: {holder} is writing it at present; wait for it, or {alternative}") from None
        except OSError as error:
            if error.errno not in NO_LOCKS:
                raise
    with suppress(OSError):  # a courtesy to others; a disk that is full is reported when it matters
        lock_file.write_text(f"process {os.getpid()} on {socket.gethostname()}")
    try:
        yield
    finally:
        # Removed while it is still held: filelock does not content itself with a file that has lost its name.
        with suppress(OSError):  # if it cannot be, it stays, unlocked, and is taken over by the next
            lock_file.unlink()
        lock.release()


def _note(lock_file: Path) -> str:
    try:
        return lock_file.read_text(errors="replace")
    except OSError:
        return ""
