"""Write files whole or not at all: a reader, or an interrupted run, never meets half a file."""

import errno
import glob
import os
import secrets
import shutil
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
    errno.EFBIG: "larger than the disk or your limit (ulimit -f) allows: raise that, or choose another disk",
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
    with output_errors(f"write {target}", temporary):
        try:
            os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
            yield temporary
            _flush_to_disk(temporary)
            os.replace(temporary, target)
        except BaseException:
            _remove(temporary)
            raise


@contextmanager
def output_errors(action: str, path: Path) -> Iterator[None]:
    """Turn what the operating system refuses into one line for the engineer.

    Parameters
    ----------
    action : str
        What is tried, such as "write basis.h5".
    path : Path
        What it is tried on; errors about other files keep their own words.

    Raises
    ------
    OutputError
    """
    try:
        yield
    except OSError as error:
        raise OutputError(f"cannot {action}: {_reason(error, path)}") from error


def refuse_existing(path: Path, overwrite: bool) -> None:
    """Raise OutputError when there is something at `path` that may not be replaced."""
    if os.path.exists(path) and not overwrite:  # unlike Path.exists, no error where a name is too long
        raise OutputError(f"{path}: exists already; choose another name or add --overwrite")


def ensure_folder(path: Path) -> Path:
    """Create a folder, with those above it, unless it is there, and return it.

    Raises
    ------
    OutputError
        When it cannot be created.
    """
    path = Path(path)
    with output_errors(f"create the folder {path}", path):
        path.mkdir(parents=True, exist_ok=True)
    return path


def ensure_writable(folder: Path) -> Path:
    """Create a folder unless it is there, try whether files can be written to it, and return it.

    Raises
    ------
    OutputError
        When it cannot be created or written to: better before hours of work than after.
    """
    trial = ensure_folder(folder) / f".{os.getpid()}.{secrets.token_hex(4)}.tmp"
    with output_errors(f"write to the folder {folder}", trial):
        trial.touch()
        trial.unlink()
    return folder


def remove_folder(folder: Path) -> None:
    """Remove a folder with all that is in it.

    Raises
    ------
    OutputError
    """
    with output_errors(f"remove the folder {folder}", folder):
        shutil.rmtree(folder)


def remove_abandoned(folder: Path, name: str | None = None) -> None:
    """Remove the temporary files that killed processes left; only while no other process can be writing them.

    Parameters
    ----------
    folder : Path
    name : str, optional
        Of the target file; all by default.
    """
    for path in folder.glob(f".{'*' if name is None else glob.escape(name)}.*.tmp"):
        _remove(path)


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
