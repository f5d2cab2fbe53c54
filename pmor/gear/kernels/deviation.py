"""Deviations of a gear's loaded flanks from the involute helicoid: modifications, errors of manufacture, pitch.

Amounts are lengths in mm along the transverse line of action, positive where material is removed, zero at the
reference: they add to the gap of the flanks. A normal amount, as measuring machines print it, is cos(beta_b) times
that, with beta_b the base helix angle. Roll angles are the gear's own, in rad; z is counted from mid width of the pair,
in mm. `pmor.gear.modification` defines each term.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.compiling import compiled, inlined
from pmor.core.linear import entries_up_to


class Deviation(NamedTuple):
    """Deviation of the loaded flanks of one gear.

    Attributes
    ----------
    present : bool
        Whether they deviate at all; otherwise all else is ignored.
    middle_roll, roll_span : float
        Middle and length of the active profile, rad.
    middle_z, width : float
        Where the gear's own mid width is, and its face width, mm.
    tip_relief : float
        At the tip circle, mm.
    tip_relief_start, tip_relief_span : float
        Where it starts, and how far it is from there to the tip circle, rad.
    tip_relief_parabolic : bool
        Whether it grows with the square of the way, not with the way.
    root_relief : float
        At the start of the active profile, mm.
    root_relief_end, root_relief_span : float
        Where it ends, and how far it is from there down to the start of the active profile, rad.
    profile_crowning, profile_slope : float
        At both ends of the active profile; from its one end to the other, mm.
    helix_crowning, helix_slope : float
        At both faces; from the face with the smaller z to the other, mm.
    end_relief, end_relief_length : float
        At both faces, and how far it reaches from there, mm.
    twist : float
        By which the helix slope at the end of the active profile exceeds the one at its start, mm.
    pitch : ndarray, shape (teeth,)
        Of the flank of each tooth, mm; empty where there is none.
    angular_pitch : float
        Of the gear, of the sign of its number of teeth, rad.
    waves : ndarray, shape (W, 4)
        Of each wave: number in a revolution, amplitude, mm, phase at the gear's own mid width, rad, and its slope along
        z, rad/mm.
    grid_roll, grid_z : ndarray, shape (n,), (m,)
        Of a topography's points, ascending, rad and mm, z from the gear's own mid width; empty without one.
    grid : ndarray, shape (T, n, m, 4)
        Its amount, mm, with its slopes by roll angle, by z and by both: of all teeth, T = 1, or of each.
    """

    present: bool
    middle_roll: float
    roll_span: float
    middle_z: float
    width: float
    tip_relief: float
    tip_relief_start: float
    tip_relief_span: float
    tip_relief_parabolic: bool
    root_relief: float
    root_relief_end: float
    root_relief_span: float
    root_relief_parabolic: bool
    profile_crowning: float
    profile_slope: float
    helix_crowning: float
    helix_slope: float
    end_relief: float
    end_relief_length: float
    twist: float
    pitch: FloatArray
    angular_pitch: float
    waves: FloatArray
    grid_roll: FloatArray
    grid_z: FloatArray
    grid: FloatArray


@inlined
def flank_deviation(deviation, u, z, tooth):
    """Deviation of a gear's flank at one of its points, mm.

    Parameters
    ----------
    deviation : Deviation
        Of that gear.
    u : float
        The gear's own roll angle, rad; beyond the profile every law goes on.
    z : float
        From mid width of the pair, mm.
    tooth : int
        Counted counter-clockwise on that gear, over whole turns too: j for the pinion and -j for the wheel in the tooth
        pair j.
    """
    if not deviation.present:
        return 0.0
    d, amount = deviation, 0.0
    if d.tip_relief != 0.0 and (u - d.tip_relief_start) * d.roll_span > 0.0:
        amount += _relief((u - d.tip_relief_start) / d.tip_relief_span, d.tip_relief, d.tip_relief_parabolic)
    if d.root_relief != 0.0 and (d.root_relief_end - u) * d.roll_span > 0.0:
        amount += _relief((d.root_relief_end - u) / d.root_relief_span, d.root_relief, d.root_relief_parabolic)
    xi, zeta = (u - d.middle_roll) / d.roll_span, (z - d.middle_z) / d.width  # -1/2 to 1/2
    amount += 4.0 * (d.profile_crowning * xi * xi + d.helix_crowning * zeta * zeta)
    amount += d.profile_slope * xi + d.helix_slope * zeta + d.twist * xi * zeta
    if d.end_relief != 0.0:
        inwards = (0.5 - abs(zeta)) * d.width
        if inwards < d.end_relief_length:
            amount += d.end_relief * (1.0 - inwards / d.end_relief_length)
    if d.grid_roll.size > 0:
        amount += _on_grid(d, d.grid[tooth % len(d.grid)], u, z - d.middle_z)
    if d.pitch.size > 0:
        amount += d.pitch[tooth % d.pitch.size]
    for w in range(len(d.waves)):
        # By the angle at which the line of action touches the base circle, seen from the gear: one for all its teeth.
        phase = d.waves[w, 0] * (u - tooth * d.angular_pitch) + d.waves[w, 2] + d.waves[w, 3] * (z - d.middle_z)
        amount += d.waves[w, 1] * np.cos(phase)
    return amount


@compiled
def deviations_at(deviation, u, z, tooth, out):
    """Fill `out` (mm) with a gear's deviations at roll angles u (rad), places z (mm) and teeth, all of shape (n,)."""
    for i in range(len(out)):
        out[i] = flank_deviation(deviation, u[i], z[i], tooth[i])


@inlined
def _relief(way, amount, parabolic):
    return amount * way * way if parabolic else amount * way


@inlined
def _on_grid(d, grid, u, z):
    """Bicubic with continuous slopes through the grid's points, constant beyond its border."""
    i, u0, u1, du0, du1 = _cell(d.grid_roll, u)
    k, z0, z1, dz0, dz1 = _cell(d.grid_z, z)
    amount = 0.0
    for a in range(2):
        value, slope = (u0, du0) if a == 0 else (u1, du1)
        low, high = grid[i + a, k], grid[i + a, k + 1]
        amount += value * (z0 * low[0] + z1 * high[0] + dz0 * low[2] + dz1 * high[2])
        amount += slope * (z0 * low[1] + z1 * high[1] + dz0 * low[3] + dz1 * high[3])
    return amount


@inlined
def _cell(grid, x):
    """Number of the interval that x is in, and the weights of value and slope at either end of it."""
    i = min(max(entries_up_to(grid, x) - 1, 0), len(grid) - 2)
    h = grid[i + 1] - grid[i]
    s = min(max((x - grid[i]) / h, 0.0), 1.0)
    rising = s * s * (3.0 - 2.0 * s)
    return i, 1.0 - rising, rising, h * s * (1.0 - s) ** 2, h * s * s * (s - 1.0)
