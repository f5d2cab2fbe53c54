"""Contact points of two involutes in a transverse section, and the nodes that carry them.

The flanks are the involutes that they stand for, displaced by the nodal displacements that a cubic along the profile
interpolates, with slopes of the parabola through each node and its neighbours (C1 in the arc length). To first order
in the displacements: normals, levers and closest points are those of the undeformed involutes, which are parallel
curves about their base circles, so that no iteration is needed. In a tooth's frame the involute at roll angle u is at
r_b (e + u e'), with e the unit vector at the angle half - u from +y and e' the one at right angles, which is also the
outward normal.

In the section at z a helical pair is the spur pair whose pinion is turned further by the twist over z. Gaps are along
the transverse line of action. A displacement along the axis opens them too: the direction (x, y, z) is the flank's
normal over cos(base helix angle), at right angles to the flank's screw motion along itself.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pmor.core.compiling import compiled
from pmor.gear.kernels.motion import axial_opening, roll_angle, section_motion

# Advances are far below this, rad.
CORNER = 0.01
# Roll angle of a corner's foot below which the mate's normal turns no faster, rad: the flank ends at the base circle.
LEAST_ROLL = 0.01


class ContactPoint(NamedTuple):
    """Contact point of two flanks in a section.

    Attributes
    ----------
    gap : float
        Without displacements, mm.
    pinion_roll, wheel_roll : float
        Roll angles on both flanks, rad.
    pinion_x, pinion_y, pinion_z, wheel_x, wheel_y, wheel_z : float
        Gradient of the gap by the displacement of the pinion's and of the wheel's point, in the frame of its tooth.
    lever, mate_lever : float
        Derivative of the gap by the pinion's rotation; lever arm of the force on the wheel, mm.
    lever_slope, corner_advance : float
        Derivative of the lever by the pinion's rotation, mm, from an advance (rad) on that brings its corner to the
        line of action, and turns the lever; 0 where that is far.
    slant : float
        Angle between the flank of the gear whose corner meets the mate and the mate's, rad; 0 between the corners.
    """

    gap: float
    pinion_roll: float
    wheel_roll: float
    pinion_x: float
    pinion_y: float
    pinion_z: float
    wheel_x: float
    wheel_y: float
    wheel_z: float
    lever: float
    mate_lever: float
    lever_slope: float
    corner_advance: float
    slant: float


@compiled
def roll_of(contact_point, gear):
    """Roll angle on a gear's flank, rad."""
    return contact_point.pinion_roll if gear == 0 else contact_point.wheel_roll


@compiled
def opening_of(contact_point, gear):
    """Return the gradient of the gap by the displacement of a gear's point."""
    if gear == 0:
        return contact_point.pinion_x, contact_point.pinion_y, contact_point.pinion_z
    return contact_point.wheel_x, contact_point.wheel_y, contact_point.wheel_z


@compiled
def cubic_rows(roll, u, low, high, weights):
    """Row of the first of four nodes, and weights of the cubic along the profile at roll angle u, for value at u.

    Parameters
    ----------
    roll : ndarray
        Roll angles of the node rows, rising or falling.
    u : float
        Held inside the element rows `low` to `high` - 1.
    low, high : int
    weights : ndarray, shape (4,)
        Filled; a fourth row that the end of the flank cuts off has weight 0.
    """
    i, above, last = low, high, len(roll) - 1
    falls = roll[last] < roll[0]
    while above - i > 1:
        middle = (i + above) // 2
        if (roll[middle] > u) != falls:
            above = middle
        else:
            i = middle
    base, x = max(i - 1, 0), roll[i] ** 2  # the arc length is proportional to the square of the roll angle
    h = roll[i + 1] ** 2 - x
    s = min(max((u * u - x) / h, 0.0), 1.0)
    weights[:] = 0.0
    weights[i - base] = (1.0 + 2.0 * s) * (1.0 - s) ** 2
    weights[i + 1 - base] = s * s * (3.0 - 2.0 * s)
    for end in range(2):
        slope = h * (s * (1.0 - s) ** 2 if end == 0 else s * s * (s - 1.0))
        centre = min(max(i + end, 1), last - 1)
        before = roll[centre] ** 2 - roll[centre - 1] ** 2
        after = roll[centre + 1] ** 2 - roll[centre] ** 2
        t = roll[i + end] ** 2 - roll[centre] ** 2
        weights[centre - 1 - base] += slope * (2.0 * t - after) / (before * (before + after))
        weights[centre - base] -= slope * (2.0 * t + before - after) / (before * after)
        weights[centre + 1 - base] += slope * (2.0 * t + before) / (after * (before + after))
    return base


@compiled
def involute_foot(gears, slave, u, radius, motion):
    """ContactPoint of the point of the slave's involute at roll angle u with the master's involute.

    With a radius (mm), of the arc that goes on from that point, tangentially: its centre keeps that distance, and the
    normal through it carries the force. `motion` takes the slave's tooth to the master's.
    """
    own, mate = gears[slave], gears[1 - slave]
    rotation, shift = motion.rotation, motion.shift
    angle = own.half_angle - u
    along = own.base_radius * u - radius
    px = -own.base_radius * np.sin(angle) - along * np.cos(angle)
    py = own.base_radius * np.cos(angle) - along * np.sin(angle)
    x = rotation[0, 0] * px + rotation[0, 1] * py + shift[0]
    y = rotation[1, 0] * px + rotation[1, 1] * py + shift[1]
    roll = np.sqrt(max((x * x + y * y) / mate.base_radius**2 - 1.0, 0.0))
    side = np.copysign(1.0, mate.base_radius)
    offset = np.arctan2(-side * x, side * y) - (mate.half_angle - roll + np.arctan(roll))
    turn = mate.half_angle - roll + offset
    nx, ny = -np.cos(turn), -np.sin(turn)
    # Undeformed: the same normal carries the force on both, whether the point is inside a flank or its corner.
    own_x, own_y = rotation[0, 0] * nx + rotation[1, 0] * ny, rotation[0, 1] * nx + rotation[1, 1] * ny
    slave_arm = (x - shift[0]) * ny - (y - shift[1]) * nx
    # The foot is on the mate's flank, not on the parallel involute through the point.
    gap, mate_roll = mate.base_radius * offset - radius, roll - offset
    # The flank that is met is smooth: its normal is that of the force on both.
    axial = -mate.twist * mate.base_radius
    slant = np.arcsin(np.sin(angle) * own_x - np.cos(angle) * own_y)
    at_tip = own.undercut_roll == 0.0 or u > own.undercut_roll
    if not at_tip:  # the flank goes on towards the tip
        slant = -slant
    lever, mate_lever, slope = -mate.base_radius, -slave_arm, 0.0
    pinion, wheel = (mate_roll, -nx, -ny, -axial), (u, own_x, own_y, axial)
    # The mate's normal is at its base radius wherever the wheel's corner is. The pinion's corner turns with the pinion:
    if slave == 0:
        lever, mate_lever, pinion, wheel = slave_arm, mate.base_radius, wheel, pinion
        arm_x, arm_y = x - shift[0], y - shift[1]
        # By how much the normal turns as the corner moves over the mate, (-arm_y, arm_x) for each radian.
        square, rising = x * x + y * y, max(roll, LEAST_ROLL)
        turning = (x * arm_x + y * arm_y) / square - (y * arm_x - x * arm_y) / (square * rising)
        slope = (arm_x * nx + arm_y * ny) * (turning - 1.0) if at_tip else 0.0
    return ContactPoint(
        gap=gap, pinion_roll=pinion[0], wheel_roll=wheel[0], pinion_x=pinion[1], pinion_y=pinion[2],
        pinion_z=pinion[3], wheel_x=wheel[1], wheel_y=wheel[2], wheel_z=wheel[3], lever=lever, mate_lever=mate_lever,
        lever_slope=slope, corner_advance=0.0, slant=slant,
    )  # fmt: skip


@compiled
def _tip_foot(gears, slave, motion):
    """ContactPoint of the edge at the slave's tip with the master's involute."""
    return involute_foot(gears, slave, gears[slave].tip_roll, gears[slave].edge_radius, motion)


@compiled
def _corner_foot(gears, gear, roll, forward, back):
    """ContactPoint at the end of the path near a gear's tip, beyond which the line of action meets it at `roll`.

    Two corners end the flanks there: that gear's tip, and the undercut edge of its mate. The one that lies farther
    inside meets the other flank.
    """
    mate = 1 - gear
    if gears[gear].base_radius * (roll - gears[gear].tip_roll) > 0.0:
        found = _tip_foot(gears, gear, forward if gear == 0 else back)
        if not _undercut(gears[mate], roll_of(found, mate)):
            return found
    return involute_foot(gears, mate, gears[mate].undercut_roll, 0.0, forward if mate == 0 else back)


@compiled
def closest_approach(kinematics, gears, roll_position, advance, z, forward, back):
    """ContactPoint at the closest approach of two undeformed flanks in the section at z (mm).

    Between the corners of the flanks it lies on the line of action, which each flank meets at its own roll angle;
    beyond, a tip corner or the edge of an undercut meets the mate. `forward` and `back` are filled as in
    `section_motion`.
    """
    section = roll_position + gears[0].twist * z
    turn, opening = section_motion(kinematics, gears, section, advance, z, forward, back)
    ahead = advance + turn
    pinion_roll = roll_angle(kinematics, gears, 0, section) + ahead
    wheel_roll = roll_angle(kinematics, gears, 1, section) + turn
    aside = axial_opening(kinematics, gears, pinion_roll)
    if pinion_roll > gears[0].tip_roll or _undercut(gears[1], wheel_roll):
        return _turned(_corner_foot(gears, 0, pinion_roll, forward, back), gears, z, aside)
    if gears[1].base_radius * (wheel_roll - gears[1].tip_roll) > 0.0 or _undercut(gears[0], pinion_roll):
        return _turned(_corner_foot(gears, 1, wheel_roll, forward, back), gears, z, aside)
    slope = 0.0
    if pinion_roll > gears[0].tip_roll - CORNER:
        slope = _tip_foot(gears, 0, forward).lever_slope
    pinion, wheel = gears[0].half_angle - pinion_roll, gears[1].half_angle - wheel_roll
    axial = gears[0].twist * gears[0].base_radius
    contact_point = ContactPoint(
        gap=opening - gears[0].base_radius * advance, pinion_roll=pinion_roll, wheel_roll=wheel_roll,
        pinion_x=np.cos(pinion), pinion_y=np.sin(pinion), pinion_z=axial, wheel_x=np.cos(wheel), wheel_y=np.sin(wheel),
        wheel_z=-axial, lever=-gears[0].base_radius, mate_lever=gears[1].base_radius, lever_slope=slope,
        corner_advance=gears[0].tip_roll - pinion_roll, slant=0.0,
    )  # fmt: skip
    return _turned(contact_point, gears, z, aside)


@compiled
def _undercut(gear, roll):
    return gear.undercut_roll > 0.0 and roll < gear.undercut_roll


@compiled
def _turned(contact_point, gears, z, aside):
    """A contact_point in the section at z seen from the teeth's frames, which are those of the section z = 0."""
    if gears[0].twist == 0.0:
        return contact_point
    c, s = np.cos(gears[0].twist * z), np.sin(gears[0].twist * z)
    pinion_x, pinion_y = (
        c * contact_point.pinion_x - s * contact_point.pinion_y,
        s * contact_point.pinion_x + c * contact_point.pinion_y,
    )
    c, s = np.cos(gears[1].twist * z), np.sin(gears[1].twist * z)
    wheel_x, wheel_y = (
        c * contact_point.wheel_x - s * contact_point.wheel_y,
        s * contact_point.wheel_x + c * contact_point.wheel_y,
    )
    return ContactPoint(
        gap=contact_point.gap + aside, pinion_roll=contact_point.pinion_roll, wheel_roll=contact_point.wheel_roll,
        pinion_x=pinion_x, pinion_y=pinion_y, pinion_z=contact_point.pinion_z, wheel_x=wheel_x, wheel_y=wheel_y,
        wheel_z=contact_point.wheel_z, lever=contact_point.lever, mate_lever=contact_point.mate_lever,
        lever_slope=contact_point.lever_slope, corner_advance=contact_point.corner_advance, slant=contact_point.slant,
    )  # fmt: skip
