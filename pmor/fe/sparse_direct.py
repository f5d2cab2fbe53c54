"""Whole gears, or arcs of them, as sparse systems in the order of elimination, and their direct factorisation."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from pmor.core.conventions import rotation_z
from pmor.fe.assembly import assemble, degrees_of_freedom
from pmor.fe.completion import completion, nodes_of_elements
from pmor.fe.element import QUADRATIC_NODES
from pmor.fe.nested_dissection import elimination_order
from pmor.fe.sector import SectorMesh
from pmor.fe.whole_gear import whole_gear_mesh


def assemble_arc(
    mesh: SectorMesh, youngs_modulus: float, poisson_ratio: float, element: str, sectors: int
) -> tuple[sp.csc_array, list[sp.csr_array]]:
    """Assemble consecutive sectors of a gear whose bore is fixed.

    Parameters
    ----------
    mesh : SectorMesh
    youngs_modulus : float
        MPa.
    poisson_ratio : float
    element : {"hex8", "hex8i", "hex20"}
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
        turn = sp.kron(sp.eye_array(mesh.flank.size), rotation_z(-2.0 * np.pi * k / mesh.teeth))
        flank = (turn @ completion(mesh, mesh.flank)).tocsr()
        columns = degrees_of_freedom(rank[numbers[k, own]])[flank.indices]
        flanks.append(sp.csr_array((flank.data, columns, flank.indptr), shape=(flank.shape[0], size)))
    return stiffness[:size, :size].tocsc(), flanks


def factorise(matrix: sp.csc_array) -> spla.SuperLU:
    """Factor a symmetric positive definite matrix in its own order, without pivoting."""
    return spla.splu(matrix, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
