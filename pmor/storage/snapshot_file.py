"""Snapshots of one pinion angle: the unit in which the offline stage saves its work and resumes it."""

from __future__ import annotations

from pathlib import Path

from pmor.errors import FileFormatError
from pmor.reduction.snapshots import Snapshots
from pmor.storage.condition_table import read_conditions, write_conditions
from pmor.storage.hdf5 import Field, Schema, attribute, create, open_checked, read, write

SNAPSHOT_SCHEMA = Schema("pmor-snapshots", 4, "delete it; 'pmor offline --resume' makes it anew")


def write_snapshots(path: Path, snapshots: Snapshots, basis_key: str) -> None:
    """Write the snapshots of one angle, replacing what is there.

    Raises
    ------
    OutputError
    """
    attributes = {"phi": snapshots.phi, "basis_key": basis_key, "estimate_percent": snapshots.estimate_percent}
    with create(path, SNAPSHOT_SCHEMA, attributes, overwrite=True) as file:
        write(file, "pair_index", snapshots.pair_index, Field("1", "pair", "tooth pair"))
        write_conditions(file, [snapshots.conditions])
        write(file, "force", snapshots.force, Field("N", "condition, pair, gear, flank unknown", "nodal forces"))
        write(file, "ste", snapshots.ste_um, Field("um", "condition", "static transmission error"))
        write(file, "converged", snapshots.converged, Field("1", "condition", "whether full FE converged"))


def read_snapshots(path: Path, basis_key: str) -> Snapshots | None:
    """Read the snapshots of one angle; None when there are none, or none that belong to this case.

    Parameters
    ----------
    path : Path
    basis_key : str
        Key of the case; snapshots of another case do not count.
    """
    if not path.exists():
        return None
    try:
        with open_checked(path, SNAPSHOT_SCHEMA) as file:
            if attribute(file, "basis_key") != basis_key:
                return None
            (conditions,) = read_conditions(file)
            return Snapshots(
                phi=float(attribute(file, "phi")),
                conditions=conditions,
                pair_index=read(file, "pair_index"),
                force=read(file, "force"),
                ste_um=read(file, "ste", finite=False),
                converged=read(file, "converged"),
                estimate_percent=float(attribute(file, "estimate_percent")),
            )
    except FileFormatError:
        return None  # a damaged part is computed again, as if it had never been there
