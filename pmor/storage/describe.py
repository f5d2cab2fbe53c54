"""Content of our HDF5 files, as text."""

from __future__ import annotations

from pathlib import Path

import h5py

from pmor.core.errors import printable
from pmor.storage.basis_file import BASIS_SCHEMA
from pmor.storage.campaign_file import CAMPAIGN_SCHEMA
from pmor.storage.compliance_file import COMPLIANCE_SCHEMA
from pmor.storage.design_file import DESIGN_SCHEMA
from pmor.storage.hdf5 import attribute, check_descriptions, open_checked, read, schema_name
from pmor.storage.results_file import GEARBOX_RESULTS_SCHEMA, RESULTS_SCHEMA, SET_RESULTS_SCHEMA
from pmor.storage.snapshot_file import SNAPSHOT_SCHEMA
from pmor.storage.structure import items_of

# Of all files but bases: an unknown file is taken for a basis.
SCHEMAS = (
    SNAPSHOT_SCHEMA, RESULTS_SCHEMA, SET_RESULTS_SCHEMA, GEARBOX_RESULTS_SCHEMA, DESIGN_SCHEMA, CAMPAIGN_SCHEMA,
    COMPLIANCE_SCHEMA,
)  # fmt: skip


def file_text(path: Path) -> str:
    """Describe a file: attributes, and each dataset with shape, unit and meaning; checksums are verified.

    Raises
    ------
    FileFormatError
        When it is not one of our files, or its data are damaged.
    """
    known = {schema.name: schema for schema in SCHEMAS}
    schema = known.get(schema_name(path) or "", BASIS_SCHEMA)
    with open_checked(path, schema) as file:
        check_descriptions(file)
        lines = [f"{path}: {schema.name}", *_attributes(file), *_datasets(file)]
        return "\n".join(map(printable, lines))


def _attributes(file: h5py.File) -> list[str]:
    names = sorted(set(file.attrs) - {"case_text", "campaign_text", "schema", "text"})
    return [f"  {name:<18} {attribute(file, name)}" for name in names]


def _datasets(file: h5py.File) -> list[str]:
    lines: list[str] = []
    for name, item in items_of(file).items():
        if isinstance(item, h5py.Dataset):
            read(file, name)
            shape = " x ".join(map(str, item.shape)) or "scalar"
            unit, description, dims = (attribute(item, key, str) for key in ("unit", "description", "dims"))
            lines.append(f"  {name:<28} {shape:<26} {unit:<6} {description} ({dims})")
    return lines
