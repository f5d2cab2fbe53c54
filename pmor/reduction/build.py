"""The reduction that a case asks for.

| shapes | unknowns | use |
|---|---|---|
| `line_loads` | a line load for each section that carries | line contact: exact, without training |
| `flank_lines` | an amplitude for each active flank line | the other schemes |
| `positions` | one for each training torque and tooth pair | the paper's way |
| `pod` | one for each mode and tooth pair | many torques |
| `global_pod` | one for each mode and tooth pair | the known bad alternative |
| `static_modes` | two for each active flank node | next to exact, without training |
"""

from __future__ import annotations

import numpy as np

from pmor.body.elastic_gear import ElasticGear
from pmor.case import Case
from pmor.core.arrays import FloatArray
from pmor.reduction.contact_shapes import ContactShapes, contact_shapes, shapes_of
from pmor.reduction.flank_lines import FlankLineShapes, flank_line_shapes
from pmor.reduction.pod import global_modes, local_modes
from pmor.reduction.static_modes import static_mode_shapes


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
