"""The result of a set: its numbers, pictures and files."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.errors import CaseError
from pmor.core.shown import Columns
from pmor.export.tables import ResultArray, results_entries
from pmor.pair.samples import Samples, sample_rows
from pmor.report.curves import Drawn
from pmor.report.data_files import write_bearings_csv, write_columns_csv, write_table_csv
from pmor.report.replay import figure_of
from pmor.report.torque_figures import tolerance_figure
from pmor.results.tabular import headed
from pmor.sets.figures import (
    path_figure,
    pin_figure,
    ring_figure,
    root_stress_figure,
    set_figure,
    share_figure,
    ste_figure,
)
from pmor.sets.live import live_blocks
from pmor.sets.loader import SetFile
from pmor.sets.lost import known
from pmor.sets.output import (
    BEARING_FILES,
    FILES,
    PIN_FILES,
    REXS_FILES,
    SAMPLE_FILES,
    by_torques,
    nominal_torque,
    set_report,
    set_text,
)
from pmor.sets.readings import Data, set_data
from pmor.sets.remedies import verdict_of_set
from pmor.sets.results_data import mesh_rows, set_columns, set_results, torque_rows
from pmor.sets.solution import SetSolution
from pmor.sets.vtkhdf import write_set
from pmor.storage.results_file import ResultsFile, write_results_file
from pmor.work.results import writing_results

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
class SetResult(Drawn):
    """Gears that mesh with several others, over a mesh cycle.

    Parameters
    ----------
    samples : Samples or None
        Sets within the tolerances of the file.
    failures : tuple of str
        Torques with positions that did not converge.
    beside : mapping of str to callable
        What `write` leaves in formats of other programs, by the names of the files.
    """

    file: SetFile
    solution: SetSolution
    samples: Samples | None
    failures: tuple[str, ...]
    beside: Mapping[str, Callable[[SetResult, Path], None]] = field(default_factory=dict)

    @cached_property
    def data(self) -> Data:
        """All of it as plain data: the content of `set.json`."""
        return self._numbers | {"verdict": verdict_of_set(self.file, self.solution, self._numbers).data}

    @cached_property
    def _numbers(self) -> Data:
        """`data` without a verdict, which takes sweeps of its own."""
        return set_data(self.file, self.solution, self.samples, self.failures)

    @property
    def ste_um(self) -> FloatArray:
        """Static transmission error at each torque and angle, (D, A), um; NaN where not converged."""
        return np.asarray(self.solution.ste_um)

    @property
    def planet_share(self) -> FloatArray:
        """Share of each planet in the load, (D, A, N)."""
        return np.asarray(self.solution.planet_share)

    @property
    def k_gamma(self) -> FloatArray:
        """Mesh load factor at each torque, (D,)."""
        return self.solution.k_gamma

    def plot_set(self, angle: int = 0) -> Figure:
        """Draw all gears with the forces of their tooth pairs at the nominal torque, at an angle by its number."""
        return figure_of(set_figure(self.solution, nominal_torque(self.file, self.solution), angle))

    def plot_ste(self) -> Figure:
        """Draw the transmission error over a mesh cycle, and its orders."""
        return figure_of(ste_figure(self.solution, self._torques_Nm))

    def plot_shares(self) -> Figure:
        """Draw the share of each planet over a mesh cycle, and the orbit of the sun; of a train that of each path."""
        figure = share_figure if self.solution.plan.planets else path_figure
        return figure_of(figure(self.solution, nominal_torque(self.file, self.solution)))

    def plot_pins(self) -> Figure:
        """Draw the deflection of all pins and of the axes of the planets on them, at the nominal torque.

        Raises
        ------
        CaseError
            When the file has no pins.
        """
        if self.file.sections.pins is None:
            raise CaseError(f"{self.file.name}: has no pins: add [pins]")
        return figure_of(pin_figure(self.file.sections.pins, self.solution, nominal_torque(self.file, self.solution)))

    def plot_ring(self) -> Figure:
        """Draw the displacement of the ring's root between its teeth at angle 0, at the nominal torque.

        Raises
        ------
        CaseError
            When there is no ring with several meshes.
        """
        if self.solution.ring_deflection is None:
            raise CaseError(f"{self.file.name}: has no ring with several meshes: its deflection is not told")
        return figure_of(ring_figure(self.solution, nominal_torque(self.file, self.solution)))

    def plot_root_stress(self) -> Figure:
        """Draw the stress across the root of a tooth of each member over a turn.

        Raises
        ------
        CaseError
            When the file asks for no root stress.
        """
        if not self.solution.root_stress:
            raise CaseError(f"{self.file.name}: has no root stress: leave [results] root_stress = false out")
        return figure_of(root_stress_figure(self.solution, nominal_torque(self.file, self.solution)))

    def plot_tolerances(self) -> Figure:
        """Draw how many of the sets within tolerances stay below a mesh load factor and a transmission error.

        Raises
        ------
        CaseError
            When the file has no tolerances.
        """
        if self.samples is None:
            raise CaseError(f"{self.file.name}: has no tolerances: add [tolerances]")
        return figure_of(tolerance_figure(self.samples, self._torques_Nm))

    def to_csv(self, path: Path | str) -> None:
        """Write the table `ste.csv`: a row for each torque and angle, units in the header."""
        write_columns_csv(Path(path), self.columns())

    def columns(self) -> Columns:
        """All of it by the names of columns, for `to_dataframe`: a value for each torque and angle."""
        return set_columns(self.solution, self._torques_Nm)

    def figures(self) -> Columns:
        """The main figures under each torque, by their keys."""
        mean, span = (np.array([known(of, ste) for ste in self.ste_um]) for of in (np.mean, np.ptp))
        found = {"torque_Nm": self._torques_Nm, "ste_mean_um": mean, "ste_peak_to_peak_um": span}
        converged = {"converged": self.solution.converged.all(axis=1)}
        return found | ({"k_gamma": self.k_gamma} if self.solution.plan.planets else {}) | converged

    def _shown(self) -> Columns:
        return headed(self.figures())

    def write(self, folder: Path | str, *, overwrite: bool = False) -> None:
        """Write `set.json`, `set.md`, `report.html`, the pictures, tables, `results.h5` and `set.vtkhdf`.

        Tables are `ste.csv`, `torques.csv`, `meshes.csv`, of rolling bearings `bearings.csv`; with tolerances
        `tolerances.csv`; of `pmor.run`, and planetary sets that REXS has words for, `set.rexs`.

        Parameters
        ----------
        overwrite : bool
            Replace files of these names whoever wrote them.

        Raises
        ------
        OutputError
        """
        inputs, files = self.file.inputs, (*FILES, *SAMPLE_FILES, *PIN_FILES, *BEARING_FILES, *REXS_FILES)
        with writing_results(
            folder, files, self.file.whole_text, inputs=inputs, overwrite=overwrite, working=()
        ) as out:
            report = set_report(self.file, self.solution, self.samples, self.data)
            replace(report, page_only=live_blocks(self.file, self.solution)).write(out)
            if self.samples is not None:
                write_table_csv(out / "tolerances.csv", sample_rows(self.samples, self._torques_Nm))
            self.to_csv(out / "ste.csv")
            write_table_csv(out / "torques.csv", torque_rows(self.data))
            write_table_csv(out / "meshes.csv", mesh_rows(self.data))
            write_bearings_csv(out, by_torques(self.data))
            write_results_file(out / "results.h5", self._results_file())
            for name, write in self.beside.items():
                write(self, out / name)
            write_set(self.solution, self.file.cases, nominal_torque(self.file, self.solution), out / "set.vtkhdf")

    def _labelled(self) -> dict[str, ResultArray]:
        return results_entries(self._results_file())

    def _results_file(self) -> ResultsFile:
        return set_results(self.file, self.solution, self._torques_Nm, self.data)

    @property
    def _torques_Nm(self) -> FloatArray:
        """Torques of the member that the file names."""
        return np.asarray(self.solution.torque_Nm * self.file.plan.nominal_Nm / self.file.plan.torque_Nm)

    def __repr__(self) -> str:
        meshes, torques = len(self.file.plan.meshes), len(self.solution.torque_Nm)
        return f"<SetResult of {self.file.name!r}: {meshes} meshes, {torques} torques>"

    def __str__(self) -> str:
        return set_text(self.file, self.solution, self.data)
