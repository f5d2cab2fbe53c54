"""The tables and the results file of a gearbox: arrays for other programs, by part and load."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from pmor.body.bearing_readings import element_arrays, rolling_bearings
from pmor.export.tables import line_arrays, sweep_arrays
from pmor.machine.coupled import SolvedLoad, SolvedMesh
from pmor.machine.loader import GearboxFile
from pmor.machine.readings import Data
from pmor.report.data_files import ste_columns
from pmor.results.load_distribution import line_states
from pmor.results.quantities import figures_of_mesh
from pmor.sets.results_data import MOST_LINES, set_arrays, set_columns
from pmor.storage.results_file import OF_A_GEARBOX, ResultsFile


def gearbox_columns(loads: Sequence[SolvedLoad]) -> dict[str, np.ndarray]:
    """One value per load, part and angle: the columns of `ste.csv`.

    Columns: load, part (mesh or set), phi_rad (of its pinion or sun), torque_Nm (on it), ste_um (NaN where not
    converged), converged (0/1).
    """
    keys, parts = ("phi_rad", "torque_Nm", "ste_um", "converged"), list[dict[str, Any]]()
    for load in loads:
        own = [(mesh.meshing.settings.name, ste_columns(mesh.sweep)) for mesh in load.meshes]
        own += [(one.meshing.settings.name, set_columns(one.solution, one.solution.torque_Nm)) for one in load.sets]
        for name, columns in own:
            of = {"load": load.load.name, "part": name}
            count = len(columns["ste_um"])
            parts.append({key: [text] * count for key, text in of.items()} | {key: columns[key] for key in keys})
    return {key: np.concatenate([part[key] for part in parts]) for key in ("load", "part", *keys) if parts}


def mesh_rows(data: Data) -> list[Data]:
    """Return the figures of each mesh under each load, those of sets among them: rows of `meshes.csv`."""
    found = []
    for load in data["loads"]:
        meshes = [*load["meshes"], *({**mesh, "name": f"{one['name']}: {mesh['name']}"}
                                     for one in load["sets"] for mesh in one["meshes"])]  # fmt: skip
        found += [{"load": load["name"], **_spread(mesh)} for mesh in meshes]
    return found


def _spread(mesh: Data) -> Data:
    """Figures of a mesh, those of pinion and wheel in columns of their own."""
    found: Data = {}
    for key, value in mesh.items():
        if key.endswith("root_stress_max_MPa"):
            stem = key.removesuffix("_max_MPa")
            found |= {f"{stem}_{gear}_MPa": value and value[n] for n, gear in enumerate(("pinion", "wheel"))}
        elif not isinstance(value, list | dict):
            found[key] = value
    return found


def gearbox_results(file: GearboxFile, loads: Sequence[SolvedLoad], data: Data) -> ResultsFile:
    """Return the content of the results file: for meshes that of a run, for sets that of a set, and bearings.

    `data` is that of `gearbox.json`.
    """
    arrays = dict[str, np.ndarray]()
    for load, entry in zip(loads, data["loads"], strict=True):
        parts = {f"meshes/{_named(mesh.meshing.settings.name)}": _mesh_arrays(mesh) for mesh in load.meshes}
        for one in load.sets:
            parts[f"sets/{_named(one.meshing.settings.name)}"] = set_arrays(one.solution, one.solution.torque_Nm)
        parts |= {f"bearings/{_named(one['name'])}": element_arrays(one) for one in rolling_bearings(entry)}
        for place, of_part in parts.items():
            arrays |= {f"{place}/{_named(load.load.name)}/{name}": values for name, values in of_part.items()}
    names = {
        "loads": tuple(load.load.name for load in loads), "meshes": tuple(file.cases), "sets": tuple(file.model.sets)
    }  # fmt: skip
    return ResultsFile(file.name, file.whole_text, arrays, names, OF_A_GEARBOX)


def _mesh_arrays(mesh: SolvedMesh) -> dict[str, np.ndarray]:
    pair, lines = mesh.meshing.pair, line_states(mesh.sweep)
    found = line_arrays(lines, figures_of_mesh(pair, lines))
    if lines.load_N_per_mm.size > MOST_LINES:
        found = {name: values for name, values in found.items() if not name.startswith("lines/")}
    return sweep_arrays(mesh.sweep, pair) | found


def _named(name: str) -> str:
    """Name of a group: a stroke would make two of it."""
    return name.replace("/", "_")
