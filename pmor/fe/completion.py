"""Displacement of the grid's nodes that quadratic elements do not have: in the middle of faces and of elements.

Flanks are taken as full grids of nodes: displacements there follow from the elements' shape functions, and forces
there go to the element's nodes by the same shares, so that work is the same.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import scipy.sparse as sp

from pmor.core.arrays import FloatArray, IntArray
from pmor.fe.element import QUADRATIC_NODES, node_places
from pmor.fe.hexahedron import shape_functions
from pmor.fe.sector import SectorMesh


def nodes_of_elements(mesh: SectorMesh, nodes: IntArray) -> IntArray:
    """Return those of some nodes (any shape) that elements have, flattened in their order."""
    flat = np.asarray(nodes).ravel()
    return flat[~np.isin(flat, mesh.middles)]


def completion(mesh: SectorMesh, nodes: IntArray) -> sp.csr_array:
    """Return the displacement of nodes over that of those among them that elements have.

    Parameters
    ----------
    nodes : ndarray of int
        All nodes of a flank, or of the sector, any shape.

    Returns
    -------
    scipy.sparse.csr_array, shape (3 n, 3 k)
        Unknowns x y z node by node.
    """
    flat, own = np.asarray(nodes).ravel(), nodes_of_elements(mesh, nodes)
    if len(own) == len(flat):
        return sp.eye_array(3 * len(flat), format="csr")
    row, column = np.full(len(mesh.nodes), -1), np.full(len(mesh.nodes), -1)
    row[flat], column[own] = np.arange(len(flat)), np.arange(len(own))
    # A face within the mesh belongs to two elements: the first one counts.
    middle, index = np.unique(mesh.elements[:, QUADRATIC_NODES:], return_index=True)
    wanted = row[middle] >= 0
    element, place = np.divmod(index[wanted], mesh.elements.shape[1] - QUADRATIC_NODES)
    share = _shares_of_middles()[place]
    used = share != 0.0  # of a face: the nodes on its edges
    rows = np.repeat(row[middle[wanted]], np.count_nonzero(used, axis=1))
    columns = column[mesh.elements[element, :QUADRATIC_NODES][used]]
    scalar = sp.coo_array(
        (np.concatenate([np.ones(len(own)), share[used]]),
         (np.concatenate([row[own], rows]), np.concatenate([column[own], columns]))),
        shape=(len(flat), len(own)),
    )  # fmt: skip
    return sp.kron(scalar, np.eye(3)).tocsr()


@cache
def _shares_of_middles() -> FloatArray:
    """Shape functions at the middles of the faces and of the element, (7, nodes): quarters, freed of round-off."""
    middles = node_places(2)[QUADRATIC_NODES:] - 1.0
    return np.asarray(np.round(4.0 * np.stack([shape_functions(place, 2) for place in middles])) / 4.0)
