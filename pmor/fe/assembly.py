"""Assembly of the global stiffness matrix."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from pmor.core.arrays import FloatArray, IntArray
from pmor.fe.element import QUADRATIC_NODES
from pmor.fe.hexahedron import element_stiffness


def degrees_of_freedom(node_ids: IntArray) -> IntArray:
    """Return the degrees of freedom of nodes, x y z node by node, flattened."""
    return (3 * np.asarray(node_ids, dtype=np.int64).ravel()[:, None] + np.arange(3)).ravel()


def assemble(
    nodes: FloatArray, elements: IntArray, youngs_modulus: float, poisson_ratio: float, element: str
) -> sp.csr_array:
    """Assemble the stiffness matrix of a mesh.

    Parameters
    ----------
    nodes, elements, youngs_modulus, poisson_ratio, element
        As in `pmor.fe.hexahedron.element_stiffness`; the middles of faces of `SectorMesh.elements` are passed over.

    Returns
    -------
    scipy.sparse.csr_array, shape (3 n_nodes, 3 n_nodes)
        N/mm.
    """
    elements = elements[:, :QUADRATIC_NODES]
    blocks = element_stiffness(nodes, elements, youngs_modulus, poisson_ratio, element)
    return added_up(blocks, degrees_of_freedom(elements).reshape(len(elements), -1), 3 * len(nodes))


def added_up(blocks: FloatArray, unknowns: IntArray, size: int) -> sp.csr_array:
    """Add up the matrices of elements.

    Parameters
    ----------
    blocks : ndarray, shape (n, k, k)
    unknowns : ndarray of int, shape (n, k)
        Of each element; negative ones are held.
    size : int
        Number of unknowns in all.

    Returns
    -------
    scipy.sparse.csr_array, shape (size, size)
    """
    rows = np.repeat(unknowns, unknowns.shape[1], axis=1).ravel()
    columns = np.tile(unknowns, (1, unknowns.shape[1])).ravel()
    free = (rows >= 0) & (columns >= 0)
    return sp.coo_array((blocks.ravel()[free], (rows[free], columns[free])), shape=(size, size)).tocsr()
