"""The file of a single gear's compliance, as a store of them keeps it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pmor.body.root_stress import RootStressShapes
from pmor.body.support import Support
from pmor.core.errors import FileFormatError
from pmor.storage.basis_layout import COMPLIANCE, ROOT_STRESS, SUPPORT
from pmor.storage.hdf5 import Schema, attribute, create, open_checked, read_all, write_all
from pmor.storage.layout import Field

COMPLIANCE_SCHEMA = Schema("pmor-compliance", 4, "remove it: the gear is solved again")
STRESS, HOLES = "root_stress", "holes"
LAYOUT = {
    "compliance": Field("mm/N", COMPLIANCE, "of the flank nodes, of the loaded tooth and those beside it"),
    **{f"{HOLES}/{name}": Field(f.unit, f.dims, f.description, optional=True) for name, f in SUPPORT.items()},
    **{f"{STRESS}/{name}": Field(f.unit, f.dims, f.description, optional=True) for name, f in ROOT_STRESS.items()},
}


@dataclass(frozen=True)
class SolvedGear:
    """Finite elements of a gear, solved for line loads.

    Parameters
    ----------
    compliance : ndarray, shape (neighbours + 1, n, n)
        As in `pmor.body.flank_compliance.FlankCompliance`.
    root_stress : RootStressShapes or None
        Where it was asked for.
    support : Support or None
        The part of low rank, of holes.
    """

    compliance: np.ndarray
    root_stress: RootStressShapes | None
    support: Support | None = None


def read_compliance(path: Path, key: str) -> SolvedGear:
    """Read the file of the gear with a key.

    Raises
    ------
    FileFormatError
        When it is missing, foreign, damaged, of another version, or of another gear.
    """
    with open_checked(path, COMPLIANCE_SCHEMA) as file:
        if attribute(file, "key", str) != key:
            raise FileFormatError(f"{path}: is of another gear: {COMPLIANCE_SCHEMA.remedy}")
        arrays = read_all(file, LAYOUT)
        stress = RootStressShapes(*(arrays[f"{STRESS}/{name}"] for name in ROOT_STRESS)) if STRESS in file else None
        support = Support(*(arrays[f"{HOLES}/{name}"] for name in SUPPORT)) if HOLES in file else None
        return SolvedGear(arrays["compliance"], stress, support)


def write_compliance(path: Path, key: str, solved: SolvedGear) -> None:
    """Write the file of the gear with a key, whole; equal contents are equal files; OutputError where that fails."""
    stress = solved.root_stress
    arrays = {} if stress is None else {f"{STRESS}/{name}": getattr(stress, name) for name in ROOT_STRESS}
    if solved.support is not None:
        arrays |= {f"{HOLES}/{name}": getattr(solved.support, name) for name in SUPPORT}
    with create(path, COMPLIANCE_SCHEMA, {"key": key}, overwrite=True, dated=False) as file:
        write_all(file, {"compliance": solved.compliance, **arrays}, LAYOUT)
