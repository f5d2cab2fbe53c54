"""What the kernels pass to each other: named tuples of arrays and scalars, and columns of arrays by name.

Lengths are in mm, angles in rad, forces in N. Gears are numbered 0 (pinion) and 1 (wheel), everywhere. P is the number
of tooth pairs that can be in reach together.

The part of a flank that can touch is a *window*: a grid of nodes (rows, columns), rows from the root towards the tip,
columns along +z. Beside the rows of its elements a window holds one neighbouring row on either side where the flank has
one, because node normals are averaged over the elements around a node. A window is an array of integers, shape (7,).
"""

from __future__ import annotations

from typing import NamedTuple

from pmor.arrays import BoolArray, FloatArray, IntArray

# A window: number of its first node among the nodes of all windows; rows of nodes; number of its first element row,
# counted in the window; rows of elements; whether the first element row is the first of the flank, and the last the
# last one; number of its first element row, counted on the flank.
OFFSET, NODE_ROWS, FIRST, ELEMENT_ROWS, AT_ROOT, AT_TIP, FIRST_ROW = range(7)

# Half distances from a contact point to its neighbours.
TO_ROOT, TO_TIP, TO_LOW_Z, TO_HIGH_Z = range(4)

# Kinds of contact schemes.
NODAL, STRIP, LINE = range(3)


class Kinematics(NamedTuple):
    """Kinematics of a gear pair, and its wheel's axis out of place.

    Attributes
    ----------
    action_length : float
        Length of the line of action between the base circles, mm.
    pressure_angle : float
        Working pressure angle, rad.
    centre_distance : float
        mm.
    pitch : float
        Angular pitch of the pinion, rad.
    path_start, path_end : float
        First and last roll position of the path of contact, rad.
    least_radius : float
        Bottom of the radii of curvature, mm.
    local_share : float
        Share of the approach by which flanks interpenetrate where they meet.
    row_spacing : float
        Largest distance between rows of contact points, mm.
    offset_x, offset_y : float
        Offset of the wheel's axis at mid width, z = 0, mm.
    slope_x, slope_y : float
        Slope of the wheel's axis.
    first_touch : float
        Angle by which the unloaded pinion is ahead when the flanks first touch, at one of the faces, from which the
        lead counts, rad.
    """

    action_length: float
    pressure_angle: float
    centre_distance: float
    pitch: float
    path_start: float
    path_end: float
    least_radius: float
    local_share: float
    row_spacing: float
    offset_x: float = 0.0
    offset_y: float = 0.0
    slope_x: float = 0.0
    slope_y: float = 0.0
    first_touch: float = 0.0


class Gear(NamedTuple):
    """Loaded flank of a gear, undeformed, in its tooth's frame.

    Attributes
    ----------
    nodes : ndarray, shape (n + 1, m + 1, 3)
        From the start of the involute to the tip, along +z, mm.
    roll : ndarray, shape (n + 1,)
        Roll angles of the rows of nodes, rad.
    extents : ndarray, shape (rows, columns of contact points, 4)
        Half distances of each point to its neighbours (`TO_ROOT` ...), mm; their products are its share of area.
    base_radius : float
        mm.
    form_roll, tip_roll : float
        Roll angles at the form circle and at the tip circle, rad.
    half_angle : float
        Half the tooth's angle on the base circle, rad.
    line_compliance : float
        Of the closed form of line contact, mm^2/N.
    line_constant : ndarray, shape (n + 1,)
        Its constant at each row of nodes; empty for other schemes.
    section_width : ndarray, shape (m + 1,)
        Share of the face width that each column of nodes stands for, mm.
    """

    nodes: FloatArray
    roll: FloatArray
    extents: FloatArray
    base_radius: float
    form_roll: float
    tip_roll: float
    half_angle: float
    line_compliance: float
    line_constant: FloatArray
    section_width: FloatArray


class Scheme(NamedTuple):
    """How contact is evaluated.

    Attributes
    ----------
    kind : int
        `NODAL`, `STRIP` or `LINE`.
    lodm_profile, lodm_width : int
        Subdivisions of an element along the profile and the width.
    smooth : bool
        Ferguson patches, else bilinear facets.
    direct : bool
        Project on the master's patches themselves; else on bilinear facets through its refined points (the paper).
    parabolic : bool
        At the edges of the flank: normals from one-sided parabolas instead of the paper's plain average over the
        concurrent elements, which is one-sided there and wrong by half an element's turn.
    mirrored : bool
        The last column lies in a plane of symmetry z = const, behind which the flank goes on: each contact point stands
        for its mirror image too.
    penalty : float
        N/mm^3.
    foot_step : float
        Last step to the foot of a point, in elements.
    pinion_share : float
        Share of the penalty with which the pinion is the slave; negative: the gear whose tip is nearer is.
    gauss_points, gauss_weights : ndarray
        On [-1, 1], for strips.
    """

    kind: int
    lodm_profile: int
    lodm_width: int
    smooth: bool
    direct: bool
    parabolic: bool
    mirrored: bool
    penalty: float
    foot_step: float
    pinion_share: float
    gauss_points: FloatArray
    gauss_weights: FloatArray


class Pair(NamedTuple):
    """A gear pair as the kernels see it."""

    kinematics: Kinematics
    gears: tuple[Gear, Gear]
    scheme: Scheme


class Reach(NamedTuple):
    """The tooth pairs in reach at a pinion angle, and their windows.

    Attributes
    ----------
    phi : float
        Pinion angle, rad.
    pairs : int
        How many there are; rows behind them are not used.
    tooth_pair : ndarray of int, shape (P,)
        Their indices, ascending.
    windows : ndarray of int, shape (P, 2, 7)
        Of pinion and wheel.
    centre : ndarray, shape (P, 2)
        Kinematic contact in element rows of the flank.
    clear : float
        Gap beyond which a row of points and those behind it cannot touch, mm.
    """

    phi: float
    pairs: int
    tooth_pair: IntArray
    windows: IntArray
    centre: FloatArray
    clear: float


class Motion(NamedTuple):
    """Rigid motion from one tooth's frame into its mate's: ``x_mate = rotation x + shift``.

    `shift` is a point of the own gear's axis in the mate's frame, mm, ``rotation[:, 2]`` that axis' direction.
    """

    rotation: FloatArray
    shift: FloatArray


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
    """Room for the foot of the perpendicular from a point on a surface.

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


class Points(NamedTuple):
    """Contact points: those that penetrate, or nearly do.

    Attributes
    ----------
    pair : ndarray of int, shape (n,)
        Number of the tooth pair among those in reach.
    slave : ndarray of int, shape (n,)
        Gear whose point it is.
    node : ndarray of int, shape (n, 8)
        Window nodes that carry the point: four of the slave, four of the master.
    weight : ndarray, shape (n, 8, 3)
        Gradient of the gap by the displacements of these nodes.
    gap : ndarray, shape (n,)
        mm.
    stiffness : ndarray, shape (n,)
        N/mm.
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


class SearchRoom(NamedTuple):
    """Room for a search: the points that it lists, the feet that it remembers, and what it needs on the way."""

    points: Points
    feet: Feet
    forward: Motion
    back: Motion
    carriers: Carriers


class Found(NamedTuple):
    """What a search says beside the points.

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
    """Shapes of a gear that belong to its flank lines (`pmor.reduction.flank_lines.GearLines`).

    Attributes
    ----------
    start : ndarray of int, shape (lines + 1,)
    displacement : ndarray, shape (2 reach + 1, m, f)
    gram : ndarray, shape (2 reach + 1, m, m)
    """

    start: IntArray
    displacement: FloatArray
    gram: FloatArray


class PositionShapes(NamedTuple):
    """Shapes of a pair at roll positions (`pmor.reduction.contact_shapes.ContactShapes`).

    Attributes
    ----------
    first, step : float
        Grid of roll positions, rad.
    loaded : ndarray of bool, shape (M, T)
    displacement : ndarray, shape (M, T, 2, 2 reach + 1, f)
    gram : ndarray, shape (reach + 1, M, S, S, T, T)
    turn : ndarray, shape (M - 1, T, T)
    angle : ndarray, shape (M - 1, T)
        Of `pmor.reduction.grassmann.Geodesics`; both empty where each member is interpolated by itself.
    """

    first: float
    step: float
    loaded: BoolArray
    displacement: FloatArray
    gram: FloatArray
    turn: FloatArray
    angle: FloatArray


class Family(NamedTuple):
    """The shapes of a reduced pair: of one family, the arrays of the other one are empty.

    Attributes
    ----------
    by_line : bool
        Which of the two. A member of lines belongs to one gear, one of positions to both.
    lines : two GearLines
        Of pinion and wheel.
    positions : PositionShapes
    beside : int
        How many lines beside the elements of a window have members too: 0 or 1.
    """

    by_line: bool
    lines: tuple[GearLines, GearLines]
    positions: PositionShapes
    beside: int


class Members(NamedTuple):
    """The shapes in reach at a position, whose amplitudes are the unknowns.

    Attributes
    ----------
    size : int
        How many there are.
    slot : ndarray of int, shape (size or more,)
        Tooth pair (its number in reach) times the shapes that a pair can have at all, plus the shape.
    ranges : ndarray of int, shape (2, 2)
        For each gear the first and the last but one member that moves it.
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
    """Room for the solution of one position.

    Attributes
    ----------
    undeformed, nodes : ndarray, shape (nodes, 3)
        Window nodes, mm; for exact flanks zero and the displacements alone, which small loads would lose among the
        digits of the coordinates.
    slope : ndarray, shape (points, members)
        Derivatives of the gaps by the members' amplitudes.
    free_gap : ndarray, shape (points,)
        Gaps without elastic deformation, mm.
    active : ndarray of bool, shape (points,)
        Whether a point carries load in the linearised problem.
    target, difference, solution, trial, rhs : ndarray, shape (members + 1,)
    matrix, factor : ndarray, shape (members + 1, members + 1)
    room : SearchRoom
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
    room: SearchRoom


class Position(NamedTuple):
    """All that one pinion angle needs."""

    reach: Reach
    members: Members
    work: Work


class Drive(NamedTuple):
    """What holds the pinion.

    Attributes
    ----------
    torque : float
        N mm; 0 where its lead is given instead.
    approach : float
        Approach of the flanks to expect, mm.
    held : bool
        Whether the lead is given.
    """

    torque: float
    approach: float
    held: bool
