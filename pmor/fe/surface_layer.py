"""The layer of elements below the loaded flank, and what the law of line contact takes the place of.

The layer is the first columns of elements of the tooth block, counted from the flank, with everything below it held:
its compliance is the local one, the dent without the bending of the tooth. The law (`pmor.contact.line_contact`) is
that of a layer in plane strain, loaded evenly along the width. So what is taken out of a gear's compliance is the layer
of the mesh in that very state: all transverse sections deform alike, each moves under the line load in it alone. What
the layer of the mesh does beyond that stays where it is: neighbouring sections hold each other up where the load
changes or ends, and at free faces, where plane strain ends, the layer is softer.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from pmor.arrays import FloatArray, IntArray
from pmor.conventions import rotation_z
from pmor.mesh.element import QUADRATIC_NODES, tributary_widths
from pmor.mesh.sector import SectorMesh


# Depths of the layer over which line loads are evened out for that, on either side. Columns of nodes that are nearer to
# each other than the contact is wide would else have less than no compliance between them; it is half a depth at most.
EVENED = 0.5


def layer_compliance(mesh: SectorMesh, columns: int, stiffness: FloatArray) -> FloatArray:
    """Return the compliance of the flank by its layer alone, with all sections deforming alike.

    Parameters
    ----------
    mesh : SectorMesh
    columns : int
        Columns of nodes above the layer's inner face.
    stiffness : ndarray, shape (n_elements, 3 k, 3 k)
        Of the sector's elements, N/mm.

    Returns
    -------
    ndarray, shape (f, f)
        Of all unknowns of `SectorMesh.flank`, mm/N; forces on one column of nodes move that column alone, and those
        that are nearer than `EVENED` depths.
    """
    rows, across = mesh.flank.shape
    slice_width = float(mesh.z[mesh.order] - mesh.z[0])
    alone = _section_compliance(mesh, columns, stiffness) * slice_width
    middle = mesh.tooth_rows[-1 - rows // 2].reshape(-1, across)[[0, columns], 0]
    depth = float(np.linalg.norm(np.diff(mesh.nodes[middle], axis=0)))
    shares = _even_loads(mesh.z, tributary_widths(mesh.z, mesh.order), EVENED * depth)
    turned = [rotation_z(mesh.twist_per_length * (z - mesh.z[0])) for z in mesh.z]
    compliance = np.zeros((rows, across, 3, rows, across, 3))
    for to, by in np.argwhere(shares > 0.0):
        block = np.einsum("ab,rbsc,dc->rasd", turned[to], alone, turned[by])
        compliance[:, to, :, :, by] = shares[to, by] * block
    found = compliance.reshape(3 * rows * across, -1)
    held = mesh.flank_held_axially
    found[held] = found[:, held] = 0.0
    return found


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
    """Displacement of the flank's rows of nodes under forces on them, (rows, 3, rows, 3), of a slice one element wide.

    Its sections deform alike: turned with the helix, all nodes of a row along it move together.
    """
    layers = len(mesh.z)
    elements = mesh.elements[:, :QUADRATIC_NODES]
    sliced = np.flatnonzero((elements % layers <= mesh.order).all(axis=1))
    nodes = elements[sliced]
    sections = np.concatenate([row.reshape(-1, layers)[:columns, 0] for row in mesh.tooth_rows[1:]]) // layers
    # The handover row belongs to the ring as well: it is held.
    rank = np.full(len(mesh.nodes) // layers + 1, -1)
    rank[sections] = np.arange(len(sections))
    blocks = _turned(stiffness[sliced], nodes % layers, mesh)
    unknowns = (3 * rank[nodes // layers][:, :, None] + np.arange(3)).reshape(len(nodes), -1)
    row = np.repeat(unknowns, unknowns.shape[1], axis=1).ravel()
    column = np.tile(unknowns, (1, unknowns.shape[1])).ravel()
    free = (row >= 0) & (column >= 0)
    size = 3 * len(sections)
    matrix = sp.coo_array((blocks.ravel()[free], (row[free], column[free])), shape=(size, size)).toarray()
    # Quadratic elements have no nodes in the middle of a section.
    there = np.diagonal(matrix) > 0.0
    flank = (3 * rank[mesh.flank[:, 0] // layers][:, None] + np.arange(3)).ravel()
    moves = (flank >= 0) & there[flank]
    forces = np.zeros((np.count_nonzero(there), np.count_nonzero(moves)))
    forces[(np.cumsum(there) - 1)[flank[moves]], np.arange(forces.shape[1])] = 1.0
    factor = la.cho_factor(matrix[np.ix_(there, there)], lower=True, check_finite=False)
    found = np.zeros((len(flank), len(flank)))
    found[np.ix_(moves, moves)] = forces.T @ la.cho_solve(factor, forces, check_finite=False)
    return found.reshape(len(mesh.flank), 3, len(mesh.flank), 3)


def _turned(stiffness: FloatArray, column: IntArray, mesh: SectorMesh) -> FloatArray:
    """Stiffness of elements whose nodes' displacements are those in the section of their first column, turned."""
    if mesh.twist_per_length == 0.0:
        return stiffness
    angle = mesh.twist_per_length * (mesh.z - mesh.z[0])
    turn = np.stack([rotation_z(float(a)) for a in angle])[column]  # (elements, nodes, 3, 3)
    count, size = column.shape
    blocks = stiffness.reshape(count, size, 3, size, 3)
    turned = np.einsum("eiab,eiajc,ejcd->eibjd", turn, blocks, turn, optimize=True)
    return np.asarray(turned.reshape(count, 3 * size, 3 * size))
