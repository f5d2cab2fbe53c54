"""What the kernels know of a pair: named tuples of arrays and scalars, and columns of arrays by name.

Lengths are in mm, angles in rad, forces in N. Gears are numbered 0 (pinion) and 1 (wheel), everywhere. P is the number
of tooth pairs that can touch together.

The part of a flank that can touch is a *window*: a grid of nodes (rows, columns), rows from the root towards the tip,
columns along +z. Beside the rows of its elements a window holds one neighbouring row on either side where the flank has
one, because node normals are averaged over the elements around a node. A window is an array of integers, shape (7,).
"""

from __future__ import annotations

from typing import NamedTuple

from pmor.core.arrays import FloatArray, IntArray
from pmor.gear.kernels.deviation import Deviation
from pmor.line.kernels.tip_corner import Corner

# A window: number of its first node among the nodes of all windows; rows of nodes; number of its first element row,
# counted in the window; rows of elements; whether the first element row is the first of the flank, and the last the
# last one; number of its first element row, counted on the flank.
OFFSET, NODE_ROWS, FIRST, ELEMENT_ROWS, AT_ROOT, AT_TIP, FIRST_ROW = range(7)

# Half distances from a contact point to its neighbours.
TO_ROOT, TO_TIP, TO_LOW_Z, TO_HIGH_Z = range(4)


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
        First and last roll position of the path of contact, in each section of the face width by itself, rad.
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
        advance counts, rad.
    face_low, face_high : float
        First and last z at which both gears have teeth, mm.
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
    face_low: float = 0.0
    face_high: float = 0.0


class Gear(NamedTuple):
    """Loaded flank of a gear, undeformed, in its tooth's frame.

    Attributes
    ----------
    nodes : ndarray, shape (n + 1, m + 1, 3)
        From the start of the involute to the tip, along +z, mm.
    roll : ndarray, shape (n + 1,)
        Roll angles of the rows of nodes, rad.
    extents : ndarray, shape (rows, columns of contact points, 4)
        Half distances of each point to its neighbours along and across the profile (`TO_ROOT` ...), mm; their products
        are its share of area.
    base_radius : float
        mm.
    form_roll, tip_roll : float
        Roll angles at the form circle and where the flank ends towards the tip, rad.
    half_angle : float
        Half the tooth's angle on the base circle, rad.
    line_compliance : float
        Of the closed form of line contact, mm^2/N.
    line_constant : ndarray, shape (n + 1,)
        Its constant at each row of nodes; empty for other schemes.
    twist : float
        Rotation of the transverse section per length along +z, rad/mm; 0 for spur gears, of opposite signs on the two
        gears of a helical pair.
    edge_radius : float
        Of the rounded edge behind the flank's end, mm; 0 for a sharp one.
    corner : Corner
        Where the layer of line contact ends.
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
    twist: float
    edge_radius: float
    corner: Corner


class LineScheme(NamedTuple):
    """Contact as one line load for each section.

    Each scheme has a type of its own, so that only its own kernels are compiled.

    Attributes
    ----------
    exact : bool
        The flanks are involutes, not surfaces through nodes: true.
    mirrored : bool
        The last column lies in a plane of symmetry z = const, behind which the flank goes on: each contact point stands
        for its mirror image too.
    """

    exact: bool
    mirrored: bool


class StripScheme(NamedTuple):
    """Contact as penalty pressure over the strips in which exact flanks overlap.

    Attributes
    ----------
    exact, mirrored : bool
        See `LineScheme`.
    penalty : float
        N/mm^3.
    pinion_share : float
        Share of the penalty with which the pinion is the slave; negative: the gear whose tip is nearer is.
    gauss_points, gauss_weights : ndarray
        On [-1, 1].
    """

    exact: bool
    mirrored: bool
    penalty: float
    pinion_share: float
    gauss_points: FloatArray
    gauss_weights: FloatArray


class NodalScheme(NamedTuple):
    """Contact of refined surface points under the penalty law.

    Attributes
    ----------
    exact : bool
        False.
    mirrored, penalty, pinion_share
        See `StripScheme`.
    lodm_profile, lodm_width : int
        Subdivisions of an element along the profile and the width.
    smooth : bool
        Ferguson patches, else bilinear facets.
    direct : bool
        Project on the master's patches themselves; else on bilinear facets through its refined points (the paper).
    parabolic : bool
        At the edges of the flank: normals from one-sided parabolas instead of the paper's plain average over the
        concurrent elements, which is one-sided there and wrong by half an element's turn.
    foot_step : float
        Last step to the foot of a point, in elements.
    """

    exact: bool
    mirrored: bool
    penalty: float
    pinion_share: float
    lodm_profile: int
    lodm_width: int
    smooth: bool
    direct: bool
    parabolic: bool
    foot_step: float


class Sections(NamedTuple):
    """The transverse sections in which line contact is evaluated, S of them, and what carries them (C columns each).

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


class Pair(NamedTuple):
    """A gear pair as the kernels see it.

    Attributes
    ----------
    kinematics : Kinematics
    gears : two Gear
        Their flanks are the involute helicoids that the nodes lie on.
    scheme : LineScheme, StripScheme or NodalScheme
    sections : Sections or None
        None for the nodal scheme.
    deviations : two Deviation
        Of the flanks of pinion and wheel from `gears`.
    """

    kinematics: Kinematics
    gears: tuple[Gear, Gear]
    scheme: LineScheme | StripScheme | NodalScheme
    sections: Sections | None
    deviations: tuple[Deviation, Deviation]


class ActivePatches(NamedTuple):
    """The tooth pairs that can touch at a pinion angle, and their windows.

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
        Kinematic contact in element rows of the flank; of helical pairs in the middle of the active sections.
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
