"""The layer of elements below the loaded flank, whose compliance the law of line contact replaces.

The layer is the first columns of elements of the tooth block, counted from the flank, with everything below it held:
its compliance is the local one, the dent without the bending of the tooth. The law (`pmor.line.hertz`) is that of a
layer in plane strain, loaded evenly along the width. A spur gear loses the layer of its mesh in that very state: all
transverse sections deform alike, each under its own line load alone. The rest of the layer stays: neighbouring sections
hold each other up where the load changes or ends, and at free faces, where plane strain ends, the layer is softer.

Lines of contact on helical flanks run across the rows of nodes. The answer of the mesh depends on the place of the load
between its nodes, and no state of the mesh goes with the law: the whole layer is taken out. The same holds for a mesh
in plane strain, which has no other state.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg as la

from pmor.core.arrays import FloatArray, IntArray
from pmor.fe.assembly import added_up, degrees_of_freedom
from pmor.fe.completion import completion, nodes_of_elements
from pmor.fe.element import QUADRATIC_NODES, tributary_widths
from pmor.fe.elimination import condense, inverse
from pmor.fe.nested_dissection import element_places
from pmor.fe.sector import SectorMesh

# Depths of the layer over which line loads are evened out for that, on either side; the contact is half a depth wide at
# most. For columns of nodes nearer to each other than its width, the difference could become negative.
EVENED = 1.0


def layer_compliance(mesh: SectorMesh, columns: int, stiffness: FloatArray) -> FloatArray:
    """Return the compliance of the flank by its layer alone: of spur gears with all sections deforming alike.

    Parameters
    ----------
    columns : int
        Columns of nodes above the layer's inner face.
    stiffness : ndarray, shape (n_elements, 3 k, 3 k)
        Of the sector's elements, N/mm.

    Returns
    -------
    ndarray, shape (f, f)
        Of all unknowns of `SectorMesh.flank`, mm/N; of spur gears without those along the axis, where no load is.
    """
    if mesh.twist_per_length != 0.0 or mesh.width == "plane_strain":
        return _of_the_whole_layer(mesh, columns, stiffness)
    rows, across = mesh.flank.shape
    middle = mesh.tooth_rows[-1 - rows // 2].reshape(-1, across)[[0, columns], 0]
    depth = float(np.linalg.norm(np.diff(mesh.nodes[middle], axis=0)))
    shares = _even_loads(mesh.z, tributary_widths(mesh.z, mesh.order), EVENED * depth)
    compliance = np.zeros((rows, across, 3, rows, across, 3))
    alone = _section_compliance(mesh, columns, stiffness)
    compliance[:, :, :2, :, :, :2] = np.einsum("rasd,tb->rtasbd", alone, shares)
    return compliance.reshape(3 * rows * across, -1)


def inverse_flank_stiffness(mesh: SectorMesh, stiffness: FloatArray, unknowns: IntArray) -> FloatArray:
    """Return the inverse of the stiffness of some unknowns of flanks, which it takes the place of.

    Axially held unknowns have a stiffness of their own without meaning: they do not move.
    """
    compliance = inverse(stiffness)
    held = np.isin(unknowns, mesh.held_axially)
    compliance[held, held] = 0.0
    return compliance


def _of_the_whole_layer(mesh: SectorMesh, columns: int, stiffness: FloatArray) -> FloatArray:
    """Compliance of the flank with everything below the layer held fixed."""
    layers, elements = len(mesh.z), mesh.elements[:, :QUADRATIC_NODES]
    # The handover row belongs to the ring as well: it is held.
    free = np.zeros(len(mesh.nodes), dtype=bool)
    free[np.concatenate([row[: columns * layers] for row in mesh.tooth_rows[1:]])] = True
    inside = np.flatnonzero(free[elements].any(axis=1))
    flank = nodes_of_elements(mesh, mesh.flank)
    schur = condense(stiffness[inside], elements[inside], element_places(mesh)[inside], flank, np.flatnonzero(~free))
    full = completion(mesh, mesh.flank)
    return np.asarray(full @ (full @ inverse_flank_stiffness(mesh, schur, degrees_of_freedom(flank)).T).T)


def _even_loads(z: FloatArray, width: FloatArray, length: float) -> FloatArray:
    """Displacement of each column under a force on each, of sections that move 1 mm under 1 N/mm, mm/N.

    Line loads are evened out over a length on either side first. Under those that are even already all columns move
    alike, and forces on columns that are farther apart do not know of each other.
    """
    near = np.maximum(1.0 - np.abs(z[:, None] - z) / length, 0.0)
    scale = np.ones(len(z))
    for _ in range(100):  # to row sums of 1 with a symmetric matrix (Sinkhorn)
        scale = np.sqrt(scale / (near @ (width * scale)))
    evened = scale[:, None] * near * scale
    return np.asarray(evened @ (width[:, None] * evened))


def _section_compliance(mesh: SectorMesh, columns: int, stiffness: FloatArray) -> FloatArray:
    """Displacement of the flank's rows of nodes under line loads on them, in x and y, (rows, 2, rows, 2), mm^2/N.

    Of a slice one element wide whose sections deform alike, each in its plane: all nodes of a row move together.
    """
    layers, rows = len(mesh.z), len(mesh.flank)
    elements = mesh.elements[:, :QUADRATIC_NODES]
    sliced = np.flatnonzero((elements % layers <= mesh.order).all(axis=1))
    sections = np.concatenate([row.reshape(-1, layers)[:columns, 0] for row in mesh.tooth_rows[1:]]) // layers
    rank = np.full(len(mesh.nodes) // layers + 1, -1)
    rank[sections] = np.arange(len(sections))
    unknowns = (2 * rank[elements[sliced] // layers][:, :, None] + np.arange(2)).reshape(len(sliced), -1)
    in_plane = np.flatnonzero(np.arange(stiffness.shape[1]) % 3 < 2)
    blocks = stiffness[sliced][:, in_plane[:, None], in_plane]
    matrix = added_up(blocks, unknowns, 2 * len(sections)).toarray()
    there = np.diagonal(matrix) > 0.0  # quadratic elements have no nodes in the middle of a section
    flank = (2 * rank[mesh.flank[:, 0] // layers][:, None] + np.arange(2)).ravel()
    moves = (flank >= 0) & there[flank]
    forces = np.zeros((np.count_nonzero(there), np.count_nonzero(moves)))
    forces[(np.cumsum(there) - 1)[flank[moves]], np.arange(forces.shape[1])] = float(mesh.z[mesh.order] - mesh.z[0])
    factor = la.cho_factor(matrix[np.ix_(there, there)], lower=True, check_finite=False)
    found = np.zeros((2 * rows, 2 * rows))
    found[np.ix_(moves, moves)] = (forces.T != 0.0) @ la.cho_solve(factor, forces, check_finite=False)
    return found.reshape(rows, 2, rows, 2)
