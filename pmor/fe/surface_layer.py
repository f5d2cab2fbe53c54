"""The layer of elements below the loaded flank: its compliance with the inner face held, and its depth.

The layer is the first columns of elements of the tooth block, counted from the flank. Everything below is held fixed,
so its compliance is the local one: the dent, without the bending of the tooth (`pmor.contact.line_contact`).
"""

from __future__ import annotations

import numpy as np

from pmor.arrays import FloatArray
from pmor.fe.completion import nodes_of_elements
from pmor.fe.elimination import condense, inverse
from pmor.fe.nested_dissection import element_places
from pmor.mesh.element import QUADRATIC_NODES
from pmor.mesh.sector import SectorMesh


def layer_compliance(mesh: SectorMesh, columns: int, stiffness: FloatArray) -> FloatArray:
    """Return the compliance of the flank with everything below the layer held fixed.

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
        Of the unknowns of the flank's nodes that elements have, in the order of `SectorMesh.flank`, mm/N.
    """
    layers, elements = len(mesh.z), mesh.elements[:, :QUADRATIC_NODES]
    # The handover row belongs to the ring as well: it is held.
    free = np.zeros(len(mesh.nodes), dtype=bool)
    free[np.concatenate([row[: columns * layers] for row in mesh.tooth_rows[1:]])] = True
    inside = np.flatnonzero(free[elements].any(axis=1))
    schur = condense(
        stiffness[inside], elements[inside], element_places(mesh)[inside], nodes_of_elements(mesh, mesh.flank),
        np.flatnonzero(~free),
    )  # fmt: skip
    return inverse(schur)
