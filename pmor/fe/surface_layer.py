"""The layer of elements below the loaded flank: its compliance with the inner face held, and its depth.

The layer is the first columns of elements of the tooth block, counted from the flank. Everything below is held fixed,
so its compliance is the local one: the dent, without the bending of the tooth (`pmor.contact.line_contact`).
"""

from __future__ import annotations

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from pmor.fe.assembly import degrees_of_freedom
from pmor.gear.conventions import FloatArray
from pmor.mesh.sector import SectorMesh


def layer_compliance(mesh: SectorMesh, columns: int, stiffness: sp.csr_array) -> FloatArray:
    """Return the compliance of the flank with everything below the layer held fixed.

    Parameters
    ----------
    mesh : SectorMesh
    columns : int
        Elements through the layer.
    stiffness : scipy.sparse.csr_array
        Of the sector, N/mm.

    Returns
    -------
    ndarray, shape (f, f)
        Of the flank's unknowns in the order of `SectorMesh.flank`, mm/N.
    """
    layers = len(mesh.z)
    # The handover row belongs to the ring as well: it is held.
    grid = np.stack([row.reshape(-1, layers) for row in mesh.tooth_rows[1:]])
    schur, inner = np.empty((0, 0)), np.empty(0, dtype=np.int64)
    for column in range(columns - 1, -1, -1):
        dofs = degrees_of_freedom(grid[:, column].ravel())
        block = stiffness[dofs][:, dofs].toarray()
        if len(inner):
            factor = la.cholesky(schur, lower=True, overwrite_a=True, check_finite=False)
            coupling = stiffness[inner][:, dofs].toarray()
            half = la.solve_triangular(factor, coupling, lower=True, overwrite_b=True, check_finite=False)
            block -= half.T @ half
        schur, inner = block, dofs
    # The flank's rows are the last ones of the tooth block.
    size = 3 * mesh.flank.size
    unit = np.eye(len(inner))[:, -size:]
    half = la.solve_triangular(la.cholesky(schur, lower=True, check_finite=False), unit, lower=True, check_finite=False)
    return np.asarray(half.T @ half)
