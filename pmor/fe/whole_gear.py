"""A whole gear, or an arc of it: its sectors with the side faces merged, as a sparse system that is solved directly."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from pmor.core.arrays import FloatArray, IntArray
from pmor.core.conventions import rotation_z
from pmor.core.errors import MeshError
from pmor.fe.assembly import assemble, degrees_of_freedom
from pmor.fe.completion import completion, nodes_of_elements
from pmor.fe.element import QUADRATIC_NODES
from pmor.fe.nested_dissection import elimination_order
from pmor.fe.sector import SectorMesh


def whole_gear_mesh(mesh: SectorMesh) -> tuple[FloatArray, IntArray, IntArray]:
    """Repeat a sector around the axis and merge the side faces.

    Returns
    -------
    nodes : ndarray, shape (n_nodes, 3)
        In the frame of tooth 0, mm.
    elements : ndarray of int, shape (n_elements, 8 or 27)
    numbers : ndarray of int, shape (teeth, sector nodes)
        Node of the whole gear for each node of each sector.

    Raises
    ------
    MeshError
        When the sector does not span the whole face width.
    """
    if mesh.width != "whole":
        raise MeshError(f'whole gears have the whole face width, not "{mesh.width}": write [mesh] width = "whole"')
    count = len(mesh.nodes)
    # The bore's corner nodes are shared between neighbours as well.
    left = np.concatenate([mesh.left, mesh.bore[: len(mesh.z)]])
    right = np.concatenate([mesh.right, mesh.bore[-len(mesh.z) :]])
    own = np.setdiff1d(np.arange(count), right)
    numbers = np.empty((mesh.teeth, count), dtype=np.int64)
    numbers[:, own] = np.arange(mesh.teeth * len(own)).reshape(mesh.teeth, len(own))
    numbers[:, right] = np.roll(numbers, 1, axis=0)[:, left]
    nodes = np.empty((mesh.teeth * len(own), 3))
    for k in range(mesh.teeth):
        nodes[numbers[k, own]] = mesh.nodes[own] @ rotation_z(k * mesh.angular_pitch).T
    return nodes, numbers[:, mesh.elements].reshape(-1, mesh.elements.shape[1]), numbers


def assemble_arc(
    mesh: SectorMesh, youngs_modulus: float, poisson_ratio: float, element: str, sectors: int
) -> tuple[sp.csc_array, list[sp.csr_array]]:
    """Assemble consecutive sectors of a gear whose bore is fixed.

    Parameters
    ----------
    mesh, youngs_modulus, poisson_ratio, element
        As in `pmor.fe.condensation.condense_sector`.
    sectors : int
        Counted counter-clockwise from sector 0; all teeth make the closed ring, fewer an arc with open ends.

    Returns
    -------
    stiffness : scipy.sparse.csc_array, shape (n, n)
        Of the free unknowns in the frame of tooth 0, node by node in the order of elimination, N/mm.
    flanks : list of scipy.sparse.csr_array, shape (3 x flank nodes, n)
        For each sector, times the unknowns: displacement of the flank's nodes in the frame of its tooth, x y z node by
        node.
    """
    nodes, elements, numbers = whole_gear_mesh(mesh)
    free = elimination_order(mesh, numbers, sectors)
    arc = elements[: len(mesh.elements) * sectors, :QUADRATIC_NODES]
    order = np.concatenate([free, np.setdiff1d(arc, free)])
    rank = np.full(len(nodes), -1)
    rank[order] = np.arange(len(order))
    # Numbered like this before assembly, the matrix needs no permutation, and the fixed unknowns are the last.
    stiffness = assemble(nodes[order], rank[arc], youngs_modulus, poisson_ratio, element)
    size, own = 3 * len(free), nodes_of_elements(mesh, mesh.flank)
    flanks = []
    for k in range(sectors):
        turn = sp.kron(sp.eye_array(mesh.flank.size), rotation_z(-k * mesh.angular_pitch))
        flank = (turn @ completion(mesh, mesh.flank)).tocsr()
        columns = degrees_of_freedom(rank[numbers[k, own]])[flank.indices]
        flanks.append(sp.csr_array((flank.data, columns, flank.indptr), shape=(flank.shape[0], size)))
    return stiffness[:size, :size].tocsc(), flanks


def factorise(matrix: sp.csc_array) -> spla.SuperLU:
    """Factor a symmetric positive definite matrix in its own order, without pivoting."""
    return spla.splu(matrix, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
