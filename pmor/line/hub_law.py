"""Line contact between hubs that stand where they are put: mesh force and tangent over the mesh cycle.

Sections of involute flanks push along one direction in the plane of action, the more so the further along the width
they lie: two coordinates hold all that displaced hubs do to their gaps, L u = c Y^T u with a column for the force at
the pitch point and one for a couple about the normal of the plane of action, c = (1, z + a tan(beta_b)) for a section
that lies a along the transverse line of action. Their forces are the mesh force in the transverse plane, N, and that
couple, N mm. Off a tip corner the direction turns a little, and c is the nearest.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pmor.core.arrays import BoolArray, FloatArray
from pmor.gear.condition import Condition
from pmor.gear.pair import GearPair
from pmor.line.hubs import HUB, Hubs
from pmor.line.kernels.loads import COLD, solve_lines
from pmor.line.pair import LinePair, meshes_of, no_results
from pmor.line.train import smooth_rows

# Coordinates of a mesh: by how much the flanks part at the pitch point, mm, and by how much they tilt, rad.
COORDINATES = 2


@dataclass(frozen=True)
class HubLaw:
    """Forces of a mesh over its cycle at hubs that stand still, A angles, or of many such places of the hubs.

    Parameters
    ----------
    force : ndarray, shape (..., A, 2)
        On both coordinates, positive where flanks push apart: N, N mm.
    tangent : ndarray, shape (..., A, 2, 2)
        Of the forces that resist: -d force / d coordinate.
    """

    force: FloatArray
    tangent: FloatArray
    converged: BoolArray


def mesh_coordinates(pair: GearPair) -> FloatArray:
    """Return Y: the wrenches on both hubs by unit forces on the coordinates, in axes of the pair, shape (12, 2)."""
    alpha = pair.working_pressure_angle
    normal = np.array([0.0, 0.0, 0.0, math.sin(alpha), math.cos(alpha), 0.0])
    return np.column_stack([smooth_rows(pair).ravel(), np.concatenate([normal, -normal])])


def law_at(pair: LinePair, phi: FloatArray, condition: Condition, displacement: FloatArray) -> HubLaw:
    """Return the forces at pinion angles (A,), rad, with both hubs displaced.

    Parameters
    ----------
    pair : LinePair
        Over the whole width.
    displacement : ndarray, shape (12,)
        Of both hubs, the rotations about their axes too, in axes of the pair, mm and rad.
    """
    found = laws_at(pair, phi, condition, (mesh_coordinates(pair.meshed.pair).T @ displacement)[None])
    return HubLaw(found.force[0], found.tangent[0], found.converged[0])


def laws_at(pair: LinePair, phi: FloatArray, condition: Condition, coordinates: FloatArray) -> HubLaw:
    """Return the forces as `law_at` does, at many places of the coordinates, (D, 2)."""
    standing = Hubs(np.zeros((2 * HUB, 2 * HUB)), np.zeros(2 * HUB))
    placed = LinePair(pair.meshed.on_hubs(standing), pair.compliance, pair.components, pair.supports).place(
        phi, condition.misalignment
    )
    rows = placed.hub_rows @ np.linalg.pinv(mesh_coordinates(pair.meshed.pair)).T
    meshes = meshes_of([pair], np.array([[-1.0 / pair.base_radius, 0.0]]), np.array([[-1.0, 0.0]]))
    grid = len(coordinates), len(phi), COORDINATES
    moved = np.ascontiguousarray(np.broadcast_to(coordinates[:, None], grid))
    found = no_results(grid, pair.size, tangent=True)
    solve_lines(
        placed.lines, rows, meshes, pair.between_flanks, placed.flexibility, placed.deviation(condition.assembly),
        moved, True, COLD, found,
    )  # fmt: skip
    return HubLaw(np.einsum("dan,anc->dac", found.force, rows), found.stiffness, found.converged)
