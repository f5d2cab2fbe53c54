"""Folders that the program fills: of results, which belong to one case text, and of unfinished work.

Files of others in them (`pmor.storage.manifest`) are neither replaced nor removed; where one is in the way, the refusal
comes before the work.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from pmor.core.errors import OutputError
from pmor.storage.atomic import ensure_folder, ensure_writable, output_errors, remove_abandoned
from pmor.storage.lock import only_writer_in_folder
from pmor.storage.manifest import (
    MANIFEST,
    begin_manifest,
    foreign_words,
    has_manifest,
    is_ours,
    listed,
    origin_in,
    origin_of,
    record,
    record_origin,
)

LONGEST_NAME = 100
_LOG = logging.getLogger("pmor.storage")


def default_folder(name: str, ending: str = "") -> Path:
    """Return the folder below ``out`` for a case or study: the name may come from a file, and is no path."""
    plain = "".join(c if c.isprintable() and c not in '/\\:*?"<>|' else "_" for c in name).lstrip(".")
    return Path("out") / ((plain[:LONGEST_NAME] or "case") + ending)


@contextmanager
def results_folder(
    folder: Path, names: Sequence[str], working: Sequence[str] = (), overwrite: bool = False,
    inputs: Sequence[Path] = (),
) -> Iterator[Path]:  # fmt: skip
    """Lock a folder for results, which is made unless it is there.

    Parameters
    ----------
    names : sequence of str
        Files that are going to be written there.
    working : sequence of str
        Folders in it for unfinished work.
    overwrite : bool
        Replace files of these names whoever wrote them.
    inputs : sequence of Path
        Files that the results are made from, which are not replaced at any rate.

    Raises
    ------
    OutputError
        When a file of such a name is there that is not ours, another process writes there, or it is read-only.
    """
    with only_writer_in_folder(ensure_writable(folder)):
        refuse_in_the_way([folder / name for name in names], overwrite, inputs)
        for name in working:
            refuse_foreign_folder(folder / name)
        with output_errors(f"write to the folder {folder}", folder / MANIFEST):
            begin_manifest(folder)
            # Files before the results belong to no text: a basis holds its own case.
            record_origin(folder, "")
            for name in names:
                if overwrite and (folder / name).exists():
                    record(folder / name)
        remove_abandoned(folder)
        yield folder


def refuse_in_the_way(paths: Sequence[Path], overwrite: bool, inputs: Sequence[Path] = ()) -> None:
    """Raise OutputError where a file that is going to be written would replace one that is not ours, or an input."""
    for path in paths:
        if not os.path.lexists(path):
            continue
        for source in inputs:
            if source.exists() and path.exists() and path.samefile(source):
                raise OutputError(f"{path}: is an input of the results; choose another place for them")
        no_file = path.is_dir() or path.is_symlink()
        if no_file or not (overwrite or is_ours(path)):
            remedy = "choose another place" + ("" if no_file else ", or pass overwrite=True")
            raise OutputError(f"{path}: {foreign_words(path)}; {remedy}")


def start_results(folder: Path, text: str) -> None:
    """Remove the files in a folder of results that were made from another text; to be called when new ones are there.

    The log ``pmor`` names the removed files, and each one that was changed by hand and therefore stays.

    Parameters
    ----------
    folder : Path
        Held by `results_folder`.
    text : str
        Origin of the results that are written from here on.

    Raises
    ------
    OutputError
    """
    origin, removed, changed = origin_of(text), list[str](), list[Path]()
    with output_errors(f"write to the folder {folder}", folder / MANIFEST):
        for name, contents in sorted(listed(folder).items()):
            path = folder / name
            if not os.path.lexists(path) or set(contents.values()) <= {"", origin}:
                continue
            earlier = origin_in(contents, path)
            if earlier is None:
                changed.append(path)
            elif earlier not in ("", origin):
                path.unlink()
                removed.append(name)
        record_origin(folder, origin)
    if removed:
        _LOG.info("%s: removed results of another text or version: %s", folder, ", ".join(removed))
    for path in changed:
        _LOG.info("%s: was made from another text and changed since: it stays, and is none of these results", path)


def working_folder(folder: Path, anew: bool = False) -> Path:
    """Make a folder for unfinished work, or take over the one that is there, and return it.

    Parameters
    ----------
    anew : bool
        Remove our files in it.

    Raises
    ------
    OutputError
        When it is there, holds something, and this program did not make it; or it cannot be made.
    """
    refuse_foreign_folder(folder)
    if anew:
        remove_working_folder(folder)
    ensure_folder(folder)
    with output_errors(f"write to the folder {folder}", folder / MANIFEST):
        begin_manifest(folder)
    remove_abandoned(folder)
    return folder


def remove_working_folder(folder: Path) -> None:
    """Remove a folder for unfinished work; files of others stay, and the folder with them.

    OutputError where that fails.

    Files count by their names alone: a broken disk may have left half of one.
    """
    if not has_manifest(folder):
        return
    with output_errors(f"remove the folder {folder}", folder):
        remove_abandoned(folder)
        for name in listed(folder):
            if not (folder / name).is_dir():
                (folder / name).unlink(missing_ok=True)
        for inner in folder.iterdir():
            if inner.is_dir() and not inner.is_symlink():
                remove_working_folder(inner)
        if [path.name for path in folder.iterdir()] == [MANIFEST]:
            (folder / MANIFEST).unlink()
            folder.rmdir()


def refuse_foreign_folder(folder: Path) -> None:
    """Raise OutputError when a folder for unfinished work is there, holds something, and is not ours."""
    if folder.is_dir() and not has_manifest(folder) and any(folder.iterdir()):
        raise OutputError(
            f"{folder}: is needed for unfinished work, and pmor did not make it; move it away, or choose another place"
        )
