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

from pmor.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from pmor.gear.condition import Condition
from pmor.gear.pair import GearPair
from pmor.line.hubs import Hubs
from pmor.line.kernels.loads import COLD, solve_lines
from pmor.line.pair import LinePair, LineResults, PlacedSections, meshes_of, no_results, section_patterns
from pmor.line.train import smooth_rows

# Coordinates of a mesh: by how much the flanks part at the pitch point, mm, and by how much they tilt, rad.
COORDINATES = 2


@dataclass(frozen=True)
class HubLaw:
    """Forces of a mesh over its cycle at hubs that stand still, A angles.

    Parameters
    ----------
    force : ndarray, shape (A, 2)
        On both coordinates, positive where flanks push apart: N, N mm.
    tangent : ndarray, shape (A, 2, 2)
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


def law_at(
    pair: LinePair, phi: FloatArray, condition: Condition, displacement: FloatArray, taken_out: FloatArray | None = None
) -> HubLaw:
    """Return the forces at pinion angles (A,), rad, with both hubs displaced.

    Parameters
    ----------
    pair : LinePair
        Over the whole width.
    displacement : ndarray, shape (12,)
        Of both hubs, the rotations about their axes too, in axes of the pair, mm and rad.
    taken_out : ndarray, shape (2, 2), optional
        Compliance at the coordinates that gears have and the law is to be without.
    """
    placed, rows, found = _solved(pair, phi, condition, displacement, taken_out)
    return HubLaw(np.einsum("an,anc->ac", found.force[0], rows), found.stiffness[0], found.converged[0])


def mode_coordinates(
    pair: LinePair, phi: FloatArray, condition: Condition, displacement: FloatArray, gear: int, diameters: IntArray,
    flank: ComplexArray,
) -> FloatArray:  # fmt: skip
    """Return how the modes of a gear move the coordinates of its mesh: mean over the cycle by the load of the sections.

    Of the displacement Re((a - i b) phi e^(i n theta)), theta in axes of the pair from the line of centres on.

    Parameters
    ----------
    pair, phi, condition, displacement
        As in `law_at`.
    gear : int
        0 the pinion, 1 the wheel.
    diameters : ndarray of int, shape (m,)
        n.
    flank : ndarray of complex, shape (3 f, m)
        phi at the nodes of the flank of a tooth, in its frame.

    Returns
    -------
    ndarray, shape (2, m, 2)
        By amplitudes a and b.
    """
    placed, rows, found = _solved(pair, phi, condition, displacement, None)
    gaps = [section_patterns(pair.meshed, placed.lines, gear, np.ascontiguousarray(part))
            for part in (flank.real, flank.imag)]  # fmt: skip
    geometry, count = pair.meshed.pair, pair.meshed.tooth_pair_count
    teeth = placed.lines.first_pair[:, None] + np.arange(count)
    roll = phi[:, None] + geometry.pitch * teeth
    angle = roll
    if gear == 1:
        angle = math.pi + geometry.contact_roll_angles(roll)[1]
        angle = angle - geometry.wheel.base_half_angle - geometry.working_pressure_angle
    turned = np.exp(1j * diameters * np.repeat(angle, rows.shape[1] // count, axis=1)[..., None])
    gap = (gaps[0] + 1j * gaps[1]) * turned
    loaded = found.force[0][..., None] * rows
    weight = np.einsum("anc,and->cd", loaded, rows)
    mean = np.linalg.solve(weight, np.einsum("anc,anm->cm", loaded, gap))
    return np.stack([mean.real, mean.imag], axis=-1)


def _solved(
    pair: LinePair, phi: FloatArray, condition: Condition, displacement: FloatArray, taken_out: FloatArray | None
) -> tuple[PlacedSections, FloatArray, LineResults]:
    """Sections, their rows by the coordinates, and their loads between hubs that stand."""
    columns = mesh_coordinates(pair.meshed.pair)
    back = np.linalg.pinv(columns)
    compliance = np.zeros((len(displacement),) * 2) if taken_out is None else -back.T @ taken_out @ back
    standing = Hubs(compliance, np.zeros(len(displacement)))
    placed = LinePair(pair.meshed.on_hubs(standing), pair.compliance, pair.components, pair.supports).place(
        phi, condition.misalignment
    )
    rows = placed.hub_rows @ back.T
    meshes = meshes_of([pair], np.array([[-1.0 / pair.base_radius, 0.0]]), np.array([[-1.0, 0.0]]))
    moved = np.ascontiguousarray(np.broadcast_to(columns.T @ displacement, (1, len(phi), COORDINATES)))
    found = no_results(moved.shape, pair.size, tangent=True)
    solve_lines(
        placed.lines, rows, meshes, pair.between_flanks, placed.flexibility, placed.deviation(condition.assembly),
        moved, True, COLD, found,
    )  # fmt: skip
    return placed, rows, found
