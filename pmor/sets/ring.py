"""Deflection of a ring: how far its root moves between the teeth, against what holds its outside."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pmor.body.rim import RimMotion
from pmor.core.arrays import FloatArray, IntArray
from pmor.line.kernels.types import LineResults
from pmor.line.pair import section_patterns
from pmor.line.several import LATER, PlacedMesh, PlacedTrain, section_teeth

# Angles whose displacements are held at once.
TOGETHER = 64


@dataclass(frozen=True)
class RingDeflection:
    """Displacement of a ring's root between its teeth under D torques, mean over the width.

    Parameters
    ----------
    place_deg : ndarray, shape (z,)
        Of the cuts between teeth at angle 0, counter-clockwise from the y axis, increasing.
    displacement_um : ndarray, shape (D, z, 2)
        Outwards and counter-clockwise at angle 0.
    most_um, least_um : ndarray, shape (D,)
        Radial ones at all places, and angles that converged: limits.
    """

    place_deg: FloatArray
    displacement_um: FloatArray
    most_um: FloatArray
    least_um: FloatArray


def ring_deflection(placed: PlacedTrain, found: LineResults, pitches: int, clockwise: bool) -> RingDeflection | None:
    """Return the deflection of the first ring of a train that meshes at several places; None without one.

    NaN at places where angle 0 did not converge.

    Parameters
    ----------
    placed, found, pitches
        As in `pmor.sets.root_stress.root_stress_of_set`.
    clockwise : bool
        Whether the train is the image of the set, x to -x.
    """
    number, body = next(
        ((n, one) for n, one in enumerate(placed.train.bodies) if one.rim_motion is not None), (-1, None)
    )
    if body is None or body.rim_motion is None:
        return None
    rim, meshes = body.rim_motion, [(n, one) for n, one in enumerate(placed.placed) if one.mesh.bodies[1] == number]
    uses = [(n, one, section_patterns(one.mesh.pair.meshed, one.lines, 1, rim.rows)) for n, one in meshes]
    (torques, count), angles, first = found.converged.shape, len(placed.phi), np.empty(0)
    most, least = np.full(torques, np.nan), np.full(torques, np.nan)
    for start in range(0, count, angles):
        later = placed.train.mesh_cycles(start * pitches // count)
        for low in range(0, angles, TOGETHER):
            block = slice(low, min(low + TOGETHER, angles))
            force = found.force[:, start + block.start : start + block.stop]
            parts = [_under(rim, one, rows, force, block, round(float(later[n]))) for n, one, rows in uses]
            moved = 1e3 * np.sum(parts, axis=0)
            first = first if first.size else moved[:, 0]
            most = np.fmax(most, np.fmax.reduce(moved[..., 0], axis=(1, 2)))
            least = np.fmin(least, np.fmin.reduce(moved[..., 0], axis=(1, 2)))
    side, image = -1.0 if clockwise else 1.0, -1.0 if meshes[0][1].mesh.image else 1.0
    places = np.degrees(side * _places(meshes[0][1], float(placed.phi[0]))) % 360.0
    order = np.argsort(places)
    return RingDeflection(places[order], first[:, order] * [1.0, side * image], most, least)


def _under(
    rim: RimMotion, one: PlacedMesh, rows: FloatArray, force: FloatArray, block: slice, later: int
) -> FloatArray:
    """Displacement by the forces (D, a, n) of a mesh at a block of angles, so many pitches later, (D, a, z, 2), mm."""
    sections = len(one.mesh.pair.meshed.width)
    own, count = force[..., one.part], rows.shape[1] // sections
    loads = np.einsum(
        "dapn,apnr->pdar", own.reshape(*own.shape[:2], count, sections),
        rows[block].reshape(-1, count, sections, rows.shape[2]),
    )  # fmt: skip
    teeth: IntArray = section_teeth(one)[block, ::sections, 1] + LATER[1] * later
    return np.sum([rim.under(load, teeth[:, pair]) for pair, load in enumerate(loads)], axis=0)


def _places(one: PlacedMesh, phi: float) -> FloatArray:
    """Places of the cuts behind teeth 0 ... z - 1 at an angle, counter-clockwise from the y axis of the train, rad."""
    mesh = one.mesh
    pair, side = mesh.pair.meshed.pair, -1.0 if mesh.image else 1.0
    wheel = pair.wheel
    drawn = 0.0 if wheel.flank_section(np.array([wheel.form_roll_angle]))[0, 1] > 0.0 else math.pi
    turned = drawn + math.pi + pair.wheel_tooth_rotation(mesh.start + mesh.rate * phi)
    behind = np.arange(abs(wheel.teeth)) - mesh.first_tooth[1] + 0.5
    return np.asarray(mesh.direction + side * (turned + wheel.angular_pitch * behind))
