"""Compliances of single gears under the digest of all that they depend on: what was solved once is never solved again.

The store serves any number of processes and runs at a time. An entry is written beside its place and renamed; who
solves the same gear meanwhile writes the same bytes. It is parted by the first digit of the digest, each part with an
equal share of the limit: after a write the process looks at that part alone, and removes what was not used for longest.
So the limit holds without anybody counting. A store is a help, not a place of results: where it cannot be read or
written, gears are solved as without it.
"""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pmor.errors import FileFormatError, OutputError
from pmor.reduction.root_stress import RootStressShapes
from pmor.storage.atomic import ensure_folder, output_errors
from pmor.storage.basis_layout import COMPLIANCE, ROOT_STRESS
from pmor.storage.hdf5 import Schema, create, open_checked, read, write
from pmor.storage.layout import Field, check_layout
from pmor.storage.structure import items_of
from pmor.version import __version__

COMPLIANCE_SCHEMA = Schema("pmor-compliance", 1, "remove it: the gear is solved again")
# One of it means the folder is a store, and its entries may go.
MARKER = "pmor-compliances.txt"
MARKER_TEXT = "Compliances of single gears, kept by 'pmor campaign'. All of it may be removed at any time.\n"
PARTS = "0123456789abcdef"
ENTRY = re.compile(r"[0-9a-f]{64}\.h5")
GIB = 2**30
LAYOUT = {
    "compliance": Field("mm/N", COMPLIANCE, "of the flank nodes, of the loaded tooth and those beside it"),
    **{f"root_stress/{name}": Field(f.unit, f.dims, f.description, optional=True) for name, f in ROOT_STRESS.items()},
}


@dataclass(frozen=True)
class SolvedGear:
    """What line loads need of a gear's finite elements.

    Parameters
    ----------
    compliance : ndarray, shape (reach + 1, n, n)
        As in `pmor.reduction.error_estimate.FlankCompliance`.
    root_stress : RootStressShapes or None
        Where it was asked for.
    """

    compliance: np.ndarray
    root_stress: RootStressShapes | None


@dataclass(frozen=True)
class Store:
    """A folder of compliances.

    Parameters
    ----------
    folder : Path
    limit_bytes : float
    """

    folder: Path
    limit_bytes: float

    def get(self, key: str, solve: Callable[[], SolvedGear]) -> SolvedGear:
        """Return what is kept under a key, or solve for it and keep it."""
        path = self.folder / key[0] / f"{key}.h5"
        found = _read(path)
        if found is None:
            found = solve()
            with suppress(OutputError, OSError):  # no space, no rights: the next one solves it again
                ensure_folder(path.parent)
                _write(path, found)
                _make_room(path.parent, self.limit_bytes / len(PARTS))
        return found


def open_store(folder: Path, limit_gib: float) -> Store:
    """Make a folder a store unless it is one.

    Raises
    ------
    OutputError
        When it holds something else, or cannot be written to.
    """
    marker = folder / MARKER
    if not marker.is_file():
        if folder.is_dir() and any(folder.iterdir()):
            raise OutputError(f"{folder}: holds other files, and is to be the store of compliances; choose another")
        ensure_folder(folder)
        with output_errors(f"write to the folder {folder}", marker):
            marker.write_text(MARKER_TEXT, encoding="utf-8")
    return Store(folder.resolve(), limit_gib * GIB)


def is_store(folder: Path) -> bool:
    """Whether a folder is a store of compliances."""
    return (folder / MARKER).is_file()


def entries(folder: Path) -> list[Path]:
    """Return the files of a store."""
    return [path for part in PARTS for path in sorted((folder / part).glob("*.h5")) if ENTRY.fullmatch(path.name)]


def key_of(*parts: Any) -> str:
    """Return the SHA-256, in hex, of arrays, numbers, text and dataclasses of them, and of the program's version."""
    digest = hashlib.sha256()
    for data in _bytes_of((__version__, *parts)):
        digest.update(f"{len(data)}:".encode())
        digest.update(data)
    return digest.hexdigest()


def _bytes_of(value: Any) -> Iterable[bytes]:
    if isinstance(value, np.ndarray):
        yield f"{value.dtype.str} {value.shape}".encode()
        yield np.ascontiguousarray(value).tobytes()
    elif is_dataclass(value):
        yield type(value).__name__.encode()
        for item in fields(value):
            yield item.name.encode()
            yield from _bytes_of(getattr(value, item.name))
    elif isinstance(value, tuple):
        yield f"{len(value)} items".encode()
        for item in value:
            yield from _bytes_of(item)
    else:
        yield repr(value).encode()


def _read(path: Path) -> SolvedGear | None:
    """An entry, or None where there is none that is whole; it counts as used now."""
    if not path.is_file():
        return None
    try:
        with open_checked(path, COMPLIANCE_SCHEMA) as file:
            check_layout(items_of(file), LAYOUT, {})
            compliance = read(file, "compliance", LAYOUT["compliance"])
            stress = None
            if "root_stress" in file:
                names = (f"root_stress/{name}" for name in ROOT_STRESS)
                stress = RootStressShapes(*(read(file, name, LAYOUT[name]) for name in names))
        with suppress(OSError):
            os.utime(path)
    except FileFormatError:
        return None  # damaged, or removed meanwhile: it is made anew
    return SolvedGear(compliance, stress)


def _write(path: Path, solved: SolvedGear) -> None:
    with create(path, COMPLIANCE_SCHEMA, {}, overwrite=True, dated=False) as file:
        write(file, "compliance", solved.compliance, LAYOUT["compliance"])
        stress = {} if solved.root_stress is None else _arrays(solved.root_stress)
        for name, array in stress.items():
            write(file, f"root_stress/{name}", array, LAYOUT[f"root_stress/{name}"])


def _arrays(stress: RootStressShapes) -> dict[str, np.ndarray]:
    return {name: getattr(stress, name) for name in ROOT_STRESS}


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
