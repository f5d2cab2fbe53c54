"""List of the files that this program wrote into a folder: it replaces and removes nothing else.

A folder of ours holds a manifest with a line for each file that was written there: its name and the SHA-256 of its
content, appended before the file gets that name. So a kill at any moment leaves no file of ours that is not listed. A
file that is not listed, or has another content by now, belongs to somebody else. Lines are only ever appended, each in
one call: threads and processes that write at the same time do not lose each other's.

Lines between them give the origin of the files after them (`origin_of`).
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pmor.core.errors import OutputError
from pmor.core.version import __version__

MANIFEST, ORIGIN = ".pmor-manifest.jsonl", "origin"
# Digests of the contents that a file had, each with its origin, the latest of equal ones.
Contents = dict[str, str]


def origin_of(text: str) -> str:
    """Return the digest of the origin of results: a text, such as that of the case, and this version."""
    return hashlib.sha256(f"{__version__}\n{text}".encode()).hexdigest()


def begin_manifest(folder: Path) -> None:
    """Make a folder one of ours, unless it is; OSError when it cannot be written to."""
    (folder / MANIFEST).touch()


def has_manifest(folder: Path) -> bool:
    """Whether a folder is one of ours."""
    return (folder / MANIFEST).is_file()


def record(target: Path, content: Path | None = None) -> None:
    """List a file with its present or future content, unless its folder is not one of ours.

    Parameters
    ----------
    target : Path
        The name that it is listed under.
    content : Path, optional
        Another file with its content.
    """
    if has_manifest(target.parent):
        _append(target.parent, {"file": target.name, "sha256": _digest(content or target)})


def record_origin(folder: Path, origin: str) -> None:
    """Note the origin of the files that are listed from here on."""
    _append(folder, {ORIGIN: origin})


@contextmanager
def of_no_origin(folder: Path) -> Iterator[None]:
    """Let files that are listed inside have no origin: results of another text leave them where they are."""
    if not has_manifest(folder):
        yield
        return
    before = next((str(entry["origin"]) for entry in reversed(_entries(folder, ORIGIN)) if ORIGIN in entry), "")
    record_origin(folder, "")
    try:
        yield
    finally:
        record_origin(folder, before)


def listed(folder: Path, of: str | None = None) -> dict[str, Contents]:
    """Return the manifest of a folder by the names of files, or what it has of one of them; empty without manifest."""
    entries: dict[str, Contents] = {}
    origin = ""
    for entry in _entries(folder, *([ORIGIN, of] if of is not None else [])):
        name, digest = entry.get("file"), entry.get("sha256")
        origin = str(entry.get(ORIGIN, origin))
        if isinstance(name, str) and isinstance(digest, str) and _is_plain(name):
            entries.setdefault(name, {})[digest] = origin
    return entries


def origin_in(contents: Contents, path: Path) -> str | None:
    """Return the origin of a file; None where its content is not listed: it is not ours."""
    if path.is_symlink() or not path.is_file():
        return None
    return contents.get(_digest(path))


def is_ours(path: Path) -> bool:
    """Whether a file is there as this program wrote it."""
    return origin_in(listed(path.parent, path.name).get(path.name, {}), path) is not None


def refuse_foreign(path: Path) -> None:
    """Raise OutputError when there is something at `path`, in a folder of ours, that this program did not write."""
    if has_manifest(path.parent) and os.path.lexists(path) and not is_ours(path):
        raise OutputError(f"{path}: {foreign_words(path)}; move it away, or choose another folder")


def foreign_words(path: Path) -> str:
    """Say why a file is not ours."""
    if path.is_symlink():
        return "is a link"
    if path.is_dir():
        return "is a folder"
    if path.name in listed(path.parent, path.name):
        return "has been changed since pmor wrote it"
    return "is there, and not known to be written by pmor"


def _append(folder: Path, entry: dict[str, Any]) -> None:
    # The line break in front ends a line that a kill has left half written.
    line = ("\n" + json.dumps(entry) + "\n").encode()
    descriptor = os.open(folder / MANIFEST, os.O_WRONLY | os.O_APPEND)
    try:
        os.write(descriptor, line)
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _entries(folder: Path, *words: str) -> list[dict[str, Any]]:
    """The lines in which one of some words is: those of a folder that is used again and again are thousands."""
    try:
        lines = (folder / MANIFEST).read_text("utf-8", "replace").splitlines()
    except OSError:
        return []
    written = [json.dumps(word) for word in words]
    return [_entry(line) for line in lines if not words or any(word in line for word in written)]


def _entry(line: str) -> dict[str, Any]:
    try:
        entry = json.loads(line)
    except (ValueError, RecursionError):
        return {}
    return entry if isinstance(entry, dict) else {}


def _is_plain(name: str) -> bool:
    """Whether a name is one of a file in this folder, not a path out of it."""
    return name == Path(name).name and name != ".." and name.isprintable() and name != ""


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
