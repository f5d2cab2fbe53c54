"""Arrays of a results file for tables; datasets carry their units, axes and descriptions."""

from __future__ import annotations

from pathlib import Path

import h5py

from pmor.export.tables import Entry
from pmor.storage.hdf5 import Schema, attribute, check_descriptions, open_checked, read
from pmor.storage.structure import items_of

SCALAR = "scalar"


def file_entries(path: Path, schema: Schema) -> dict[str, Entry]:
    """Return the datasets of a file by their names.

    Raises
    ------
    FileFormatError
        When it is foreign, damaged, or of another version.
    """
    found = {}
    with open_checked(path, schema) as file:
        check_descriptions(file)
        for name, item in items_of(file).items():
            if isinstance(item, h5py.Dataset):
                unit, axes, text = (attribute(item, key, str) for key in ("unit", "dims", "description"))
                values = read(file, name)
                named = tuple(axis.strip() for axis in axes.split(",") if axis.strip() not in ("", SCALAR))
                found[name] = Entry(values, unit, named, text)
    return found
