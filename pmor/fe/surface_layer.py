"""The layer of elements below the loaded flank: its compliance with the inner face held, and its depth.

The layer is the first columns of elements of the tooth block, counted from the flank. Everything below is held fixed,
so its compliance is the local one: the dent, without the bending of the tooth (`pmor.contact.line_contact`).
"""

from __future__ import annotations

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from pmor.arrays import FloatArray
from pmor.fe.assembly import degrees_of_freedom
from pmor.fe.completion import nodes_of_elements
from pmor.fe.elimination import eliminate_chain, in_twos, submatrix
from pmor.mesh.sector import SectorMesh


def layer_compliance(mesh: SectorMesh, columns: int, stiffness: sp.csr_array) -> FloatArray:
    """Return the compliance of the flank with everything below the layer held fixed.

    Parameters
    ----------
    mesh : SectorMesh
    columns : int
        Columns of nodes above the layer's inner face.
    stiffness : scipy.sparse.csr_array
        Of the sector, N/mm.

    Returns
    -------
    ndarray, shape (f, f)
        Of the unknowns of the flank's nodes that elements have, in the order of `SectorMesh.flank`, mm/N.
    """
    layers, flank = len(mesh.z), degrees_of_freedom(nodes_of_elements(mesh, mesh.flank))
    # The handover row belongs to the ring as well: it is held. The rows across the layer are short; its columns are as
    # long as the tooth is high and take more than twice the time with 64 elements.
    rows = (row.reshape(-1, layers)[:columns] for row in mesh.tooth_rows[1:])
    across = (degrees_of_freedom(nodes_of_elements(mesh, row)) for row in rows)
    inside = [np.setdiff1d(row, flank) for row in across]
    chain = [row for row in (inside if mesh.order == 1 else in_twos(inside)) if len(row)]
    reached, update = eliminate_chain(stiffness, [*chain, np.empty(0, dtype=np.int64)], flank, None)
    order = np.argsort(flank)
    place = order[np.searchsorted(flank, reached, sorter=order)]
    schur = submatrix(stiffness, flank, flank)
    schur[np.ix_(place, place)] += update
    half = la.solve_triangular(
        la.cholesky(schur, lower=True, check_finite=False), np.eye(len(flank)), lower=True, check_finite=False
    )
    return np.asarray(half.T @ half)
