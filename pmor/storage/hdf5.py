"""HDF5 files that say what they are: schema, version, units, provenance, checksums.

A file is written beside its target and renamed when complete. Every dataset carries its unit, the meaning of its axes,
a description and the SHA-256 of its bytes; reading verifies it.
"""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import h5py
import numpy as np

import pmor
from pmor.errors import CaseError, FileFormatError
from pmor.storage.atomic import atomic_path, refuse_existing


@dataclass(frozen=True)
class Schema:
    """Kind and version of a file.

    Parameters
    ----------
    name : str
    version : int
    remedy : str
        What a user does about a file that this version cannot read.
    """

    name: str
    version: int
    remedy: str


@dataclass(frozen=True)
class Field:
    """What a dataset means.

    Parameters
    ----------
    unit : str
    dims : str
        Meaning of the axes.
    description : str
    """

    unit: str
    dims: str
    description: str


@contextmanager
def create(path: Path, schema: Schema, attributes: dict[str, Any], overwrite: bool) -> Iterator[h5py.File]:
    """Write a new file atomically.

    Parameters
    ----------
    path : Path
    schema : Schema
    attributes : dict
        Root attributes beside schema, version and provenance.
    overwrite : bool
        Whether an existing file may be replaced.

    Raises
    ------
    OutputError
        When the file exists and `overwrite` is false, or cannot be written.
    """
    refuse_existing(path, overwrite)
    with atomic_path(path) as temporary, h5py.File(temporary, "w") as file:
        file.attrs.update(
            schema=schema.name,
            schema_version=schema.version,
            created=datetime.now(UTC).isoformat(timespec="seconds"),
            pmor_version=pmor.__version__,
            numpy_version=np.__version__,
            h5py_version=h5py.__version__,
            python_version=platform.python_version(),
            **attributes,
        )
        yield file


def write(group: h5py.Group, name: str, data: Any, field: Field) -> None:
    """Write a dataset with its description and checksum."""
    array = np.ascontiguousarray(data)
    dataset = group.create_dataset(name, data=array)
    checksum = hashlib.sha256(array.tobytes()).hexdigest()
    dataset.attrs.update(unit=field.unit, dims=field.dims, description=field.description, sha256=checksum)


@contextmanager
def open_checked(path: Path, schema: Schema) -> Iterator[h5py.File]:
    """Open a file for reading, if it is what it should be.

    Raises
    ------
    FileFormatError
        When the file is missing, is no HDF5 file, has another schema or version, or lacks something.
    """
    if not path.is_file():
        raise FileFormatError(f"{path}: no such file; {schema.remedy}")
    try:
        file = h5py.File(path, "r")
    except OSError as error:
        raise FileFormatError(f"{path}: not a readable HDF5 file, or a damaged one; {schema.remedy}") from error
    with file:
        found, version = file.attrs.get("schema"), file.attrs.get("schema_version")
        if found != schema.name:
            raise FileFormatError(f"{path}: not a {schema.name} file (schema {found!r}); {schema.remedy}")
        if version != schema.version:
            age = "a newer" if isinstance(version, np.integer) and version > schema.version else "an older"
            raise FileFormatError(
                f"{path}: {schema.name} version {version}, written by {age} pmor; this one reads version "
                f"{schema.version}; {schema.remedy}"
            )
        try:
            yield file
        except (KeyError, OSError, ValueError, CaseError) as error:
            raise FileFormatError(f"{path}: damaged, incomplete or outdated ({error}); {schema.remedy}") from error


def schema_name(path: Path) -> str | None:
    """Return the schema that a file claims to have; None when it claims none or cannot be read."""
    try:
        with h5py.File(path, "r") as file:
            return str(file.attrs["schema"])
    except (OSError, KeyError):
        return None


def read(group: h5py.Group, name: str) -> np.ndarray:
    """Read a dataset and verify its checksum, within `open_checked`.

    Raises
    ------
    ValueError
        When the bytes are not those that were written; `open_checked` says which file and what to do.
    """
    dataset = group[name]
    array = np.asarray(dataset[()])
    if hashlib.sha256(array.tobytes()).hexdigest() != dataset.attrs["sha256"]:
        raise ValueError(f"checksum of {dataset.name} differs")
    return array
