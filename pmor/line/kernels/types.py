"""Meshes for the kernels of line contact, beside their geometry (`pmor.gear.kernels.types`), and their results."""

from __future__ import annotations

from typing import NamedTuple

from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.line.kernels.tip_corner import Corner, Corners


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


class Meshes(NamedTuple):
    """All that N sections of M meshes have at every angle; K movements.

    Attributes
    ----------
    mesh, tooth_pair : ndarray of int, shape (N,)
        Of each section; sections of a mesh, and of a tooth pair in it, follow each other.
    width : ndarray, shape (N,)
        With their images, mm.
    ahead : ndarray, shape (M, K)
        Advance of each mesh's pinion against its wheel that closes the flanks as much as a movement, rad.
    share : ndarray, shape (M, K)
        Force of each mesh to expect by the loads.
    softness : ndarray, shape (M,)
        Approach of its flanks to expect by force, mm/N.
    corners : Corners
    """

    mesh: IntArray
    tooth_pair: IntArray
    width: FloatArray
    ahead: FloatArray
    share: FloatArray
    softness: FloatArray
    corners: Corners


class LineResults(NamedTuple):
    """Results of `pmor.line.kernels.loads.solve_lines`, under D loads or movements.

    Attributes
    ----------
    movement : ndarray, shape (D, A, K)
        q, rad or mm.
    steps : ndarray of int, shape (D, A)
    converged : ndarray of bool, shape (D, A)
    force : ndarray, shape (D, A, N)
        Along the transverse line of action, N; 0 where not converged.
    loose : ndarray of int, shape (D, A)
        Number of the movement whose forces and loads do not balance; -1 where all do.
    torque : ndarray, shape (D, A, P) or (0, 0, 0)
        On the pinion by the forces of each tooth pair, N mm; not filled where it is of size 0.
    stiffness : ndarray, shape (D, A, K, K) or (0, 0, 0, 0)
        Tangent d load / d movement of the nonlinear solution; 0 where nothing carries. Likewise.
    sensitivity : ndarray, shape (D, A, N) or (0, 0, 0)
        d movement / d deviation of each section under the same loads, of the first movement: rad/mm. Likewise.
    """

    movement: FloatArray
    steps: IntArray
    converged: BoolArray
    force: FloatArray
    loose: IntArray
    torque: FloatArray
    stiffness: FloatArray
    sensitivity: FloatArray

    @property
    def advance(self) -> FloatArray:
        """Of a pair, (D, A), rad."""
        return self.movement[..., 0]
