"""Where the sections of line contact are over a range of angles, and what they are like there without load.

Neither depends on torque or deviations of the flanks (`pmor.line.kernels.loads`, equation 1).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.core.compiling import allocating, compiled
from pmor.gear.kernels.deviation import flank_deviation
from pmor.gear.kernels.types import Motion
from pmor.line.kernels.contact_point import closest_approach, cubic_rows, opening_of, roll_of
from pmor.line.kernels.law import line_law, sections_alike
from pmor.line.kernels.tip_corner import LAW_FIELDS, store_law
from pmor.line.kernels.types import Carriers


class Lines(NamedTuple):
    """Sections of all tooth pairs that can touch over A pinion angles: P pairs of S sections, N = P S unknowns at most.

    Attributes
    ----------
    first_pair : ndarray of int, shape (A,)
        Number of the first tooth pair in patches; the others follow.
    gap : ndarray, shape (A, N)
        Between undeformed flanks without deviations at advance 0, mm; infinite far beyond the path.
    lever, mate_lever : ndarray, shape (A, N)
        Derivative of the gap by the pinion's rotation, and lever arm of the force on the wheel, mm.
    lever_slope, corner_advance : ndarray, shape (A, N)
        Derivative of the lever by the pinion's rotation, mm, from an advance (rad) on that brings its corner into contact.
    roll : ndarray, shape (A, N, 2)
        Roll angles on pinion and wheel, rad.
    law : ndarray, shape (A, N, 12)
        `LineLaw` of each section, in the order of its fields.
    row : ndarray of int, shape (A, N, 2)
        First of the four rows of nodes that carry a section, on each gear.
    gradient : ndarray, shape (A, N, 2, 4 c)
        Gradient of the gap by the c components of displacement in these rows.
    flexibility : ndarray, shape (A, N, N)
        D, of the sections that are `ready`; of others the part of low rank alone, L S L^T, mm/N (`pmor.body.support`).
    ready : ndarray of bool, shape (A, N)
    """

    first_pair: IntArray
    gap: FloatArray
    lever: FloatArray
    mate_lever: FloatArray
    lever_slope: FloatArray
    corner_advance: FloatArray
    roll: FloatArray
    law: FloatArray
    row: IntArray
    gradient: FloatArray
    flexibility: FloatArray
    ready: BoolArray


@allocating
def place_lines(phi, kinematics, gears, layers, z, pair_count, components):
    """Place the sections of all tooth pairs that can touch at some pinion angles.

    Parameters
    ----------
    phi : ndarray, shape (A,)
        rad.
    kinematics : Kinematics
    gears : two Gear
    layers : two Layer
    z : ndarray, shape (S,)
        Of the sections, mm.
    pair_count : int
        Tooth pairs that can touch at most: P.
    components : int
        Of displacement: 2 without, 3 with those along the axis.

    Returns
    -------
    Lines
        With no section ready, on gears that stand on nothing that gives.
    """
    angles, sections = len(phi), len(z)
    size = pair_count * sections
    lines = Lines(
        np.zeros(angles, dtype=np.int64), np.zeros((angles, size)), np.zeros((angles, size)), np.zeros((angles, size)),
        np.zeros((angles, size)), np.zeros((angles, size)),
        np.zeros((angles, size, 2)), np.zeros((angles, size, LAW_FIELDS)), np.zeros((angles, size, 2), dtype=np.int64),
        np.zeros((angles, size, 2, 4 * components)), np.zeros((angles, size, size)),
        np.zeros((angles, size), dtype=np.bool_),
    )  # fmt: skip
    forward, back = Motion(np.empty((3, 3)), np.empty(3)), Motion(np.empty((3, 3)), np.empty(3))
    carriers = Carriers(np.empty(2, dtype=np.int64), np.empty((2, 4)))
    middle, alike = 0.5 * (kinematics.path_start + kinematics.path_end), sections_alike(kinematics, gears)
    for i in range(angles):
        # As many pairs as can touch, about the middle of the path.
        first = int(np.ceil((middle - phi[i]) / kinematics.pitch - 0.5 * pair_count))
        lines.first_pair[i] = first
        for p in range(pair_count):
            roll_position = phi[i] + (first + p) * kinematics.pitch
            for s in range(sections):
                n = p * sections + s
                if s > 0 and alike:
                    _copy_section(lines, i, n)
                else:
                    _place_section(lines, i, n, kinematics, gears, layers, roll_position, z[s], forward, back, carriers)
    return lines


@compiled
def _place_section(lines, i, n, kinematics, gears, layers, roll_position, z, forward, back, carriers):
    parts, section, margin = lines.gradient.shape[3] // 4, roll_position + gears[0].twist * z, 0.5 * kinematics.pitch
    if section < kinematics.path_start - margin or section > kinematics.path_end + margin:
        # So far beyond the path a corner would meet the mate's other side.
        lines.gap[i, n], lines.lever[i, n], lines.mate_lever[i, n] = np.inf, -gears[0].base_radius, gears[1].base_radius
        return
    touch = kinematics.first_touch
    contact_point = closest_approach(kinematics, gears, roll_position, touch, z, forward, back)
    # Placed where plain flanks first touch; gaps are those at advance 0.
    lines.gap[i, n] = contact_point.gap - contact_point.lever * touch
    lines.lever[i, n], lines.mate_lever[i, n] = contact_point.lever, contact_point.mate_lever
    lines.lever_slope[i, n], lines.corner_advance[i, n] = (
        contact_point.lever_slope,
        touch + contact_point.corner_advance,
    )
    for gear in range(2):
        roll, u = gears[gear].roll, roll_of(contact_point, gear)
        carriers.row[gear] = cubic_rows(roll, u, 0, len(roll) - 1, carriers.weight[gear])
        # Four rows in any case: of a flank with fewer elements the first ones have no share.
        row = min(carriers.row[gear], len(roll) - 4)
        behind = carriers.row[gear] - row
        lines.roll[i, n, gear], lines.row[i, n, gear] = u, row
        x, y, axial = opening_of(contact_point, gear)
        for a in range(4 - behind):
            weight, at = carriers.weight[gear, a], parts * (a + behind)
            lines.gradient[i, n, gear, at], lines.gradient[i, n, gear, at + 1] = weight * x, weight * y
            if parts == 3:
                lines.gradient[i, n, gear, at + 2] = weight * axial
    store_law(line_law(gears, layers, contact_point, carriers), lines.law[i, n])


@compiled
def _copy_section(lines, i, n):
    """On spur gears with parallel axes undeformed flanks meet in all sections alike."""
    lines.gap[i, n], lines.lever[i, n] = lines.gap[i, n - 1], lines.lever[i, n - 1]
    lines.mate_lever[i, n] = lines.mate_lever[i, n - 1]
    lines.lever_slope[i, n], lines.corner_advance[i, n] = lines.lever_slope[i, n - 1], lines.corner_advance[i, n - 1]
    for k in range(LAW_FIELDS):
        lines.law[i, n, k] = lines.law[i, n - 1, k]
    for gear in range(2):
        lines.roll[i, n, gear], lines.row[i, n, gear] = lines.roll[i, n - 1, gear], lines.row[i, n - 1, gear]
        for k in range(lines.gradient.shape[3]):
            lines.gradient[i, n, gear, k] = lines.gradient[i, n - 1, gear, k]


@compiled
def line_deviations(lines, z, pinion, wheel, out):
    """Fill `out`, shape (A, N), with what both flanks deviate by in all sections, mm.

    Parameters
    ----------
    lines : Lines
    z : ndarray, shape (S,)
        Of the sections, mm.
    pinion, wheel : Deviation
    out : ndarray
    """
    sections = len(z)
    for i in range(out.shape[0]):
        for n in range(out.shape[1]):
            tooth, place = lines.first_pair[i] + n // sections, z[n % sections]
            out[i, n] = flank_deviation(pinion, lines.roll[i, n, 0], place, tooth)
            # The wheel's teeth count against the pinion's.
            out[i, n] += flank_deviation(wheel, lines.roll[i, n, 1], place, -tooth)
