"""Hubs that give way: gears on shafts, bearings and housing, under line contact.

The hub of each gear is its rigid bore, or the mean motion of the bore of a gear of one piece with its shaft: three
displacements and three rotations. A unit force in a section acts on the hubs of pinion and wheel with the wrench L, six
components each, at the point of contact; moved hubs change its gap by the same row (virtual work). With S the
compliance of both hubs and u_0 what other loads do to them,

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
from pmor.line.kernels.hubs import ROWS, Axes, fill_hub_rows
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
    rows = np.empty((*lines.gap.shape, ROWS))
    fill_hub_rows(lines, z, axes_of(pair), rows)
    return rows


def axes_of(pair: GearPair) -> Axes:
    """Return the axes of a pair for the kernels."""
    base_radii = pair.pinion.base_radius, pair.wheel.base_radius
    return Axes(pair.centre_distance, *base_radii, math.tan(pair.base_helix_angle))


def mean_wrench(rows: FloatArray, force: FloatArray) -> FloatArray:
    """Return the wrench on both hubs by forces in the sections (A, N), mean over the angles, shape (12,)."""
    return np.asarray(np.einsum("an,anr->r", force, rows) / len(rows))
