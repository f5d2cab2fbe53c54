"""Points of all tooth pairs in reach that penetrate, or nearly do, whichever the scheme."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba.extending import overload

from pmor.arrays import FloatArray
from pmor.contact.kernels.compiling import ALLOCATING, allocating, compiled
from pmor.contact.kernels.line import search_line
from pmor.contact.kernels.motion import pinion_slave_share, relative_motion, section_roll_position
from pmor.contact.kernels.nodal import Facing, search_pair
from pmor.contact.kernels.state import Carriers, Feet, Found, Points, SearchRoom
from pmor.contact.kernels.strip import search_strip
from pmor.contact.kernels.types import (
    ELEMENT_ROWS,
    FIRST_ROW,
    LineScheme,
    Motion,
    NodalScheme,
    Pair,
    Reach,
    StripScheme,
)
from pmor.contact.kernels.windows import element_row


@allocating
def _room(reach, carriers, size, profile_points, width_points):
    """Room for `size` points with so many nodes each, and for feet on a grid (profile, width) on each flank."""
    owners, values = np.empty((2, size), dtype=np.int64), np.empty((4, size))
    points = Points(
        owners[0], owners[1], np.empty((size, carriers), dtype=np.int64), np.empty((size, carriers, 3)), values[0],
        values[1], values[2], values[3], np.empty((size, 4), dtype=np.int64),
    )  # fmt: skip
    grid = (reach.pairs, 2, profile_points, width_points, 2)
    forward, back = Motion(np.empty((3, 3)), np.empty(3)), Motion(np.empty((3, 3)), np.empty(3))
    carriers = Carriers(np.empty(2, dtype=np.int64), np.empty((2, 4)))
    return SearchRoom(points, Feet(np.full(grid, -1), np.empty(grid)), forward, back, carriers)


@compiled
def _most_elements(reach):
    elements = 0
    for p in range(reach.pairs):
        elements = max(elements, reach.windows[p, 0, ELEMENT_ROWS], reach.windows[p, 1, ELEMENT_ROWS])
    return elements


@compiled
def _most_columns(gears):
    return max(gears[0].nodes.shape[1], gears[1].nodes.shape[1])


@allocating
def _room_of_lines(pair, reach):
    share = pair.sections.share
    return _room(reach, 8 * share.shape[2], reach.pairs * share.shape[1], 0, 0)


@allocating
def _room_of_strips(pair, reach):
    pieces = 2 * reach.pairs * (_most_elements(reach) + 3) * _most_columns(pair.gears)
    return _room(reach, 8 * pair.sections.share.shape[2], pieces * len(pair.scheme.gauss_points), 0, 0)


@allocating
def _room_of_nodes(pair, reach):
    profile_points = _most_elements(reach) * pair.scheme.lodm_profile + 1
    width_points = (_most_columns(pair.gears) - 1) * pair.scheme.lodm_width + 1
    return _room(reach, 8, 2 * reach.pairs * profile_points * width_points, profile_points, width_points)


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


@compiled
def _search_lines(pair, reach, lead, nodes, largest_gap, room):
    points, found = room.points, Found(0, np.inf, False)
    for p in range(reach.pairs):
        before = found
        # Line contact knows no slave: its points are the pinion's.
        found = search_line(pair, reach, p, lead, nodes, largest_gap, before.listed, room)
        found = _with_earlier(found, before, p, 0, points)
    return found


@allocating
def _search_strips(pair, reach, lead, nodes, largest_gap, room):
    scheme, points, found = pair.scheme, room.points, Found(0, np.inf, False)
    images = 2.0 if scheme.mirrored else 1.0
    for p in range(reach.pairs):
        roll_position = reach.phi + reach.tooth_pair[p] * pair.kinematics.pitch
        share = pinion_slave_share(pair.kinematics, scheme, roll_position)
        for slave in range(2):
            before, portion = found, images * (share if slave == 0 else 1.0 - share)
            if portion > 0.0:
                found = search_strip(pair, reach, p, slave, lead, portion * scheme.penalty, nodes, before.listed, room)
                found = _with_earlier(found, before, p, slave, points)
    return found


@allocating
def _search_nodes(pair, reach, lead, nodes, largest_gap, room):
    points, found = room.points, Found(0, np.inf, False)
    for p in range(reach.pairs):
        roll_position = reach.phi + reach.tooth_pair[p] * pair.kinematics.pitch
        relative_motion(pair.kinematics, pair.gears, roll_position, lead, room.forward, room.back)
        for slave in range(2):
            facing, before = facing_flanks(pair, reach, p, slave, room), found
            if _any_slave(facing.penalty):
                feet = Feet(room.feet.element[p, slave], room.feet.guess[p, slave])
                found = search_pair(pair.scheme, facing, nodes, largest_gap, feet, before.listed, points)
                found = _with_earlier(found, before, p, slave, points)
    return found


@compiled
def _any_slave(penalty):
    for value in penalty:
        if value > 0.0:
            return True
    return False


@compiled
def _with_earlier(found, before, p, slave, points):
    """Say whose the points are that were found last, and add up."""
    points.pair[before.listed : found.listed], points.slave[before.listed : found.listed] = p, slave
    return Found(found.listed, min(found.smallest, before.smallest), found.border or before.border)


class _Kernels(NamedTuple):
    """What a scheme has of its own."""

    search: Any
    room: Any


_OF_SCHEME = {
    LineScheme: _Kernels(_search_lines, _room_of_lines),
    StripScheme: _Kernels(_search_strips, _room_of_strips),
    NodalScheme: _Kernels(_search_nodes, _room_of_nodes),
}


def search_room(pair: Pair, reach: Reach) -> SearchRoom:
    """Return room for all points that `search_all` can list."""
    room: SearchRoom = _OF_SCHEME[type(pair.scheme)].room(pair, reach)
    return room


def search_all(
    pair: Pair, reach: Reach, lead: float, nodes: FloatArray, largest_gap: float, room: SearchRoom
) -> Found:
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
    found: Found = _OF_SCHEME[type(pair.scheme)].search(pair, reach, lead, nodes, largest_gap, room)
    return found


def _kernels_of(pair: Any) -> _Kernels:
    """Return the kernels of a pair's scheme from its compiled type."""
    return _OF_SCHEME[pair[Pair._fields.index("scheme")].instance_class]


# Where kernels call these two, the type of the scheme decides, and nothing of the other schemes is compiled.
@overload(search_room, jit_options=ALLOCATING)  # type: ignore[arg-type]
def _room_within(pair, reach):
    return _kernels_of(pair).room.py_func


@overload(search_all, jit_options=ALLOCATING)  # type: ignore[arg-type]
def _search_within(pair, reach, lead, nodes, largest_gap, room):
    return _kernels_of(pair).search.py_func
