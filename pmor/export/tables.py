"""Self-describing arrays as CSV tables; the header documents each column.

Each array names its axes ("torque, angle"). Arrays of a group with the same axes share a table, a row for each place;
an axis that an array of its own gives places to, ascending (the angle's are `phi`), brings that column along, another
one its index from 0. Comment lines `# name [unit]: meaning` come before the names.

Arrays of a sweep and of a results file for tables, with the units, axes and descriptions of the results file.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pmor.core.shown import brief
from pmor.core.version import __version__
from pmor.gear.pair import GearPair
from pmor.results.loads import LineStates
from pmor.results.quantities import Figures
from pmor.results.sweep import SteSweep, mesh_stiffness, orders_of
from pmor.storage.layout import Layout
from pmor.storage.results_file import ResultsFile, read_results
from pmor.storage.results_layout import RESULTS_LAYOUT

#: places along axes that groups share
COMMON = {"torque": "ste/torque", "angle": "ste/phi"}
# Of one table: a spreadsheet takes no more.
MOST_ROWS = 1_048_576


@brief
@dataclass(frozen=True, eq=False)
class ResultArray:
    """An array with its unit, axes and description.

    Parameters
    ----------
    values : ndarray
    dims : tuple of str
        Names of its axes; none of a single number.
    """

    values: np.ndarray
    unit: str
    dims: tuple[str, ...]
    description: str


def csv_tables(entries: Mapping[str, ResultArray], source: str) -> tuple[dict[str, str], list[str]]:
    """Return tables as text by file name, and the names of arrays too long for a table.

    Parameters
    ----------
    entries : mapping
        By names with their group, such as ``ste/phi``.
    source : str
        Subject of the tables, for the first line.
    """
    tables, too_long = dict[str, str](), list[str]()
    together = _together(entries)
    for (group, axes), names in together.items():
        if len(axes) == len(names) == 1 and any(g == group and axes[0] in a and a != axes for g, a in together):
            continue  # coordinates alone: they stand in the tables of their values
        shape = entries[names[0]].values.shape
        if int(np.prod(shape)) > MOST_ROWS:
            too_long += names
            continue
        columns = {name.rpartition("/")[2]: entries[name] for name in names}
        places = {axis: _place_of(axis, group, entries, len_) for axis, len_ in zip(axes, shape, strict=True)}
        stem = "_".join([group or "values", *(f"per_{axis}" for axis in axes)]).replace(" ", "_")
        tables[f"{stem}.csv"] = _text(source, places, columns, shape)
    return tables, too_long


def _together(entries: Mapping[str, ResultArray]) -> dict[tuple[str, tuple[str, ...]], list[str]]:
    groups: dict[tuple[str, tuple[str, ...]], list[str]] = {}
    for name, entry in entries.items():
        if entry.values.ndim != len(entry.dims):
            raise ValueError(f"{name}: {entry.values.ndim} axes, and names for {len(entry.dims)}")
        groups.setdefault((name.rpartition("/")[0].replace("/", "_"), entry.dims), []).append(name)
    return groups


def _place_of(axis: str, group: str, entries: Mapping[str, ResultArray], length: int) -> tuple[str, ResultArray]:
    """Column of an axis: an ascending array along it alone, or the torques and angles of the sweep; else an index."""
    places = {
        name: entry
        for name, entry in entries.items()
        if entry.dims == (axis,) and len(entry.values) == length and (np.diff(entry.values.astype(float)) > 0.0).all()
    }
    own = [name for name in places if name.rpartition("/")[0].replace("/", "_") == group]
    if own:
        return own[0].rpartition("/")[2], places[own[0]]
    # Of the groups beside this one, or farther up; those of a gearbox have as many of them as parts and loads.
    for name in places if axis in COMMON else ():
        place, _, common = name.rpartition("ste/")
        if f"ste/{common}" == COMMON[axis] and group.startswith(place.replace("/", "_")):
            return common, places[name]
    return axis, ResultArray(np.arange(length), "1", (axis,), "index, from 0")


def _text(
    source: str, places: Mapping[str, tuple[str, ResultArray]], columns: Mapping[str, ResultArray], shape: Sequence[int]
) -> str:
    indices = np.indices(shape).reshape(len(shape), -1) if shape else np.zeros((0, 1), dtype=int)
    shown = dict[str, tuple[ResultArray, np.ndarray]]()
    for (name, entry), index in zip(places.values(), indices, strict=True):
        shown[name] = entry, entry.values[index]
    for name, entry in columns.items():
        shown[name] = entry, entry.values.reshape(-1)
    lines = [f"# {source}, pmor {__version__}"]
    lines += [f"# {name} [{entry.unit}]: {entry.description}" for name, (entry, _) in shown.items()]
    lines.append(",".join(shown))
    lines += [",".join(map(_cell, row)) for row in zip(*(values.tolist() for _, values in shown.values()), strict=True)]
    return "\n".join(lines) + "\n"


def _cell(value: float | int | bool) -> str:
    """Shortest text that reads back as the same number; nothing where there is none."""
    if isinstance(value, bool):
        return str(int(value))
    return "" if value != value else repr(value)


def sweep_arrays(sweep: SteSweep, pair: GearPair) -> dict[str, np.ndarray]:
    """Return transmission error, load sharing, stiffness and orders of a sweep by their paths in a results file."""
    stiffness = mesh_stiffness(sweep, pair.pinion.base_radius, pair.common_width)
    optional = {
        "ste/unloaded": sweep.unloaded_um, "ste/error_bar": sweep.error_bar_um,
        "stiffness/tangent": None if sweep.stiffness_N_per_um is None else stiffness.tangent,
    }  # fmt: skip
    arrays = {
        "ste/phi": sweep.phi_rad, "ste/torque": sweep.torque_Nm, "ste/ste": sweep.ste_um,
        "ste/rotation": 1e3 * sweep.ste_um / pair.pinion.base_radius, "ste/converged": sweep.converged,
        "ste/pair_index": sweep.pair_index, "ste/pair_share": sweep.pair_share, "stiffness/secant": stiffness.secant,
        **{name: array for name, array in optional.items() if array is not None},
    }  # fmt: skip
    if sweep.converged.all():
        orders = [orders_of(sweep, row) for row in range(len(sweep.torque_Nm))]
        arrays["orders/order"] = orders[0].order
        arrays |= {f"orders/{name}": np.stack([getattr(o, name) for o in orders]) for name in ("amplitude", "phase")}
    return arrays


def line_arrays(lines: LineStates, figures: Figures) -> dict[str, np.ndarray]:
    """Return the line contact of a sweep, and what is read off it, by their paths in a results file."""
    return {
        "lines/pair": lines.pair, "lines/z": lines.z_mm, "lines/width": lines.width_mm, "lines/roll": lines.roll_rad,
        "lines/load": lines.load_N_per_mm, "lines/half_width": lines.half_width_mm,
        "lines/pressure": lines.pressure_MPa, "lines/sensitivity": lines.sensitivity,
        **{f"face/{key}": values for key, values in figures.items()},
    }  # fmt: skip


def sweep_entries(sweep: SteSweep, pair: GearPair) -> dict[str, ResultArray]:
    """Return the arrays of `sweep_arrays` with their descriptions."""
    return _described(sweep_arrays(sweep, pair), RESULTS_LAYOUT)


def line_entries(lines: LineStates, figures: Figures) -> dict[str, ResultArray]:
    """Return the arrays of `line_arrays` with their descriptions."""
    return _described(line_arrays(lines, figures), RESULTS_LAYOUT)


def file_entries(path: Path) -> dict[str, ResultArray]:
    """Return the arrays of a results file with their descriptions.

    Raises
    ------
    FileFormatError
        When it is foreign, damaged, or of another version.
    """
    return results_entries(read_results(path))


def results_entries(results: ResultsFile) -> dict[str, ResultArray]:
    """Return the arrays of the content of a results file with their descriptions."""
    return _described(results.arrays, results.layout)


def _described(arrays: Mapping[str, np.ndarray], layout: Layout) -> dict[str, ResultArray]:
    fields = {name: (array, layout[name]) for name, array in arrays.items()}
    return {name: ResultArray(a, f.unit, tuple(f.dims.split(", ")), f.description) for name, (a, f) in fields.items()}
