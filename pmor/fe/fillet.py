"""A fine mesh of the material around one root fillet, for the notch stress: the mesh of the sector is too coarse there.

Elements run along the outline, from a little above the start of the involute down to the middle of the tooth space, and
grow with the depth below it. Its cut follows the sector's mesh (`pmor.body.fillet_stress`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.fe.element import QUADRATIC_NODES, node_places
from pmor.fe.sector import SectorMesh
from pmor.gear.tooth import Tooth, angle_from_centre_line, twist_sections

# Length of elements along the fillet in modules, at most and at least, and by how much it turns over one of them, rad.
# *Measured*, paper's pair: the largest stress is within 0.1 % of that with elements of a quarter of this length.
ALONG, SHORTEST, TURN = 0.12, 0.05, 0.2
# Depth of the first elements over their length, and how depth and length grow away from the fillet.
FIRST_DEPTH, GROWTH_DEPTH, GROWTH_ALONG = 1.25, 2.0, 0.3
# Depth of the cut in modules, and how far above the start of the involute it begins: there the sector's mesh is good.
CUT_DEPTH = 0.6
ABOVE = 0.25
# Columns of nodes up to which the stress is known at all of them; of more, at those on the borders of elements.
MOST_COLUMNS = 9
# Of the rim, and of half the tooth's thickness at the start of the involute, if that is less.
DEEPEST = 0.6


@dataclass(frozen=True)
class FilletMesh:
    """Quadratic hexahedra around the loaded flank's root fillet.

    Parameters
    ----------
    section : ndarray, shape (rows, columns, 2)
        Nodes of the section z = 0: from the surface inwards, along the outline from flank to tooth space, mm.
    z : ndarray, shape (layers,)
        Of the nodes, mm; those between elements belong to a column of the sector's nodes.
    nodes : ndarray, shape (rows * columns * layers, 3)
        mm.
    elements : ndarray of int, shape (n, 20)
    first : int
        Column of `section` at the start of the involute.
    """

    section: FloatArray
    z: FloatArray
    nodes: FloatArray
    elements: IntArray
    first: int

    @property
    def numbers(self) -> IntArray:
        """Number of each node of the grid, shape (rows, columns, layers)."""
        return np.arange(len(self.nodes)).reshape(*self.section.shape[:2], len(self.z))

    @property
    def places(self) -> IntArray:
        """Row, column and layer of each element, shape (n, 3)."""
        rows, columns = ((count - 1) // 2 for count in self.section.shape[:2])
        grid = np.indices((rows, columns, (len(self.z) - 1) // 2))
        return np.asarray(grid.reshape(3, -1).T)

    @property
    def columns(self) -> IntArray:
        """Places in `z` of the columns at which the stress is asked for."""
        return np.arange(0, len(self.z), 1 if len(self.z) <= MOST_COLUMNS else 2)


def build_fillet(tooth: Tooth, sector: SectorMesh) -> FilletMesh:
    """Mesh the material around the loaded flank's root fillet, on the columns of a sector."""
    module = tooth.module
    outline, arc, start, end = _outline(tooth)
    places, first, shortest = _along(outline, arc, start, end, module)
    points = np.stack([np.interp(places, arc, outline[:, d]) for d in range(2)], axis=-1)
    inward = np.interp(places, arc, _inward(outline, start, end, tooth))
    rim = abs(abs(tooth.root_radius) - float(np.linalg.norm(sector.nodes[sector.bore[0], :2])))
    thickness = abs(float(np.interp(start, arc, outline[:, 0])))
    deepest = min(CUT_DEPTH * module, DEEPEST * rim, DEEPEST * thickness)
    depth = _depths(deepest, FIRST_DEPTH * shortest)
    direction = np.stack([np.cos(inward), np.sin(inward)], axis=-1)
    section = points + depth[:, None, None] * direction
    z = sector.z if sector.order == 2 else _with_middles(sector.z)
    layers = len(z)
    nodes = twist_sections(section.reshape(-1, 1, 2), z[None], tooth.twist_per_length).reshape(-1, 3)
    numbers = np.arange(len(nodes)).reshape(*section.shape[:2], layers)
    windows = np.lib.stride_tricks.sliding_window_view(numbers, (3, 3, 3))[::2, ::2, ::2]
    column, row, layer = node_places(2)[:QUADRATIC_NODES].T
    elements = windows[..., row, column, layer].reshape(-1, QUADRATIC_NODES)
    return FilletMesh(section, z, nodes, elements, first)


def _outline(tooth: Tooth) -> tuple[FloatArray, FloatArray, float, float]:
    """Outline from above the fillet to the middle of the tooth space, its arc length, and that of the fillet's ends."""
    lowest, base = tooth.form_roll_angle, tooth.base_radius
    highest = math.sqrt(lowest**2 + 2.0 * ABOVE * tooth.module / base)
    flank = tooth.flank_section(np.linspace(highest, lowest, 200))
    fillet = tooth.root_section(np.linspace(0.0, 1.0, 2001))
    angles = np.linspace(angle_from_centre_line(fillet[-1], tooth.root_radius), math.pi / tooth.teeth, 100)
    land = tooth.root_radius * np.stack([-np.sin(angles), np.cos(angles)], axis=-1)
    outline = np.concatenate([flank[:-1], fillet, land[1:]])
    arc = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(outline, axis=0), axis=1)))
    return outline, arc, float(arc[len(flank) - 1]), float(arc[len(flank) + len(fillet) - 2])


def _along(
    outline: FloatArray, arc: FloatArray, start: float, end: float, module: float
) -> tuple[FloatArray, int, float]:
    """Arc lengths of the nodes along the outline, mm; which is at the start of the involute; the shortest element."""
    above = 2 * max(1, round(0.5 * ABOVE / ALONG))
    inside = (arc >= start) & (arc <= end)
    tangent = np.gradient(outline[inside], arc[inside], axis=0)
    turning = np.abs(np.gradient(np.unwrap(np.arctan2(tangent[:, 1], tangent[:, 0])), arc[inside]))
    density = np.clip(turning / TURN, 1.0 / (ALONG * module), 1.0 / (SHORTEST * module))
    steps = 0.5 * (density[1:] + density[:-1]) * np.diff(arc[inside])
    count = np.append(0.0, np.cumsum(steps))
    elements = max(4, math.ceil(count[-1]))
    ends = np.interp(np.linspace(0.0, count[-1], elements + 1), count, arc[inside])
    parts = [np.linspace(0.0, start, above + 1)[:-1], _with_middles(ends)]
    last, rest = float(ends[-1] - ends[-2]), float(arc[-1]) - end
    if rest > 1e-6 * module:
        number = max(1, math.ceil(math.log1p(GROWTH_ALONG * rest / last) / math.log1p(GROWTH_ALONG)))
        lengths = (1.0 + GROWTH_ALONG) ** np.arange(number)
        parts.append(_with_middles(end + rest * np.append(0.0, np.cumsum(lengths)) / lengths.sum())[1:])
    return np.concatenate(parts), above, float(np.diff(ends).min())


def _inward(outline: FloatArray, start: float, end: float, tooth: Tooth) -> FloatArray:
    """Direction in which the depth is measured, at each point of an outline, rad.

    Normal to the fillet. Normals of the involute would meet below it: there it is that of the fillet's beginning.
    """
    tangent = np.gradient(outline, axis=0)
    normal = np.unwrap(np.arctan2(tangent[:, 0], -tangent[:, 1]))
    arc = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(outline, axis=0), axis=1)))
    side = math.copysign(1.0, tooth.root_radius)
    radial = np.arctan2(-side * outline[:, 1], -side * outline[:, 0])
    inside, beyond = (arc >= start) & (arc < end), arc >= end
    first = normal[np.argmax(inside)]
    normal[~inside] = first
    normal = np.minimum.accumulate(normal)
    return np.where(beyond, radial, np.maximum(normal, radial[np.argmax(beyond)]))


def _depths(deepest: float, first: float) -> FloatArray:
    count = max(2, math.ceil(math.log(1.0 + (GROWTH_DEPTH - 1.0) * deepest / first) / math.log(GROWTH_DEPTH)))
    steps = GROWTH_DEPTH ** np.arange(count)
    return _with_middles(deepest * np.append(0.0, np.cumsum(steps)) / steps.sum())


def _with_middles(ends: FloatArray) -> FloatArray:
    both = np.stack([ends[:-1], 0.5 * (ends[1:] + ends[:-1])], axis=1).ravel()
    return np.append(both, ends[-1])
