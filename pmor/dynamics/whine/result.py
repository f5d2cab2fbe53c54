"""The result of a gearbox or a set in motion: its arrays, pictures and files."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pmor.core.copies import in_a_copy
from pmor.core.shown import Columns
from pmor.dynamics.whine.arrays import line_columns, motion_arrays, response_columns
from pmor.dynamics.whine.figures import bearings_figure, campbell_figure, meshes_figure, waterfall_figure
from pmor.dynamics.whine.output import (
    FILES,
    Data,
    MovingFile,
    kind_of,
    loudest,
    whine_data,
    whine_report,
    whine_text,
)
from pmor.dynamics.whine.parting_output import parting_arrays, parting_rows
from pmor.dynamics.whine.pictures import drawn_modes, modes_figure, write_modes
from pmor.dynamics.whine.readings import bearing_names
from pmor.dynamics.whine.response import LoadResponse
from pmor.export.tables import ResultArray, results_entries
from pmor.report.curves import Drawn
from pmor.report.data_files import write_columns_csv, write_table_csv
from pmor.report.replay import figure_of
from pmor.storage.results_file import OF_MOTION, ResultsFile, write_results_file
from pmor.work.results import writing_results

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
class MotionResult(Drawn):
    """A gearbox or a planetary set in small motion over its speed, about each load that has an equilibrium."""

    file: MovingFile
    loads: tuple[LoadResponse, ...]
    failures: tuple[str, ...]

    @cached_property
    def data(self) -> Data:
        """All of it as plain data: the content of `dynamics.json`."""
        return whine_data(self.file, self.loads, self.failures)

    def columns(self) -> Columns:
        """All lines by the names of columns, those of `lines.csv`, for `to_dataframe`."""
        return line_columns(self.loads)

    def plot_bearings(self) -> Figure:
        """Draw the dynamic forces of all bearings over the speed."""
        return figure_of(bearings_figure(self.loads))

    def plot_meshes(self) -> Figure:
        """Draw the dynamic forces of all meshes over the speed."""
        return figure_of(meshes_figure(self.loads))

    def plot_campbell(self, load: int = 0) -> Figure:
        """Draw natural frequencies and harmonics over the speed, of a load by its number."""
        return figure_of(campbell_figure(self.loads[load], self.file.sections.dynamics.highest_frequency_Hz))

    def plot_waterfall(self, load: int = 0) -> Figure:
        """Draw the lines of the bearing forces over speed and frequency, of a load by its number."""
        return figure_of(waterfall_figure(self.loads[load], self.file.sections.dynamics.highest_frequency_Hz))

    def plot_modes(self, numbers: Sequence[int], load: int = 0) -> Figure:
        """Draw natural modes by their numbers, as the page has them, of a load by its number."""
        return modes_figure(self.file, self.loads[load], numbers)

    def write(self, folder: Path | str, *, overwrite: bool = False) -> None:
        """Write `dynamics.json`, `dynamics.md`, `report.html`, tables, pictures, `results.h5` and `modes.vtkhdf`.

        Tables are `response.csv` and `lines.csv`; `results.h5` holds the lines and the model by modes, `modes.vtkhdf`
        the modes in motion under the load with the largest bearing force.

        Raises
        ------
        OutputError
        """
        inputs, text = self.file.inputs, self.file.text
        with writing_results(folder, FILES, text, inputs=inputs, overwrite=overwrite, working=()) as out:
            data = self.data
            with in_a_copy(lambda: self._write_files(out)) if self.loads else nullcontext(lambda: None) as written:
                whine_report(self.file, self.loads, data).write(out)
                written()

    def write_numbers(self, folder: Path | str, *, overwrite: bool = False) -> None:
        """Write `response.csv` and `results.h5` alone, as of the first loads while others are solved.

        Raises
        ------
        OutputError
        """
        inputs, text = self.file.inputs, self.file.text
        with writing_results(folder, FILES, text, inputs=inputs, overwrite=overwrite, working=()) as out:
            self._write_numbers(out)

    def _write_files(self, out: Path) -> None:
        if drawn := drawn_modes(self.data):
            write_modes(self.file, loudest(self.loads), drawn, out / "modes.vtkhdf")
        self._write_numbers(out)
        write_columns_csv(out / "lines.csv", self.columns())
        if parted := parting_rows(self.loads):
            write_table_csv(out / "parting.csv", parted, list({key: None for row in parted for key in row}))

    def _write_numbers(self, out: Path) -> None:
        write_columns_csv(out / "response.csv", response_columns(self.loads))
        write_results_file(out / "results.h5", self._results_file())

    def _labelled(self) -> dict[str, ResultArray]:
        return results_entries(self._results_file())

    def _drawn(self) -> Columns:
        return response_columns(self.loads)

    def _results_file(self) -> ResultsFile:
        first, named = self.loads[0], {response.solved.load.name: response for response in self.loads}
        arrays = {
            f"motion/{kind_of(self.file)}/{name.replace('/', '_')}/{key}": values
            for name, response in named.items()
            for key, values in {**motion_arrays(response), **parting_arrays(response)}.items()
        }  # fmt: skip
        names = {
            "loads": tuple(named), "meshes": tuple(first.mesh_names),
            "bearings": tuple(bearing_names(first)), "sources": tuple(source.name for source in first.sources),
        }  # fmt: skip
        return ResultsFile(self.file.name, self.file.text, arrays, names, OF_MOTION)

    def _shown(self) -> Columns:
        largest = [response.rms.bearings.max(axis=0) for response in self.loads]
        names = bearing_names(self.loads[0]) if self.loads else []
        return {
            "load": [response.solved.load.name for response in self.loads],
            **{f"{name}, largest force, rms, N": np.array(largest)[:, n] for n, name in enumerate(names)},
        }

    def __repr__(self) -> str:
        return f"<MotionResult of {self.file.name!r}: {len(self.loads)} loads>"

    def __str__(self) -> str:
        return whine_text(self.data)
