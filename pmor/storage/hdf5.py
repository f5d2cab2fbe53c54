"""Self-describing HDF5 files: schema, version, units, provenance, checksums.

A file is made in memory, written beside its target and renamed when complete. Every dataset carries its unit, the
meaning of its axes, a description and the SHA-256 of its bytes; everything else is covered by the seal
(`pmor.storage.seal`). Opening verifies that nothing but plain data is in it (`pmor.storage.structure`), and the seal;
reading a dataset verifies that dataset. A seal finds accidents, not intent: arrays are compared with a layout
(`pmor.storage.layout`) before anything is computed with them.
"""

from __future__ import annotations

import hashlib
import io
import platform
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from pmor.core.errors import CaseError, FileFormatError, GeometryError, OutputError
from pmor.core.version import __version__
from pmor.storage.atomic import atomic_path, refuse_existing
from pmor.storage.layout import Field, Layout, check_layout, check_values
from pmor.storage.manifest import foreign_words, is_ours
from pmor.storage.seal import CONTENTS, DESCRIPTIONS, checksums, contents_checksum, descriptions_checksum
from pmor.storage.structure import Damaged, check_plain, items_of

# Types of attributes as the library returns them.
ATTRIBUTES = {str: str, float: np.floating, int: np.integer, bool: np.bool_}
LONGEST_CLAIM = 60  # characters
SIGNATURE = b"\x89HDF\r\n\x1a\n"
# The first format whose own structures (headers, tables of contents) carry checksums, so that the HDF5 library notices
# damage before it acts on it. Readable since HDF5 1.10 (2016).
FORMAT = ("v110", "v110")


@dataclass(frozen=True)
class Schema:
    """Kind and version of a file.

    Parameters
    ----------
    remedy : str
        For a file that this version cannot read.
    """

    name: str
    version: int
    remedy: str


@contextmanager
def create(
    path: Path, schema: Schema, attributes: dict[str, Any], overwrite: bool, dated: bool = True
) -> Iterator[h5py.File]:
    """Write a new file atomically.

    Parameters
    ----------
    attributes : dict
        Root attributes beside schema, version and provenance.
    overwrite : bool
        Whether an existing file may be replaced.
    dated : bool
        Whether the time of writing is stored: without it, equal contents are equal files.

    Yields
    ------
    h5py.File
        In memory: the HDF5 library does not survive a disk that fills up, plain writing does.

    Raises
    ------
    OutputError
        When the file exists and `overwrite` is false, or cannot be written.
    """
    refuse_existing(path, overwrite)
    with atomic_path(path, overwrite) as temporary:
        # Not the library's own image of a file in memory: before HDF5 2.0 the checksum of its first block is wrong.
        image = io.BytesIO()
        with h5py.File(image, "w", libver=FORMAT) as file:
            set_attributes(
                file, schema=schema.name, schema_version=schema.version,
                **({"created": datetime.now(UTC).isoformat(timespec="seconds")} if dated else {}),
                pmor_version=__version__, numpy_version=np.__version__, h5py_version=h5py.__version__,
                python_version=platform.python_version(), **attributes,
            )  # fmt: skip
            yield file
            set_attributes(file, **checksums(file))
        temporary.write_bytes(image.getbuffer())


def write(group: h5py.Group, name: str, data: Any, field: Field) -> None:
    """Write a dataset with its description and checksum."""
    array = np.ascontiguousarray(data)
    dataset = group.create_dataset(name, data=array)
    words = {"unit": field.unit, "dims": field.dims, "description": field.description, "sha256": _checksum(array)}
    set_attributes(dataset, **words)


def write_all(group: h5py.Group, arrays: Mapping[str, Any], layout: Layout) -> None:
    """Write datasets by their paths in a layout."""
    for name, array in arrays.items():
        write(group, name, array, layout[name])


def read_all(group: h5py.Group, layout: Layout, sizes: Mapping[str, int] | None = None) -> dict[str, np.ndarray]:
    """Read the datasets of a layout that are there, within `open_checked`: names, types, shapes and values fit it.

    Damaged where one does not.

    Parameters
    ----------
    layout : mapping of str to Field
        By the path in the group.
    sizes : mapping of str to int, optional
        Lengths of axes that are known beforehand.
    """
    check_layout(items_of(group), layout, sizes or {})
    return {name: read(group, name, field) for name, field in layout.items() if name in group}


def set_attributes(item: h5py.Group | h5py.Dataset, **values: Any) -> None:
    """Store attributes, text with a fixed length.

    Text of variable length, which h5py makes of a str, lies in a part of the file that has no checksum: the HDF5
    library then loops forever where one bit of it is wrong.
    """
    for name, value in values.items():
        if isinstance(value, str):
            data = value.encode()
            item.attrs.create(name, data, dtype=h5py.string_dtype(length=max(len(data), 1)))
        else:
            item.attrs[name] = value


def attribute(item: h5py.Group | h5py.Dataset, name: str, kind: type | None = None) -> Any:
    """Return an attribute.

    Parameters
    ----------
    kind : {str, float, int, bool}, optional
        Required type.

    Raises
    ------
    KeyError
        When there is none.
    Damaged
        When it is something else.
    """
    value = item.attrs[name]
    value = value.decode(errors="replace") if isinstance(value, bytes) else value
    if kind is None:
        return value
    if not isinstance(value, ATTRIBUTES[kind]):
        what = f"the attribute {name} of {item.name} is {value!r:.40}"
        raise Damaged(f"is of no use: {what}, and should be of the type {kind.__name__}")
    return kind(value)


@contextmanager
def open_checked(path: Path, schema: Schema) -> Iterator[h5py.File]:
    """Open a file of a schema for reading.

    Raises
    ------
    FileFormatError
        When the file is missing, is no HDF5 file, is truncated, damaged or edited, has another schema or version, or
        lacks something.
    """
    with _open(path, schema) as file:
        try:
            _check_schema(file, schema)
            with _library_errors_as_damage(Damaged):
                check_plain(items_of(file), file.id.get_filesize())
            _check_seal(file, CONTENTS, contents_checksum)
            yield file
        except Damaged as damage:
            raise FileFormatError(f"{path}: {damage}; {schema.remedy}") from damage
        except (KeyError, ValueError, CaseError, GeometryError) as error:
            raise FileFormatError(f"{path}: incomplete or outdated ({error}); {schema.remedy}") from error


def schema_name(path: Path) -> str | None:
    """Return the schema that a file claims to have; None when it claims none or cannot be read."""
    try:
        with _library_errors_as_damage(), h5py.File(path, "r") as file:
            return str(_claimed(file, "schema"))
    except Damaged:
        return None


def refuse_other_kind(path: Path, schema: Schema) -> None:
    """Raise OutputError for what is in the place of a file of ours, unless it was ours, or is of its kind."""
    if not is_ours(path) and schema_name(path) != schema.name:
        reason = f"{foreign_words(path)}: no {schema.name.removeprefix('pmor-')} to replace"
        raise OutputError(f"{path}: {reason}; move it away, or choose another folder")


def read(group: h5py.Group, name: str, field: Field | None = None) -> np.ndarray:
    """Read a dataset and verify it, within `open_checked`.

    Parameters
    ----------
    field : Field, optional
        Bounds of its values; type and shape are checked already (`check_layout`).

    Raises
    ------
    Damaged
        When the bytes differ from the written ones, or from the field; `open_checked` adds the file and the remedy.
    KeyError
        When there is no such dataset.
    """
    with _library_errors_as_damage(KeyError):
        dataset = group[name]
    with _library_errors_as_damage():
        array = np.asarray(dataset[()])
        intact = attribute(dataset, "sha256") == _checksum(array)
    if not intact:
        raise Damaged(f"is damaged, or was edited by hand: the checksum of {dataset.name} differs")
    if field is not None:
        check_values(dataset.name, array, field)
    return array


def check_descriptions(file: h5py.File) -> None:
    """Verify units and descriptions of all datasets, within `open_checked`; Damaged where one differs."""
    _check_seal(file, DESCRIPTIONS, descriptions_checksum)


@contextmanager
def _open(path: Path, schema: Schema) -> Iterator[h5py.File]:
    try:
        size, start = path.stat().st_size, b""
        if not path.is_dir():
            with path.open("rb") as stream:
                start = stream.read(len(SIGNATURE))
    except OSError as error:
        absent = isinstance(error, FileNotFoundError | NotADirectoryError)
        reason = "no such file" if absent else f"cannot be read ({error.strerror})"
        raise FileFormatError(f"{path}: {reason}; {schema.remedy}") from error
    try:
        file = h5py.File(path, "r")
    except Exception as error:  # see `_library_errors_as_damage`
        reason = "is a folder, not a file" if path.is_dir() else _why_no_hdf5(size, start, str(error))
        raise FileFormatError(f"{path}: {reason}; {schema.remedy}") from error
    with file:
        yield file


def _why_no_hdf5(size: int, start: bytes, said: str) -> str:
    if size == 0:
        return "is empty"
    if not SIGNATURE.startswith(start):
        return "is not an HDF5 file"
    if "truncated" in said or start != SIGNATURE or size < 100:
        whole = re.search(r"stored_eof = (\d+)", said)
        return f"is truncated: only {size} bytes" + (f" of {whole[1]}" if whole else "") + " are there"
    return "is a damaged HDF5 file"


def _check_schema(file: h5py.File, schema: Schema) -> None:
    with _library_errors_as_damage():
        names = ("schema", "schema_version")
        claimed, version = (_claimed(file, name) if name in file.attrs else None for name in names)
    if claimed is None:
        raise Damaged(f"is an HDF5 file of another program, not a {schema.name} file")
    if claimed != schema.name:
        raise Damaged(f"is not a {schema.name} file but one of the kind {claimed!r}")
    if not isinstance(version, np.integer):
        raise Damaged(f"is damaged, or was edited by hand: {version!r} is no version of a {schema.name} file")
    if version != schema.version:
        age = "a newer" if version > schema.version else "an older"
        raise Damaged(
            f"is {schema.name} version {version}, written by {age} pmor; this one reads version {schema.version}"
        )


def _claimed(file: h5py.File, name: str) -> Any:
    """An attribute of a file that may be anybody's: text or a number, cut to what fits into a message."""
    value = attribute(file, name) if file.attrs.get_id(name).get_space().get_simple_extent_npoints() == 1 else "it"
    return value[:LONGEST_CLAIM] if isinstance(value, str) else value


def _check_seal(file: h5py.File, name: str, checksum: Callable[[h5py.File], str]) -> None:
    with _library_errors_as_damage():
        intact = name in file.attrs and attribute(file, name) == checksum(file)
    if not intact:
        raise Damaged(f"is damaged, or was edited by hand: {name} does not fit the names and attributes in it")


@contextmanager
def _library_errors_as_damage(*passed: type[Exception]) -> Iterator[None]:
    """The HDF5 library answers a damaged file with an exception of any type; only `passed` ones go through."""
    try:
        yield
    except passed:
        raise
    except Exception as error:
        raise Damaged(f"is damaged: the HDF5 library says {error}") from error


def _checksum(array: np.ndarray) -> str:
    # Viewed as bytes, without a copy of what may be large; flat, because a view of no numbers has no last axis.
    return hashlib.sha256(array.reshape(-1).view(np.uint8).data).hexdigest()
