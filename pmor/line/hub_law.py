"""Line contact between hubs that stand where they are put: mesh force and tangent over the mesh cycle.

Sections of involute flanks push along one direction in the plane of action, the more so the further along the width
they lie: two coordinates hold all that displaced hubs do to their gaps, L u = c Y^T u with a column for the force at
the pitch point and one for a couple about the normal of the plane of action, c = (1, z + a tan(beta_b)) for a section
that lies a along the transverse line of action. Their forces are the mesh force in the transverse plane, N, and that
couple, N mm. Off a tip corner the direction turns, and c says what a turn of the pinion does: then the first force is
the torque on the pinion over its base radius, as in a pair by itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pmor.body.far_compliance import ROWS
from pmor.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from pmor.gear.condition import Condition
from pmor.gear.pair import GearPair
from pmor.line.hubs import HUB, Hubs
from pmor.line.kernels.loads import COLD, WARM, solve_lines
from pmor.line.kernels.places import Lines
from pmor.line.pair import (
    NONE,
    LinePair,
    LineResults,
    PlacedSections,
    meshes_of,
    no_results,
    section_patterns,
)
from pmor.line.several import GearTrain, PlacedTrain
from pmor.line.train import smooth_rows

# Coordinates of a mesh: by how much the flanks part at the pitch point, mm, and by how much they tilt, rad.
COORDINATES = 2


@dataclass(frozen=True)
class HubLaw:
    """Forces of a mesh over its cycle at hubs that stand still, A angles, or of many such places of the hubs.

    Parameters
    ----------
    force : ndarray, shape (..., A, K)
        On both coordinates, of a train on those of all meshes, positive where flanks push apart: N, N mm.
    tangent : ndarray, shape (..., A, K, K)
        Of the forces that resist: -d force / d coordinate.
    sections : ndarray, shape (D, A, N), optional
        Forces of the N sections of a pair, N.
    """

    force: FloatArray
    tangent: FloatArray
    converged: BoolArray
    sections: FloatArray | None = None


def mesh_coordinates(pair: GearPair) -> FloatArray:
    """Return Y: the wrenches on both hubs by unit forces on the coordinates, in axes of the pair, shape (12, 2)."""
    alpha = pair.working_pressure_angle
    normal = np.array([0.0, 0.0, 0.0, math.sin(alpha), math.cos(alpha), 0.0])
    return np.column_stack([smooth_rows(pair).ravel(), np.concatenate([normal, -normal])])


def hub_moves(pair: GearPair) -> FloatArray:
    """Return B with Y^T B = 1: the displacements of both hubs that unit coordinates stand for, shape (12, 2).

    The pinion turns, the wheel stands; flanks tilt by both hubs.
    """
    along, tilting = mesh_coordinates(pair).T
    turn, tilted = np.zeros(2 * HUB), tilting / (tilting @ tilting)
    turn[HUB - 1] = 1.0 / along[HUB - 1]
    return np.column_stack([turn, tilted - (along @ tilted) * turn])


def laws_at(
    pair: LinePair, phi: FloatArray, condition: Condition, coordinates: FloatArray, taken_out: FloatArray | None = None,
    near: FloatArray | None = None,
) -> HubLaw:  # fmt: skip
    """Return the forces at pinion angles (A,), rad, at many places of the hubs.

    Parameters
    ----------
    pair : LinePair
        Over the whole width.
    coordinates : ndarray, shape (D, 2) or (D, A, 2)
        Of the mesh at all angles, or at each: Y^T u of the displacements u of both hubs (`mesh_coordinates`).
    taken_out : ndarray, shape (2, 2), optional
        Compliance at the coordinates that gears have and the law is to be without.
    near : ndarray, shape (D, A, N), optional
        Forces of the sections under little else, N, from which fewer steps lead to these.
    """
    _, rows, found = _solved(pair, phi, condition, coordinates, taken_out, near)
    return HubLaw(_forces([pair], rows, found), found.stiffness, found.converged, found.force)


def _tooth_pairs(pair: LinePair) -> int:
    return pair.meshed.tooth_pair_count


def _forces(pairs: Sequence[LinePair], rows: FloatArray, found: LineResults) -> FloatArray:
    """Forces on the coordinates of meshes by those of their sections, (D, A, K): under a corner the lever turns."""
    forces, ends = np.einsum("dan,anc->dac", found.force, rows), np.cumsum([0, *map(_tooth_pairs, pairs)])
    kept = forces.shape[2] // len(pairs)
    for number, (pair, start, end) in enumerate(zip(pairs, ends[:-1], ends[1:], strict=True)):
        forces[..., kept * number] = found.torque[..., start:end].sum(axis=2) / pair.base_radius
    return np.asarray(forces)


def mode_coordinates(
    pair: LinePair, phi: FloatArray, condition: Condition, displacement: FloatArray, gear: int, diameters: IntArray,
    flank: ComplexArray,
) -> FloatArray:  # fmt: skip
    """Return how the modes of a gear move the coordinates of its mesh: mean over the cycle by the load of the sections.

    Of the displacement Re((a - i b) phi e^(i n theta)), theta in axes of the pair from the line of centres on.

    Parameters
    ----------
    pair, phi, condition
        As in `laws_at`.
    displacement : ndarray, shape (12,)
        Of both hubs, the rotations about their axes too, in axes of the pair, mm and rad.
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
    coordinates = (mesh_coordinates(pair.meshed.pair).T @ displacement)[None]
    placed, rows, found = _solved(pair, phi, condition, coordinates, None)
    gap = gap_patterns(pair, placed.lines, gear, flank)
    geometry, count = pair.meshed.pair, pair.meshed.tooth_pair_count
    teeth = placed.lines.first_pair[:, None] + np.arange(count)
    roll = phi[:, None] + geometry.pitch * teeth
    angle = roll
    if gear == 1:
        # Teeth of a ring are drawn on the other side.
        drawn = 0.0 if geometry.wheel.teeth > 0 else math.pi
        angle = drawn + math.pi + geometry.contact_roll_angles(roll)[1]
        angle = angle - geometry.wheel.base_half_angle - geometry.working_pressure_angle
    turned = np.exp(1j * diameters * np.repeat(angle, rows.shape[1] // count, axis=1)[..., None])
    gap = gap * turned
    loaded = found.force[0][..., None] * rows
    weight = np.einsum("anc,and->cd", loaded, rows)
    mean = np.linalg.solve(weight, np.einsum("anc,anm->cm", loaded, gap))
    return np.stack([mean.real, mean.imag], axis=-1)


def gap_patterns(pair: LinePair, lines: Lines, gear: int, flank: ComplexArray) -> ComplexArray:
    """Return by how much displacements of a gear's flank (3 f, m) open the gaps of placed sections, (A, N, m)."""
    # Flanks of spur gears are pressed along x and y alone.
    parts = lines.gradient.shape[3] // ROWS
    pressed = np.ascontiguousarray(flank.reshape(-1, 3, flank.shape[1])[:, :parts].reshape(-1, flank.shape[1]))
    real, imag = (section_patterns(pair.meshed, lines, gear, np.ascontiguousarray(part))
                  for part in (pressed.real, pressed.imag))  # fmt: skip
    return np.asarray(real + 1j * imag)


def _solved(
    pair: LinePair, phi: FloatArray, condition: Condition, coordinates: FloatArray, taken_out: FloatArray | None,
    near: FloatArray | None = None,
) -> tuple[PlacedSections, FloatArray, LineResults]:  # fmt: skip
    """Sections, their rows by the coordinates, and their loads between hubs that stand."""
    moves = hub_moves(pair.meshed.pair)
    compliance = np.zeros((2 * HUB, 2 * HUB)) if taken_out is None else -moves @ taken_out @ moves.T
    standing = Hubs(compliance, np.zeros(2 * HUB))
    placed = replace(pair, meshed=pair.meshed.on_hubs(standing)).place(phi, condition.misalignment)
    rows = placed.hub_rows @ moves
    meshes = meshes_of([pair], np.array([[-1.0 / pair.base_radius, 0.0]]), np.array([[-1.0, 0.0]]))
    grid = len(coordinates), len(phi), COORDINATES
    moved = np.ascontiguousarray(np.broadcast_to(coordinates.reshape(len(coordinates), -1, COORDINATES), grid))
    found = no_results(grid, pair.size, _tooth_pairs(pair), tangent=True)
    deviation, starts = placed.deviation(condition.assembly), [COLD]
    if near is not None:
        # Twice: tangents are those where the last step began, which from nearby may be the only one.
        found.force[:], starts = near, [WARM, WARM]
    for start in starts:
        solve_lines(placed.lines, rows, meshes, pair.between_flanks, placed.flexibility, deviation, moved, True, start,
                    found)  # fmt: skip
    return placed, rows, found


def train_coordinates(train: GearTrain) -> FloatArray:
    """Return the wrenches on all hubs by unit forces on the coordinates of all meshes, in axes of the train, (6 B, K).

    K is twice the number of meshes; of half a width, which does not tilt, as large as that.
    """
    kept = 1 if any(mesh.pair.meshed.mirrored for mesh in train.meshes) else COORDINATES
    found = np.zeros((len(train.meshes), kept, len(train.bodies), HUB))
    for number, mesh in enumerate(train.meshes):
        columns = mesh_coordinates(mesh.pair.meshed.pair).reshape(2, HUB, COORDINATES)
        for body, own in zip(mesh.bodies, columns, strict=True):
            found[number, :, body] = (mesh.to_train @ own).T[:kept]
    return found.reshape(kept * len(train.meshes), -1).T


def train_rows(placed: PlacedTrain) -> FloatArray:
    """Return the change of the gaps of all sections by the coordinates of all meshes, (A, N, K)."""
    size, last = len(train_coordinates(placed.train).T), placed.placed[-1].part.stop
    kept = size // len(placed.placed)
    rows = np.zeros((len(placed.phi), last, size))
    for number, one in enumerate(placed.placed):
        own, moves = slice(kept * number, kept * (number + 1)), hub_moves(one.mesh.pair.meshed.pair)
        by_hubs = np.concatenate([one.mesh.to_train @ hub for hub in np.split(moves, 2)])[:, :kept]
        rows[:, one.part, own] = one.rows.reshape(*one.rows.shape[:2], -1) @ by_hubs
    return rows


def train_law_at(placed: PlacedTrain, moved: FloatArray) -> HubLaw:
    """Return the forces of all meshes of a train whose hubs stand where coordinates say, (K,); mm and rad.

    What bodies give way that meshes share is in it, what hubs stand on is not.
    """
    train = replace(placed.train, compliance=np.zeros_like(placed.train.compliance))
    found = [_of_block(block, moved) for block in replace(placed, train=train).blocks]
    return HubLaw(*(np.concatenate(parts) for parts in zip(*found, strict=True)))


def _of_block(placed: PlacedTrain, moved: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Force, tangent, and whether they converged, of some angles."""
    rows, workspace, pairs = train_rows(placed), placed.workspace(), [mesh.pair for mesh in placed.train.meshes]
    kept = len(moved) // len(pairs)
    first = np.kron(np.eye(len(pairs)), np.eye(1, kept)).astype(np.float64)
    base = np.array([[pair.base_radius] for pair in pairs], dtype=float)
    ahead: FloatArray = -first / base
    meshes = meshes_of(pairs, ahead, -first)
    everywhere = np.ascontiguousarray(np.broadcast_to(moved, (1, len(placed.phi), len(moved))))
    found = no_results(everywhere.shape, rows.shape[1], sum(map(_tooth_pairs, pairs)), tangent=True)
    solve_lines(
        placed.lines, rows, meshes, placed.train.compliance_between, workspace, NONE, everywhere, True, COLD, found
    )
    return _forces(pairs, rows, found)[0], found.stiffness[0], found.converged[0]
