"""Schemes "line" and "strip": where two involutes meet in a transverse section, and which nodes carry that.

Both take the flanks for the involutes they are, displaced by the nodal displacements that a cubic along the profile
interpolates, with slopes of the parabola through each node and its neighbours (C1 in the arc length). A section is one
column of nodes. To first order in the displacements: normals, levers and closest points are those of the undeformed
involutes, which are parallel curves about their base circles and therefore need no iteration. In a tooth's frame the
involute at roll angle u is at r_b (e + u e'), with e the unit vector at the angle half - u from +y and e' the one at
right angles, which is also the outward normal.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pmor.contact.kernels.compiling import compiled
from pmor.contact.kernels.motion import roll_angle, section_motion
from pmor.contact.kernels.types import AT_ROOT, AT_TIP, ELEMENT_ROWS, FIRST, FIRST_ROW, NODE_ROWS, OFFSET


class Meeting(NamedTuple):
    """Where two flanks meet in a section.

    Attributes
    ----------
    gap : float
        Without displacements, mm.
    pinion_roll, wheel_roll : float
        Roll angles on both flanks, rad.
    pinion_x, pinion_y, wheel_x, wheel_y : float
        Direction in which a displacement of the pinion's and of the wheel's point opens the gap, in its tooth's frame.
    lever, mate_lever : float
        Derivative of the gap by the pinion's rotation; lever arm of the force on the wheel, mm.
    """

    gap: float
    pinion_roll: float
    wheel_roll: float
    pinion_x: float
    pinion_y: float
    wheel_x: float
    wheel_y: float
    lever: float
    mate_lever: float


@compiled
def roll_of(meeting, gear):
    """Roll angle on a gear's flank, rad."""
    return meeting.pinion_roll if gear == 0 else meeting.wheel_roll


@compiled
def opening_of(meeting, gear):
    """Direction in which a displacement of a gear's point opens the gap."""
    if gear == 0:
        return meeting.pinion_x, meeting.pinion_y
    return meeting.wheel_x, meeting.wheel_y


@compiled
def cubic_rows(roll, u, low, high, weights):
    """Row of the first of four nodes, and weights of the cubic along the profile at roll angle u, for value at u.

    Parameters
    ----------
    roll : ndarray
        Roll angles of the node rows.
    u : float
        Held inside the element rows `low` to `high` - 1.
    low, high : int
    weights : ndarray, shape (4,)
        Filled; a fourth row that the end of the flank cuts off has weight 0.
    """
    last = len(roll) - 1
    i = min(max(np.searchsorted(roll, u, side="right") - 1, low), high - 1)
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
def involute_foot(gears, slave, u, motion):
    """Meeting of the point of the slave's involute at roll angle u with the master's involute.

    `motion` leads from the slave's tooth to the master's.
    """
    own, mate = gears[slave], gears[1 - slave]
    rotation, shift = motion.rotation, motion.shift
    angle = own.half_angle - u
    px = own.base_radius * (-np.sin(angle) - u * np.cos(angle))
    py = own.base_radius * (np.cos(angle) - u * np.sin(angle))
    x = rotation[0, 0] * px + rotation[0, 1] * py + shift[0]
    y = rotation[1, 0] * px + rotation[1, 1] * py + shift[1]
    roll = np.sqrt(max((x * x + y * y) / mate.base_radius**2 - 1.0, 0.0))
    offset = np.arctan2(-x, y) - (mate.half_angle - roll + np.arctan(roll))
    turn = mate.half_angle - roll + offset
    nx, ny = -np.cos(turn), -np.sin(turn)
    # Undeformed: the same normal carries the force on both, whether the point is inside a flank or its corner.
    own_x, own_y = rotation[0, 0] * nx + rotation[1, 0] * ny, rotation[0, 1] * nx + rotation[1, 1] * ny
    slave_arm = (x - shift[0]) * ny - (y - shift[1]) * nx
    # The foot is on the mate's flank, not on the parallel involute through the point.
    gap, mate_roll = mate.base_radius * offset, roll - offset
    if slave == 0:
        return Meeting(gap, u, mate_roll, own_x, own_y, -nx, -ny, slave_arm, mate.base_radius)
    return Meeting(gap, mate_roll, u, -nx, -ny, own_x, own_y, -mate.base_radius, -slave_arm)


@compiled
def closest_approach(kinematics, gears, roll_position, lead, z, forward, back):
    """Meeting at the closest approach of two undeformed flanks in the section at z (mm).

    Between the tips it lies on the line of action, which each flank meets at its own roll angle; beyond, a tip corner
    meets the mate. `forward` and `back` are filled as in `section_motion`.
    """
    turn, opening = section_motion(kinematics, gears, roll_position, lead, z, forward, back)
    ahead = lead + kinematics.first_touch + turn
    pinion_roll = roll_angle(kinematics, gears, 0, roll_position) + ahead
    wheel_roll = roll_angle(kinematics, gears, 1, roll_position) + turn
    if pinion_roll > gears[0].tip_roll:
        return involute_foot(gears, 0, gears[0].tip_roll, forward)
    if wheel_roll > gears[1].tip_roll:
        return involute_foot(gears, 1, gears[1].tip_roll, back)
    pinion, wheel = gears[0].half_angle - pinion_roll, gears[1].half_angle - wheel_roll
    return Meeting(
        opening - gears[0].base_radius * lead, pinion_roll, wheel_roll, np.cos(pinion), np.sin(pinion),
        np.cos(wheel), np.sin(wheel), -gears[0].base_radius, gears[1].base_radius,
    )  # fmt: skip


@compiled
def carry(gears, windows, meeting, carriers):
    """Find the nodes that carry a meeting, on both flanks; return whether it is inside both windows.

    Parameters
    ----------
    gears : two Gear
    windows : ndarray of int, shape (2, 7)
        Of the tooth pair.
    meeting : Meeting
    carriers : Carriers
        Filled.
    """
    inside = True
    for gear in range(2):
        roll, window, u = gears[gear].roll, windows[gear], roll_of(meeting, gear)
        low = window[FIRST_ROW]
        high = low + window[ELEMENT_ROWS]
        carriers.row[gear] = cubic_rows(roll, u, low, high, carriers.weight[gear])
        beyond_low = window[AT_ROOT] == 0 and u < roll[low]
        inside = inside and not beyond_low and not (window[AT_TIP] == 0 and u > roll[high])
    return inside


@compiled
def gap_change(moved, columns, windows, meeting, carriers, column):
    """Change of the gap (mm) by the displacements `moved`, shape (nodes, 3), in one section of `columns`."""
    change = 0.0
    for gear in range(2):
        window, (x, y) = windows[gear], opening_of(meeting, gear)
        first = window[FIRST_ROW] - window[FIRST]
        for a in range(4):
            weight = carriers.weight[gear, a]
            if weight != 0.0:
                node = moved[window[OFFSET] + (carriers.row[gear] + a - first) * columns + column]
                change += weight * (x * node[0] + y * node[1])
    return change


@compiled
def list_point(columns, windows, meeting, carriers, column, slave, gap, stiffness, count, points):
    """Write a point of a section, of `columns`, into the list."""
    points.gap[count], points.stiffness[count] = gap, stiffness
    points.lever[count], points.mate_lever[count] = meeting.lever, meeting.mate_lever
    node, weight, place = points.node, points.weight, points.place
    for side in range(2):
        gear = slave ^ side
        window, (x, y) = windows[gear], opening_of(meeting, gear)
        first = window[FIRST_ROW] - window[FIRST]
        for a in range(4):
            row = min(carriers.row[gear] + a - first, window[NODE_ROWS] - 1)
            node[count, 4 * side + a] = window[OFFSET] + row * columns + column
            weight[count, 4 * side + a, 0] = carriers.weight[gear, a] * x
            weight[count, 4 * side + a, 1] = carriers.weight[gear, a] * y
            weight[count, 4 * side + a, 2] = 0.0
        place[count, 2 * side], place[count, 2 * side + 1] = carriers.row[gear] - window[FIRST_ROW], column
