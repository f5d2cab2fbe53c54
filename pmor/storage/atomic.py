"""Write files whole or not at all: no reader, and no interruption, finds half a file."""

import errno
import os
import re
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pmor.core.errors import OutputError
from pmor.storage.manifest import record, refuse_foreign

# Names of temporary files: the target, the process, and eight random digits.
TEMPORARY = re.compile(r"\.(?P<target>.+)\.pmor-(?P<process>\d+)-[0-9a-f]{8}\.tmp")

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
def atomic_path(target: Path, overwrite: bool = False) -> Iterator[Path]:
    """Give a temporary file beside `target` and rename it to `target` when the block succeeds.

    The temporary file exists, empty, when the block begins, so that an unusable folder shows before the work is done.
    If the block raises, the file is removed and an existing target stays as it was. In a folder of ours the new file
    is listed in the manifest.

    Parameters
    ----------
    target : Path
        The file to make or to replace.
    overwrite : bool
        Replace in a folder of ours also what this program did not write there.

    Yields
    ------
    Path
        Where to write; in the folder of `target`, unique to this process and call.

    Raises
    ------
    OutputError
        When the operating system refuses, also inside the block; when there is somebody else's file in a folder of
        ours.
    """
    target = Path(target)
    if not overwrite:
        refuse_foreign(target)
    temporary = target.with_name(f".{target.name}.pmor-{os.getpid()}-{secrets.token_hex(4)}.tmp")
    with output_errors(f"write {target}", temporary):
        try:
            os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
            yield temporary
            _flush_to_disk(temporary)
            record(target, temporary)
            os.replace(temporary, target)
        except BaseException:
            _remove(temporary)
            raise


@contextmanager
def output_errors(action: str, path: Path) -> Iterator[None]:
    """Turn an error of the operating system into one line for the engineer.

    Parameters
    ----------
    action : str
        Such as "write basis.h5".
    path : Path
        Its object; errors about other files keep their own words.

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
    if os.path.isdir(path):
        raise OutputError(f"{path}: is a folder, not a file; choose another name")
    if os.path.exists(path) and not overwrite:  # unlike Path.exists, no error where a name is too long
        raise OutputError(f"{path}: exists already; choose another name or pass overwrite=True")


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


def remove_abandoned(folder: Path, name: str | None = None) -> None:
    """Remove the temporary files that killed processes left.

    Parameters
    ----------
    folder : Path
        In which no other process writes files of these names with its lock.
    name : str, optional
        Of the target file; by default all but those that a process has locked.
    """
    for path in folder.iterdir():
        match = TEMPORARY.fullmatch(path.name)
        if match is None or path.is_dir() or _runs(int(match["process"])):
            continue
        if name == match["target"] or (name is None and not (folder / f".{match['target']}.lock").exists()):
            _remove(path)


def _runs(process: int) -> bool:
    """Whether a process is running that is not this one: it has only just begun, and has no files yet."""
    if process == os.getpid():
        return False
    if os.name != "posix":
        return True  # there, asking would end it
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except OSError:
        pass  # somebody else's
    return True


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
