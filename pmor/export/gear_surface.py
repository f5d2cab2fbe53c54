"""Surface of a gear as rings of points along its axis, for pictures and VTK.

A mesh with fields at several steps as VTKHDF, for ParaView and the like.

Version 2.0 of the format, a temporal `UnstructuredGrid`: the mesh is stored once, and each step has its fields.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import h5py
import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.core.conventions import rotation_z
from pmor.gear.tooth import Tooth, twist_sections

# Rings before the first transverse section with a flank: bore and face have points of their own, which carry nothing.
BEFORE = 2


def gear_rings(tooth: Tooth, turned: float, bore: float, roll: FloatArray, fillet: int, z: FloatArray) -> FloatArray:
    """Return rings around a gear, from bore to bore, (Z + 4, 2 T (R + fillet), 3), mm.

    Parameters
    ----------
    turned : float
        Angle of its first tooth, the others follow by `Tooth.angular_pitch`, rad.
    bore : float
        Radius of the surface that the teeth stand on: of a ring that of its outside, mm.
    roll : ndarray, shape (R,)
        Roll angles of points on both flanks, rad.
    fillet : int
        Points of a fillet.
    z : ndarray, shape (Z,)
        Of the transverse sections, mm.
    """
    outline = _outline(tooth, roll, fillet)
    teeth = [outline @ rotation_z(turned + tooth.angular_pitch * j)[:2, :2].T for j in range(abs(tooth.teeth))]
    sections = twist_sections(np.concatenate(teeth), z[:, None], tooth.twist_per_length)
    faces = sections[[0, -1]]
    bores = faces.copy()
    bores[..., :2] *= bore / np.linalg.norm(faces[..., :2], axis=-1, keepdims=True)
    return np.concatenate([bores[:1], faces[:1], sections, faces[1:], bores[1:]])


def quads_between(rings: FloatArray) -> IntArray:
    """Return the corners of the quadrilaterals between rings (K, N, 3), (m, 4), by the numbers of points.

    They look outwards where the rings run counter-clockwise about the axis, one after the other along it.
    """
    count, points = rings.shape[:2]
    first = points * np.arange(count - 1)[:, None] + np.arange(points)
    beside = points * np.arange(count - 1)[:, None] + (np.arange(points) + 1) % points
    return np.asarray(np.stack([first, beside, beside + points, first + points], axis=-1).reshape(-1, 4))


def flank_columns(tooth: int, loaded: bool, points: int, fillet: int) -> IntArray:
    """Return where the points of a flank are on a ring, by rising roll angle.

    Parameters
    ----------
    tooth : int
        Its number from the first one on.
    loaded : bool
        Whether it is the drive flank.
    points : int
        R, of the flank.
    fillet : int
        Points of a fillet.
    """
    first = 2 * (points + fillet) * tooth + fillet
    along = np.arange(points)
    return np.asarray(first + (2 * points - 1 - along if loaded else along))


def _outline(tooth: Tooth, roll: FloatArray, fillet: int) -> FloatArray:
    """Outline of a tooth, counter-clockwise: fillet and flank of the coast side, flank and fillet of the loaded one."""
    flank = tooth.flank_section(roll)[::-1]
    loaded = np.concatenate([flank, tooth.root_section(np.linspace(0.0, 1.0, fillet + 1)[1:])])
    return np.concatenate([loaded[::-1] * [-1.0, 1.0], loaded])


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
