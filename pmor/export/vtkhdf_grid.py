"""A mesh with fields at several steps as VTKHDF, for ParaView and the like.

Version 2.0 of the format, a temporal `UnstructuredGrid`: the mesh is stored once, and each step has its fields.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import h5py
import numpy as np

from pmor.core.arrays import FloatArray, IntArray

# VTK's numbers of the quadrilateral, the hexahedron and the quadratic one.
QUADRILATERAL, HEXAHEDRON, QUADRATIC_HEXAHEDRON = 9, 12, 25


class Grid(NamedTuple):
    """Cells of one kind.

    Attributes
    ----------
    points : ndarray, shape (n, 3)
    cells : ndarray of int, shape (m, c)
        Their points.
    kind : int
        VTK's number.
    numbers : mapping of str to ndarray of int, shape (m,)
        Of the cells.
    """

    points: FloatArray
    cells: IntArray
    kind: int
    numbers: Mapping[str, IntArray]


def hat_functions(places: FloatArray | IntArray, nodes: FloatArray | IntArray) -> FloatArray:
    """Return what nodes (n,), rising, have of a load at places (p,) that is linear between them, (p, n)."""
    return np.stack([np.interp(places, nodes, one) for one in np.eye(len(nodes))], axis=1)


def write_grid(
    file: h5py.File, grid: Grid, steps: FloatArray, fields: Mapping[str, int], parts: Iterable[Mapping[str, FloatArray]]
) -> None:
    """Write a grid and its fields.

    Parameters
    ----------
    steps : ndarray, shape (s,)
        Times, or what counts as such.
    fields : mapping of str to int
        Names at the points, and their components.
    parts : iterable of mappings of str to ndarray, shape (points, components, s)
        Fields of one part of the points after the other.
    """
    root = file.create_group("VTKHDF")
    root.attrs["Version"] = np.array([2, 0])
    root.attrs.create("Type", b"UnstructuredGrid", dtype=h5py.string_dtype("ascii", len("UnstructuredGrid")))
    points, (cells, corners) = len(grid.points), grid.cells.shape
    for name, count in (("Points", points), ("Cells", cells), ("ConnectivityIds", grid.cells.size)):
        root[f"NumberOf{name}"] = np.array([count])
    root["Points"], root["Connectivity"] = grid.points, grid.cells.ravel()
    root["Offsets"] = corners * np.arange(cells + 1)
    root["Types"] = np.full(cells, grid.kind, dtype=np.uint8)
    for name, numbers in grid.numbers.items():
        root[f"CellData/{name}"] = numbers
    _write_steps(root, grid, steps, fields)
    for name, components in fields.items():
        shape = (len(steps) * points, components) if components > 1 else (len(steps) * points,)
        root.create_dataset(f"PointData/{name}", shape, np.float32)
    first = 0
    for part in parts:
        size = len(next(iter(part.values())))
        for name, values in part.items():
            for step in range(len(steps)):
                rows = slice(step * points + first, step * points + first + size)
                root[f"PointData/{name}"][rows] = values[..., step] if fields[name] > 1 else values[:, 0, step]
        first += size


def _write_steps(root: h5py.Group, grid: Grid, values: FloatArray, fields: Mapping[str, int]) -> None:
    """Write where each step begins: the mesh is the same one, the fields follow each other."""
    steps, count = root.create_group("Steps"), len(values)
    steps.attrs["NSteps"] = count
    steps["Values"] = values
    steps["PartOffsets"], steps["NumberOfParts"] = np.zeros(count, dtype=np.int64), np.ones(count, dtype=np.int64)
    steps["PointOffsets"] = np.zeros(count, dtype=np.int64)
    for name in ("CellOffsets", "ConnectivityIdOffsets"):
        steps[name] = np.zeros((count, 1), dtype=np.int64)
    for name in fields:
        steps[f"PointDataOffsets/{name}"] = len(grid.points) * np.arange(count)
    for name in grid.numbers:
        steps[f"CellDataOffsets/{name}"] = np.zeros(count, dtype=np.int64)
