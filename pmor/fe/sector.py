r"""Structured hexahedral mesh of one tooth sector, conforming to its neighbours.

Two blocks in the transverse section, extruded along the (twisted) face width::

        tip
      +------+          tooth block: rows from the handover line in the fillet up to the tip,
      |      |          columns from the loaded flank across to the other one
      |      |
    __+------+__        ring block: columns from the counter-clockwise side face across to the clockwise one,
    \\          /        rows from the outline down to the bore
     \\________/
        bore
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.core.errors import MeshError
from pmor.core.roots_and_minima import root
from pmor.fe.element import QUADRATIC_NODES, node_places
from pmor.fe.outline import Outline, tooth_outline
from pmor.gear.tooth import Tooth, angle_from_centre_line, twist_sections

THICKNESS_GROWTH = 1.2
RIM_GROWTH = 1.3
# Logarithm of the ratio of the two radii of a row of elements, at most, times the elements over the profile, of which
# `MOST_COUNTED` count. Towards a bore displacements go like log r and 1 / r^n: rows that grow with their distance from
# the teeth alone do not see that. *Measured*, 18 and 72 teeth in plane strain, 8 quadratic elements, bores of 0.1 to
# 0.9 of the root circles: the STE is 0.03 % low at most, and was 3.2 % low.
RADII_OF_A_ROW, MOST_COUNTED = 3.2, 16
# Depth below the flank, in modules, where every mesh has a line of nodes, so that the layer that line contact takes out
# is as deep on all of them: else its depth jumps between meshes, and the STE at single angles by 0.1 % with it.
LAYER_DEPTH = 0.4
# Of half the tooth's thickness: in thin teeth the line stays this far out.
DEEPEST_LAYER = 0.6


@dataclass(frozen=True)
class SectorMesh:
    """One tooth sector.

    Parameters
    ----------
    nodes : ndarray, shape (n_nodes, 3)
        In the tooth frame, mm.
    elements : ndarray of int, shape (n_elements, 8) or (n_elements, 27)
        Hexahedra in the usual order (four nodes at the lower z, counter-clockwise, then the four above them). Quadratic
        ones go on as in `pmor.fe.element`, with the nodes in the middle of faces, that are not theirs, at the end.
    flank : ndarray of int, shape (n + 1, m + 1)
        Nodes of the loaded flank: from the start of the involute to the tip, along the face width.
    flank_roll_angle : ndarray, shape (n + 1,)
        rad.
    z : ndarray, shape (m + 1,)
        Axial node positions, mm, 0 in the middle of the pair.
    left, right : ndarray of int, shape (n_side,)
        Nodes of the counter-clockwise and clockwise side face without the bore; partners share an index.
    bore : ndarray of int, shape (n_bore,)
        Nodes on the bore.
    tooth_rows : tuple of ndarray of int
        All nodes of each row of the tooth block, from the handover line (shared with the ring) to the tip.
    ring_rows : tuple of ndarray of int
        All nodes of each row of the ring block, from the outline to the bore.
    teeth : int
        Number of sectors in the gear.
    width : {"whole", "half", "plane_strain"}
        The whole face width; half of it, up to the plane of symmetry z = 0; or one layer of elements, whose nodes stay
        in their transverse planes.
    order : int
        Intervals between nodes along the edge of an element: 1 of linear elements, 2 of quadratic ones.
    twist_per_length : float
        By which sections are turned along the axis, rad/mm.
    on_blank : bool
        The nodes on the bore are not held but stand on a blank: the bore is a cylinder within the rim.
    """

    nodes: FloatArray
    elements: IntArray
    flank: IntArray
    flank_roll_angle: FloatArray
    z: FloatArray
    left: IntArray
    right: IntArray
    bore: IntArray
    tooth_rows: tuple[IntArray, ...]
    ring_rows: tuple[IntArray, ...]
    teeth: int
    width: str = "whole"
    order: int = 1
    twist_per_length: float = 0.0
    on_blank: bool = False

    @property
    def held(self) -> IntArray:
        """Nodes that do not move: those on the bore."""
        return self.bore[:0] if self.on_blank else self.bore

    @property
    def interface(self) -> IntArray:
        """Nodes that stand on a blank."""
        return self.bore if self.on_blank else self.bore[:0]

    @property
    def mirrored(self) -> bool:
        """Whether the mesh ends in a plane of symmetry at mid width: forces on it count twice."""
        return self.width == "half"

    def is_like(self, other: SectorMesh) -> bool:
        """Return whether another sector has the same nodes and elements."""
        return self is other or (
            (self.teeth, self.width) == (other.teeth, other.width)
            and np.array_equal(self.nodes, other.nodes)
            and np.array_equal(self.elements, other.elements)
        )

    @property
    def angular_pitch(self) -> float:
        """Angle from the right side face to the left one, rad; negative in an internal gear."""
        return math.copysign(2.0 * math.pi / self.teeth, self.nodes[self.flank[0, 0], 1])

    @property
    def images(self) -> FloatArray:
        """How many nodes of the whole width each column of nodes stands for, shape (m + 1,)."""
        images = np.full(len(self.z), 2.0 if self.mirrored else 1.0)
        images[-1] = 1.0
        return images

    @cached_property
    def middles(self) -> IntArray:
        """Nodes of the grid that no element has: in the middle of the faces of quadratic ones, and of these."""
        return np.unique(self.elements[:, QUADRATIC_NODES:])

    @property
    def held_axially(self) -> IntArray:
        """Degrees of freedom u_z that are zero: those in the plane of symmetry, and all of them in plane strain."""
        layers = len(self.z)
        first = {"whole": len(self.nodes), "half": layers - 1, "plane_strain": 0}[self.width]
        return 3 * np.arange(first, len(self.nodes), layers if self.mirrored else 1) + 2

    @property
    def flank_held_axially(self) -> np.ndarray:
        """Which unknowns of the flank, node by node and x y z, are among them, shape (3 (n + 1) (m + 1),)."""
        unknowns = 3 * self.flank.ravel()[:, None] + np.arange(3)
        return np.isin(unknowns.ravel(), self.held_axially)

    @property
    def back(self) -> IntArray:
        """Nodes of the other flank of the tooth, in the order of `flank`, shape (n + 1, m + 1)."""
        rows, layers = self.tooth_rows[-len(self.flank) :], len(self.z)
        return np.stack([row.reshape(-1, layers)[-1] for row in rows])

    @property
    def flank_nodes(self) -> FloatArray:
        """Coordinates of the flank nodes, shape (n + 1, m + 1, 3), mm."""
        return self.nodes[self.flank]


def build_sector(
    tooth: Tooth, bore_radius: float, face_width: float, profile_elements: int, width_elements: int,
    spacing: str = "roll_angle", width: str = "whole", offset: float = 0.0, order: int = 1,
) -> SectorMesh:  # fmt: skip
    """Mesh one tooth sector.

    Parameters
    ----------
    bore_radius, face_width : float
        mm.
    profile_elements, width_elements : int
        Elements along the flank (start of involute to tip) and over the whole face width.
    spacing : {"roll_angle", "arc_length"}
        Spacing of the flank nodes.
    width : {"whole", "half", "plane_strain"}
        How much of the face width is meshed (`SectorMesh`); half takes an even number of elements over the width, plane
        strain is one whatever their number.
    offset : float
        Middle of the face along z, mm; half a width takes none.
    order : int
        1 for linear elements, 2 for quadratic ones.

    Raises
    ------
    MeshError
        When the bore leaves no rim, or an element is turned inside out.
    """
    outline = tooth_outline(tooth, profile_elements, spacing, order)
    radius = np.copysign(np.linalg.norm(outline.lower_fillet, axis=1), tooth.root_radius)
    rim = float(radius.min()) - bore_radius
    if rim <= 0.0:
        raise MeshError(f"bore_radius_mm = {bore_radius:g}: leaves no rim below the root; reduce it")
    tooth_points = tooth_block(outline, tooth.module, order)
    ring_points = _ring_block(outline, tooth_points[0], bore_radius, tooth.teeth, order, widest_row(profile_elements))

    # Section numbering: tooth block first, then the ring without the handover row that it shares with the tooth.
    rows, columns = tooth_points.shape[0], tooth_points.shape[1]
    tooth_id = np.arange(rows * columns).reshape(rows, columns)
    first = len(outline.lower_fillet) - 1
    shared = np.zeros(ring_points.shape[:2], dtype=bool)
    shared[0, first : first + columns] = True
    ring_id = np.empty(ring_points.shape[:2], dtype=np.int64)
    ring_id[~shared] = rows * columns + np.arange(np.count_nonzero(~shared))
    ring_id[shared] = tooth_id[0]
    section = np.concatenate([tooth_points.reshape(-1, 2), ring_points[~shared]])
    cells = np.concatenate([_cells(tooth_id, order), _cells(ring_id[::-1], order)])

    across = order * (1 if width == "plane_strain" else width_elements)
    z = np.linspace(offset - 0.5 * face_width, offset + 0.5 * face_width, across + 1)
    if width == "half":
        z = z[: across // 2 + 1]
    layers = len(z)
    nodes = twist_sections(section[:, None, :], z[None, :], tooth.twist_per_length).reshape(-1, 3)
    through = np.arange(0, layers - 1, order)[:, None] + np.arange(order + 1)
    grid = cells[:, None, :, :, None] * layers + through[None, :, None, None, :]
    column, row, layer = node_places(order).T
    elements = grid[:, :, row, column, layer].reshape(-1, len(row))

    def through_width(section_ids: IntArray) -> IntArray:
        return (np.asarray(section_ids)[..., None] * layers + np.arange(layers)).astype(np.int64)

    return SectorMesh(
        nodes=nodes, elements=elements, flank=through_width(tooth_id[-order * profile_elements - 1 :, 0]),
        flank_roll_angle=outline.flank_roll_angle, z=z, left=through_width(ring_id[:-1, 0]).ravel(),
        right=through_width(ring_id[:-1, -1]).ravel(), bore=through_width(ring_id[-1]).ravel(),
        tooth_rows=tuple(through_width(row).ravel() for row in tooth_id),
        ring_rows=tuple(through_width(row).ravel() for row in ring_id), teeth=abs(tooth.teeth), width=width,
        order=order, twist_per_length=tooth.twist_per_length,
    )  # fmt: skip


def tooth_block(outline: Outline, module: float, order: int = 1) -> FloatArray:
    """Fill a tooth's section: transfinite interpolation between the two flanks, the tip land and the handover line.

    Parameters
    ----------
    module : float
        mm.
    order : int
        Intervals between nodes along the edge of an element.

    Returns
    -------
    ndarray, shape (rows, columns, 2)
        Rows from the handover line to the tip, columns from the loaded flank to the other one, mm.
    """
    left = np.concatenate([outline.upper_fillet[:-1], outline.flank])
    mirror = np.array([-1.0, 1.0])
    right = left * mirror
    half_width = abs(outline.flank[len(outline.flank) // 2, 0])
    element = order * float(np.linalg.norm(outline.flank[-1] - outline.flank[0])) / (len(outline.flank) - 1)
    graded = 0.5 * _through_thickness(half_width, LAYER_DEPTH * module, element, THICKNESS_GROWTH**order)
    across = _halved(np.concatenate([graded, 1.0 - graded[-2::-1]]), order)

    tip_radius = np.copysign(np.linalg.norm(left[-1]), left[-1, 1])
    tip_angle = angle_from_centre_line(left[-1], tip_radius) * (1.0 - 2.0 * across)
    tip = tip_radius * np.stack([-np.sin(tip_angle), np.cos(tip_angle)], axis=-1)
    base = left[0] + across[:, None] * (right[0] - left[0])
    sag = 0.5 * abs(left[0, 0]) * math.tan(math.radians(15.0))
    base[:, 1] -= sag * (1.0 - (1.0 - 2.0 * across) ** 2)

    up = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(left, axis=0), axis=1))])
    up /= up[-1]
    s, t = across[None, :, None], up[:, None, None]
    sides = (1 - s) * left[:, None] + s * right[:, None]
    ends = (1 - t) * base[None] + t * tip[None]
    corners = (1 - s) * ((1 - t) * left[0] + t * left[-1]) + s * ((1 - t) * right[0] + t * right[-1])
    return sides + ends - corners


def widest_row(profile_elements: int) -> float:
    """Return the ratio of the two radii of a row of elements between teeth and bore, at most."""
    return math.exp(RADII_OF_A_ROW / min(profile_elements, MOST_COUNTED))


def _ring_block(
    outline: Outline, handover: FloatArray, bore_radius: float, teeth: int, order: int, widest: float
) -> FloatArray:
    """Columns that fan out evenly from the outline to the bore: (rows, columns, 2), from the outline inwards."""
    mirror = np.array([-1.0, 1.0])
    top = np.concatenate([outline.lower_fillet[:-1], handover, (outline.lower_fillet[:-1] * mirror)[::-1]])
    radius, angle = np.copysign(np.linalg.norm(top, axis=1), bore_radius), angle_from_centre_line(top, bore_radius)
    element = order * float(np.mean(np.linalg.norm(np.diff(top, axis=0), axis=1)))
    rows = _rows_to_bore(float(radius.mean()), bore_radius, element, 3 if order == 1 else 2, RIM_GROWTH**order, widest)
    depth = _halved(rows, order)[:, None]
    even = np.linspace(math.pi / teeth, -math.pi / teeth, len(top))
    row_radius = radius + depth * (bore_radius - radius)
    row_angle = angle + depth * (even - angle)
    return np.stack([-row_radius * np.sin(row_angle), row_radius * np.cos(row_angle)], axis=-1)


def _through_thickness(half_width: float, depth: float, first: float, growth: float) -> FloatArray:
    """Positions from 0 at the flank to 1 in the middle of the tooth, one of them at a depth."""
    depth = min(depth, DEEPEST_LAYER * half_width)
    layer = depth * _graded(depth, first, 1, growth)
    below = half_width - depth
    inside = below * _graded(below, growth * (layer[-1] - layer[-2]), 1, growth)
    return np.concatenate([layer, depth + inside[1:]]) / half_width


def _graded(length: float, first: float, least: int, growth: float) -> FloatArray:
    """Positions from 0 to 1 whose steps grow by a constant factor, from about `first` of `length` on."""
    elements = max(least, math.ceil(math.log(1.0 + (growth - 1.0) * length / first) / math.log(growth)))
    steps = growth ** np.arange(elements)
    return np.asarray(np.concatenate([[0.0], np.cumsum(steps)]) / np.sum(steps))


def _rows_to_bore(
    radius: float, bore_radius: float, first: float, least: int, growth: float, widest: float
) -> FloatArray:
    """Positions from 0 at a mean radius to 1 at the bore: steps grow as in `_graded`, to the widest row at most.

    Both radii are negative where the bore is the outside of a ring.
    """
    share = 1.0 - widest ** math.copysign(1.0, -radius)

    def depths(first: float, rows: int) -> FloatArray:
        positions = np.zeros(rows + 1)
        for row in range(rows):
            positions[row + 1] = positions[row] + min(first * growth**row, share * (radius - positions[row]))
        return positions

    height, rows = radius - bore_radius, least
    while depths(first, rows)[-1] < height:
        rows += 1
    first = root(lambda first: depths(first, rows)[-1] - height, 0.0, first)
    reached = depths(first, rows)
    return np.asarray(reached / reached[-1])


def _halved(positions: FloatArray, order: int) -> FloatArray:
    """Put the nodes inside elements evenly between their ends."""
    places = np.linspace(0.0, 1.0, order + 1)[:-1]
    return np.append((positions[:-1, None] + np.diff(positions)[:, None] * places).ravel(), positions[-1])


def _cells(grid: IntArray, order: int) -> IntArray:
    """Nodes of the elements of a grid whose rows go up (+y) and whose columns go right (+x): (n, row, column)."""
    windows = np.lib.stride_tricks.sliding_window_view(grid, (order + 1, order + 1))[::order, ::order]
    return np.ascontiguousarray(windows.reshape(-1, order + 1, order + 1))
