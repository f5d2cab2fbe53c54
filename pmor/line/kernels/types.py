"""A pair for the kernels of line contact, beside its geometry (`pmor.gear.kernels.types`)."""

from __future__ import annotations

from typing import NamedTuple

from pmor.core.arrays import FloatArray, IntArray
from pmor.line.kernels.tip_corner import Corner


class Layer(NamedTuple):
    """Layer below a gear's loaded flank that the law of the line load stands for.

    Attributes
    ----------
    compliance : float
        2 (1 - nu^2) / (pi E), mm^2/N.
    constant : ndarray, shape (n + 1,)
        ln(2 depth) + 1/2 + a of the approach at each row of nodes (`pmor.line.hertz`).
    tip, undercut : Corner
        Where the flank ends at the tip, and at the edge that undercut leaves.
    """

    compliance: float
    constant: FloatArray
    tip: Corner
    undercut: Corner


class Carriers(NamedTuple):
    """Nodes that carry a point of a section: four of a column, on both gears.

    Attributes
    ----------
    row : ndarray of int, shape (2,)
        Row of the first of the four on the flank.
    weight : ndarray, shape (2, 4)
    """

    row: IntArray
    weight: FloatArray


class Sections(NamedTuple):
    """Transverse sections in which line contact is evaluated, S of them, and the C columns of nodes that carry each.

    Attributes
    ----------
    z : ndarray, shape (S,)
        mm.
    width : ndarray, shape (S,)
        Share of the face width that each stands for, mm.
    column : ndarray of int, shape (2, S)
        First of the columns of nodes that carry a section, on each gear.
    share : ndarray, shape (2, S, C)
        Weights of these columns.
    """

    z: FloatArray
    width: FloatArray
    column: IntArray
    share: FloatArray
