"""Nodal scheme (Cosco et al. 2016, eq. 1-4): refine the slave's flank, project its points, list those in contact."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.core.compiling import allocating, compiled, inlined
from pmor.gear.kernels.types import Motion
from pmor.penalty.kernels.projection import project, share_on_master
from pmor.penalty.kernels.state import Foot, Found, Surface
from pmor.penalty.kernels.surface import prepare_surface, refine, row_points, unit_cross
from pmor.penalty.kernels.types import (
    AT_ROOT,
    AT_TIP,
    ELEMENT_ROWS,
    FIRST,
    NODE_ROWS,
    OFFSET,
    TO_HIGH_Z,
    TO_LOW_Z,
    TO_ROOT,
    TO_TIP,
)


class Facing(NamedTuple):
    """The window of a slave and that of its master, undeformed.

    Attributes
    ----------
    slave, master : ndarray of int, shape (7,)
        Windows.
    slave_columns, master_columns : int
        Node columns.
    extents : ndarray, shape (slave points along the window's rows, points along the width, 4)
        See `Gear`.
    motion : Motion
        From the slave's tooth to the master's.
    penalty : ndarray, shape (points along the width,)
        Of the slave's points in each section, N/mm^3; 0 where there are none.
    slave_centre, master_centre : ndarray, shape (points along the width,)
        Kinematic contact in each section, in element rows of the two windows, from the first element row of each.
    across : ndarray, shape (points along the width,)
        Where each section meets the master, in node columns.
    column_width : float
        Of the master's node columns, mm.
    clear : float
        Gap beyond which a point and those behind it cannot touch, mm.
    """

    slave: IntArray
    master: IntArray
    slave_columns: int
    master_columns: int
    extents: FloatArray
    motion: Motion
    slave_is_pinion: bool
    penalty: FloatArray
    slave_centre: FloatArray
    master_centre: FloatArray
    across: FloatArray
    column_width: float
    clear: float


class Visit(NamedTuple):
    """How far the search has come in each section of the slave.

    Attributes
    ----------
    start : ndarray of int, shape (points along the width,)
        Row of points from which the search goes outwards.
    going : ndarray of bool, shape (points along the width,)
        Whether rows further out are still to be visited.
    smallest : ndarray, shape (points along the width,)
        Smallest gap met, mm; infinite while nothing projects.
    """

    start: IntArray
    going: BoolArray
    smallest: FloatArray


class _Grid(NamedTuple):
    """The slave's surface, and the patches of the master on which its points are projected.

    Attributes
    ----------
    first, patches : int
        Element rows of the master that may be used.
    detail_profile, detail_width : int
        Patches of the master in one of its elements.
    """

    slave: Surface
    master: Surface
    first: int
    patches: int
    detail_profile: int
    detail_width: int


@inlined
def _transfer(window, columns, ei, ek, s, t, nx, ny, nz, count, at, points):
    """Nodes of an element and the bilinear shares of a force n at (s, t) in it (the paper's force transfer)."""
    node = window[OFFSET] + (window[FIRST] + ei) * columns + ek
    index, weight = points.node, points.weight
    for a in range(4):
        share = (s if a >= 2 else 1.0 - s) * (t if a % 2 == 1 else 1.0 - t)
        index[count, at + a] = node + (columns if a >= 2 else 0) + a % 2
        weight[count, at + a, 0], weight[count, at + a, 1] = share * nx, share * ny
        weight[count, at + a, 2] = share * nz


@inlined
def _list_levers(facing, x, foot, nx, ny, nz, count, points):
    """Each point turns about its own gear's axis."""
    rotation, shift = facing.motion.rotation, facing.motion.shift
    ax, ay, az = x[0] - shift[0], x[1] - shift[1], x[2] - shift[2]
    slave_arm = (
        rotation[2, 2] * (ax * ny - ay * nx)
        + rotation[0, 2] * (ay * nz - az * ny) + rotation[1, 2] * (az * nx - ax * nz)
    )  # fmt: skip
    master_arm = foot.point[0] * ny - foot.point[1] * nx
    points.lever[count] = slave_arm if facing.slave_is_pinion else -master_arm
    points.mate_lever[count] = master_arm if facing.slave_is_pinion else -slave_arm


@inlined
def _guess_foot(feet, row, column, across, columns, foot):
    """Where a point was projected in the last iteration is the best guess; else beside its neighbour."""
    element, guess = foot.element, foot.guess
    if feet.element[row, column, 0] >= 0:
        element[0], element[1] = feet.element[row, column, 0], feet.element[row, column, 1]
        guess[0], guess[1] = feet.guess[row, column, 0], feet.guess[row, column, 1]
    else:
        # On a border between two patches, the inner one: the search then is the same on both sides of mid width.
        inner = int(across) if 2.0 * across <= columns - 1 else int(np.ceil(across)) - 1
        element[1] = min(max(inner, 0), columns - 2)
        guess[1] = min(max(across - element[1], -0.5), 1.5)


@inlined
def _guess_row(facing, grid, row, column, foot):
    """Towards the tip of the slave is towards the root of the master, by about as many elements."""
    first, patches, place = grid.first, grid.patches, facing.master_centre[column] + facing.slave_centre[column] - row
    place *= grid.detail_profile
    foot.element[0] = first + min(max(int(place), 0), patches - 1)
    foot.guess[0] = min(max(place - foot.element[0] + first, -0.5), 1.5)


@compiled
def _search_row(row, direction, scheme, facing, grid, largest_gap, feet, visit, foot, x, row_of_points, count, points):
    """Project the points of one row of the slave that are to be visited; return `Found` of it.

    `foot`, `x` and `row_of_points` are workspace.
    """
    slave, master, motion = facing.slave, facing.master, facing.motion
    rotation, shift, surface, first = motion.rotation, motion.shift, grid.master, grid.first
    lodm_width, last_k = scheme.lodm_width, facing.slave_columns - 2
    ei = min(row // scheme.lodm_profile, slave[ELEMENT_ROWS] - 1)
    s = row / scheme.lodm_profile - ei
    smallest, border = np.inf, False
    row_points(grid.slave, slave[FIRST] + ei, s, lodm_width, row_of_points)
    # The first and the last row of points, where the flank goes on beyond the window.
    at_cut = (row == 0 and slave[AT_ROOT] == 0) or (
        row == slave[ELEMENT_ROWS] * scheme.lodm_profile and slave[AT_TIP] == 0
    )
    ek, part = 0, -1
    for column in range((last_k + 1) * lodm_width + 1):
        part += 1
        if part == lodm_width and ek < last_k:
            ek, part = ek + 1, 0
        if not visit.going[column] or direction * (row - visit.start[column]) < 0:
            continue
        before = visit.smallest[column]
        px, py, pz = row_of_points[column, 0], row_of_points[column, 1], row_of_points[column, 2]
        for d in range(3):
            x[d] = shift[d] + rotation[d, 0] * px + rotation[d, 1] * py + rotation[d, 2] * pz
        _guess_row(facing, grid, row / scheme.lodm_profile, column, foot)
        _guess_foot(feet, row, column, facing.across[column] * grid.detail_width, surface.nodes.shape[1], foot)
        project(surface, first, grid.patches, x, foot, scheme.foot_step)
        element, guess, tangent_s, tangent_t = foot.element, foot.guess, foot.tangent_s, foot.tangent_t
        feet.element[row, column, 0], feet.element[row, column, 1] = element[0], element[1]
        feet.guess[row, column, 0], feet.guess[row, column, 1] = guess[0], guess[1]
        extents = facing.extents[row, column]
        share = share_on_master(master, surface.nodes, first, grid.patches, x, foot, extents)
        if share <= 0.0:  # nothing faces it, as nothing does behind a row that did
            visit.going[column] = before == np.inf
        if share == 0.0:
            continue
        nx, ny, nz = unit_cross(tangent_t, tangent_s)
        gap = nx * (x[0] - foot.point[0]) + ny * (x[1] - foot.point[1]) + nz * (x[2] - foot.point[2])
        if share < 0.0:
            border = border or gap < 0.0
            continue
        smallest, visit.smallest[column] = min(smallest, gap), min(before, gap)
        visit.going[column] = gap <= facing.clear
        if gap >= largest_gap:
            continue
        along = extents[TO_ROOT] + extents[TO_TIP]
        points.gap[count] = gap
        points.stiffness[count] = facing.penalty[column] * share * along * (extents[TO_LOW_Z] + extents[TO_HIGH_Z])
        _list_levers(facing, x, foot, nx, ny, nz, count, points)
        turned_x = rotation[0, 0] * nx + rotation[1, 0] * ny + rotation[2, 0] * nz
        turned_y = rotation[0, 1] * nx + rotation[1, 1] * ny + rotation[2, 1] * nz
        turned_z = rotation[0, 2] * nx + rotation[1, 2] * ny + rotation[2, 2] * nz
        _transfer(slave, last_k + 2, ei, ek, s, part / lodm_width, turned_x, turned_y, turned_z, count, 0, points)
        mi, mk, s_master, t_master = element[0] - first, element[1], guess[0], guess[1]
        if not scheme.direct:  # the grid is finer than the elements that carry it
            s_master, t_master = (mi + s_master) / grid.detail_profile, (mk + t_master) / grid.detail_width
            mi, mk = mi // grid.detail_profile, mk // grid.detail_width
            s_master, t_master = s_master - mi, t_master - mk
        _transfer(master, facing.master_columns, mi, mk, s_master, t_master, -nx, -ny, -nz, count, 4, points)
        place = points.place
        place[count, 0], place[count, 1], place[count, 2], place[count, 3] = row, column, mi, mk
        border = border or (gap < 0.0 and at_cut)
        count += 1
    return Found(count, smallest, border)


@allocating
def window_surface(nodes, window, columns, scheme):
    """Return the surface over the deformed nodes of a window with `columns` columns of nodes."""
    grid = nodes[window[OFFSET] : window[OFFSET] + window[NODE_ROWS] * columns].reshape(window[NODE_ROWS], columns, 3)
    at_root, at_tip = window[AT_ROOT] == 1, window[AT_TIP] == 1
    return prepare_surface(grid, at_root, at_tip, scheme.smooth, scheme.parabolic, scheme.mirrored)


@allocating
def _grid_of(nodes, facing, scheme):
    """Both surfaces; the master's as it is, or facets through its refined points."""
    master, window = window_surface(nodes, facing.master, facing.master_columns, scheme), facing.master
    slave, rows = window_surface(nodes, facing.slave, facing.slave_columns, scheme), window[ELEMENT_ROWS]
    if scheme.direct:
        return _Grid(slave, master, window[FIRST], rows, 1, 1)
    lodm_profile, lodm_width = scheme.lodm_profile, scheme.lodm_width
    refined = np.empty((rows * lodm_profile + 1, (facing.master_columns - 1) * lodm_width + 1, 3))
    refine(master, window[FIRST], rows, lodm_profile, lodm_width, refined)
    facets = Surface(refined, master.along_rows, master.along_columns, False)
    return _Grid(slave, facets, 0, rows * lodm_profile, lodm_profile, lodm_width)


@allocating
def search_pair(scheme, facing, nodes, largest_gap, feet, count, points):
    """List the slave points of one tooth pair that penetrate, or nearly do; return `Found`.

    In each section of the slave its points are visited outwards from the kinematic contact there; flanks separate
    quadratically, so a direction ends at the first point that is clear of the master.

    Parameters
    ----------
    scheme : Scheme
    facing : Facing
    nodes : ndarray, shape (n, 3)
        Deformed nodes of all windows, each in its own tooth's frame, mm.
    largest_gap : float
        Points with a gap below it are listed: 0 for those that penetrate, mm.
    feet : Feet
        Of this slave and its windows; updated.
    count : int
        How many points there are already; new ones are written behind them.
    points : Points
    """
    grid = _grid_of(nodes, facing, scheme)
    foot = Foot(np.empty(2, dtype=np.int64), np.empty(2), np.empty(3), np.empty(3), np.empty(3))
    columns, rows = len(facing.across), facing.slave[ELEMENT_ROWS] * scheme.lodm_profile + 1
    x, row_of_points = np.empty(3), np.empty((columns, 3))
    visit = Visit(np.empty(columns, dtype=np.int64), np.empty(columns, dtype=np.bool_), np.full(columns, np.inf))
    lowest, highest = rows, 0
    for column in range(columns):
        start = min(max(int(round(facing.slave_centre[column] * scheme.lodm_profile)), 0), rows - 1)
        visit.start[column], lowest, highest = start, min(lowest, start), max(highest, start)
    smallest, border = np.inf, False
    for direction in (1, -1):
        for column in range(columns):
            visit.going[column] = _faces_master(facing, column)
        row = lowest if direction == 1 else highest - 1
        if direction == -1:
            for column in range(columns):
                visit.start[column] -= 1
        while 0 <= row < rows and visit.going.any():
            found = _search_row(
                row, direction, scheme, facing, grid, largest_gap, feet, visit, foot, x, row_of_points, count, points
            )
            count = found.listed
            smallest, border = min(smallest, found.smallest), border or found.border
            row += direction
    return Found(count, smallest, border)


@compiled
def _faces_master(facing, column):
    """Whether any of the area of a section's points may face the master, and they are slaves at all."""
    extents, last = facing.extents[0, column], facing.master_columns - 1
    spare = 0.5 + (extents[TO_LOW_Z] + extents[TO_HIGH_Z]) / facing.column_width
    return facing.penalty[column] > 0.0 and -spare < facing.across[column] < last + spare
