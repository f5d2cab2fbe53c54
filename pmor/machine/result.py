"""The result of a gearbox: its numbers, pictures and files."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pmor.body.beam import NODE
from pmor.core.shown import Columns
from pmor.export.tables import ResultArray, results_entries
from pmor.machine.coupled import SolvedLoad
from pmor.machine.figures import deflection_figure, face_load_figure, ste_figure
from pmor.machine.fit import Fit
from pmor.machine.live import live_blocks
from pmor.machine.loader import GearboxFile
from pmor.machine.output import FILES, SET_FILES, TURN_ORDERS, gearbox_data, gearbox_report, gearbox_text, set_files
from pmor.machine.readings import Data, bearing_data
from pmor.machine.remedies import verdict_of_gearbox
from pmor.machine.results_data import gearbox_columns, gearbox_results, mesh_rows
from pmor.machine.turn_tables import order_rows
from pmor.machine.view import machine_figure
from pmor.machine.vtkhdf import write_machine
from pmor.report.curves import Drawn
from pmor.report.data_files import write_bearings_csv, write_columns_csv, write_table_csv
from pmor.report.replay import figure_of
from pmor.results.load_distribution import line_states
from pmor.results.loads import together
from pmor.results.root_stress import GEARS
from pmor.results.solution import MeshView, PartView, place_of
from pmor.results.tabular import headed
from pmor.sets.vtkhdf import write_set
from pmor.storage.results_file import ResultsFile, write_results_file
from pmor.work.results import writing_results
from pmor_online.model import ReducedPair

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
class GearboxResult(Drawn):
    """A gearbox under its load cases.

    Parameters
    ----------
    loads : tuple of SolvedLoad
        Those that have an equilibrium.
    failures : tuple of str
        Load cases without one, and meshes with positions that did not converge.
    fits : tuple of Fit
        The flank that fits each mesh.
    pairs : mapping of str to ReducedPair
        Of the meshes, by name.
    seconds : mapping of str to float
        Wall time of each phase.
    beside : mapping of str to callable
        What `write` leaves in formats of other programs, by the names of the files.
    """

    file: GearboxFile
    loads: tuple[SolvedLoad, ...]
    failures: tuple[str, ...]
    fits: tuple[Fit, ...]
    pairs: Mapping[str, ReducedPair]
    seconds: Mapping[str, float] = field(default_factory=dict)
    beside: Mapping[str, Callable[[GearboxResult, Path], None]] = field(default_factory=dict)

    @cached_property
    def data(self) -> Data:
        """All of it as plain data: the content of `gearbox.json`."""
        return self._numbers | {"verdict": verdict_of_gearbox(self.loads, self.pairs, self.fits, self._numbers)}

    @cached_property
    def _numbers(self) -> Data:
        """`data` without a verdict, which takes sweeps of its own."""
        return gearbox_data(self.file, self.loads, self.failures, self.fits)

    def to_csv(self, path: Path | str) -> None:
        """Write the table `ste.csv`: a row for each load, mesh or set, and angle, units in the header."""
        write_columns_csv(Path(path), self.columns())

    def columns(self) -> Columns:
        """All of it by the names of columns, for `to_dataframe`: a value for each load, mesh or set, and angle."""
        return gearbox_columns(self.loads)

    def figures(self) -> Columns:
        """The main figures of each mesh under each load that has an equilibrium, by their keys."""
        rows = mesh_rows(self._numbers)
        keys = ("load", "name", "ste_mean_um", "ste_peak_to_peak_um", "k_h_beta", "flank_pressure_max_MPa")
        return {key: [row.get(key) for row in rows] for key in keys}

    def _shown(self) -> Columns:
        return headed(self.figures())

    def _labelled(self) -> dict[str, ResultArray]:
        return results_entries(self._results_file())

    def _results_file(self) -> ResultsFile:
        return gearbox_results(self.file, self.loads, self.data)

    def mesh(self, name: str) -> MeshView:
        """Return a mesh under all loads, with all that is read off its line contact."""
        number = place_of("mesh", name, [mesh.meshing.settings.name for mesh in self.loads[0].meshes])
        meshes = [load.meshes[number] for load in self.loads]
        return MeshView(name, meshes[0].meshing.pair, together([line_states(mesh.sweep) for mesh in meshes]))

    def gear(self, name: str) -> PartView:
        """Return mean force and moment of a mesh on a gear, named as ``mesh.pinion``, and where its hub is."""
        every = [f"{mesh.meshing.settings.name}.{gear}" for mesh in self.loads[0].meshes for gear in GEARS]
        number, side = divmod(place_of("gear", name, every), len(GEARS))
        wrench, moved = [], []
        for load in self.loads:
            mesh = load.meshes[number]
            hub = mesh.meshing.hubs[side]
            wrench.append(mesh.force * mesh.meshing.wrenches[side])
            moved.append(load.equilibrium.displacement[hub : hub + NODE])
        return PartView(name, np.array(wrench)[:, None], np.array(moved)[:, None])

    def support(self, name: str) -> PartView:
        """Return what a shaft carries into a bearing, and how far it moves against what that stands on."""
        number = place_of("support", name, [bearing.name for bearing in self.file.model.sections.bearings])
        rows = [bearing_data(load)[number] for load in self.loads]
        wrench = [[*row["force_N"], 1e3 * row.get("torque_Nm", 0.0), *row["moment_Nmm"]] for row in rows]
        moved = [[*row["displacement_um"], 0.0, *row["tilt_mrad"]] for row in rows]
        return PartView(name, np.array(wrench)[:, None], 1e-3 * np.array(moved)[:, None])

    def plot_deflection(self, load: int = 0) -> Figure:
        """Draw the deflected shafts under a load case, by its number."""
        return figure_of(deflection_figure(self.file.model, self.loads[load]))

    def plot_machine(self, load: int = 0) -> Figure:
        """Draw the deflected machine in space under a load case, by its number."""
        return machine_figure(self.file.model, self.loads[load])

    def plot_ste(self) -> Figure:
        """Draw the transmission error of each mesh, on its supports and on rigid ones."""
        return figure_of(ste_figure(self.loads))

    def plot_face_load(self) -> Figure:
        """Draw the line load over the face of each mesh."""
        return figure_of(face_load_figure(self.loads))

    def write(self, folder: Path | str, *, overwrite: bool = False) -> None:
        """Write `gearbox.json`, `gearbox.md`, `report.html`, the pictures, tables and `results.h5`.

        Tables are `ste.csv`, `meshes.csv`, of rolling bearings `bearings.csv`, of sets over turns
        of their carrier `turn_orders.csv`; `machine.vtkhdf` shows the machine; of
        `pmor.run` REXS too.

        Parameters
        ----------
        overwrite : bool
            Replace files of these names whoever wrote them.

        Raises
        ------
        OutputError
        """
        inputs, files, text = self.file.inputs, (*FILES, *set_files(self.file)), self.file.whole_text
        with writing_results(folder, files, text, inputs=inputs, overwrite=overwrite, working=()) as out:
            report = gearbox_report(self.file, self.loads, self.data)
            replace(report, page_only=live_blocks(self.loads, self.pairs)).write(out)
            if self.loads:
                write_machine(self.file.model, self.loads, out / "machine.vtkhdf")
                self.to_csv(out / "ste.csv")
                rows = mesh_rows(self.data)
                write_table_csv(out / "meshes.csv", rows, list(dict.fromkeys(key for row in rows for key in row)))
                write_bearings_csv(out, {load["name"]: load for load in self.data["loads"]})
                if turned := order_rows(self.data):
                    write_table_csv(out / TURN_ORDERS, turned)
                write_results_file(out / "results.h5", self._results_file())
                for one in self.loads[0].sets:
                    target = out / f"set_{one.meshing.settings.name}_{SET_FILES[-1]}"
                    write_set(one.solution, one.meshing.file.cases, 0, target)
            for name, write in self.beside.items():
                write(self, out / name)

    def __repr__(self) -> str:
        meshes = len(self.file.model.sections.meshes)
        return f"<GearboxResult of {self.file.name!r}: {meshes} meshes, {len(self.loads)} loads>"

    def __str__(self) -> str:
        times = ", ".join(f"{phase} {seconds:.2g}" for phase, seconds in self.seconds.items())
        return gearbox_text(self.data) + f"\n  seconds: {times}" * bool(times)
