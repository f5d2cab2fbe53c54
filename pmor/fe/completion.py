"""Displacement of the grid's nodes that quadratic elements do not have: in the middle of faces and of elements.

Flanks are taken as full grids of nodes: what follows from the elements' own shape functions there is put in, and forces
there go to the element's nodes by the same shares, so that work is the same.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from pmor.arrays import FloatArray, IntArray
from pmor.fe.hexahedron import shape_functions
from pmor.mesh.element import QUADRATIC_NODES, node_places
from pmor.mesh.sector import SectorMesh


def nodes_of_elements(mesh: SectorMesh, nodes: IntArray) -> IntArray:
    """Return those of some nodes (any shape) that elements have, flattened in their order."""
    flat = np.asarray(nodes).ravel()
    return flat[~np.isin(flat, mesh.middles)]


def completion(mesh: SectorMesh, nodes: IntArray) -> sp.csr_array:
    """Return the displacement of nodes over that of those among them that elements have.

    Parameters
    ----------
    mesh : SectorMesh
    nodes : ndarray of int
        All nodes of a flank, or of the sector, any shape.

    Returns
    -------
    scipy.sparse.csr_array, shape (3 n, 3 k)
        Unknowns x y z node by node.
    """
    flat, own = np.asarray(nodes).ravel(), nodes_of_elements(mesh, nodes)
    row, column = np.full(len(mesh.nodes), -1), np.full(len(mesh.nodes), -1)
    row[flat], column[own] = np.arange(len(flat)), np.arange(len(own))
    rows, columns, shares = [row[own]], [column[own]], [np.ones(len(own))]
    if len(mesh.middles):
        places = node_places(2)
        known = mesh.elements[:, :QUADRATIC_NODES]
        for k in range(QUADRATIC_NODES, len(places)):
            share: FloatArray = shape_functions(places[k] - 1.0, 2)
            used = np.flatnonzero(share)
            # A face in the middle of the mesh has two elements: the first one counts.
            middle, element = np.unique(mesh.elements[:, k], return_index=True)
            fresh = (row[middle] >= 0) & ~np.isin(middle, _done(mesh, k))
            around = known[element[fresh]][:, used]
            rows.append(np.repeat(row[middle[fresh]], len(used)))
            columns.append(column[around].ravel())
            shares.append(np.tile(share[used], np.count_nonzero(fresh)))
    entries = np.concatenate(shares), (np.concatenate(rows), np.concatenate(columns))
    scalar = sp.coo_array(entries, shape=(len(flat), len(own)))
    return sp.kron(scalar, np.eye(3)).tocsr()


def _done(mesh: SectorMesh, k: int) -> IntArray:
    """Middles that an earlier place within the elements stands for."""
    return np.unique(mesh.elements[:, QUADRATIC_NODES:k])
