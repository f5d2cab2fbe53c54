"""Results as files for machines: CSV and JSON."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pmor.body.bearing_readings import row_table
from pmor.results.root_stress import RootStress
from pmor.results.sweep import MeshStiffness, SteSweep
from pmor.storage.atomic import atomic_path


def write_ste_csv(path: Path, sweep: SteSweep) -> None:
    """Write the columns of `ste_columns`."""
    write_columns_csv(path, ste_columns(sweep))


def ste_columns(sweep: SteSweep) -> dict[str, np.ndarray]:
    """One value per torque and angle; an STE that did not converge is NaN, an empty field of a file.

    Columns: phi_rad, torque_Nm, ste_um, ste_error_estimate_um (empty where the basis holds none), converged (0/1),
    newton_steps, unloaded_ste_um (empty where it is zero), ste_mesh_error_estimate_um (empty where there is none),
    share_pair_<index> (fraction of the torque).
    """
    torques, angles = sweep.ste_um.shape
    nothing = np.full_like(sweep.ste_um, np.nan)
    error, unloaded = (nothing if a is None else a for a in (sweep.ste_error_um, sweep.unloaded_um))
    of_mesh = nothing[:, 0] if sweep.mesh_error_um is None else sweep.mesh_error_um
    return {
        "phi_rad": np.tile(sweep.phi_rad, torques), "torque_Nm": np.repeat(sweep.torque_Nm, angles),
        "ste_um": sweep.ste_um.ravel(), "ste_error_estimate_um": error.ravel(),
        "converged": sweep.converged.ravel().astype(int), "newton_steps": sweep.newton_steps.ravel(),
        "unloaded_ste_um": unloaded.ravel(), "ste_mesh_error_estimate_um": np.repeat(of_mesh, angles),
        **{f"share_pair_{j}": sweep.pair_share[:, :, p].ravel() for p, j in enumerate(sweep.pair_index)},
    }  # fmt: skip


def write_stiffness_csv(path: Path, sweep: SteSweep, stiffness: MeshStiffness) -> None:
    """One line per torque and angle: mesh stiffness per face width; empty where it is undefined or not known.

    Columns: phi_rad, torque_Nm, secant_N_per_mm_um, tangent_N_per_mm_um.
    """
    known = stiffness.tangent is not None and len(stiffness.tangent) == len(sweep.torque_Nm)
    tangent = stiffness.tangent if known and stiffness.tangent is not None else np.full_like(sweep.ste_um, np.nan)
    rows = [
        {"phi_rad": phi, "torque_Nm": torque, "secant_N_per_mm_um": stiffness.secant[i, k],
         "tangent_N_per_mm_um": tangent[i, k]}
        for i, torque in enumerate(sweep.torque_Nm) for k, phi in enumerate(sweep.phi_rad)
    ]  # fmt: skip
    write_table_csv(path, rows)


def write_stress_csv(path: Path, stress: RootStress) -> None:
    """One line per torque, angle, gear, loaded tooth and side of it: the largest root stress there.

    Columns: phi_rad, torque_Nm, gear (pinion, wheel), tooth (tooth pair), side (tension: of the loaded flank;
    compression), max_principal_MPa, von_mises_MPa, radius_mm and z_mm (where: of the principal stress in tension, of
    von Mises's in compression).
    """
    write_columns_csv(path, stress.columns())


def write_columns_csv(path: Path, columns: Mapping[str, Any]) -> None:
    """Write columns of equal length by their names: lists, or arrays, which take a quarter of the time of rows."""
    _write_csv(path, columns, zip(*map(_fields, columns.values()), strict=True))


def write_table_csv(path: Path, rows: Sequence[Mapping[str, Any]], columns: Sequence[str] = ()) -> None:
    """Rows of plain values under some columns, by default the keys of the first row; unknown values are empty."""
    heads = columns or list(rows[0])
    _write_csv(path, heads, zip(*(_fields([row.get(head, "") for row in rows]) for head in heads), strict=True))


def _write_csv(path: Path, heads: Iterable[str], rows: Iterable[Sequence[Any]]) -> None:
    buffer = io.StringIO(newline="")
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(heads)
    writer.writerows(rows)
    with atomic_path(path) as temporary:
        temporary.write_text(buffer.getvalue(), encoding="utf-8", newline="")


def write_bearings_csv(folder: Path, loads: Mapping[str, Any]) -> None:
    """Write `bearings.csv`, a row for each row of each rolling bearing under each load; nothing without any."""
    if rows := row_table(loads):
        write_table_csv(folder / "bearings.csv", rows)


def write_summary_json(path: Path, summary: Mapping[str, Any], overwrite: bool = False, indent: int | None = 2) -> None:
    """Plain numbers, keys in sorted order; NaN and infinity become null, anything that is not plain data is refused.

    Parameters
    ----------
    summary : mapping
    overwrite : bool
        As in `pmor.storage.atomic.atomic_path`.
    indent : int or None
        None for programs alone: many numbers are written in a fraction of the time.

    Raises
    ------
    TypeError
        Naming the key of a value that JSON cannot hold.
    """
    plain = plain_data(summary, "summary")
    text = json.dumps(plain, indent=indent, sort_keys=True, allow_nan=False, ensure_ascii=False)
    with atomic_path(path, overwrite) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")


def _fields(column: Any) -> list[Any]:
    """Entries of a column as they are written."""
    if isinstance(column, np.ndarray):
        return ["" if value != value else value for value in column.tolist()]  # noqa: PLR0124  # NaN alone
    return [_field(value) if isinstance(value, float) else value for value in column]


def _field(value: float) -> str:
    """Shortest text that reads back as the same double; empty for NaN."""
    return "" if math.isnan(value) else repr(float(value))


def plain_data(value: Any, key: str = "data") -> Any:
    """Return numbers, text, lists and mappings as JSON knows them: None where a number is not known."""
    if value is None or isinstance(value, (bool, str)):
        return value
    if isinstance(value, np.bool_):
        return bool(value)
    if isinstance(value, (int, np.integer)):
        return int(value)
    if isinstance(value, (float, np.floating)):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, Mapping):
        if not all(isinstance(k, str) for k in value):
            raise TypeError(f"{key}: keys must be text")
        return {k: plain_data(v, f"{key}.{k}") for k, v in value.items()}
    if isinstance(value, np.ndarray):
        return plain_data(value.tolist(), key)
    if isinstance(value, (list, tuple)):
        if all(type(v) is float for v in value):  # most there are, and none needs a name
            return [v if math.isfinite(v) else None for v in value]
        return [plain_data(v, f"{key}[{i}]") for i, v in enumerate(value)]
    raise TypeError(f"{key}: a {type(value).__name__} cannot be written as plain JSON")
