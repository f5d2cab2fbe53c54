"""What is in one of our HDF5 files, as text."""

from __future__ import annotations

from pathlib import Path

import h5py

from pmor.storage.basis_file import BASIS_SCHEMA
from pmor.storage.hdf5 import check_descriptions, open_checked, read, schema_name
from pmor.storage.snapshot_file import SNAPSHOT_SCHEMA


def file_text(path: Path) -> str:
    """Describe a file: attributes, and each dataset with shape, unit and meaning; checksums are verified.

    Raises
    ------
    FileFormatError
        When it is not one of our files, or its data are damaged.
    """
    schema = SNAPSHOT_SCHEMA if schema_name(path) == SNAPSHOT_SCHEMA.name else BASIS_SCHEMA
    with open_checked(path, schema) as file:
        check_descriptions(file)
        return "\n".join([f"{path}: {schema.name}", *_attributes(file), *_datasets(file)])


def _attributes(file: h5py.File) -> list[str]:
    return [f"  {name:<18} {file.attrs[name]}" for name in sorted(file.attrs) if name not in ("case_text", "schema")]


def _datasets(file: h5py.File) -> list[str]:
    lines: list[str] = []

    def visit(name: str, item: object) -> None:
        if isinstance(item, h5py.Dataset):
            read(file, name, finite=False)
            shape = " x ".join(map(str, item.shape)) or "scalar"
            a = item.attrs
            lines.append(f"  {name:<28} {shape:<26} {a['unit']:<6} {a['description']} ({a['dims']})")

    file.visititems(visit)
    return lines
