"""Solved gears under the digest of all that they depend on: a gear is solved once, whatever asks for it.

The store of a folder of results is beside it, so that runs and products share it. It serves any number of processes and
runs at a time. An entry is written beside its place and renamed; another process that solves the same gear meanwhile
writes the same bytes. The first digit of the digest parts the store, with an equal share of the limit for each part:
after a write the process looks at that part alone, and removes the entries unused for longest. The limit thus holds
without a common count. A store holds no results: where it cannot be read or written, gears are solved as without it.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from pmor.body.flank_compliance import SolvedGear
from pmor.core.errors import FileFormatError, OutputError
from pmor.storage.atomic import ensure_folder, output_errors, remove_abandoned
from pmor.storage.compliance_file import read_compliance, write_compliance

# One of it means the folder is a store, and its entries may go.
MARKER = "pmor-compliances.txt"
MARKER_TEXT = "Finite elements of single gears, kept by pmor. All of it may be removed at any time.\n"
PARTS = "0123456789abcdef"
ENTRY = re.compile(r"[0-9a-f]{64}\.h5")
GIB = 2**30
# Name of the store beside folders of results, and its largest size by default.
NAME, LIMIT_GIB = "compliances", 5.0

# Gives the gear with a key, and solves for it where it is not kept.
KeptGear = Callable[[str, Callable[[], SolvedGear]], SolvedGear]


def not_kept(key: str, solve: Callable[[], SolvedGear]) -> SolvedGear:
    """Solve for a gear that is kept nowhere, as `KeptGear`."""
    return solve()


@dataclass(frozen=True)
class Store:
    """A folder of gears, and its largest size; of 0 bytes nothing is kept; `anew`: what is kept is replaced."""

    folder: Path
    limit_bytes: float
    anew: bool = False

    def get(self, key: str, solve: Callable[[], SolvedGear]) -> SolvedGear:
        """Return the entry of a key, or solve for it and keep it."""
        if not self.limit_bytes:
            return solve()
        path = self.folder / key[0] / f"{key}.h5"
        found = None if self.anew else _found(path, key)
        if found is None:
            found = solve()
            with suppress(OutputError, OSError):  # no space, no rights: the next one solves it again
                ensure_folder(path.parent)
                write_compliance(path, key, found)
                _make_room(path.parent, self.limit_bytes / len(PARTS))
        return found


def refuse_foreign_store(folder: Path) -> None:
    """Raise OutputError when a folder that is to be a store holds something else."""
    if not is_store(folder) and folder.exists() and not (folder.is_dir() and not any(folder.iterdir())):
        raise OutputError(f"{folder}: holds other things, and is to be the store of compliances: choose another folder")


def open_store(folder: Path, limit_gib: float) -> Store:
    """Make a folder a store unless it is one; OutputError when it holds something else, or cannot be written to."""
    if not limit_gib:
        return Store(folder, 0.0)
    refuse_foreign_store(folder)
    marker = folder / MARKER
    if not is_store(folder):
        ensure_folder(folder)
        with output_errors(f"write to the folder {folder}", marker):
            marker.write_text(MARKER_TEXT, encoding="utf-8")
    return Store(folder.resolve(), limit_gib * GIB)


def kept_beside(path: Path | None, anew: bool = False, make: bool = True) -> KeptGear:
    """Return where the gears of a folder of results, or of a file, are kept: in the store beside it.

    Parameters
    ----------
    path : Path or None
        None keeps nothing.
    anew : bool
        Solve all gears, and replace those that are kept.
    make : bool
        Make the store where there is none.
    """
    if path is None or not (make or is_store(path.absolute().parent / NAME)):
        return not_kept
    try:
        store = open_store(path.absolute().parent / NAME, LIMIT_GIB)
    except OutputError:  # other things are there, or no rights
        return not_kept
    return replace(store, anew=anew).get


def is_store(folder: Path) -> bool:
    """Whether a folder is a store of compliances."""
    return (folder / MARKER).is_file()


def remove_unfinished(store: Store) -> None:
    """Remove what solving processes that were ended left half written; on machines beside, one at work writes anew."""
    for part in PARTS if store.limit_bytes else ():
        with suppress(OSError):  # not there yet, or no rights
            remove_abandoned(store.folder / part)


def entries(folder: Path) -> list[Path]:
    """Return the files of a store."""
    return [path for part in PARTS for path in sorted((folder / part).glob("*.h5")) if ENTRY.fullmatch(path.name)]


def _found(path: Path, key: str) -> SolvedGear | None:
    """An entry, or None where there is none that is whole; it counts as used now."""
    if not path.is_file():
        return None
    try:
        solved = read_compliance(path, key)
    except FileFormatError:
        return None  # damaged, of another gear, or removed meanwhile: it is made anew
    with suppress(OSError):
        os.utime(path)
    return solved


def _make_room(part: Path, limit: float) -> None:
    """Remove entries of a part, those not used for longest first, until it keeps to its limit."""
    found = []
    for path in part.iterdir():
        if ENTRY.fullmatch(path.name):
            with suppress(OSError):  # another process removes as well
                state = path.stat()
                found.append((state.st_mtime_ns, path.name, state.st_size, path))
    total = sum(size for _, _, size, _ in found)
    for _, _, size, path in sorted(found):
        if total <= limit:
            return
        with suppress(OSError):
            path.unlink()
        total -= size
