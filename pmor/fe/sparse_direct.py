"""Whole gears, or arcs of them, as sparse systems in the order of elimination, and their direct factorisation."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from pmor.arrays import IntArray
from pmor.fe.assembly import assemble
from pmor.fe.nested_dissection import elimination_order
from pmor.fe.whole_gear import whole_gear_mesh
from pmor.mesh.sector import SectorMesh


def assemble_arc(
    mesh: SectorMesh, youngs_modulus: float, poisson_ratio: float, element: str, sectors: int
) -> tuple[sp.csc_array, IntArray]:
    """Assemble consecutive sectors of a gear whose bore is fixed.

    Parameters
    ----------
    mesh : SectorMesh
    youngs_modulus : float
        MPa.
    poisson_ratio : float
    element : {"hex8", "hex8i"}
    sectors : int
        Counted counter-clockwise from sector 0; all teeth make the closed ring, fewer an arc with open ends.

    Returns
    -------
    stiffness : scipy.sparse.csc_array, shape (n, n)
        Of the free unknowns in the frame of tooth 0, node by node in the order of elimination, N/mm.
    flank_unknown : ndarray of int, shape (sectors, flank nodes)
        First of the three unknowns of each flank node.
    """
    nodes, elements, numbers = whole_gear_mesh(mesh)
    free = elimination_order(mesh, numbers, sectors)
    order = np.concatenate([free, np.unique(numbers[:sectors, mesh.bore])])
    rank = np.full(len(nodes), -1)
    rank[order] = np.arange(len(order))
    # Numbered like this before assembly, the matrix needs no permutation, and the fixed unknowns are the last.
    arc = rank[elements.reshape(mesh.teeth, -1)[:sectors].reshape(-1, 8)]
    stiffness = assemble(nodes[order], arc, youngs_modulus, poisson_ratio, element)
    size = 3 * len(free)
    return stiffness[:size, :size].tocsc(), 3 * rank[numbers[:sectors, mesh.flank.ravel()]]


def factorise(matrix: sp.csc_array) -> spla.SuperLU:
    """Factor a symmetric positive definite matrix in its own order, without pivoting."""
    return spla.splu(matrix, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
