"""Geometric nested dissection of the structured gear mesh: the order that keeps the fill of a sparse factor small.

Nodes of an element differ by at most one row, one column and one layer, so every plane of the grid separates what lies
on its two sides (George, SIAM J. Numer. Anal. 10 (1973) 345). The planes are found by counting, no graph is needed.
"""

from __future__ import annotations

import numpy as np

from pmor.arrays import IntArray
from pmor.mesh.sector import SectorMesh

# Below this many nodes a part is dense anyway.
LEAF_NODES = 12
# A separator leaves at least this share of the nodes on either side.
BALANCE = 0.25


def sector_grid(mesh: SectorMesh) -> IntArray:
    """Return row, column and layer of each node of a sector, shape (n_nodes, 3).

    Rows count outwards from the bore, columns from the counter-clockwise side face to the clockwise one; the tooth
    continues the columns of the ring that it stands on.
    """
    layers = len(mesh.z)
    grid = np.empty((len(mesh.nodes), 3), dtype=np.int64)
    first = int(np.flatnonzero(mesh.ring_rows[0] == mesh.tooth_rows[0][0])[0]) // layers
    outline = len(mesh.ring_rows) - 1
    rows = [(outline - r, 0, nodes) for r, nodes in enumerate(mesh.ring_rows)]
    rows += [(outline + r, first, nodes) for r, nodes in enumerate(mesh.tooth_rows)]
    for row, column, nodes in rows:
        number = np.arange(len(nodes))
        grid[nodes] = np.column_stack([np.full(len(nodes), row), column + number // layers, number % layers])
    return grid


def elimination_order(mesh: SectorMesh, numbers: IntArray, sectors: int) -> IntArray:
    """Order the free nodes of a gear, or of an arc of it with open ends, for elimination.

    Parameters
    ----------
    mesh : SectorMesh
    numbers : ndarray of int, shape (teeth, sector nodes)
        Node of the whole gear for each node of each sector (`pmor.fe.whole_gear`).
    sectors : int
        Sectors of the arc, counted from sector 0; all teeth: the closed ring.

    Returns
    -------
    ndarray of int, shape (n,)
        Nodes of the whole gear, those on the bore left out.
    """
    sector = sector_grid(mesh)
    width = int(sector[:, 1].max())
    free = np.setdiff1d(np.arange(len(mesh.nodes)), mesh.bore)
    grid = np.empty((int(numbers.max()) + 1, 3), dtype=np.int64)
    for k in range(sectors):
        # Sectors count counter-clockwise, columns clockwise.
        grid[numbers[k]] = sector - [0, k * width, 0]
    nodes = np.unique(numbers[:sectors, free])
    column = grid[nodes, 1]
    # A ring has to be cut open, at the face where its columns end and begin, before planes can separate it.
    cut = (column == column.min()) & (sectors == mesh.teeth)
    inner = nodes[~cut]
    return np.concatenate([inner[nested_dissection(grid[inner])], nodes[cut]])


def nested_dissection(grid: IntArray) -> IntArray:
    """Order nodes so that each separator comes after the two parts that it separates.

    Parameters
    ----------
    grid : ndarray of int, shape (n, 3)
        Place of each node; nodes that are coupled differ by at most one in each direction.

    Returns
    -------
    ndarray of int, shape (n,)
        Node numbers in the order of elimination.
    """
    parts: list[IntArray] = []
    _dissect(grid, np.lexsort(grid.T), parts)
    return np.concatenate(parts)


def _dissect(grid: IntArray, nodes: IntArray, parts: list[IntArray]) -> None:
    """Append the order of some nodes to `parts`."""
    axis, plane = _separator(grid[nodes]) if len(nodes) > LEAF_NODES else (0, None)
    if plane is None:
        parts.append(nodes)
        return
    place = grid[nodes, axis]
    _dissect(grid, nodes[place < plane], parts)
    _dissect(grid, nodes[place > plane], parts)
    parts.append(nodes[place == plane])


def _separator(grid: IntArray) -> tuple[int, int | None]:
    """Return the axis and place of the plane with the fewest nodes that leaves balanced parts, if there is one."""
    best: tuple[int, int | None] = (0, None)
    fewest = len(grid)
    for axis in range(3):
        low = int(grid[:, axis].min())
        count = np.bincount(grid[:, axis] - low)
        below = np.cumsum(count) - count
        smaller = np.minimum(below, len(grid) - below - count)
        allowed = np.flatnonzero(smaller >= BALANCE * (len(grid) - count))
        if len(allowed) > 0:
            # Of equally small planes the one that halves best.
            plane = allowed[np.lexsort((-smaller[allowed], count[allowed]))[0]]
            if count[plane] < fewest:
                fewest, best = int(count[plane]), (axis, low + int(plane))
    return best
