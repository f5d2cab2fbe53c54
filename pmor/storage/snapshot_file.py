"""Snapshots of one pinion angle: the unit in which the offline stage saves its work and resumes it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pmor.core.errors import FileFormatError
from pmor.reduction.basis import Snapshots
from pmor.storage.condition_table import CONDITIONS, NAME, read_conditions, write_conditions
from pmor.storage.hdf5 import Schema, attribute, create, open_checked, read_all, write_all
from pmor.storage.layout import Field, require

SNAPSHOT_SCHEMA = Schema("pmor-snapshots", 6, "delete it; pmor.train makes it anew")

# Tooth pairs are numbered from the one at the line of centres; far beyond all in mesh.
FARTHEST_PAIR = 1000
SNAPSHOT_LAYOUT = {
    "pair_index": Field("1", "pair", "tooth pair", kind=int, increasing=True, least=-FARTHEST_PAIR, most=FARTHEST_PAIR),
    NAME: CONDITIONS,
    "force": Field("N", "condition, pair, gear, flank unknown", "nodal forces"),
    "ste": Field("um", "condition", "static transmission error", finite=False),
    "converged": Field("1", "condition", "whether full FE converged", kind=bool),
}


def write_snapshots(path: Path, snapshots: Snapshots, basis_key: str) -> None:
    """Write the snapshots of one angle; an existing file is replaced; OutputError where that fails."""
    attributes = {"phi": snapshots.phi, "basis_key": basis_key, "estimate_percent": snapshots.estimate_percent}
    with create(path, SNAPSHOT_SCHEMA, attributes, overwrite=True) as file:
        own = snapshots.pair_index, snapshots.force, snapshots.ste_um, snapshots.converged
        write_all(file, dict(zip(("pair_index", "force", "ste", "converged"), own, strict=True)), SNAPSHOT_LAYOUT)
        write_conditions(file, [snapshots.conditions])


def read_snapshots(path: Path, basis_key: str) -> Snapshots | None:
    """Read the snapshots of one angle; None when there are none, or none that belong to this case.

    Parameters
    ----------
    basis_key : str
        Key of the case; snapshots of another case do not count.
    """
    if not path.exists():
        return None
    try:
        with open_checked(path, SNAPSHOT_SCHEMA) as file:
            if attribute(file, "basis_key") != basis_key:
                return None
            arrays = read_all(file, SNAPSHOT_LAYOUT, {"angle": 1, "gear": 2})
            (conditions,) = read_conditions(file)
            require(np.array_equal(np.isfinite(arrays["ste"]), arrays["converged"]), "a state is solved and is not")
            return Snapshots(
                phi=attribute(file, "phi", float), conditions=conditions, pair_index=arrays["pair_index"],
                force=arrays["force"], ste_um=arrays["ste"], converged=arrays["converged"],
                estimate_percent=attribute(file, "estimate_percent", float),
            )  # fmt: skip
    except FileFormatError:
        return None  # a damaged part is computed again, as if it had never been there
