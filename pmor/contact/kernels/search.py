"""Points of all tooth pairs in reach that penetrate, or nearly do, whichever the scheme."""

from __future__ import annotations

import numpy as np

from pmor.contact.kernels.compiling import allocating, compiled
from pmor.contact.kernels.line import search_line
from pmor.contact.kernels.motion import pinion_slave_share, relative_motion, section_roll_position
from pmor.contact.kernels.nodal import Facing, search_pair
from pmor.contact.kernels.state import Carriers, Feet, Found, Points, SearchRoom
from pmor.contact.kernels.strip import search_strip
from pmor.contact.kernels.types import ELEMENT_ROWS, FIRST_ROW, LINE, NODAL, STRIP, Motion
from pmor.contact.kernels.windows import element_row


@compiled
def _grid_size(pair, reach):
    """Points that can be listed, and the grid on which feet are remembered (profile, width)."""
    scheme, elements = pair.scheme, 0
    for p in range(reach.pairs):
        elements = max(elements, reach.windows[p, 0, ELEMENT_ROWS], reach.windows[p, 1, ELEMENT_ROWS])
    columns = max(pair.gears[0].nodes.shape[1], pair.gears[1].nodes.shape[1])
    if scheme.kind == LINE:
        return reach.pairs * len(pair.sections.z), 0, 0
    if scheme.kind == STRIP:
        return 2 * reach.pairs * (elements + 3) * len(scheme.gauss_points) * columns, 0, 0
    profile_points, width_points = elements * scheme.lodm_profile + 1, (columns - 1) * scheme.lodm_width + 1
    return 2 * reach.pairs * profile_points * width_points, profile_points, width_points


@allocating
def search_room(pair, reach):
    """Return room for all points that `search_all` can list."""
    size, profile_points, width_points = _grid_size(pair, reach)
    owners, values = np.empty((2, size), dtype=np.int64), np.empty((4, size))
    carriers = 8 if pair.scheme.kind == NODAL else 8 * pair.sections.share.shape[2]
    points = Points(
        owners[0], owners[1], np.empty((size, carriers), dtype=np.int64), np.empty((size, carriers, 3)), values[0],
        values[1], values[2], values[3], np.empty((size, 4), dtype=np.int64),
    )  # fmt: skip
    grid = (reach.pairs, 2, profile_points, width_points, 2)
    forward, back = Motion(np.empty((3, 3)), np.empty(3)), Motion(np.empty((3, 3)), np.empty(3))
    carriers = Carriers(np.empty(2, dtype=np.int64), np.empty((2, 4)))
    return SearchRoom(points, Feet(np.full(grid, -1), np.empty(grid)), forward, back, carriers)


@allocating
def facing_flanks(pair, reach, p, slave, room):
    """How the flank of one gear of tooth pair `p` faces that of its mate: `Facing`, with the motion from `room`."""
    kinematics, gears, scheme, master = pair.kinematics, pair.gears, pair.scheme, 1 - slave
    own, mate = reach.windows[p, slave], reach.windows[p, master]
    first, roll_position = own[FIRST_ROW] * scheme.lodm_profile, reach.phi + reach.tooth_pair[p] * kinematics.pitch
    extents = gears[slave].extents[first : first + own[ELEMENT_ROWS] * scheme.lodm_profile + 1]
    z, mate_z = gears[slave].nodes[0, :, 2], gears[master].nodes[0, :, 2]
    columns = (len(z) - 1) * scheme.lodm_width + 1
    penalty, across = np.empty(columns), np.empty(columns)
    slave_centre, master_centre = np.empty(columns), np.empty(columns)
    column_width = (mate_z[-1] - mate_z[0]) / (len(mate_z) - 1)
    images = 2.0 if scheme.mirrored else 1.0
    for column in range(columns):
        k = min(column // scheme.lodm_width, len(z) - 2)
        section = z[k] + (column / scheme.lodm_width - k) * (z[k + 1] - z[k])
        own_position = section_roll_position(gears, roll_position, section)
        share = pinion_slave_share(kinematics, scheme, own_position)
        penalty[column] = images * (share if slave == 0 else 1.0 - share) * scheme.penalty
        slave_centre[column] = element_row(kinematics, gears, slave, own_position) - own[FIRST_ROW]
        master_centre[column] = element_row(kinematics, gears, master, own_position) - mate[FIRST_ROW]
        across[column] = (section - mate_z[0]) / column_width
    return Facing(
        own, mate, len(z), len(mate_z), extents, room.forward if slave == 0 else room.back, slave == 0, penalty,
        slave_centre, master_centre, across, column_width, reach.clear,
    )  # fmt: skip


@allocating
def _search_nodal(pair, reach, p, slave, nodes, largest_gap, count, room):
    """The points of one gear of tooth pair `p`; see `search_all`."""
    facing = facing_flanks(pair, reach, p, slave, room)
    if facing.penalty.max() == 0.0:
        return Found(count, np.inf, False)
    feet = Feet(room.feet.element[p, slave], room.feet.guess[p, slave])
    return search_pair(pair.scheme, facing, nodes, largest_gap, feet, count, room.points)


@compiled
def search_all(pair, reach, lead, nodes, largest_gap, room):
    """List the points of all tooth pairs in reach that penetrate, or nearly do.

    Parameters
    ----------
    pair : Pair
    reach : Reach
    lead : float
        Rotation of the pinion ahead of its kinematic position, rad.
    nodes : ndarray, shape (n, 3)
        Deformed nodes of all windows, mm; for exact flanks their displacements alone (`Work`).
    largest_gap : float
        Points with a gap below it are listed, mm; strips list what penetrates.
    room : SearchRoom
        Its points are filled.

    Returns
    -------
    Found
    """
    kinematics, scheme, points = pair.kinematics, pair.scheme, room.points
    images = 2.0 if scheme.mirrored else 1.0
    count, smallest, border = 0, np.inf, False
    for p in range(reach.pairs):
        roll_position = reach.phi + reach.tooth_pair[p] * kinematics.pitch
        if scheme.kind == NODAL:
            relative_motion(kinematics, pair.gears, roll_position, lead, room.forward, room.back)
        share = pinion_slave_share(kinematics, scheme, roll_position)
        for slave in range(2):
            before, portion = count, images * (share if slave == 0 else 1.0 - share)
            if scheme.kind == NODAL:
                found = _search_nodal(pair, reach, p, slave, nodes, largest_gap, count, room)
            elif scheme.kind == LINE and slave == 0:  # line contact knows no slave: its points are the pinion's
                found = search_line(pair, reach, p, lead, nodes, largest_gap, count, room)
            elif scheme.kind == STRIP and portion > 0.0:
                found = search_strip(pair, reach, p, slave, lead, portion * scheme.penalty, nodes, count, room)
            else:
                continue
            count = found.listed
            smallest, border = min(smallest, found.smallest), border or found.border
            points.pair[before:count], points.slave[before:count] = p, slave
    return Found(count, smallest, border)
