"""The surface layer of a tooth: columns of elements below the loaded flank, and their depth."""

from __future__ import annotations

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.fe.outline import tooth_outline
from pmor.fe.sector import tooth_block
from pmor.gear.tooth import Tooth


def surface_layer(
    tooth: Tooth, profile_elements: int, spacing: str, depth: float, order: int = 1
) -> tuple[int, FloatArray]:
    """Find the columns of elements that make a layer of about a given depth in the middle of the flank.

    Parameters
    ----------
    spacing : {"roll_angle", "arc_length"}
        As in `pmor.fe.sector.build_sector`.
    depth : float
        mm.
    order : int
        1 for linear elements, 2 for quadratic ones.

    Returns
    -------
    columns : int
        Columns of nodes above the layer's inner face: one element's at least, at most up to the middle of the
        tooth.
    depths : ndarray, shape (order profile_elements + 1,)
        Depth below each row of flank nodes, along the flank's normal, mm.
    """
    block = tooth_block(tooth_outline(tooth, profile_elements, spacing, order), tooth.module, order)
    rows = order * profile_elements
    flank = block[-rows - 1 :, 0]
    half_columns = (block.shape[1] - 1) // 2
    depths = np.stack([_depth(flank, block[:, column]) for column in range(order, half_columns + 1, order)])
    nearest = int(np.argmin(np.abs(depths[:, rows // 2] - depth)))
    return order * (nearest + 1), depths[nearest]


def _depth(flank: FloatArray, inner: FloatArray) -> FloatArray:
    """Distance from points of the flank to the curve below, along the inward normals."""
    tangent = np.gradient(flank, axis=0)
    normal = np.stack([tangent[:, 1], -tangent[:, 0]], axis=-1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    start, chord = inner[:-1], np.diff(inner, axis=0)
    across = start[None] - flank[:, None]  # (point, segment, 2)
    determinant = _cross(normal[:, None], chord[None])
    distance = _cross(across, chord[None]) / determinant
    place = _cross(across, normal[:, None]) / determinant
    # Where a normal leaves through the tip land, the last segment is continued.
    outside = np.maximum(np.maximum(-place, place - 1.0), 0.0)
    return np.asarray(distance[np.arange(len(flank)), np.argmin(outside, axis=1)])


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
