"""Compliance between the sections of flanks, for line loads: that of the flank nodes, interpolated over the width."""

from __future__ import annotations

import numpy as np

from pmor.core.arrays import FloatArray, IntArray

# Rows of nodes that carry a section.
ROWS = 4


def section_compliance(
    gears: tuple[FloatArray, FloatArray], components: int, sections: tuple[IntArray, FloatArray], rows: tuple[int, int]
) -> tuple[FloatArray, FloatArray]:
    """Return displacements at each section's rows of nodes under unit forces there.

    Parameters
    ----------
    gears : two ndarrays
    components : int
        As in `pmor.body.flank_compliance.FlankCompliance`.
    sections : (ndarray of int, shape (2, S); ndarray, shape (2, S, b))
        First column of nodes that carries each section on pinion and wheel, and the shares of b columns from there on.
    rows : (int, int)
        Rows of nodes on the pinion's and the wheel's flank.

    Returns
    -------
    two ndarrays, shape (neighbours + 1, S, S, r c, r c)
        Displaced section, loaded section; r rows, at least four, of c components, mm/N. The same array for gears that
        share their compliance and whose columns carry the sections alike.
    """
    first, share = sections
    pinion = _of_gear(gears[0], components, rows[0], first[0], share[0])
    if gears[1] is gears[0] and np.array_equal(*first) and np.array_equal(*share):
        return pinion, pinion
    return pinion, _of_gear(gears[1], components, rows[1], first[1], share[1])


def section_shares(first: IntArray, share: FloatArray, columns: int) -> FloatArray:
    """Return the share of each column of nodes in each section, shape (S, columns).

    Parameters
    ----------
    first : ndarray of int, shape (S,)
        First column of nodes that carries each section.
    share : ndarray, shape (S, b)
        Of the b columns from there on; zero beyond the last one.
    """
    shares = np.zeros((len(first), columns))
    for section, (start, weights) in enumerate(zip(first, share, strict=True)):
        used = weights[: columns - start]
        shares[section, start : start + len(used)] = used
    return shares


def _of_gear(blocks: FloatArray, components: int, rows: int, first: IntArray, share: FloatArray) -> FloatArray:
    columns = blocks.shape[1] // (rows * components)
    shares = section_shares(first, share, columns)
    size, held = rows * components, max(rows, ROWS) * components
    between = np.zeros((len(blocks), len(shares), len(shares), held, held))
    for apart, block in enumerate(blocks):
        whole = block.reshape(rows, columns, components, rows, columns, components)
        loaded = np.tensordot(whole, shares, axes=(4, 1))  # rows, columns, parts, rows, parts, sections
        both = np.tensordot(shares, loaded, axes=(1, 1))  # sections, rows, parts, rows, parts, sections
        between[apart, :, :, :size, :size] = both.transpose(0, 5, 1, 2, 3, 4).reshape(
            len(shares), len(shares), size, size
        )
    return between
