"""Assembly of the global stiffness matrix."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from pmor.arrays import FloatArray, IntArray
from pmor.fe.hexahedron import element_stiffness
from pmor.mesh.element import QUADRATIC_NODES


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
    dofs = (3 * elements[:, :, None] + np.arange(3)).reshape(len(elements), -1)
    rows = np.repeat(dofs, dofs.shape[1], axis=1).ravel()
    columns = np.tile(dofs, (1, dofs.shape[1])).ravel()
    size = 3 * len(nodes)
    return sp.coo_array((blocks.ravel(), (rows, columns)), shape=(size, size)).tocsr()
