"""Penalty pressure over the strips in which exact flanks overlap: a smooth function of everything, nothing refined."""

from __future__ import annotations

import numpy as np

from pmor.core.compiling import allocating, compiled
from pmor.gear.kernels.motion import roll_angle, section_motion
from pmor.gear.kernels.types import AT_ROOT, AT_TIP, ELEMENT_ROWS, FIRST_ROW
from pmor.line.kernels.contact_point import carry, gap_change, involute_foot, list_point, roll_of
from pmor.penalty.kernels.state import Found


@compiled
def _strip_gap(moved, pair, windows, slave, u, motion, column, carriers):
    """Gap of the slave's point at roll angle u in a section, whether both windows hold the point, and the contact point."""
    contact_point = involute_foot(pair.gears, slave, u, 0.0, motion)
    inside = carry(pair.gears, windows, contact_point, carriers)
    change = gap_change(moved, pair.gears, pair.sections, windows, contact_point, carriers, column)
    return contact_point.gap + change, inside, contact_point


@compiled
def _strip_end(moved, pair, windows, slave, low, gap_low, high, gap_high, motion, column, carriers):
    """Where the gap changes sign between two roll angles, by false position with halving (Illinois)."""
    side, u = 0, low
    for _ in range(60):
        u = (low * gap_high - high * gap_low) / (gap_high - gap_low)
        gap, _inside, _meeting = _strip_gap(moved, pair, windows, slave, u, motion, column, carriers)
        if abs(gap) <= 1e-15 or abs(high - low) <= 1e-14:
            break
        if (gap < 0.0) == (gap_low < 0.0):
            low, gap_low = u, gap
            gap_high = 0.5 * gap_high if side == 1 else gap_high
            side = 1
        else:
            high, gap_high = u, gap
            gap_low = 0.5 * gap_low if side == -1 else gap_low
            side = -1
    return u


@compiled
def _strip_borders(gears, window, slave, centre, motion, borders):
    """Roll angles of the slave between which the gap is smooth, in order; return their number.

    The node rows of its window, the closest approach `centre`, and the place that faces the master's tip, where the
    list ends or begins.
    """
    roll, first, rows = gears[slave].roll, window[FIRST_ROW], window[ELEMENT_ROWS]
    mate, low, high = gears[1 - slave], roll[first], roll[first + rows]
    # Towards the slave's root is towards the master's tip.
    start = low
    for _ in range(20):
        beyond = roll_of(involute_foot(gears, slave, start, 0.0, motion), 1 - slave) - mate.tip_roll
        if (beyond <= 0.0 and start <= low) or abs(beyond) < 1e-14:
            break
        start = max(start + beyond * mate.base_radius / gears[slave].base_radius, low)
    count = 0
    for i in range(rows + 1):
        u = roll[first + i]
        if count == 0 and u >= start:
            if u > start:
                borders[count] = start
                count += 1
        if u < start:
            continue
        if count > 0 and borders[count - 1] < centre < u:
            borders[count] = centre
            count += 1
        borders[count] = u
        count += 1
    return count if start < high else 0


@compiled
def _list_piece(moved, pair, windows, slave, low, high, motion, column, penalty, count, workspace):
    """List the Gauss points between two roll angles of the slave."""
    gears, scheme, carriers = pair.gears, pair.scheme, workspace.carriers
    for a in range(len(scheme.gauss_points)):
        u = 0.5 * (low + high) + 0.5 * (high - low) * scheme.gauss_points[a]
        gap, _inside, contact_point = _strip_gap(moved, pair, windows, slave, u, motion, column, carriers)
        # An element of the involute's length is r_b u du.
        length = 0.5 * (high - low) * scheme.gauss_weights[a] * gears[slave].base_radius * u
        stiffness = penalty * length * pair.sections.width[column]
        list_point(
            gears,
            pair.sections,
            windows,
            contact_point,
            carriers,
            column,
            slave,
            gap,
            stiffness,
            0.0,
            count,
            workspace.points,
        )
        count += 1
    return count


@allocating
def search_strip(pair, patches, p, slave, advance, penalty, moved, count, workspace):
    """List the points of tooth pair `p` that integrate the pressure over its strips; see `search_all`.

    In each section the strip is cut at node rows, at the closest approach and at its own ends, and each piece has
    Gauss points.

    Parameters
    ----------
    slave : int
        Gear over whose flank is integrated.
    penalty : float
        Its share, N/mm^3.
    """
    kinematics, gears, windows, carriers = pair.kinematics, pair.gears, patches.windows[p], workspace.carriers
    roll_position = patches.phi + patches.tooth_pair[p] * kinematics.pitch
    motion = workspace.forward if slave == 0 else workspace.back
    window, z = windows[slave], gears[slave].nodes[0, :, 2]
    borders = np.empty(window[ELEMENT_ROWS] + 4)
    alike = kinematics.slope_x == 0.0 and kinematics.slope_y == 0.0
    smallest, border, borders_count = np.inf, False, 0
    for column in range(len(z)):
        if column == 0 or not alike:
            turn, _ = section_motion(
                kinematics, gears, roll_position, advance, z[column], workspace.forward, workspace.back
            )
            centre = roll_angle(kinematics, gears, slave, roll_position) + turn
            borders_count = _strip_borders(gears, window, slave, centre, motion, borders)
        before = 0.0
        for i in range(borders_count):
            gap, inside, _meeting = _strip_gap(moved, pair, windows, slave, borders[i], motion, column, carriers)
            smallest = min(smallest, gap)
            at_window_root = borders[0] <= gears[slave].roll[window[FIRST_ROW]]
            cut_off = (i == 0 and window[AT_ROOT] == 0 and at_window_root) or (
                i == borders_count - 1 and window[AT_TIP] == 0
            )
            border = border or (gap < 0.0 and (cut_off or not inside))
            if i > 0 and (gap < 0.0 or before < 0.0):
                low, high = borders[i - 1], borders[i]
                if before * gap < 0.0:
                    end = _strip_end(moved, pair, windows, slave, low, before, high, gap, motion, column, carriers)
                    low, high = (end, high) if gap < 0.0 else (low, end)
                count = _list_piece(moved, pair, windows, slave, low, high, motion, column, penalty, count, workspace)
            before = gap
    return Found(count, smallest, border)
