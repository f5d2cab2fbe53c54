"""Snapshots of one pinion angle: the unit in which the offline stage saves its work and resumes it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pmor.arrays import BoolArray, FloatArray, IntArray
from pmor.errors import FileFormatError
from pmor.storage.hdf5 import Field, Schema, attribute, create, open_checked, read, write

SNAPSHOT_SCHEMA = Schema("pmor-snapshots", 3, "delete it; 'pmor offline --resume' makes it anew")


@dataclass(frozen=True)
class Snapshots:
    """Full-FE equilibria at one pinion angle: P tooth pairs in reach, T conditions, f flank unknowns per tooth.

    Parameters
    ----------
    phi : float
        Pinion angle, rad.
    torque : ndarray, shape (T,)
        N mm.
    misalignment : ndarray, shape (T, 3)
        In plane, out of plane, centre distance, um.
    pair_index : ndarray of int, shape (P,)
    force : ndarray, shape (T, P, 2, f)
        Nodal forces on the flanks of pinion and wheel, N; those on a node and on its image together.
    ste_um : ndarray, shape (T,)
        NaN where not converged.
    converged : ndarray of bool, shape (T,)
    estimate_percent : float
        Largest error estimate before this angle was chosen (`pmor.storage.basis_file.Training`); NaN if none was made.
    """

    phi: float
    torque: FloatArray
    misalignment: FloatArray
    pair_index: IntArray
    force: FloatArray
    ste_um: FloatArray
    converged: BoolArray
    estimate_percent: float = float("nan")


def write_snapshots(path: Path, snapshots: Snapshots, basis_key: str) -> None:
    """Write the snapshots of one angle, replacing what is there.

    Raises
    ------
    OutputError
    """
    attributes = {"phi": snapshots.phi, "basis_key": basis_key, "estimate_percent": snapshots.estimate_percent}
    with create(path, SNAPSHOT_SCHEMA, attributes, overwrite=True) as file:
        write(file, "pair_index", snapshots.pair_index, Field("1", "pair", "tooth pair"))
        write(file, "torque", snapshots.torque, Field("N mm", "condition", "pinion torque"))
        deviations = Field("um", "condition, deviation", "misalignment in plane, out of plane, centre distance")
        write(file, "misalignment", snapshots.misalignment, deviations)
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
            return Snapshots(
                phi=float(attribute(file, "phi")),
                torque=read(file, "torque"),
                misalignment=read(file, "misalignment"),
                pair_index=read(file, "pair_index"),
                force=read(file, "force"),
                ste_um=read(file, "ste", finite=False),
                converged=read(file, "converged"),
                estimate_percent=float(attribute(file, "estimate_percent")),
            )
    except FileFormatError:
        return None  # a damaged part is computed again, as if it had never been there
