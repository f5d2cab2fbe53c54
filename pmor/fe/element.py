"""Places of the nodes of a hexahedron, in VTK's order, and the widths that columns of nodes carry."""

from __future__ import annotations

import numpy as np

from pmor.core.arrays import FloatArray, IntArray

_CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
_EDGES = [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]]
_FACES = [[0, 1, 1], [2, 1, 1], [1, 0, 1], [1, 2, 1], [1, 1, 0], [1, 1, 2]]

# Nodes of quadratic hexahedra, on corners and edges. The grid has nodes in the middle of faces and elements too.
QUADRATIC_NODES = 20


def node_places(order: int) -> IntArray:
    """Return the place of each node in the element's grid of (order + 1)^3 nodes, shape (n, 3), from 0 to `order`.

    Corners first, counter-clockwise at the lower z and then above them; of quadratic elements the middles of the edges
    (below, above, upright), of the faces (-x, +x, -y, +y, -z, +z) and of the element follow.
    """
    if order == 1:
        return _CORNERS
    return np.concatenate([2 * _CORNERS, _CORNERS[_EDGES].sum(axis=1), _FACES, [[1, 1, 1]]])


def tributary_widths(z: FloatArray, order: int) -> FloatArray:
    """Return the width that each column of nodes carries, so that even loads are the elements' consistent nodal forces.

    Parameters
    ----------
    z : ndarray, shape (m + 1,)
        Columns of nodes, rising, mm.
    order : int
        Intervals between columns that an element spans.

    Returns
    -------
    ndarray, shape (m + 1,)
        mm.
    """
    step = np.diff(z)
    if order == 1:
        return np.append(0.5 * step, 0.0) + np.insert(0.5 * step, 0, 0.0)
    simpson = np.zeros(len(z))
    span = step[::2] + step[1::2]
    simpson[0:-2:2] += span / 6.0
    simpson[1::2] += span * (4.0 / 6.0)
    simpson[2::2] += span / 6.0
    return simpson
