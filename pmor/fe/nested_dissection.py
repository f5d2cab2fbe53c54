"""Geometric nested dissection of the structured gear mesh: which nodes are eliminated together, and in which order.

Elements are halved again and again by planes of the grid (George, SIAM J. Numer. Anal. 10 (1973) 345). Once the inner
nodes of a part are eliminated its border is left, and a plane across the mesh is a small one. The planes are found by
counting elements, no graph is needed, and it does not matter how many nodes an element has.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pmor.core.arrays import IntArray
from pmor.fe.element import QUADRATIC_NODES
from pmor.fe.sector import SectorMesh

# A plane leaves at least this share of the elements on either side.
BALANCE = 0.25

# Unknowns of the elements of a part that dense elimination does not divide further: of smaller ones most time goes by
# around LAPACK.
UNDIVIDED = 1000


class Part(NamedTuple):
    """Some elements that hang together.

    Parameters
    ----------
    elements : ndarray of int
        Of a part that is not divided further; none of the others.
    parts : tuple of int
        The two that it is divided into, which precede it.
    inner : ndarray of int
        Nodes that are eliminated here: no element outside has them, and none of the two parts has eliminated them.
    border : ndarray of int
        Nodes that elements outside have too, or that are retained.
    """

    elements: IntArray
    parts: tuple[int, ...]
    inner: IntArray
    border: IntArray


def element_places(mesh: SectorMesh) -> IntArray:
    """Return row, column and layer of each element of a sector, shape (n_elements, 3).

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
    return grid[mesh.elements].min(axis=1) // mesh.order


def nested_dissection(places: IntArray, elements: IntArray, retained: IntArray, undivided: int) -> list[Part]:
    """Divide elements into parts within parts.

    Parameters
    ----------
    places : ndarray of int, shape (n, 3)
        Row, column and layer of each element; those that share nodes differ by at most one in each direction, but for
        the first and last columns of a closed ring.
    elements : ndarray of int, shape (n, nodes)
        Nodes of each; negative numbers are passed over.
    retained : ndarray of int
        Nodes that are not eliminated.
    undivided : int
        Parts of so many elements are not divided further.

    Returns
    -------
    list of Part
        In the order of elimination; the last one is the whole.
    """
    size = int(elements.max()) + 1
    users = np.bincount(elements[elements >= 0], minlength=size)
    users[retained] += 1  # never all within
    parts: list[Part] = []

    def divide(own: IntArray) -> tuple[IntArray, IntArray]:
        """Append a part and those within it; return its border, and how many of its elements have each node there."""
        split = _separator(places[own]) if len(own) > undivided else None
        if split is None:
            within: tuple[int, ...] = ()
            nodes, count = np.unique(elements[own], return_counts=True)
            nodes, count = nodes[nodes >= 0], count[nodes >= 0]
        else:
            axis, plane = split
            below = places[own, axis] < plane
            borders, counts, last = [], [], []
            for half in (own[below], own[~below]):
                border, number = divide(half)
                borders.append(border)
                counts.append(number)
                last.append(len(parts) - 1)
            nodes, place = np.unique(np.concatenate(borders), return_inverse=True)
            count = np.bincount(place, weights=np.concatenate(counts)).astype(np.int64)
            within, own = tuple(last), own[:0]
        done = count == users[nodes]
        parts.append(Part(own, within, nodes[done], nodes[~done]))
        return nodes[~done], count[~done]

    divide(np.arange(len(elements)))
    return parts


def elimination_order(mesh: SectorMesh, numbers: IntArray, sectors: int) -> IntArray:
    """Order the free nodes of a gear, or of an arc of it with open ends, for elimination.

    Parameters
    ----------
    numbers : ndarray of int, shape (teeth, sector nodes)
        Node of the whole gear for each node of each sector (`pmor.fe.whole_gear`).
    sectors : int
        Sectors of the arc, counted from sector 0; all teeth: the closed ring.

    Returns
    -------
    ndarray of int, shape (n,)
        Nodes of the whole gear that elements have, those on the bore left out.
    """
    place = element_places(mesh)
    width = int(place[:, 1].max()) + 1
    # Sectors count counter-clockwise, columns clockwise.
    places = np.concatenate([place - [0, k * width, 0] for k in range(sectors)])
    elements = numbers[:sectors, mesh.elements[:, :QUADRATIC_NODES]].reshape(len(places), -1)
    elements = np.where(np.isin(elements, numbers[:, mesh.bore]), -1, elements)
    parts = nested_dissection(places, elements, np.empty(0, dtype=np.int64), 1)
    return np.concatenate([part.inner for part in parts])


def _separator(places: IntArray) -> tuple[int, int] | None:
    """Return axis and place of the plane that cuts the fewest elements apart and leaves balanced halves."""
    best: tuple[int, int, int, int] | None = None
    for axis in range(3):
        low = int(places[:, axis].min())
        count = np.bincount(places[:, axis] - low)
        below = np.cumsum(count)[:-1]
        smaller = np.minimum(below, len(places) - below)
        cut = np.minimum(count[:-1], count[1:])
        for plane in np.flatnonzero(smaller >= BALANCE * len(places)):
            # Of equally small planes the one that halves best.
            key = int(cut[plane]), -int(smaller[plane]), axis, low + int(plane) + 1
            best = key if best is None else min(best, key)
    return None if best is None else (best[2], best[3])
