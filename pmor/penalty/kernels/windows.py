"""Which tooth pairs can touch, and which element rows of their flanks: everything follows from the kinematics."""

from __future__ import annotations

import numpy as np

from pmor.core.compiling import allocating, compiled
from pmor.core.linear import entries_below, entries_up_to
from pmor.gear.kernels.deviation import flank_deviation
from pmor.gear.kernels.motion import roll_angle, section_roll_position
from pmor.penalty.kernels.types import (
    AT_ROOT,
    AT_TIP,
    ELEMENT_ROWS,
    FIRST,
    FIRST_ROW,
    NODE_ROWS,
    OFFSET,
    ActivePatches,
)


@compiled
def _on_flank(gear, roll):
    return min(max(roll, gear.form_roll), gear.tip_roll)


@compiled
def relative_radius(kinematics, gears, least_radius, roll_position):
    """Relative radius of curvature of the flanks where a pair at a roll position (rad) touches, mm."""
    curvature = 0.0
    for gear in range(2):
        roll = _on_flank(gears[gear], roll_angle(kinematics, gears, gear, roll_position))
        curvature += 1.0 / max(roll * gears[gear].base_radius, least_radius)
    return 1.0 / curvature


@compiled
def overshoot(kinematics, gears, least_radius, depth):
    """How far beyond the path of contact an approach `depth` (mm) makes a pair touch, rad of roll position."""
    at_start = relative_radius(kinematics, gears, least_radius, kinematics.path_start)
    radius = max(at_start, relative_radius(kinematics, gears, least_radius, kinematics.path_end))
    return min(np.sqrt(2.0 * depth * radius) / gears[0].base_radius, 0.5 * kinematics.pitch)


@compiled
def element_row(kinematics, gears, gear, roll_position):
    """Where on a gear's flank its kinematic contact at a roll position (rad) is, in element rows."""
    flank = gears[gear]
    roll, rows = _on_flank(flank, roll_angle(kinematics, gears, gear, roll_position)), len(flank.roll) - 1
    row = min(max(entries_up_to(flank.roll, roll) - 1, 0), rows - 1)
    return row + (roll - flank.roll[row]) / (flank.roll[row + 1] - flank.roll[row])


@compiled
def _place_window(gear, start, end, half, offset, window):
    """Cut the element rows from the roll angle `start` to `end`, and within the arc length `half` of them."""
    rows = len(gear.roll) - 1
    span = 2.0 * half / gear.base_radius  # arc length s = r_b u^2 / 2
    low = entries_up_to(gear.roll, np.sqrt(max(start**2 - span, 0.0))) - 1
    high = entries_below(gear.roll, np.sqrt(end**2 + span))
    low = min(max(low, 0), rows - 1)
    high = min(max(high, low + 1), rows)
    node_low, node_high = max(low - 1, 0), min(high + 1, rows)
    window[OFFSET], window[NODE_ROWS], window[FIRST] = offset, node_high - node_low + 1, low - node_low
    window[ELEMENT_ROWS], window[FIRST_ROW] = high - low, low
    window[AT_ROOT], window[AT_TIP] = 1 if low == 0 else 0, 1 if high == rows else 0


@allocating
def place_windows(phi, depth, clear, pair_count, kinematics, gears, limits):
    """Find the tooth pairs and windows that can touch, in any section of the face width.

    Parameters
    ----------
    phi : float
        Pinion angle, rad.
    depth : float
        Approach of the flanks to allow for, mm.
    clear : float
        Gap beyond which a row of contact points is clear of the mate, mm.
    pair_count : int
        Tooth pairs that can touch at most.
    kinematics : Kinematics
    gears : two Gear
    limits : WindowLimits

    Returns
    -------
    patches : ActivePatches
    nodes : int
        Number of nodes of all windows.
    """
    index, windows = np.zeros(pair_count, dtype=np.int64), np.zeros((pair_count, 2, 7), dtype=np.int64)
    centre = np.zeros((pair_count, 2))
    pitch, margin = kinematics.pitch, overshoot(kinematics, gears, limits.least_radius, depth)
    start, end = kinematics.path_start - margin, kinematics.path_end + margin
    # By how much the section that is farthest behind, and the one farthest ahead, differ from that at z = 0.
    one = section_roll_position(gears, 0.0, kinematics.face_low)
    other = section_roll_position(gears, 0.0, kinematics.face_high)
    behind, ahead = min(one, other), max(one, other)
    low = int(np.ceil((start - ahead - phi) / pitch - 1e-12))
    high = int(np.floor((end - behind - phi) / pitch + 1e-12))
    pairs, offset = 0, 0
    for number in range(low, high + 1):
        roll_position = phi + number * pitch
        first, last = max(roll_position + behind, start), min(roll_position + ahead, end)
        middle, radius = 0.5 * (first + last), 0.0
        for place in (first, middle, last):
            radius = max(radius, relative_radius(kinematics, gears, limits.least_radius, place))
        # Wherever contact lies, a row of points on either side of it is inside, not on the border.
        half = max(np.sqrt(2.0 * limits.local_share * depth * radius), 1.5 * limits.row_spacing)
        for gear in range(2):
            flank, window = gears[gear], windows[pairs, gear]
            one = _on_flank(flank, roll_angle(kinematics, gears, gear, first))
            other = _on_flank(flank, roll_angle(kinematics, gears, gear, last))
            _place_window(flank, min(one, other), max(one, other), half, offset, window)
            centre[pairs, gear] = element_row(kinematics, gears, gear, middle)
            offset += window[NODE_ROWS] * flank.nodes.shape[1]
        index[pairs] = number
        pairs += 1
    return ActivePatches(phi, pairs, index, windows, centre, clear), offset


@compiled
def load_windows(patches, gears, deviations, out):
    """Fill `out`, shape (nodes, 3), with the undeformed nodes of all windows (mm), where the flanks deviate to."""
    for p in range(patches.pairs):
        for gear in range(2):
            nodes, window = gears[gear].nodes, patches.windows[p, gear]
            low = window[FIRST_ROW] - window[FIRST]
            tooth = patches.tooth_pair[p] if gear == 0 else -patches.tooth_pair[p]
            for i in range(window[NODE_ROWS]):
                for k in range(nodes.shape[1]):
                    for d in range(3):
                        out[window[OFFSET] + i * nodes.shape[1] + k, d] = nodes[low + i, k, d]
                    node = out[window[OFFSET] + i * nodes.shape[1] + k]
                    _deviate(gears[gear], deviations[gear], low + i, tooth, node)


@compiled
def _deviate(gear, deviation, row, tooth, node):
    """Move a node into the material, along the involute's normal in its transverse section."""
    if deviation.present:
        amount = flank_deviation(deviation, gear.roll[row], node[2], tooth)
        angle = gear.half_angle - gear.roll[row] + gear.twist * node[2]  # see `sections`
        node[0] += amount * np.cos(angle)
        node[1] += amount * np.sin(angle)


@compiled
def pinion_slave_share(kinematics, scheme, roll_position):
    """Share of the penalty with which the pinion is the slave.

    Where the gear whose tip is nearer is the slave, a tip corner always meets the smooth flank of its mate, on either
    gear alike; the two hand over smoothly in the middle fifth of the path of contact.
    """
    if scheme.pinion_share >= 0.0:
        return scheme.pinion_share
    start, end = kinematics.path_start, kinematics.path_end
    x = min(max(5.0 * (roll_position - start) / (end - start) - 2.0, 0.0), 1.0)
    return x * x * (3.0 - 2.0 * x)
