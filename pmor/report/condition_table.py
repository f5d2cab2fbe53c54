"""The conditions that a case lists, swept: rows for machines, and a table of the page."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from pmor.case import Case, condition_words
from pmor.report.table import Table
from pmor.results.sweep import SteSweep, mesh_orders, peak_to_peak_um, ste_mean_um
from pmor_online.conditions import ConditionSweep
from pmor_online.run import OnlineResult

# Conditions that a page lists; all of them are in the file.
MOST_LISTED = 100
N_ORDERS = 5
COLUMNS = ("torque_Nm", "ste_mean_um", "ste_peak_to_peak_um", "ste_order_1_um", "unloaded_ste_peak_to_peak_um")


def sweep_row(sweep: SteSweep, t: int) -> dict[str, Any]:
    """Return the figures of a sweep at one of its torques: plain values, units in the keys."""
    unloaded = None if sweep.unloaded_um is None else sweep.unloaded_um[t]
    return {
        "torque_Nm": float(sweep.torque_Nm[t]), "ste_mean_um": float(ste_mean_um(sweep)[t]),
        "ste_peak_to_peak_um": float(peak_to_peak_um(sweep)[t]),
        "unloaded_ste_mean_um": None if unloaded is None else float(np.mean(unloaded)),
        "unloaded_ste_peak_to_peak_um": None if unloaded is None else float(np.ptp(unloaded)),
        "first_touch_um": None if unloaded is None else float(np.min(unloaded)),
        "ste_mesh_error_percent": None if sweep.mesh_error_percent is None else float(sweep.mesh_error_percent[t]),
    }  # fmt: skip


def order_columns(sweep: SteSweep, t: int) -> dict[str, float]:
    """Return the first orders of the mesh at one of the torques."""
    return {f"ste_order_{k}_um": float(a) for k, a in enumerate(mesh_orders(sweep, t, N_ORDERS), start=1)}


def condition_rows(found: ConditionSweep) -> list[dict[str, Any]]:
    """Return a row for each torque at which a condition was swept: plain values, units in the keys."""
    sweep = found.sweep
    return [
        {
            "condition": found.name, **asdict(found.assembly.misalignment), **sweep_row(sweep, t),
            **order_columns(sweep, t),
            "n_positions_failed": int(np.count_nonzero(~sweep.converged[t])), "flank": found.flank,
        }
        for t in range(len(sweep.torque_Nm))
    ]  # fmt: skip


def condition_table(result: OnlineResult) -> Table:
    """Return the table of a page: each condition at its own torque."""
    case, listed = result.reduced.basis.case, result.conditions[:MOST_LISTED]
    rows = [_row(case, number, found) for number, found in enumerate(listed)]
    note = "Each at its own torque; all torques and more orders are in conditions.csv."
    if len(listed) < len(result.conditions):
        note += f" The first {len(listed)} of {len(result.conditions)} conditions."
    columns = ["condition", "differences from the case", "torque, N m", "STE mean, µm", "STE peak-to-peak, µm",
               "first order, µm", "without load, peak-to-peak, µm"]  # fmt: skip
    return Table("Conditions", columns, rows, note, folded=True)


def _row(case: Case, number: int, found: ConditionSweep) -> list[str | float | None]:
    """Cells of a condition at its own torque."""
    row = condition_rows(found)[found.own]
    words = "; ".join(condition_words(case, case.conditions[number]))
    return [found.name, words or None, *(row[key] for key in COLUMNS)]
