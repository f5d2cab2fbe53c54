"""A state for the kernels: surfaces, feet, contact points, active shapes, workspace.

Named tuples of arrays and scalars, as in `pmor.penalty.kernels.types`, which has units and numbering.
"""

from __future__ import annotations

from typing import NamedTuple

from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.gear.kernels.types import Motion
from pmor.penalty.kernels.types import ActivePatches


class Surface(NamedTuple):
    """Surface over a grid of deformed nodes.

    Attributes
    ----------
    nodes : ndarray, shape (rows, columns, 3)
        mm.
    along_rows, along_columns : ndarray, shape (rows, columns, 2, 3)
        Tangents of the edges from node (i, k) to (i + 1, k) and to (i, k + 1), at both ends; of a smooth surface.
    smooth : bool
        Ferguson patches, else bilinear facets.
    """

    nodes: FloatArray
    along_rows: FloatArray
    along_columns: FloatArray
    smooth: bool


class Foot(NamedTuple):
    """Workspace for the foot of the perpendicular from a point on a surface.

    Attributes
    ----------
    element : ndarray of int, shape (2,)
        The patch that holds it.
    guess : ndarray, shape (2,)
        Parameters in the patch.
    point, tangent_s, tangent_t : ndarray, shape (3,)
        The foot, and the tangents there.
    """

    element: IntArray
    guess: FloatArray
    point: FloatArray
    tangent_s: FloatArray
    tangent_t: FloatArray


class Feet(NamedTuple):
    """Where each slave point was projected the last time.

    Attributes
    ----------
    element : ndarray of int, shape (..., rows, columns of slave points, 2)
        -1: not yet.
    guess : ndarray, shape (..., rows, columns of slave points, 2)
    """

    element: IntArray
    guess: FloatArray


class Points(NamedTuple):
    """Contact points: those that penetrate, or nearly do.

    Attributes
    ----------
    pair : ndarray of int, shape (n,)
        Number of the tooth pair among those that can touch.
    slave : ndarray of int, shape (n,)
        Gear whose point it is: 0 pinion, 1 wheel.
    node : ndarray of int, shape (n, 8)
        Window nodes that carry the point: four of the slave, four of the master.
    weight : ndarray, shape (n, 8, 3)
        Gradient of the gap by the displacements of these nodes.
    gap : ndarray, shape (n,)
        Negative: penetration, mm.
    stiffness : ndarray, shape (n,)
        Penalty times share of area, N/mm.
    lever, mate_lever : ndarray, shape (n,)
        Derivative of the gap by the pinion's rotation; lever arm of the force on the wheel, mm.
    place : ndarray of int, shape (n, 4)
        Row and column of the slave point in its window, row and column of the master's element in its own.
    """

    pair: IntArray
    slave: IntArray
    node: IntArray
    weight: FloatArray
    gap: FloatArray
    stiffness: FloatArray
    lever: FloatArray
    mate_lever: FloatArray
    place: IntArray


class SearchWorkspace(NamedTuple):
    """Workspace for a search: the points that it lists, the feet that it remembers, and two motions."""

    points: Points
    feet: Feet
    forward: Motion
    back: Motion


class Found(NamedTuple):
    """Results of a search beside the points.

    Attributes
    ----------
    listed : int
        Points listed so far.
    smallest : float
        Smallest gap met, mm; infinite if nothing projects.
    border : bool
        Contact reaches the end of a window that is not the edge of its flank: the window is too small.
    """

    listed: int
    smallest: float
    border: bool


class GearLines(NamedTuple):
    """Shapes of a gear that belong to its flank lines: see `pmor.reduction.flank_lines.GearLines`."""

    start: IntArray
    displacement: FloatArray
    gram: FloatArray


class PositionShapes(NamedTuple):
    """Shapes of a pair at roll positions (`pmor.reduction.contact_shapes.ContactShapes`).

    Attributes
    ----------
    first, step : float
        Grid of roll positions, rad.
    loaded, displacement, gram
        As there.
    """

    first: float
    step: float
    loaded: BoolArray
    displacement: FloatArray
    gram: FloatArray


class Family(NamedTuple):
    """The shapes of a reduced pair: of one family, the arrays of the other one are empty.

    Attributes
    ----------
    by_line : bool
        Which of the two. A shape of lines belongs to one gear, one of positions to both.
    lines : two GearLines
        Of pinion and wheel.
    """

    by_line: bool
    lines: tuple[GearLines, GearLines]
    positions: PositionShapes


class ActiveShapes(NamedTuple):
    """The active shapes, whose amplitudes are the unknowns.

    Attributes
    ----------
    size : int
        How many there are.
    slot : ndarray of int, shape (size or more,)
        Tooth pair (its number among those that can touch) times the shapes that a pair can have at all, plus the shape.
    ranges : ndarray of int, shape (2, 2)
        For each gear the first and the last but one shape that moves it.
    gram, factor : ndarray, shape (size or more, size or more)
        Energy products, and their upper Cholesky factor.
    fields : ndarray, shape (size or more, 3 nodes)
        ``fields[j - ranges[gear, 0]]``: displacements of the window nodes.
    """

    size: int
    slot: IntArray
    ranges: IntArray
    gram: FloatArray
    factor: FloatArray
    fields: FloatArray


class Work(NamedTuple):
    """Workspace for the solution of one position.

    Attributes
    ----------
    undeformed, nodes : ndarray, shape (nodes, 3)
        Window nodes, mm.
    slope : ndarray, shape (points, active_shapes)
        Derivatives of the gaps by the active shapes' amplitudes.
    free_gap : ndarray, shape (points,)
        Gaps without elastic deformation, mm.
    active : ndarray of bool, shape (points,)
        Whether a point carries load in the linearised problem.
    target, difference, solution, trial, rhs : ndarray, shape (active shapes + 1,)
    matrix, factor : ndarray, shape (active shapes + 1, active shapes + 1)
    """

    undeformed: FloatArray
    nodes: FloatArray
    slope: FloatArray
    free_gap: FloatArray
    active: BoolArray
    target: FloatArray
    difference: FloatArray
    solution: FloatArray
    trial: FloatArray
    rhs: FloatArray
    matrix: FloatArray
    factor: FloatArray
    workspace: SearchWorkspace


class Position(NamedTuple):
    """All that one pinion angle needs."""

    patches: ActivePatches
    active_shapes: ActiveShapes
    work: Work


class Load(NamedTuple):
    """Load of the pair.

    Attributes
    ----------
    torque : float
        On the pinion, N mm.
    approach : float
        Approach of the flanks to expect, mm.
    """

    torque: float
    approach: float
