"""Positions of the sections of line contact over a range of angles, and their unloaded gaps, levers and laws.

Neither depends on torque or deviations of the flanks (`pmor.line.kernels.loads`, equation 1).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.core.compiling import allocating, compiled
from pmor.gear.kernels.deviation import flank_deviation
from pmor.gear.kernels.types import Motion
from pmor.line.kernels.contact_point import closest_approach, cubic_rows, opening_of, roll_of
from pmor.line.kernels.law import line_law, sections_alike
from pmor.line.kernels.tip_corner import LAW_FIELDS, store_law
from pmor.line.kernels.types import Carriers

# Lever over the pinion's base radius below which a corner slides along its mate, far away, and does not meet it.
LEAST_LEVER = 0.1


class Places(NamedTuple):
    """Where the flanks of all tooth pairs that can touch meet over A pinion angles: P pairs of S sections, N = P S.

    Attributes
    ----------
    first_pair : ndarray of int, shape (A,)
        Number of the first tooth pair; the others follow.
    gap : ndarray, shape (A, N)
        Between undeformed flanks without deviations at advance 0, mm; infinite far beyond the path.
    lever, mate_lever : ndarray, shape (A, N)
        Derivative of the gap by the pinion's rotation, and lever arm of the force on the wheel, mm.
    lever_slope, corner_advance : ndarray, shape (A, N)
        Derivative of the lever by the pinion's rotation, mm, from an advance (rad) on that brings its corner into
        contact.
    roll : ndarray, shape (A, N, 2)
        Roll angles on pinion and wheel, rad.
    """

    first_pair: IntArray
    gap: FloatArray
    lever: FloatArray
    mate_lever: FloatArray
    lever_slope: FloatArray
    corner_advance: FloatArray
    roll: FloatArray


class Lines(NamedTuple):
    """Sections as `Places` has them, with their laws, and how nodes carry them.

    Attributes
    ----------
    first_pair, gap, lever, mate_lever, lever_slope, corner_advance, roll : ndarray
        As in `Places`.
    law : ndarray, shape (A, N, 12)
        `LineLaw` of each section, in the order of its fields.
    row : ndarray of int, shape (A, N, 2)
        First of the four rows of nodes that carry a section, on each gear.
    gradient : ndarray, shape (A, N, 2, 4 c)
        Gradient of the gap by the c components of displacement in these rows.
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


@allocating
def place_flanks(phi, kinematics, gears, z, pair_count):
    """Find where the flanks of all tooth pairs that can touch meet at some pinion angles.

    Parameters
    ----------
    phi : ndarray, shape (A,)
        rad.
    kinematics : Kinematics
    gears : two Gear
    z : ndarray, shape (S,)
        Of the sections, mm.
    pair_count : int
        Tooth pairs that can touch at most: P.

    Returns
    -------
    Places
    """
    angles, sections = len(phi), len(z)
    grid = angles, pair_count * sections
    places = Places(
        first_pair=np.zeros(angles, dtype=np.int64), gap=np.zeros(grid), lever=np.zeros(grid),
        mate_lever=np.zeros(grid), lever_slope=np.zeros(grid), corner_advance=np.zeros(grid),
        roll=np.zeros((angles, grid[1], 2)),
    )  # fmt: skip
    forward, back = Motion(np.empty((3, 3)), np.empty(3)), Motion(np.empty((3, 3)), np.empty(3))
    for i in range(angles):
        places.first_pair[i] = _first_pair(phi[i], kinematics, pair_count)
        for n in range(grid[1]):
            roll_position = phi[i] + (places.first_pair[i] + n // sections) * kinematics.pitch
            if _within(places, i, n, kinematics, gears, roll_position, z[n % sections]):
                _place(places, i, n, kinematics, gears, roll_position, z[n % sections], forward, back)
    return places


@allocating
def place_lines(phi, kinematics, gears, layers, z, pair_count, components):
    """Place the sections of all tooth pairs that can touch at some pinion angles.

    Parameters
    ----------
    phi, kinematics, gears, z, pair_count
        As in `place_flanks`.
    layers : two Layer
    components : int
        Of displacement: 2 without, 3 with those along the axis.

    Returns
    -------
    Lines
    """
    lines = empty_lines(len(phi), pair_count * len(z), components)
    fill_lines(lines, phi, kinematics, gears, layers, z)
    return lines


@allocating
def empty_lines(angles, size, components):
    """Return room for `size` sections at each of some angles."""
    grid = angles, size
    return Lines(
        first_pair=np.zeros(angles, dtype=np.int64), gap=np.zeros(grid), lever=np.zeros(grid),
        mate_lever=np.zeros(grid), lever_slope=np.zeros(grid), corner_advance=np.zeros(grid),
        roll=np.zeros((angles, size, 2)),
        law=np.zeros((angles, size, LAW_FIELDS)), row=np.zeros((angles, size, 2), dtype=np.int64),
        gradient=np.zeros((angles, size, 2, 4 * components)),
    )  # fmt: skip


@allocating
def fill_lines(lines, phi, kinematics, gears, layers, z):
    """Place sections at as many pinion angles as there is room for, gradients 0; arguments as of `place_lines`."""
    angles, size = lines.gap.shape
    sections = len(z)
    forward, back = Motion(np.empty((3, 3)), np.empty(3)), Motion(np.empty((3, 3)), np.empty(3))
    carriers, alike = Carriers(np.empty(2, dtype=np.int64), np.empty((2, 4))), sections_alike(kinematics, gears)
    for i in range(angles):
        lines.first_pair[i] = _first_pair(phi[i], kinematics, size // sections)
        for n in range(size):
            if alike and n % sections > 0:
                _copy_section(lines, i, n)
                continue
            roll_position = phi[i] + (lines.first_pair[i] + n // sections) * kinematics.pitch
            if _within(lines, i, n, kinematics, gears, roll_position, z[n % sections]):
                contact_point = _place(lines, i, n, kinematics, gears, roll_position, z[n % sections], forward, back)
                _carry(lines, i, n, gears, layers, contact_point, carriers)


@compiled
def _first_pair(phi, kinematics, pair_count):
    """As many pairs as can touch, about the middle of the path."""
    middle = 0.5 * (kinematics.path_start + kinematics.path_end)
    return int(np.ceil((middle - phi) / kinematics.pitch - 0.5 * pair_count))


@compiled
def _within(places, i, n, kinematics, gears, roll_position, z):
    """Whether a section can touch; so far beyond the path a corner would meet the mate's other side."""
    section, margin = roll_position + gears[0].twist * z, 0.5 * kinematics.pitch
    if kinematics.path_start - margin <= section <= kinematics.path_end + margin:
        return True
    places.gap[i, n], places.lever[i, n], places.mate_lever[i, n] = np.inf, -gears[0].base_radius, gears[1].base_radius
    return False


@compiled
def _place(places, i, n, kinematics, gears, roll_position, z, forward, back):
    touch = kinematics.first_touch
    contact_point = closest_approach(kinematics, gears, roll_position, touch, z, forward, back)
    # Placed where plain flanks first touch; gaps are those at advance 0.
    places.gap[i, n] = contact_point.gap - contact_point.lever * touch
    places.lever[i, n], places.mate_lever[i, n] = contact_point.lever, contact_point.mate_lever
    places.lever_slope[i, n] = contact_point.lever_slope
    if contact_point.lever > -LEAST_LEVER * gears[0].base_radius:
        places.gap[i, n], places.lever[i, n], places.lever_slope[i, n] = np.inf, -gears[0].base_radius, 0.0
    places.corner_advance[i, n] = touch + contact_point.corner_advance
    places.roll[i, n, 0], places.roll[i, n, 1] = contact_point.pinion_roll, contact_point.wheel_roll
    return contact_point


@compiled
def _carry(lines, i, n, gears, layers, contact_point, carriers):
    parts = lines.gradient.shape[3] // 4
    for gear in range(2):
        roll, u = gears[gear].roll, roll_of(contact_point, gear)
        carriers.row[gear] = cubic_rows(roll, u, 0, len(roll) - 1, carriers.weight[gear])
        # Four rows in any case: of a flank with fewer elements the first ones have no share.
        row = min(carriers.row[gear], len(roll) - 4)
        behind = carriers.row[gear] - row
        lines.row[i, n, gear] = row
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
    """Fill `out`, shape (A, N), with the deviations of both flanks, added up, in all sections, mm.

    Parameters
    ----------
    lines : Lines or Places
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
