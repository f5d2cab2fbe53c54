"""The result of the pair in motion: its arrays, pictures and files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pmor.case import text_of
from pmor.core.arrays import FloatArray
from pmor.core.shown import Columns
from pmor.dynamics.figures import motion_figure, response_figure, waterfall_figure
from pmor.dynamics.measure import RUNS, Data
from pmor.dynamics.output import FILES, dynamics_data, dynamics_report, dynamics_text
from pmor.dynamics.rating import rated
from pmor.dynamics.solution import Dynamics
from pmor.report.curves import Drawn
from pmor.report.data_files import write_table_csv
from pmor.report.replay import figure_of
from pmor.work.results import writing_results

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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


@dataclass(frozen=True, eq=False, repr=False)
class DynamicsResult(Drawn):
    """Responses of a pair over its speed, one per torque."""

    found: Dynamics

    @property
    def data(self) -> Data:
        """All of it as plain data: the content of `dynamics.json`."""
        return dynamics_data(self.found)

    @property
    def torque_Nm(self) -> FloatArray:
        """Mean torques, shape (T,), N m."""
        return self._numbers("torque_Nm")

    @property
    def natural_frequency_Hz(self) -> FloatArray:
        """Natural frequencies with the mean mesh stiffness, shape (T,), Hz."""
        return self._numbers("natural_frequency_Hz")

    @property
    def natural_speed_rpm(self) -> FloatArray:
        """Speeds of the pinion at which the mesh has these frequencies, shape (T,), rpm."""
        return self._numbers("natural_speed_rpm")

    @property
    def peaks(self) -> tuple[tuple[Data, ...], ...]:
        """Peaks of the response, for each torque (`pmor.dynamics.peaks.peaks_of`)."""
        return tuple(tuple(response["peaks"]) for response in self.found.responses)

    @property
    def folds(self) -> tuple[tuple[Data, ...], ...]:
        """Jumps of motion, for each torque: mesh frequency, transmission error, and the direction of speed."""
        return tuple(tuple(response["folds"]) for response in self.found.responses)

    @property
    def failures(self) -> tuple[str, ...]:
        """Torques without a response, or a part of it, and why; empty when all are there."""
        return self.found.failures

    def plot_response(self) -> Figure:
        """Transmission error and dynamic factor over the mesh frequency."""
        solved = self.found
        factors = [rated(solved.case, solved.pair, solved.model.mass, response) for response in solved.responses]
        return figure_of(response_figure(solved.responses, factors))

    def plot_waterfall(self) -> Figure | None:
        """Orders along the run-up; None without a run."""
        chart = waterfall_figure(self.found.responses)
        return None if chart is None else figure_of(chart)

    def plot_motion(self) -> Figure | None:
        """The largest stable motion of each torque, in the phase plane and over the mesh cycle."""
        chart = motion_figure(self.found.responses)
        return None if chart is None else figure_of(chart)

    def write(self, folder: Path | str, *, overwrite: bool = False) -> None:
        """Write `dynamics.json`, `dynamics.md`, `report.html`, `response.csv`, pictures; remove finished pieces.

        Pieces stay where something failed: the next run takes them over.

        Parameters
        ----------
        overwrite : bool
            Replace files of these names whoever wrote them.

        Raises
        ------
        OutputError
        """
        text, complete = text_of(self.found.case), not self.failures
        with writing_results(folder, FILES, text, overwrite=overwrite, complete=complete) as out:
            dynamics_report(self.found).write(out)
            write_curves(out / "response.csv", self.found.responses)

    def _numbers(self, key: str) -> FloatArray:
        return np.array([response[key] for response in self.found.responses])

    def columns(self) -> Columns:
        """All curves by the names of columns, those of `response.csv`, for `to_dataframe`; None is unknown."""
        rows = curve_rows(self.found.responses)
        return {key: [row.get(key) for row in rows] for key in COLUMNS}

    def _shown(self) -> Columns:
        return {
            "torque, N m": self.torque_Nm, "natural frequency, Hz": self.natural_frequency_Hz,
            "natural speed, rpm": self.natural_speed_rpm, "peaks": [len(listed) for listed in self.peaks],
            "jump frequencies": [len(listed) for listed in self.folds],
        }  # fmt: skip

    def __repr__(self) -> str:
        count = sum(len(folds) for folds in self.folds)
        torques = ", ".join(f"{torque:g}" for torque in self.torque_Nm)
        return f"<DynamicsResult of {self.found.case.name!r}: {torques} N m, {count} jump frequencies>"

    def __str__(self) -> str:
        return dynamics_text(self.found)
