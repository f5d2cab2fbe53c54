"""Write files whole or not at all: a reader, or an interrupted run, never meets half a file."""

import errno
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pmor.errors import OutputError

REMEDIES = {
    errno.EACCES: "the folder is read-only for you: choose another folder",
    errno.EPERM: "the folder is read-only for you: choose another folder",
    errno.EROFS: "the disk is read-only: choose another folder",
    errno.ENOENT: "its folder does not exist: create it, or choose another",
    errno.ENOTDIR: "a part of the path is a file, not a folder: choose another path",
    errno.ENOSPC: "no space is left on the disk: free some, or choose another disk",
    errno.EDQUOT: "your disk quota is used up: free some space, or choose another disk",
    errno.EISDIR: "a folder of that name is there: choose another name",
    errno.EEXIST: "a file of that name is there: choose another name",
    errno.ENAMETOOLONG: "the name is too long: choose a shorter one",
}


@contextmanager
def atomic_path(target: Path) -> Iterator[Path]:
    """Give a temporary file beside `target` and rename it to `target` when the block succeeds.

    The temporary file exists, empty, when the block begins, so that an unusable folder shows before the work is done.
    If the block raises, the file is removed and an existing target stays as it was.

    Parameters
    ----------
    target : Path
        The file to make or to replace.

    Yields
    ------
    Path
        Where to write; in the folder of `target`, unique to this process and call.

    Raises
    ------
    OutputError
        When the operating system refuses, also inside the block.
    """
    target = Path(target)
    temporary = target.with_name(f".{target.name}.{os.getpid()}.{secrets.token_hex(4)}.tmp")
    try:
        try:
            os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
            yield temporary
            _flush_to_disk(temporary)
            os.replace(temporary, target)
        except BaseException:
            _remove(temporary)
            raise
    except OSError as error:
        raise OutputError(f"cannot write {target}: {_reason(error, temporary)}") from error


def refuse_existing(path: Path, overwrite: bool) -> None:
    """Raise OutputError when there is something at `path` that may not be replaced."""
    if path.exists() and not overwrite:
        raise OutputError(f"{path}: exists already; choose another name or add --overwrite")


def ensure_folder(path: Path) -> Path:
    """Create a folder, with those above it, unless it is there, and return it.

    Raises
    ------
    OutputError
        When it cannot be created.
    """
    path = Path(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot create the folder {path}: {_reason(error, path)}") from error
    return path


def _flush_to_disk(path: Path) -> None:
    descriptor = os.open(path, os.O_RDWR)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _remove(path: Path) -> None:
    try:
        path.unlink(missing_ok=True)
    except OSError:
        pass  # the error that brought us here is the one to report


def _reason(error: OSError, path: Path) -> str:
    # An error about another file, say one that the block reads, keeps its own words.
    about_another_file = error.filename is not None and os.fspath(error.filename) != str(path)
    if about_another_file or error.errno not in REMEDIES:
        return str(error)
    return REMEDIES[error.errno]
