"""Points of all tooth pairs that can touch that penetrate, or nearly do."""

from __future__ import annotations

import numpy as np

from pmor.core.compiling import allocating, compiled
from pmor.gear.kernels.motion import relative_motion, section_roll_position
from pmor.gear.kernels.types import Motion
from pmor.penalty.kernels.nodal import Facing, search_pair
from pmor.penalty.kernels.state import Feet, Found, Points, SearchWorkspace
from pmor.penalty.kernels.types import ELEMENT_ROWS, FIRST_ROW
from pmor.penalty.kernels.windows import element_row, pinion_slave_share


@compiled
def _most_elements(patches):
    elements = 0
    for p in range(patches.pairs):
        elements = max(elements, patches.windows[p, 0, ELEMENT_ROWS], patches.windows[p, 1, ELEMENT_ROWS])
    return elements


@allocating
def search_workspace(pair, patches):
    """Return a workspace for all points that `search_all` can list."""
    profile_points = _most_elements(patches) * pair.scheme.lodm_profile + 1
    columns = max(pair.gears[0].nodes.shape[1], pair.gears[1].nodes.shape[1])
    width_points = (columns - 1) * pair.scheme.lodm_width + 1
    size = 2 * patches.pairs * profile_points * width_points
    owners, values = np.empty((2, size), dtype=np.int64), np.empty((4, size))
    points = Points(
        pair=owners[0], slave=owners[1], node=np.empty((size, 8), dtype=np.int64), weight=np.empty((size, 8, 3)),
        gap=values[0], stiffness=values[1], lever=values[2], mate_lever=values[3],
        place=np.empty((size, 4), dtype=np.int64),
    )  # fmt: skip
    grid = (patches.pairs, 2, profile_points, width_points, 2)
    forward, back = Motion(np.empty((3, 3)), np.empty(3)), Motion(np.empty((3, 3)), np.empty(3))
    return SearchWorkspace(points, Feet(np.full(grid, -1), np.empty(grid)), forward, back)


@allocating
def facing_flanks(pair, patches, p, slave, workspace):
    """Flank of one gear of tooth pair `p` facing that of its mate: `Facing`, with the motion from `workspace`."""
    kinematics, gears, scheme, master = pair.kinematics, pair.gears, pair.scheme, 1 - slave
    own, mate = patches.windows[p, slave], patches.windows[p, master]
    first, roll_position = own[FIRST_ROW] * scheme.lodm_profile, patches.phi + patches.tooth_pair[p] * kinematics.pitch
    extents = pair.extents[slave][first : first + own[ELEMENT_ROWS] * scheme.lodm_profile + 1]
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
        slave=own, master=mate, slave_columns=len(z), master_columns=len(mate_z), extents=extents,
        motion=workspace.forward if slave == 0 else workspace.back, slave_is_pinion=slave == 0, penalty=penalty,
        slave_centre=slave_centre, master_centre=master_centre, across=across, column_width=column_width,
        clear=patches.clear,
    )  # fmt: skip


@allocating
def search_all(pair, patches, advance, nodes, largest_gap, workspace):
    """List the points of all tooth pairs that can touch that penetrate, or nearly do.

    Parameters
    ----------
    pair : Pair
    patches : ActivePatches
    advance : float
        Rotation of the pinion ahead of its kinematic position, rad.
    nodes : ndarray, shape (n, 3)
        Deformed nodes of all windows, mm.
    largest_gap : float
        Points with a gap below it are listed, mm.
    workspace : SearchWorkspace
        Its points are filled.

    Returns
    -------
    Found
    """
    points, found = workspace.points, Found(0, np.inf, False)
    for p in range(patches.pairs):
        roll_position = patches.phi + patches.tooth_pair[p] * pair.kinematics.pitch
        relative_motion(pair.kinematics, pair.gears, roll_position, advance, workspace.forward, workspace.back)
        for slave in range(2):
            facing, before = facing_flanks(pair, patches, p, slave, workspace), found
            if _is_slave(facing.penalty):
                feet = Feet(workspace.feet.element[p, slave], workspace.feet.guess[p, slave])
                found = search_pair(pair.scheme, facing, nodes, largest_gap, feet, before.listed, points)
                found = _with_earlier(found, before, p, slave, points)
    return found


@compiled
def _is_slave(penalty):
    for column in range(len(penalty)):
        if penalty[column] > 0.0:
            return True
    return False


@compiled
def _with_earlier(found, before, p, slave, points):
    """Say whose the points are that were found last, and add up."""
    points.pair[before.listed : found.listed], points.slave[before.listed : found.listed] = p, slave
    return Found(found.listed, min(found.smallest, before.smallest), found.border or before.border)
