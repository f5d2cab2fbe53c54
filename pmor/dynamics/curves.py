"""Response curves as a table: `response.csv`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from pmor.dynamics.measure import RUNS, Data
from pmor.report.data_files import write_table_csv

# Orders of the mesh frequency in the table.
ORDERS = 5
#: header of the table; a run has fewer of them than a branch
COLUMNS = (
    "torque_Nm", "curve", "mesh_frequency_Hz", "speed_rpm", "stable", "dte_rms_um", "contact_loss",
    "period_mesh_cycles", "dte_peak_to_peak_um", "dynamic_factor", "largest_force_N", "smallest_force_N",
    "separation_um", *(f"dte_order_{k}_um" for k in range(1, ORDERS + 1)),
    "pinion_bearing_force_N", "wheel_bearing_force_N",
)  # fmt: skip


def write_curves(path: Path, responses: Sequence[Data]) -> None:
    """Write one line per torque, curve (`branch_1`, ..., `run_up`, `run_down`) and point; unknown fields are empty.

    Raises
    ------
    OutputError
    """
    write_table_csv(path, curve_rows(responses), COLUMNS)


def curve_rows(responses: Sequence[Data]) -> list[Data]:
    """Return the rows of the table."""
    return [row for response in responses for row in _rows(response)]


def _rows(response: Data) -> Iterator[Data]:
    torque = {"torque_Nm": response["torque_Nm"]}
    for number, branch in enumerate(response["branches"], start=1):
        for point in branch:
            orders = dict(zip(COLUMNS[-ORDERS - 2 : -2], point["dte_orders_um"], strict=False))
            bearings = dict(zip(COLUMNS[-2:], point["bearing_force_N"], strict=True))
            row = {key: point[key] for key in COLUMNS if key in point}
            yield torque | row | orders | bearings | {"curve": f"branch_{number}", "stable": int(point["stable"])}
    for run in RUNS:
        for point in response[run] or ():
            yield torque | {"curve": run} | point
