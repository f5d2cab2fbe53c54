"""Hubs that give way: gears on shafts, bearings and housing, under line contact.

The hub of each gear is its rigid bore, which moves by three displacements and three rotations. A unit force in a
section acts on the hubs of pinion and wheel with the wrench L, six components each, at the point of contact; moved
hubs change its gap by the same row (virtual work). With S the compliance of both hubs and u_0 what other loads do to
them,

    gap = g_0 + L u_0 + ... + D F,    D = D_local + L S L^T,                                                  (A)

so that line loads and hubs are found together, by the same Newton's method. S stands still while the gears turn. The
rotation of the hubs about their axes is none of S: that of the pinion is the unknown, the wheel is held there.

The transverse line of action of a section is where the smooth flank puts it: off a tip corner both levers give its
slope, cos(alpha) = (h_1 + h_2) / a, and the roll angle of the gear whose lever is its base radius gives the point on
it. Rows are linear: hubs turn by small angles.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.gear.pair import GearPair
from pmor.line.kernels.places import Lines

HUB = 6


@dataclass(frozen=True)
class Hubs:
    """What the hubs of pinion and wheel stand on, in axes of the pair (`pmor.core.conventions`).

    Parameters
    ----------
    compliance : ndarray, shape (12, 12)
        S: displacements (mm) and rotations (rad) of both hubs under unit forces (N) and moments (N mm) at mid width.
    offset : ndarray, shape (12,)
        u_0: what other loads than that of the mesh do to them.
    """

    compliance: FloatArray
    offset: FloatArray


def held_hubs() -> Hubs:
    """Return hubs that do not move."""
    return Hubs(np.zeros((2 * HUB, 2 * HUB)), np.zeros(2 * HUB))


def hub_rows(pair: GearPair, lines: Lines, z: FloatArray) -> FloatArray:
    """Return L: the wrenches on both hubs by a unit force in each section, shape (A, N, 12), N and N mm.

    Parameters
    ----------
    lines : Lines
        N sections at A angles.
    z : ndarray, shape (S,)
        Of the sections of a tooth pair, mm.
    """
    levers = np.stack([-lines.lever, lines.mate_lever])
    base = np.array([pair.pinion.base_radius, pair.wheel.base_radius])
    cosine = np.clip(levers.sum(axis=0) / pair.centre_distance, -1.0, 1.0)
    sine = np.sqrt(1.0 - cosine**2)
    smooth_wheel = np.abs(levers[0] - base[0]) > np.abs(levers[1] - base[1])
    # From the tangent points of the line of action: on the pinion's base circle forwards, on the wheel's backwards.
    along = np.where(
        smooth_wheel, pair.centre_distance * sine - base[1] * lines.roll[..., 1], base[0] * lines.roll[..., 0]
    )
    x, y = levers[0] * sine - along * cosine, levers[0] * cosine + along * sine
    across = np.tile(z, x.shape[1] // len(z))
    axial = -math.tan(pair.base_helix_angle)
    rows = np.empty((*x.shape, 2 * HUB))
    for first, sign, up in ((0, -1.0, y), (HUB, 1.0, y - pair.centre_distance)):
        force = -sign * cosine, sign * sine, sign * axial
        moment = up * force[2] - across * force[1], across * force[0] - x * force[2], x * force[1] - up * force[0]
        for n, part in enumerate((*force, *moment)):
            rows[..., first + n] = part
    rows[~np.isfinite(lines.gap)] = 0.0
    return rows


def mean_wrench(rows: FloatArray, force: FloatArray) -> FloatArray:
    """Return the wrench on both hubs by forces in the sections (A, N), mean over the angles, shape (12,)."""
    return np.asarray(np.einsum("an,anr->r", force, rows) / len(rows))
