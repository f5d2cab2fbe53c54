"""Cells of a force table: where they are, and how they are made to agree where they border on each other.

A cell beside a larger one has values on their common border that the larger one's cubic misses by as much as the table
may leave out. They are replaced by that cubic: then the force is the same on both sides, and no solver meets a step.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.dynamics.kernels.laws import CELL, PHASE, ForceTable

# Cells to begin with, over the phase of a mesh cycle and over the displacement.
COLUMNS, ROWS = 8, 4
# One of them in the steps that places are counted in: halves of halves of it have whole sixths. A cycle, and the range.
SIZE = 6 << 20
CYCLE, RANGE = COLUMNS * SIZE, ROWS * SIZE

# Values on the border of a cell, and in which directions a cell may lie from there.
_BORDER = np.array([(a, b) for a in range(4) for b in range(4) if {a, b} & {0, 3}])
_BESIDE = ((-1, -1), (-1, 1), (1, -1), (1, 1))
# Corners may hang on borders whose own ends hang on others: most rounds, and a change that counts as none.
_MOST_ROUNDS, _ROUND_OFF = 100, 1e-15


@dataclass(frozen=True)
class Cells:
    """Origins and sizes of cells, in steps over phase and displacement, shape (n,) each.

    The phase counts over mesh cycles of different kinds, one after the other.
    """

    phase: IntArray
    width: IntArray
    x: IntArray
    height: IntArray

    def at(self, which: BoolArray) -> Cells:
        """Some of them."""
        return Cells(self.phase[which], self.width[which], self.x[which], self.height[which])

    def halves(self, over_phase: BoolArray) -> Cells:
        """Both halves of each, beside each other, over the phase or else over the displacement."""
        width = np.repeat(np.where(over_phase, self.width // 2, self.width), 2)
        height = np.repeat(np.where(over_phase, self.height, self.height // 2), 2)
        second, over = np.tile([0, 1], len(self.phase)), np.repeat(over_phase, 2)
        return Cells(
            np.repeat(self.phase, 2) + over * second * width, width,
            np.repeat(self.x, 2) + ~over * second * height, height,
        )  # fmt: skip


def roots(kinds: int) -> Cells:
    """Return the cells to begin with, for so many kinds of mesh cycles."""
    column, row = np.divmod(np.arange(kinds * COLUMNS * ROWS), ROWS)
    whole = np.full(len(column), SIZE)
    return Cells(column * SIZE, whole, row * SIZE, whole)


def together(parts: list[Cells]) -> Cells:
    """Return the cells of all parts, in order."""
    return Cells(
        *(np.concatenate([getattr(part, name) for part in parts]) for name in ("phase", "width", "x", "height"))
    )


def cubics(t: FloatArray) -> FloatArray:
    """Cubics that are 1 at one of 0, 1/3, 2/3, 1 and 0 at the others, shape (..., 4)."""
    b, c, d = 3.0 * t - 1.0, 3.0 * t - 2.0, t - 1.0
    return np.stack([-0.5 * b * c * d, 4.5 * t * c * d, -4.5 * t * b * d, 0.5 * t * b * c], axis=-1)


def join(table: ForceTable, cells: Cells, alike: IntArray) -> None:
    """Make the force of a table continuous: values on borders become those of the longest border there.

    The cells are those that have values, in the same order; `alike` has the kinds of the mesh cycles.
    """
    own, border = np.divmod(np.arange(len(cells.phase) * len(_BORDER)), len(_BORDER))
    a, b = _BORDER[border].T
    phase = cells.phase[own] + cells.width[own] // 3 * a
    x = cells.x[own] + cells.height[own] // 3 * b
    kind, phase = cells.phase[own] // CYCLE, phase - cells.phase[own] // CYCLE * CYCLE
    of, over, up = own.copy(), np.zeros(len(own)), np.zeros(len(own))
    longest = np.where((a % 3 > 0), cells.width[own], np.where(b % 3 > 0, cells.height[own], 0))
    for way in _BESIDE:
        there, t, u = _beside(table, cells, kind, phase, x, way, alike)
        length = np.where((t > 0.0) & (t < 1.0), cells.width[there], 0)
        length = np.where((u > 0.0) & (u < 1.0), cells.height[there], length)
        longer = length > longest
        longest[longer], of[longer], over[longer], up[longer] = length[longer], there[longer], t[longer], u[longer]
    hangs = np.flatnonzero(of != own)
    place, of, weights, more = (own[hangs], a[hangs], b[hangs]), of[hangs], cubics(over[hangs]), cubics(up[hangs])
    for _ in range(_MOST_ROUNDS):
        interpolated = np.einsum("na,nab,nb->n", weights, table.values[of], more)
        change = np.abs(interpolated - table.values[place]).max(initial=0.0)
        table.values[place] = interpolated
        if change <= _ROUND_OFF * table.values.max():
            return


def _beside(
    table: ForceTable, cells: Cells, kind: IntArray, phase: IntArray, x: IntArray, way: tuple[int, int], alike: IntArray
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Find the cells that lie in a direction from places; return them, and where in them the places are, 0 to 1."""
    first = np.unique(alike, return_index=True)[1]
    before, after = alike[first - 1], alike[(first + 1) % len(alike)]
    leaves, enters = (phase == 0) & (way[0] < 0), (phase == CYCLE) & (way[0] > 0)
    kind = np.where(leaves, before[kind], np.where(enters, after[kind], kind))
    phase = np.where(leaves, CYCLE, np.where(enters, 0, phase))
    # Places in half steps: one half step on lies inside a cell.
    p, q = 2 * phase + way[0], np.clip(2 * x + way[1], 1, 2 * RANGE - 1)
    column, row = p // (2 * SIZE), q // (2 * SIZE)
    node = first_root(kind) + column * ROWS + row
    start, below, width, height = column * SIZE, row * SIZE, np.full(len(p), SIZE), np.full(len(p), SIZE)
    while (halved := table.kind[node] != CELL).any():
        over_phase = halved & (table.kind[node] == PHASE)
        over_x = halved & ~over_phase
        width, height = np.where(over_phase, width // 2, width), np.where(over_x, height // 2, height)
        right, upper = over_phase & (p > 2 * (start + width)), over_x & (q > 2 * (below + height))
        start, below = start + right * width, below + upper * height
        node = np.where(halved, table.next[node] + (right | upper), node)
    return table.next[node], (phase - start) / width, (x - below) / height


def first_root(kind: IntArray) -> IntArray:
    """Return the first of the nodes to begin with of kinds of mesh cycles."""
    return kind * COLUMNS * ROWS
