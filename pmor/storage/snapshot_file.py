"""Snapshots of one pinion angle: the unit in which the offline stage saves its work and resumes it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pmor.errors import FileFormatError
from pmor.gear.conventions import FloatArray, IntArray
from pmor.result import BoolArray
from pmor.storage.hdf5 import Field, Schema, attribute, create, open_checked, read, write

SNAPSHOT_SCHEMA = Schema("pmor-snapshots", 3, "delete it; 'pmor offline --resume' makes it anew")


@dataclass(frozen=True)
class Snapshots:
    """Full-FE equilibria at one pinion angle: P tooth pairs in reach, T torques, f flank unknowns per tooth.

    Parameters
    ----------
    phi : float
        Pinion angle, rad.
    pair_index : ndarray of int, shape (P,)
    force : ndarray, shape (T, P, 2, f)
        Nodal forces on the flanks of pinion and wheel, N; those on a node and on its image together.
    ste_um : ndarray, shape (T,)
        NaN where not converged.
    converged : ndarray of bool, shape (T,)
    """

    phi: float
    pair_index: IntArray
    force: FloatArray
    ste_um: FloatArray
    converged: BoolArray


def write_snapshots(path: Path, snapshots: Snapshots, basis_key: str) -> None:
    """Write the snapshots of one angle, replacing what is there.

    Raises
    ------
    OutputError
    """
    attributes = {"phi": snapshots.phi, "basis_key": basis_key}
    with create(path, SNAPSHOT_SCHEMA, attributes, overwrite=True) as file:
        write(file, "pair_index", snapshots.pair_index, Field("1", "pair", "tooth pair"))
        write(file, "force", snapshots.force, Field("N", "torque, pair, gear, flank unknown", "nodal forces"))
        write(file, "ste", snapshots.ste_um, Field("um", "torque", "static transmission error"))
        write(file, "converged", snapshots.converged, Field("1", "torque", "whether full FE converged"))


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
            return Snapshots(
                phi=float(attribute(file, "phi")),
                pair_index=read(file, "pair_index"),
                force=read(file, "force"),
                ste_um=read(file, "ste", finite=False),
                converged=read(file, "converged"),
            )
    except FileFormatError:
        return None  # a damaged part is computed again, as if it had never been there
