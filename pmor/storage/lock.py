"""Let one process at a time write a file or into a folder.

The operating system holds the lock and frees it when its process ends, however it ends: a lock file that a killed run
left behind is simply taken over.
"""

from __future__ import annotations

import errno
import os
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from pmor.errors import OutputError
from pmor.storage.atomic import output_errors

if sys.platform != "win32":
    import fcntl

# What a file system answers that knows no locks. There, as on Windows, two runs may do the same work twice; atomic
# writes still keep each file whole.
NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.ENOTSUP)
LONGEST_NOTE = 300


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
    descriptor = _acquire(lock_file, target, alternative)
    try:
        yield
    finally:
        # Removed while it is still held: whoever has it open by now finds another file of its name, or none, and
        # begins again (`_acquire`).
        with suppress(OSError):  # if it cannot be, it stays, unlocked, and is taken over by the next
            lock_file.unlink()
        os.close(descriptor)


def _acquire(lock_file: Path, target: Path, alternative: str) -> int:
    while True:
        with output_errors(f"write {target}", lock_file):
            descriptor = os.open(lock_file, os.O_CREAT | os.O_RDWR, 0o666)
        try:
            if not _lock(descriptor):
                holder = os.read(descriptor, LONGEST_NOTE).decode(errors="replace") or "another process"
                raise OutputError(f"{target}: {holder} is writing it at present; wait for it, or {alternative}")
            if _is_still(lock_file, descriptor):
                _leave_note(descriptor)
                return descriptor
        except BaseException:
            os.close(descriptor)
            raise
        os.close(descriptor)


def _leave_note(descriptor: int) -> None:
    with suppress(OSError):  # a courtesy to others; a disk that is full is reported when it matters
        os.ftruncate(descriptor, 0)
        os.write(descriptor, f"process {os.getpid()} on {socket.gethostname()}".encode())


def _lock(descriptor: int) -> bool:
    """Lock an open file; False when another process has it locked."""
    if sys.platform != "win32":
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            return error.errno in NO_LOCKS
    return True


def _is_still(lock_file: Path, descriptor: int) -> bool:
    try:
        return os.path.samestat(os.stat(lock_file), os.fstat(descriptor))
    except FileNotFoundError:
        return False
