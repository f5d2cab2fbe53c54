"""A pair for the kernels of penalty contact: named tuples of arrays and scalars, array columns by name.

P is the number of tooth pairs that can touch together.

The part of a flank that can touch is a *window*: a grid of nodes (rows, columns), rows from the root towards the tip,
columns along +z. Beside the rows of its elements a window holds one neighbouring row on either side where the flank has
one, because node normals are averaged over the elements around a node. A window is an array of integers, shape (7,).
"""

from __future__ import annotations

from typing import NamedTuple

from pmor.core.arrays import FloatArray, IntArray
from pmor.gear.kernels.deviation import Deviation
from pmor.gear.kernels.types import Gear, Kinematics

# A window: number of its first node among the nodes of all windows; rows of nodes; number of its first element row,
# counted in the window; rows of elements; whether the first element row is the first of the flank, and the last the
# last one; number of its first element row, counted on the flank.
OFFSET, NODE_ROWS, FIRST, ELEMENT_ROWS, AT_ROOT, AT_TIP, FIRST_ROW = range(7)

# Half distances from a contact point to its neighbours.
TO_ROOT, TO_TIP, TO_LOW_Z, TO_HIGH_Z = range(4)


class NodalScheme(NamedTuple):
    """Contact of refined surface points under the penalty law.

    Attributes
    ----------
    mirrored : bool
        The last column lies in a plane of symmetry z = const, behind which the flank goes on: each contact point stands
        for its mirror image too.
    penalty : float
        N/mm^3.
    pinion_share : float
        Share of the penalty with which the pinion is the slave; negative: the gear whose tip is nearer is.
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

    mirrored: bool
    penalty: float
    pinion_share: float
    lodm_profile: int
    lodm_width: int
    smooth: bool
    direct: bool
    parabolic: bool
    foot_step: float


class WindowLimits(NamedTuple):
    """Limits of windows, beside the depth.

    Attributes
    ----------
    least_radius : float
        Bottom of the radii of curvature, mm.
    local_share : float
        Share of the approach by which flanks interpenetrate where they meet.
    row_spacing : float
        Largest distance between rows of contact points, mm.
    """

    least_radius: float
    local_share: float
    row_spacing: float


class Pair(NamedTuple):
    """A gear pair as the kernels of penalty contact see it.

    Attributes
    ----------
    extents : two ndarrays, shape (rows, columns of contact points, 4)
        Half distances of each point to its neighbours along and across the profile (`TO_ROOT` ...), mm; their products
        are its share of area.
    deviations : two Deviation
        Of the flanks of pinion and wheel from `gears`.
    """

    kinematics: Kinematics
    gears: tuple[Gear, Gear]
    extents: tuple[FloatArray, FloatArray]
    limits: WindowLimits
    scheme: NodalScheme
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
