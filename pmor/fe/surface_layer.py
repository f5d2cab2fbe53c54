"""The layer of elements below the loaded flank, whose compliance the law of line contact replaces.

The layer is the first columns of elements of the tooth block, counted from the flank, with everything below it held:
its compliance is the local one, the dent without the bending of the tooth. The answer of the mesh there depends on the
place of the load between its nodes, and on how finely it resolves a depth of the layer: all of it is taken out. What is
left is smooth over flank and width. The law (`pmor.line.hertz`) and, along the width, `pmor.line.face_ends` put a layer
back that is known in closed form.
"""

from __future__ import annotations

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.fe.assembly import degrees_of_freedom
from pmor.fe.completion import completion, nodes_of_elements
from pmor.fe.element import QUADRATIC_NODES
from pmor.fe.elimination import condense, inverse
from pmor.fe.nested_dissection import element_places
from pmor.fe.sector import SectorMesh


def inverse_flank_stiffness(mesh: SectorMesh, stiffness: FloatArray, unknowns: IntArray) -> FloatArray:
    """Return the inverse of the stiffness of some unknowns of flanks, which it takes the place of.

    Axially held unknowns have a stiffness of their own without meaning: they do not move.
    """
    compliance = inverse(stiffness)
    held = np.isin(unknowns, mesh.held_axially)
    compliance[held, held] = 0.0
    return compliance


def layer_compliance(mesh: SectorMesh, columns: int, stiffness: FloatArray) -> FloatArray:
    """Return the compliance of the flank with everything below a layer held fixed.

    Parameters
    ----------
    columns : int
        Columns of nodes above the layer's inner face.
    stiffness : ndarray, shape (n_elements, 3 k, 3 k)
        Of the sector's elements, N/mm.

    Returns
    -------
    ndarray, shape (f, f)
        Of all unknowns of `SectorMesh.flank`, mm/N.
    """
    layers, elements = len(mesh.z), mesh.elements[:, :QUADRATIC_NODES]
    # The handover row belongs to the ring as well: it is held.
    free = np.zeros(len(mesh.nodes), dtype=bool)
    free[np.concatenate([row[: columns * layers] for row in mesh.tooth_rows[1:]])] = True
    inside = np.flatnonzero(free[elements].any(axis=1))
    flank = nodes_of_elements(mesh, mesh.flank)
    schur = condense(stiffness[inside], elements[inside], element_places(mesh)[inside], flank, np.flatnonzero(~free))
    full = completion(mesh, mesh.flank)
    return np.asarray(full @ (full @ inverse_flank_stiffness(mesh, schur, degrees_of_freedom(flank)).T).T)
