"""Contact shapes split by flank line: one shape for each line of flank nodes, not for each trained position.

A flank line is a row of flank nodes of equal roll angle. Contact runs over the lines one after the other. The set of
loaded lines and their loads change quickly with the roll position; the distribution of a line's load over the face
width hardly changes. So the training gives each line its load distribution (the leading singular vectors of its forces
over all trained positions and torques), and online each active line has its own amplitude. Nothing is interpolated over
the angle, and the local dent moves with the contact as finely as the mesh allows. Shapes that belong to roll positions
must instead be interpolated between dents at different places, which fails as soon as the contact passes more than
about one element between two trained positions.

Related: static mode switching (Tamarozzi, Heirman & Desmet, CMAME 268 (2014) 336), whose unit-force modes these are,
gathered over the width.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.core.errors import ConvergenceError
from pmor.penalty.kernels import state
from pmor.penalty.kernels.state import Family, PositionShapes

if TYPE_CHECKING:
    from pmor.body.elastic_gear import ElasticGear

# Load of a line over that of the most loaded one, below which it takes its distribution from its neighbour.
LEAST_LOAD = 0.1


@dataclass(frozen=True)
class GearLines:
    """Shapes of one gear: m of them, lines from the start of the involute to the tip, f flank unknowns per tooth.

    Parameters
    ----------
    start : ndarray of int, shape (lines + 1,)
        The shapes of line i are ``start[i]`` to ``start[i + 1]``.
    force : ndarray, shape (m, f)
        Nodal forces on the flank in the tooth's frame, of norm 1 N over the whole width.
    displacement : ndarray, shape (2 neighbours + 1, m, f)
        Displacement of the teeth around, counted counter-clockwise from the loaded one, mm.
    gram : ndarray, shape (2 neighbours + 1, m, m)
        ``gram[neighbours + k, i, j]``: work of force i, acting on tooth k, on the displacement that shape j, acting on
        tooth 0, causes there, N mm.
    """

    start: IntArray
    force: FloatArray
    displacement: FloatArray
    gram: FloatArray


@dataclass(frozen=True)
class FlankLineShapes:
    """Line shapes of a gear pair.

    Parameters
    ----------
    gears : two GearLines
        Pinion and wheel.
    """

    gears: tuple[GearLines, GearLines]

    @property
    def neighbours(self) -> int:
        """Neighbouring teeth covered on either side."""
        return (self.gears[0].displacement.shape[0] - 1) // 2

    @cached_property
    def family(self) -> Family:
        """The shapes for the kernels."""
        pinion, wheel = (state.GearLines(gear.start, gear.displacement, gear.gram) for gear in self.gears)
        none = np.zeros((0, 0), dtype=bool), np.empty((0, 0, 2, 1, 0)), np.empty((0, 0, 2, 2, 0, 0))
        return Family(True, (pinion, wheel), PositionShapes(0.0, 1.0, *none))


def flank_line_shapes(
    bodies: tuple[ElasticGear, ElasticGear], force: FloatArray, flank_nodes: tuple[FloatArray, FloatArray],
    tolerance: float,
) -> FlankLineShapes:  # fmt: skip
    """Build the shapes from the force fields of the training.

    Parameters
    ----------
    bodies, flank_nodes
        As in `pmor.reduction.build.build_shapes`.
    force : ndarray, shape (..., 2, f)
        Nodal forces of full FE on the flanks of pinion and wheel, each in its tooth's frame, N; those on a node and on
        its image together.
    tolerance : float
        A further distribution of a line is kept when it carries more than this share of the first one's forces.
        Measured on the paper's pair with parallel axes: the second carries 1-3 %, and without it the STE misses full FE
        by 0.01 %.

    Raises
    ------
    ConvergenceError
        When no training state loads a flank.
    """
    lines = []
    for gear, body in enumerate(bodies):
        fields = force[..., gear, :].reshape(-1, force.shape[-1])
        lines.append(gear_lines(body, *_distributions(fields, flank_nodes[gear], tolerance, body.mesh.images)))
    return FlankLineShapes((lines[0], lines[1]))


def gear_lines(body: ElasticGear, start: IntArray, force: FloatArray) -> GearLines:
    """Add displacements and energy products to force fields on the lines of a gear, shape (m, f)."""
    offsets = range(-body.neighbours, body.neighbours + 1)
    displacement = np.stack([force @ body.tooth_compliance(k).T for k in offsets])
    return GearLines(start, force, displacement, force @ displacement.transpose(0, 2, 1))


def _distributions(
    fields: FloatArray, nodes: FloatArray, tolerance: float, images: FloatArray
) -> tuple[IntArray, FloatArray]:
    """Load distributions of all lines of a gear, shape (m, f), and where those of each line start."""
    count, columns = nodes.shape[:2]
    # Norms and products over the whole width: a force on several images is shared by them.
    weight = np.repeat(1.0 / np.sqrt(images), 3)
    by_line = fields.reshape(len(fields), count, 3 * columns) * weight
    load = np.linalg.norm(by_line, axis=(0, 2))
    # A line that the training hardly touched shows no distribution worth keeping.
    loaded = np.flatnonzero(load > LEAST_LOAD * load.max(initial=0.0))
    if not len(loaded):
        raise ConvergenceError("no training state loads a flank: there is nothing to make shapes from", [])
    own = {}
    for line in map(int, loaded):
        _, values, vectors = np.linalg.svd(by_line[:, line], full_matrices=False)
        kept = vectors[values > tolerance * values[0]]
        # Along the forces they come from: amplitudes of neighbouring lines can then be compared.
        own[line] = kept * np.where(kept @ by_line[:, line].sum(axis=0) < 0.0, -1.0, 1.0)[:, None]
    direction = _profile_direction(nodes)
    start, shapes = [0], []
    for line in range(count):
        nearest = int(loaded[np.argmin(np.abs(loaded - line))])
        turned = _turn(own[nearest], direction[line] - direction[nearest])
        field = np.zeros((len(turned), count, 3 * columns))
        field[:, line] = turned / weight
        shapes.append(field.reshape(len(turned), -1))
        start.append(start[-1] + len(turned))
    return np.array(start), np.concatenate(shapes)


def _profile_direction(nodes: FloatArray) -> FloatArray:
    """Direction of the profile at each line, rad: by how much forces along the normal turn from line to line."""
    tangent = np.gradient(nodes[:, nodes.shape[1] // 2, :2], axis=0)
    return np.asarray(np.arctan2(tangent[:, 1], tangent[:, 0]))


def _turn(fields: FloatArray, angle: float) -> FloatArray:
    """Turn the vectors of fields, shape (m, 3 columns), about the gear's axis."""
    vectors, turned = fields.reshape(len(fields), -1, 3), np.empty((len(fields), fields.shape[1] // 3, 3))
    c, s = np.cos(angle), np.sin(angle)
    turned[..., 0] = c * vectors[..., 0] - s * vectors[..., 1]
    turned[..., 1] = s * vectors[..., 0] + c * vectors[..., 1]
    turned[..., 2] = vectors[..., 2]
    return turned.reshape(fields.shape)
