"""The part of low rank of the compliance of two gears: their blanks, which turn with the teeth.

A gear's cyclic part is that of a sector held at an interface: its bore, or the cylinder below its rim. A unit force on
a flank makes r reactions there, as harmonics of tractions. With R_i the reactions to unit forces on the unknowns of
tooth i, and S the compliance behind the interface, of web and hub,

    C_ik = C_local(i - k) + R_i S R_k^T,                  D = D_local + L S L^T.                         (A)

L has one row for each placed section: the gradient of its gap times R. Rows turn from tooth to tooth, R_(i+1) = R_i Q
with Q orthogonal: S stands in the frame of the gear, and may differ from tooth to tooth (a web with holes). S is
symmetric and not negative: D stays symmetric and positive definite. What stands still while the gears turn, such as
shafts, bearings and housing, is no part of it: see `support` of `pmor.line.layered_pair.LayeredPair`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pmor.body.section_compliance import ROWS, section_shares
from pmor.core.arrays import FloatArray, IntArray


@dataclass(frozen=True)
class Support:
    """Compliance behind the interfaces of pinion and wheel, in r coordinates of both together.

    Parameters
    ----------
    rows : ndarray, shape (2, n, r)
        R of tooth 0 of pinion and wheel: reactions to unit forces on the flank's unknowns, in the tooth's frame.
    turn : ndarray, shape (2, r, r)
        Q of pinion and wheel, from a tooth to the next one counter-clockwise; orthogonal.
    compliance : ndarray, shape (r, r)
        S: displacements of the interfaces under unit reactions; mm/N where the reactions are forces in N.
    """

    rows: FloatArray
    turn: FloatArray
    compliance: FloatArray

    def flexibility(self, rows: FloatArray) -> FloatArray:
        """Return L S L^T of rows of sections, (A, N, r), at A angles: shape (A, N, N), mm/N."""
        return np.asarray(rows @ self.compliance @ rows.transpose(0, 2, 1))


def support_rows(
    support: Support, sections: tuple[IntArray, FloatArray], node_rows: tuple[int, int], first_pair: IntArray,
    row: IntArray, gradient: FloatArray,
) -> FloatArray:  # fmt: skip
    """Return L, the rows of placed sections: reactions of the interfaces to a unit force in each.

    Parameters
    ----------
    sections : (ndarray of int, shape (2, S); ndarray, shape (2, S, b))
        First column of nodes that carries each section on pinion and wheel, and the shares of b columns from there on.
    node_rows : (int, int)
        Rows of nodes on the flanks of pinion and wheel.
    first_pair : ndarray of int, shape (A,)
        First tooth pair at each angle; the others follow, S sections each: N in all.
    row : ndarray of int, shape (A, N, 2)
        First of the four rows of nodes that carry a section, on each gear.
    gradient : ndarray, shape (A, N, 2, 4 c)
        Gradient of the gap by the c components of displacement in these rows.

    Returns
    -------
    ndarray, shape (A, N, r)
    """
    found = np.zeros((*row.shape[:2], len(support.compliance)))
    place = np.arange(row.shape[1]) // len(sections[0][0])
    for gear, sense in ((0, 1), (1, -1)):  # wheel teeth count against tooth pairs
        carriers = sections[0][gear], sections[1][gear]
        of_tooth_0 = carried_rows(support.rows[gear], carriers, node_rows[gear], row[..., gear], gradient[:, :, gear])
        teeth = sense * (first_pair[:, None] + place)
        for tooth in np.unique(teeth).tolist():
            turned = np.linalg.matrix_power(support.turn[gear], tooth)
            found += np.where((teeth == tooth)[..., None], of_tooth_0 @ turned, 0.0)
    return found


def carried_rows(
    shapes: FloatArray, carriers: tuple[IntArray, FloatArray], node_rows: int, row: IntArray, gradient: FloatArray
) -> FloatArray:
    """Return what a unit force in each placed section does to shapes of a flank.

    Parameters
    ----------
    shapes : ndarray, shape (n, r)
        Over the unknowns of the flank.
    carriers : (ndarray of int, shape (S,); ndarray, shape (S, b))
        First column of nodes that carries each section of the gear, and the shares of b columns from there on.
    node_rows : int
        Rows of nodes on the flank.
    row : ndarray of int, shape (A, N)
    gradient : ndarray, shape (A, N, 4 c)
        As in `support_rows`, of one gear.

    Returns
    -------
    ndarray, shape (A, N, r)
    """
    angles, size = row.shape
    count, parts, rank = len(carriers[0]), gradient.shape[2] // ROWS, shapes.shape[1]
    columns = len(shapes) // (node_rows * parts)
    nodes = shapes.reshape(node_rows, columns, parts, rank)
    carried = np.zeros((count, max(node_rows, ROWS), parts, rank))
    carried[:, :node_rows] = np.tensordot(section_shares(*carriers, columns), nodes, axes=(1, 1))
    section = np.arange(size) % count
    by_node = carried[section[:, None], row[..., None] + np.arange(ROWS)].reshape(angles, size, ROWS * parts, rank)
    return np.asarray(np.einsum("ing,ingr->inr", gradient, by_node))
