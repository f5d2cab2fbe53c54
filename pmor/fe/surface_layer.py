"""The layer of elements below the loaded flank, whose compliance the law of line contact replaces.

The layer is the first columns of elements of the tooth block, counted from the flank, with everything below it held:
its compliance is the local one, the dent without the bending of the tooth. The answer of the mesh there depends on the
place of the load between its nodes, and on how finely it resolves a depth of the layer: all of it is taken out. What is
left is smooth over flank and width. The law (`pmor.line.hertz`) and, along the width, `pmor.line.face_ends` put a layer
back that is known in closed form.

The surface layer of a tooth: columns of elements below the loaded flank, and their depth.
"""

from __future__ import annotations

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.fe.assembly import degrees_of_freedom
from pmor.fe.completion import completion, nodes_of_elements
from pmor.fe.element import QUADRATIC_NODES
from pmor.fe.elimination import condense, inverse
from pmor.fe.nested_dissection import element_places
from pmor.fe.outline import tooth_outline
from pmor.fe.sector import SectorMesh, tooth_block
from pmor.gear.tooth import Tooth


def inverse_flank_stiffness(mesh: SectorMesh, stiffness: FloatArray, unknowns: IntArray) -> FloatArray:
    """Return the inverse of the stiffness of some unknowns of flanks, which it takes the place of.

    Axially held unknowns have a stiffness of their own without meaning: they do not move.
    """
    compliance = inverse(stiffness)
    held = np.isin(unknowns, mesh.held_axially)
    compliance[held, held] = 0.0
    return compliance


def layer_compliance(mesh: SectorMesh, columns: int, stiffness: FloatArray) -> FloatArray:
    """Return the compliance of the flank with everything below a layer held fixed.

    Parameters
    ----------
    columns : int
        Columns of nodes above the layer's inner face.
    stiffness : ndarray, shape (n_elements, 3 k, 3 k)
        Of the sector's elements, N/mm.

    Returns
    -------
    ndarray, shape (f, f)
        Of all unknowns of `SectorMesh.flank`, mm/N.
    """
    layers, elements = len(mesh.z), mesh.elements[:, :QUADRATIC_NODES]
    # The handover row belongs to the ring as well: it is held.
    free = np.zeros(len(mesh.nodes), dtype=bool)
    free[np.concatenate([row[: columns * layers] for row in mesh.tooth_rows[1:]])] = True
    inside = np.flatnonzero(free[elements].any(axis=1))
    flank = nodes_of_elements(mesh, mesh.flank)
    schur = condense(stiffness[inside], elements[inside], element_places(mesh)[inside], flank, np.flatnonzero(~free))
    full = completion(mesh, mesh.flank)
    return np.asarray(full @ (full @ inverse_flank_stiffness(mesh, schur, degrees_of_freedom(flank)).T).T)


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
