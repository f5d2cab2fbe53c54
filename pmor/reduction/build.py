"""The reduction that a case asks for.

| shapes | unknowns | use |
|---|---|---|
| `line_loads` | a line load for each section that carries | line contact: exact, without training |
| `flank_lines` | an amplitude for each active flank line | the other schemes |
| `positions` | one for each training torque and tooth pair | the paper's way |
| `pod` | one for each mode and tooth pair | many torques |
| `global_pod` | one for each mode and tooth pair | the known bad alternative |
| `static_modes` | two for each active flank node | next to exact, without training |

Static modes: shapes for the unit forces on each flank node, along the flank normal and along the profile.

The exact end of the scale of reductions (static mode switching: Tamarozzi, Heirman & Desmet, CMAME 268 (2014) 336):
every distribution of contact force over nodes is a sum of them, and only those of the active lines are
switched on. No snapshot is needed, hence no full solve offline. Normals alone would not do: a contact between two lines
loads both along its own normal. *Measured* on the paper's pair, STE against full FE: 0.01 % at most with normals alone
(flank lines: 0.005 %), 3e-8 with both directions.

When to use them: to measure the error of the other reductions without full FE; for loads or faults that no training
covers; for a handful of positions, where training does not pay. Online they cost the most unknowns: two for each active
node, where flank lines have one for each line.
"""

from __future__ import annotations

import numpy as np

from pmor.body.elastic_gear import ElasticGear
from pmor.case import Case
from pmor.core.arrays import FloatArray, IntArray
from pmor.reduction.contact_shapes import ContactShapes, contact_shapes, shapes_of
from pmor.reduction.flank_lines import FlankLineShapes, flank_line_shapes, gear_lines
from pmor.reduction.pod import global_modes, local_modes


def static_mode_shapes(
    bodies: tuple[ElasticGear, ElasticGear], flank_nodes: tuple[FloatArray, FloatArray]
) -> FlankLineShapes:
    """Build the unit-force shapes of pinion and wheel; arguments as in `pmor.reduction.build.build_shapes`."""
    pinion, wheel = (gear_lines(body, *_unit_forces(nodes)) for body, nodes in zip(bodies, flank_nodes, strict=True))
    return FlankLineShapes((pinion, wheel))


def _unit_forces(nodes: FloatArray) -> tuple[IntArray, FloatArray]:
    """First shape of each line, and forces along the flank normals and the profile, shape (m, f)."""
    lines, columns, _ = nodes.shape
    along, across = np.gradient(nodes, axis=(0, 1))
    directions = np.stack([np.cross(along, across), along], axis=2)
    directions /= np.linalg.norm(directions, axis=3, keepdims=True)
    force = np.zeros((lines, columns, 2, lines, columns, 3))
    for i, k in np.ndindex(lines, columns):
        force[i, k, :, i, k] = directions[i, k]
    fields = force.reshape(lines, columns, 2, -1)
    return 2 * fields.shape[1] * np.arange(lines + 1), fields.reshape(-1, fields.shape[3])


def build_shapes(
    case: Case, bodies: tuple[ElasticGear, ElasticGear], grid: FloatArray, force: FloatArray,
    flank_nodes: tuple[FloatArray, FloatArray],
) -> FlankLineShapes | ContactShapes | None:  # fmt: skip
    """Build the shapes that a case asks for; line loads have none.

    Parameters
    ----------
    bodies : two ElasticGear
        Pinion and wheel.
    grid : ndarray, shape (M,)
        Roll positions of the training, rad.
    force : ndarray, shape (M, T, 2, f)
        Nodal forces of full FE over roll positions and training states, N; zero where the pair is idle. Static modes
        do not look at it.
    flank_nodes : two ndarrays, shape (lines, columns, 3)
        mm.

    Raises
    ------
    ConvergenceError
        When no training state loads a flank.
    """
    reduction, per_pitch = case.reduction, case.offline.angles_per_pitch
    if reduction.shapes == "line_loads":
        return None
    if reduction.shapes == "flank_lines":
        return flank_line_shapes(bodies, force, flank_nodes, reduction.distribution_tolerance)
    if reduction.shapes == "static_modes":
        return static_mode_shapes(bodies, flank_nodes)
    if reduction.shapes == "positions":
        return contact_shapes(*bodies, grid, per_pitch, force, reduction.interpolation)
    if reduction.shapes == "pod":
        modes = local_modes(bodies, force, reduction.pod_tolerance)
        return shapes_of(bodies, grid, per_pitch, modes, reduction.interpolation)
    return same_everywhere(bodies, grid, global_modes(bodies, force, reduction.pod_tolerance))


def same_everywhere(bodies: tuple[ElasticGear, ElasticGear], grid: FloatArray, modes: FloatArray) -> ContactShapes:
    """Shapes, (r, 2, f), for all positions of a grid.

    A grid of two positions, at which tooth pairs any number of pitches apart are at the same one. At its end the pair
    is idle, so that the shapes of its beginning are used alone all the way.
    """
    return shapes_of(bodies, grid[[0, -1]], 0, np.stack([modes, np.zeros_like(modes)]), "linear")
