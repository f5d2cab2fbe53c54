"""Conditions in a file: a table with a named column for each parameter, in the unit of the column.

A further parameter of a condition is a further column; without the column it has its default, so that older files keep
their meaning. Modified flanks have no column: they are those that the case of the file trains on.
"""

from __future__ import annotations

from collections.abc import Sequence

import h5py
import numpy as np

from pmor.gear.condition import Condition, Misalignment
from pmor.storage.hdf5 import attribute, read, set_attributes, write
from pmor.storage.layout import Field

NAME = "conditions"
TORQUE = "torque"
# Deviations of the axes, by the name of their column.
AXES = {"in_plane": "in_plane_um", "out_of_plane": "out_of_plane_um", "centre_distance": "centre_distance_um"}
UNITS = {TORQUE: "N mm", **dict.fromkeys(AXES, "um")}
CONDITIONS = Field(", ".join(UNITS.values()), "angle, condition, column", f"columns: {', '.join(UNITS)}")


def write_conditions(group: h5py.Group, conditions: Sequence[Sequence[Condition]]) -> None:
    """Write the table of the conditions at each of some angles, equally many at each."""
    rows = [[_row(condition) for condition in there] for there in conditions]
    shape = len(rows), len(rows[0]) if rows else 0, len(UNITS)
    write(group, NAME, np.array(rows, dtype=float).reshape(shape), CONDITIONS)
    set_attributes(group[NAME], columns=" ".join(UNITS))


def read_conditions(group: h5py.Group) -> tuple[tuple[Condition, ...], ...]:
    """Read the table of the conditions at each of some angles.

    Raises
    ------
    ValueError
        When a column is unknown or there twice, or there is none of the torque.
    """
    table, columns = read(group, NAME, CONDITIONS), str(attribute(group[NAME], "columns")).split()
    unknown = [name for name in columns if name not in UNITS or columns.count(name) > 1]
    if unknown or TORQUE not in columns or table.ndim != 3 or table.shape[2] != len(columns):
        raise ValueError(f"its {NAME} have the columns {', '.join(columns)}, known are {', '.join(UNITS)}")
    return tuple(tuple(_condition(dict(zip(columns, row, strict=True))) for row in there) for there in table.tolist())


def _row(condition: Condition) -> list[float]:
    return [condition.torque, *(getattr(condition.misalignment, field) for field in AXES.values())]


def _condition(values: dict[str, float]) -> Condition:
    deviations = {field: values[name] for name, field in AXES.items() if name in values}
    return Condition(torque=values[TORQUE], misalignment=Misalignment(**deviations))
