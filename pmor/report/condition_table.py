"""The conditions that a case lists, swept: rows for machines, and a table of the page."""

from __future__ import annotations

from typing import Any

import numpy as np

from pmor.case import Case, condition_words
from pmor.report.table import Table
from pmor.results.sweep import mesh_orders, peak_to_peak_um, ste_mean_um
from pmor_online.conditions import ConditionSweep
from pmor_online.run import OnlineResult

# Conditions that a page lists; all of them are in the file.
MOST_LISTED = 100
N_ORDERS = 5
COLUMNS = ("torque_Nm", "ste_mean_um", "ste_peak_to_peak_um", "ste_order_1_um", "unloaded_ste_peak_to_peak_um")


def condition_rows(found: ConditionSweep) -> list[dict[str, Any]]:
    """Return a row for each torque at which a condition was swept: plain values, units in the keys."""
    sweep, misalignment = found.sweep, found.assembly.misalignment
    mean, span = ste_mean_um(sweep), peak_to_peak_um(sweep)
    rows = []
    for t, torque in enumerate(sweep.torque_Nm.tolist()):
        orders = mesh_orders(sweep, t, N_ORDERS)
        unloaded = None if sweep.unloaded_um is None else float(np.ptp(sweep.unloaded_um[t]))
        rows.append({
            "condition": found.name, "torque_Nm": torque, "in_plane_um": misalignment.in_plane_um,
            "out_of_plane_um": misalignment.out_of_plane_um, "centre_distance_um": misalignment.centre_distance_um,
            "ste_mean_um": float(mean[t]), "ste_peak_to_peak_um": float(span[t]),
            "unloaded_ste_peak_to_peak_um": unloaded,
            **{f"ste_order_{k}_um": float(amplitude) for k, amplitude in enumerate(orders, start=1)},
            "ste_mesh_error_percent": None if sweep.mesh_error_percent is None else float(sweep.mesh_error_percent[t]),
            "n_positions_failed": int(np.count_nonzero(~sweep.converged[t])),
        })  # fmt: skip
    return rows


def condition_table(result: OnlineResult) -> Table:
    """Return the table of a page: each condition at its own torque."""
    case, listed = result.reduced.basis.case, result.conditions[:MOST_LISTED]
    rows = [_row(case, number, found) for number, found in enumerate(listed)]
    note = "Each at its own torque; all torques and more orders are in conditions.csv."
    if len(listed) < len(result.conditions):
        note += f" The first {len(listed)} of {len(result.conditions)} conditions."
    columns = ["condition", "what differs from the case", "torque, N m", "STE mean, µm", "STE peak-to-peak, µm",
               "first order, µm", "without load, peak-to-peak, µm"]  # fmt: skip
    return Table("Conditions", columns, rows, note)


def _row(case: Case, number: int, found: ConditionSweep) -> list[str | float | None]:
    """Cells of a condition at its own torque."""
    row = condition_rows(found)[found.own]
    words = "; ".join(condition_words(case, case.conditions[number]))
    return [found.name, words or None, *(row[key] for key in COLUMNS)]
