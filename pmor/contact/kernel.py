"""Compiled contact of the nodal scheme: refine both flanks, project the slave's points, list what penetrates; sweeps.

Everything here is one call tree, and therefore one file: numba's cache does not notice an edit in another one, so a
split would serve stale code to whoever edits it. In the order of the file: surfaces, projection, search of one pair,
windows from the kinematics, search of all pairs, the reduced pair and its sweep. Arrays and scalars only.

The scheme is the paper's: node to surface, penalty (Cosco et al. 2016, eq. 1-4), on flanks refined by
bicubic Ferguson patches through the *deformed* nodes (eq. 5-21) or by bilinear facets.

Layout of a *window*, the part of a flank that can touch: a grid of nodes ``(rows, columns)``, rows from the root
towards the tip, columns along +z. Beside the rows of its elements a window holds one neighbouring row on either side
where the flank has one, because node normals are averaged over the elements around a node.

Integer description of a window (`window`, shape (6,)): offset of its first node in the flat node list; number of
node rows; index of the first element row inside; number of element rows; 1 if the first element row is the first of
the flank; 1 if the last element row is the last of the flank.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

# Divisions follow IEEE 754 instead of raising, which spares a branch at each; results are checked where they are used.
# What neither makes, copies nor returns arrays goes without numba's runtime: it borrows its arguments from its caller
# instead of counting references to each of their arrays at every call, which took a third of a sweep's time.
_OPTIONS: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}
_BORROWING: dict[str, Any] = {**_OPTIONS, "_nrt": False}
compiled = njit(**_BORROWING)
# Called once per contact point: dozens of shapes and strides to pass on each time.
inlined = njit(**_BORROWING, forceinline=True)
# Said aloud: a function that says nothing inherits this from its caller.
allocating = njit(**{**_OPTIONS, "_nrt": True})


@inlined
def _unit_cross(a, b):
    x, y, z = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    inverse = 1.0 / np.sqrt(x**2 + y**2 + z**2)
    return x * inverse, y * inverse, z * inverse


@inlined
def _chord(a, b):
    return b[0] - a[0], b[1] - a[1], b[2] - a[2]


@inlined
def _parabola_tangent(p0, p1, p2):
    """Tangent at p0 of the parabola through three points, parametrised by chord length."""
    a, b = _chord(p0, p1), _chord(p1, p2)
    h1, h2 = np.sqrt(a[0] ** 2 + a[1] ** 2 + a[2] ** 2), np.sqrt(b[0] ** 2 + b[1] ** 2 + b[2] ** 2)
    share = h1 / (h1 + h2)
    f, g = (1.0 + share) / h1, share / h2
    return f * a[0] - g * b[0], f * a[1] - g * b[1], f * a[2] - g * b[2]


@inlined
def _edge_tangent(nodes, i, k, step_i, step_k):
    """Tangent along (step_i, step_k) at an edge node, pointing into the grid; a chord where three nodes are missing."""
    rows, columns = nodes.shape[0], nodes.shape[1]
    here, inner = nodes[i, k], nodes[i + step_i, k + step_k]
    if 0 <= i + 2 * step_i < rows and 0 <= k + 2 * step_k < columns:
        return _parabola_tangent(here, inner, nodes[i + 2 * step_i, k + 2 * step_k])
    return _chord(here, inner)


@inlined
def _tangent(nodes, i, k, di, dk):
    """Tangent at a node along (di, dk), the rows or the columns: parabolic at the grid's edges, central inside."""
    index, last = di * i + dk * k, di * nodes.shape[0] + dk * nodes.shape[1] - 1
    if index == 0:
        return _edge_tangent(nodes, i, k, di, dk)
    if index == last:
        x, y, z = _edge_tangent(nodes, i, k, -di, -dk)
        return -x, -y, -z
    return _chord(nodes[i - di, k - dk], nodes[i + di, k + dk])


@compiled
def node_normals(nodes, low_edge, high_edge, parabolic, mirrored, out):
    """Outward normals at the nodes of a window.

    Parameters
    ----------
    nodes : ndarray, shape (rows, columns, 3)
    low_edge, high_edge : bool
        Whether the first and last row are edges of the flank (else they are rows of neighbouring elements, whose
        own normals are not needed).
    parabolic : bool
        At the edges of the flank: normals from one-sided parabolas instead of the paper's plain average over the
        concurrent elements, which is one-sided there and wrong by half an element's turn.
    mirrored : bool
        The last column lies in a plane of symmetry z = const, behind which the flank goes on.
    out : ndarray, shape (rows, columns, 3)
    """
    rows, columns = nodes.shape[0], nodes.shape[1]
    out[:] = 0.0
    for i in range(rows - 1):
        for k in range(columns - 1):
            normal = _unit_cross(_chord(nodes[i + 1, k], nodes[i, k + 1]), _chord(nodes[i, k], nodes[i + 1, k + 1]))
            for di in range(2):
                for dk in range(2):
                    for d in range(3):
                        out[i + di, k + dk, d] += normal[d]
    for i in range(rows):
        for k in range(columns):
            in_mirror = mirrored and k == columns - 1
            on_edge = (i == 0 and low_edge) or (i == rows - 1 and high_edge) or k == 0 or k == columns - 1
            if parabolic and on_edge and not (in_mirror and 0 < i < rows - 1):
                if in_mirror:
                    across = 0.0, 0.0, 1.0
                elif mirrored and k == 0 and columns == 2:  # the third node is the mirror image of the first
                    image = nodes[i, 0, 0], nodes[i, 0, 1], 2.0 * nodes[i, 1, 2] - nodes[i, 0, 2]
                    across = _parabola_tangent(nodes[i, 0], nodes[i, 1], image)
                else:
                    across = _tangent(nodes, i, k, 0, 1)
                out[i, k, 0], out[i, k, 1], out[i, k, 2] = _unit_cross(across, _tangent(nodes, i, k, 1, 0))
                continue
            if in_mirror:
                out[i, k, 2] = 0.0  # the elements behind the mirror have the opposite one
            inverse = 1.0 / np.sqrt(out[i, k, 0] ** 2 + out[i, k, 1] ** 2 + out[i, k, 2] ** 2)
            for d in range(3):
                out[i, k, d] *= inverse


@compiled
def edge_tangents(nodes, normals, low, high, along_rows, along_columns):
    """Tangents N x S x N of the element edges of node rows `low` to `high`, at both their ends (eq. 11 of the paper).

    A chord S without its part along the unit normal N. `along_rows[i, k, e]` belongs to the edge from node (i, k) to
    (i + 1, k), end e; `along_columns[i, k, e]` to the edge from (i, k) to (i, k + 1).
    """
    columns = nodes.shape[1]
    for i in range(low, high + 1):
        for k in range(columns):
            for end in range(2):
                if i < high:
                    along = 0.0
                    for d in range(3):
                        along += normals[i + end, k, d] * (nodes[i + 1, k, d] - nodes[i, k, d])
                    for d in range(3):
                        chord = nodes[i + 1, k, d] - nodes[i, k, d]
                        along_rows[i, k, end, d] = chord - along * normals[i + end, k, d]
                if k < columns - 1:
                    along = 0.0
                    for d in range(3):
                        along += normals[i, k + end, d] * (nodes[i, k + 1, d] - nodes[i, k, d])
                    for d in range(3):
                        chord = nodes[i, k + 1, d] - nodes[i, k, d]
                        along_columns[i, k, end, d] = chord - along * normals[i, k + end, d]


@inlined
def surface_point(nodes, along_rows, along_columns, smooth, i, k, s, t, point, tangent_s, tangent_t):
    """Point and tangents of the surface over element (i, k) at (s, t): one object gives all three.

    Smooth: the bicubic Ferguson patch with zero twist. Else: the bilinear facet. Parameters a little outside [0, 1]
    continue the surface.
    """
    if not smooth:
        for d in range(3):
            p00, p01, p10, p11 = nodes[i, k, d], nodes[i, k + 1, d], nodes[i + 1, k, d], nodes[i + 1, k + 1, d]
            tangent_s[d] = (1.0 - t) * (p10 - p00) + t * (p11 - p01)
            tangent_t[d] = (1.0 - s) * (p01 - p00) + s * (p11 - p10)
            point[d] = (1.0 - t) * p00 + t * p01 + s * tangent_s[d]
        return
    # Hermite polynomials (h: values, g: slopes) and their derivatives, along s and along t.
    hs1, ht1 = s * s * (3.0 - 2.0 * s), t * t * (3.0 - 2.0 * t)
    hs0, ht0 = 1.0 - hs1, 1.0 - ht1
    gs0, gs1, gt0, gt1 = s * (1.0 - s) ** 2, s * s * (s - 1.0), t * (1.0 - t) ** 2, t * t * (t - 1.0)
    dhs, dht = 6.0 * s * (1.0 - s), 6.0 * t * (1.0 - t)
    dgs0, dgs1 = (1.0 - s) * (1.0 - 3.0 * s), s * (3.0 * s - 2.0)
    dgt0, dgt1 = (1.0 - t) * (1.0 - 3.0 * t), t * (3.0 * t - 2.0)
    for d in range(3):
        # Along s first, on the two edges k and k + 1 and for their slopes along t.
        p00, p01, p10, p11 = nodes[i, k, d], nodes[i, k + 1, d], nodes[i + 1, k, d], nodes[i + 1, k + 1, d]
        r00, r10 = along_rows[i, k, 0, d], along_rows[i, k, 1, d]
        r01, r11 = along_rows[i, k + 1, 0, d], along_rows[i, k + 1, 1, d]
        c00, c01 = along_columns[i, k, 0, d], along_columns[i, k, 1, d]
        c10, c11 = along_columns[i + 1, k, 0, d], along_columns[i + 1, k, 1, d]
        edge0 = hs0 * p00 + hs1 * p10 + gs0 * r00 + gs1 * r10
        edge1 = hs0 * p01 + hs1 * p11 + gs0 * r01 + gs1 * r11
        slope0, slope1 = hs0 * c00 + hs1 * c10, hs0 * c01 + hs1 * c11
        edge0_s = dhs * (p10 - p00) + dgs0 * r00 + dgs1 * r10
        edge1_s = dhs * (p11 - p01) + dgs0 * r01 + dgs1 * r11
        slope0_s, slope1_s = dhs * (c10 - c00), dhs * (c11 - c01)
        point[d] = ht0 * edge0 + ht1 * edge1 + gt0 * slope0 + gt1 * slope1
        tangent_s[d] = ht0 * edge0_s + ht1 * edge1_s + gt0 * slope0_s + gt1 * slope1_s
        tangent_t[d] = dht * (edge1 - edge0) + dgt0 * slope0 + dgt1 * slope1


@allocating
def prepare_surface(nodes, low_edge, high_edge, smooth, parabolic, mirrored, along_rows, along_columns):
    """Edge tangents of a window of deformed nodes, when its surface is smooth; see `node_normals` and `refine`."""
    if smooth:
        normals = np.empty_like(nodes)
        node_normals(nodes, low_edge, high_edge, parabolic, mirrored, normals)
        low, high = 0 if low_edge else 1, nodes.shape[0] - (1 if high_edge else 2)
        edge_tangents(nodes, normals, low, high, along_rows, along_columns)


@inlined
def row_points(nodes, along_rows, along_columns, smooth, i, s, lodm_width, out):
    """Points of a surface along the width at parameter s of element row i; the same points as `surface_point` gives.

    One direction of the patch is done once for the whole row, which is what makes a row of slave points cheap.
    """
    columns = nodes.shape[1]
    if smooth:
        h0, h1 = (1.0 + 2.0 * s) * (1.0 - s) ** 2, s * s * (3.0 - 2.0 * s)
        g0, g1 = s * (1.0 - s) ** 2, s * s * (s - 1.0)
    else:
        h0, h1, g0, g1 = 1.0 - s, s, 0.0, 0.0
    for k in range(columns):
        for d in range(3):
            value = h0 * nodes[i, k, d] + h1 * nodes[i + 1, k, d]
            if smooth:
                value += g0 * along_rows[i, k, 0, d] + g1 * along_rows[i, k, 1, d]
            out[k * lodm_width, d] = value
    for k in range(columns - 1):
        for part in range(1, lodm_width):
            t = part / lodm_width
            for d in range(3):
                first, last = out[k * lodm_width, d], out[(k + 1) * lodm_width, d]
                if smooth:
                    tangent_0 = h0 * along_columns[i, k, 0, d] + h1 * along_columns[i + 1, k, 0, d]
                    tangent_1 = h0 * along_columns[i, k, 1, d] + h1 * along_columns[i + 1, k, 1, d]
                    out[k * lodm_width + part, d] = (
                        (1.0 + 2.0 * t) * (1.0 - t) ** 2 * first + t * t * (3.0 - 2.0 * t) * last
                        + t * (1.0 - t) ** 2 * tangent_0 + t * t * (t - 1.0) * tangent_1
                    )  # fmt: skip
                else:
                    out[k * lodm_width + part, d] = (1.0 - t) * first + t * last


@compiled
def refine(nodes, along_rows, along_columns, smooth, first, count, lodm_profile, lodm_width, out):
    """Points of the refined surface over the element rows of a window.

    Parameters
    ----------
    nodes : ndarray, shape (rows, columns, 3)
        Deformed nodes of the window.
    along_rows, along_columns : ndarray, shape (rows, columns, 2, 3)
        Edge tangents of a smooth surface.
    smooth : bool
        Ferguson patches, else bilinear facets.
    first, count : int
        First element row inside the window, number of element rows.
    lodm_profile, lodm_width : int
        Subdivisions of an element along the profile and the width.
    out : ndarray, shape (count lodm_profile + 1, (columns - 1) lodm_width + 1, 3)
    """
    for row in range(count * lodm_profile + 1):
        i = min(row // lodm_profile, count - 1)
        s = (row - i * lodm_profile) / lodm_profile
        row_points(nodes, along_rows, along_columns, smooth, first + i, s, lodm_width, out[row])


@inlined
def _foot_on_patch(nodes, along_rows, along_columns, smooth, i, k, x, guess, tangent_s, tangent_t, foot, foot_step):
    """Foot of the perpendicular on one (continued) patch by Gauss-Newton; updates `guess` = (s, t).

    The neglected curvature term is the gap over the radius of curvature: each step gains that factor. It ends with the
    first step below `foot_step` elements, which changes the gap by its square times the element's sagitta; the foot
    and the tangents are those before that step, `guess` has it in.
    """
    for _ in range(20):
        surface_point(nodes, along_rows, along_columns, smooth, i, k, guess[0], guess[1], foot, tangent_s, tangent_t)
        sx, sy, sz = tangent_s[0], tangent_s[1], tangent_s[2]
        tx, ty, tz = tangent_t[0], tangent_t[1], tangent_t[2]
        rx, ry, rz = x[0] - foot[0], x[1] - foot[1], x[2] - foot[2]
        rs, rt = rx * sx + ry * sy + rz * sz, rx * tx + ry * ty + rz * tz
        ss, tt, st = sx * sx + sy * sy + sz * sz, tx * tx + ty * ty + tz * tz, sx * tx + sy * ty + sz * tz
        inverse = 1.0 / (ss * tt - st * st)
        ds, dt = (rs * tt - rt * st) * inverse, (rt * ss - rs * st) * inverse
        if abs(ds) + abs(dt) < foot_step:
            guess[0] += ds
            guess[1] += dt
            return
        # A cubic continued far outside its patch turns back: stay near, the caller walks on to the neighbour.
        s, t = min(max(guess[0] + ds, -0.75), 1.75), min(max(guess[1] + dt, -0.75), 1.75)
        if s == guess[0] and t == guess[1]:
            return
        guess[0], guess[1] = s, t


@inlined
def project(
    nodes, along_rows, along_columns, smooth, first, count, x, element, guess, tangent_s, tangent_t, foot, foot_step
):  # fmt: skip
    """Closest point on a grid of patches, walking from patch to patch; updates `element` = (i, k) and `guess` = (s, t).

    On the outer patches the parameters may leave [0, 1]: the surface is continued there and the caller decides. At a
    convex edge between two facets neither of which holds the foot, the foot is put on the edge.

    Parameters
    ----------
    nodes, along_rows, along_columns, smooth
        The surface, as in `surface_point`.
    first, count : int
        Element rows of the grid that may be used.
    x : ndarray, shape (3,)
    element : ndarray of int, shape (2,)
        Where to start.
    guess, tangent_s, tangent_t, foot : ndarray
        Parameters, tangents and the foot.
    foot_step : float
        Of the last step to the foot, in elements.
    """
    last_i, last_k = first + count - 1, nodes.shape[1] - 2
    before_i = before_k = -1
    for _ in range(2 * (count + last_k) + 10):
        _foot_on_patch(nodes, along_rows, along_columns, smooth, element[0], element[1], x, guess,
                       tangent_s, tangent_t, foot, foot_step)  # fmt: skip
        # The tolerance keeps a foot on a shared edge with the patch that was tried first: neighbouring facets have
        # slightly different normals, and flipping between them by round-off would stop Newton short.
        next_i = element[0] + (1 if guess[0] > 1.0 + 1e-5 else (-1 if guess[0] < -1e-5 else 0))
        next_k = element[1] + (1 if guess[1] > 1.0 + 1e-5 else (-1 if guess[1] < -1e-5 else 0))
        next_i, next_k = min(max(next_i, first), last_i), min(max(next_k, 0), last_k)
        if next_i == element[0] and next_k == element[1]:
            return
        if next_i == before_i and next_k == before_k:
            guess[0], guess[1] = min(max(guess[0], 0.0), 1.0), min(max(guess[1], 0.0), 1.0)
            surface_point(nodes, along_rows, along_columns, smooth, element[0], element[1], guess[0], guess[1], foot,
                          tangent_s, tangent_t)  # fmt: skip
            return
        before_i, before_k = element[0], element[1]
        guess[0] -= next_i - element[0]
        guess[1] -= next_k - element[1]
        element[0], element[1] = next_i, next_k


@inlined
def _inside_share(overshoot, extent_out, extent_in):
    """Share of a slave point's interval that lies on the master, when the point is `overshoot` beyond its edge."""
    total = extent_out + extent_in
    return min(max((extent_in - overshoot) / total, 0.0), 1.0)


@inlined
def _edge_overshoot(nodes, edge_row, inner_row, k, t, foot, in_length):
    """Distance of a foot beyond an edge row of the master (negative inside), along the outward chord there.

    Not `in_length`: times the length of that chord, which is enough for the sign.
    """
    overshoot = length = 0.0
    for d in range(3):
        at_edge = (1.0 - t) * nodes[edge_row, k, d] + t * nodes[edge_row, k + 1, d]
        outward = at_edge - ((1.0 - t) * nodes[inner_row, k, d] + t * nodes[inner_row, k + 1, d])
        overshoot += (foot[d] - at_edge) * outward
        length += outward**2
    return overshoot / np.sqrt(length) if in_length else overshoot


@inlined
def _share_on_master(master, nodes, first, count, element, guess, tangent_t, extents, row, column, foot):
    """Share of a slave point's area that faces the master; 0 beyond its edges, -1 on the master but off the window.

    Flanks face each other: towards the slave's root is towards the master's tip.
    """
    share = 1.0
    if element[0] == first + count - 1:
        at_edge = master[5] == 1
        beyond = _edge_overshoot(nodes, first + count, first + count - 1, element[1], guess[1], foot, at_edge)
        if at_edge:
            share *= _inside_share(beyond, extents[row, column, 0], extents[row, column, 1])
        elif beyond > 0.0:
            return -1.0
    if element[0] == first:
        at_edge = master[4] == 1
        beyond = _edge_overshoot(nodes, first, first + 1, element[1], guess[1], foot, at_edge)
        if at_edge:
            share *= _inside_share(beyond, extents[row, column, 1], extents[row, column, 0])
        elif beyond > 0.0:
            return -1.0
    last = nodes.shape[1] - 2
    if element[1] == 0 or element[1] == last:
        width = np.sqrt(tangent_t[0] ** 2 + tangent_t[1] ** 2 + tangent_t[2] ** 2)
        low, high = extents[row, column, 2], extents[row, column, 3]
        if element[1] == last:
            share *= _inside_share((guess[1] - 1.0) * width, high, low)
        if element[1] == 0:
            share *= _inside_share(-guess[1] * width, low, high)
    return share


@compiled
def _search_row(
    row, surfaces, slave, master, extents, smooth, direct, detail, rotation, shift, slave_is_pinion, penalty,
    largest_gap, foot_step, count, element, guess, memory_element, memory_guess, work, lists,
):  # fmt: skip
    """Project one row of slave points; return (count, smallest gap of the row, border touched).

    `surfaces` holds the slave's nodes and tangents and the master's grid with its tangents, first row and row count;
    `detail` the subdivisions (profile, width) of the slave's and of the master's elements.
    """
    slave_nodes, slave_rows, slave_across, surface, along_rows, along_columns, first, patches = surfaces
    x, foot, tangent_s, tangent_t, points = work
    index, weight, gap, stiffness, lever, mate_lever, place = lists[:7]
    last_k = slave_nodes.shape[1] - 2
    per_column = (surface.shape[1] - 1) / ((last_k + 1) * detail[1])
    ei = min(row // detail[0], slave[3] - 1)
    s = row / detail[0] - ei
    smallest, touches_border = np.inf, False
    row_points(slave_nodes, slave_rows, slave_across, smooth, slave[2] + ei, s, detail[1], points)
    ek, part = 0, -1
    for column in range((last_k + 1) * detail[1] + 1):
        part += 1
        if part == detail[1] and ek < last_k:
            ek, part = ek + 1, 0
        px, py, pz = points[column, 0], points[column, 1], points[column, 2]
        for d in range(3):
            x[d] = shift[d] + rotation[d, 0] * px + rotation[d, 1] * py + rotation[d, 2] * pz
        # Where a point was projected in the last iteration is the best guess; else beside its neighbour.
        if memory_element[row, column, 0] >= 0:
            element[0], element[1] = memory_element[row, column, 0], memory_element[row, column, 1]
            guess[0], guess[1] = memory_guess[row, column, 0], memory_guess[row, column, 1]
        else:
            # On a border between two patches, the inner one: the search then is the same on both sides of mid width.
            across = column * per_column
            inner = int(across) if 2.0 * across <= surface.shape[1] - 1 else int(np.ceil(across)) - 1
            element[1] = min(inner, surface.shape[1] - 2)
            guess[1] = across - element[1]
        project(surface, along_rows, along_columns, smooth and direct, first, patches, x, element, guess,
                tangent_s, tangent_t, foot, foot_step)  # fmt: skip
        memory_element[row, column, 0], memory_element[row, column, 1] = element[0], element[1]
        memory_guess[row, column, 0], memory_guess[row, column, 1] = guess[0], guess[1]
        share = _share_on_master(
            master, surface, first, patches, element, guess, tangent_t, extents, row, column, foot
        )
        if share == 0.0:
            continue
        nx, ny, nz = _unit_cross(tangent_t, tangent_s)
        g = nx * (x[0] - foot[0]) + ny * (x[1] - foot[1]) + nz * (x[2] - foot[2])
        if share < 0.0:
            touches_border = touches_border or g < 0.0
            continue
        smallest = min(smallest, g)
        if g >= largest_gap:
            continue
        gap[count] = g
        along = extents[row, column, 0] + extents[row, column, 1]
        stiffness[count] = penalty * share * along * (extents[row, column, 2] + extents[row, column, 3])
        # Each point turns about its own gear's axis.
        ax, ay, az = x[0] - shift[0], x[1] - shift[1], x[2] - shift[2]
        slave_arm = (
            rotation[2, 2] * (ax * ny - ay * nx)
            + rotation[0, 2] * (ay * nz - az * ny) + rotation[1, 2] * (az * nx - ax * nz)
        )  # fmt: skip
        master_arm = foot[0] * ny - foot[1] * nx
        lever[count] = slave_arm if slave_is_pinion else -master_arm
        mate_lever[count] = master_arm if slave_is_pinion else -slave_arm
        turned_x = rotation[0, 0] * nx + rotation[1, 0] * ny + rotation[2, 0] * nz
        turned_y = rotation[0, 1] * nx + rotation[1, 1] * ny + rotation[2, 1] * nz
        turned_z = rotation[0, 2] * nx + rotation[1, 2] * ny + rotation[2, 2] * nz
        _transfer(slave, last_k + 2, ei, ek, s, part / detail[1], turned_x, turned_y, turned_z, count, 0, index, weight)
        mi, mk, s_master, t_master = element[0] - first, element[1], guess[0], guess[1]
        if not direct:  # the grid is finer than the elements that carry it
            s_master, t_master = (mi + s_master) / detail[2], (mk + t_master) / detail[3]
            mi, mk = mi // detail[2], mk // detail[3]
            s_master, t_master = s_master - mi, t_master - mk
        columns = (surface.shape[1] - 1) // detail[3] + 1
        _transfer(master, columns, mi, mk, s_master, t_master, -nx, -ny, -nz, count, 4, index, weight)
        place[count, 0], place[count, 1], place[count, 2], place[count, 3] = row, column, mi, mk
        if g < 0.0 and ((row == 0 and slave[4] == 0) or (row == slave[3] * detail[0] and slave[5] == 0)):
            touches_border = True
        count += 1
    return count, smallest, touches_border


@allocating
def _window_nodes(nodes, window, columns):
    return nodes[window[0] : window[0] + window[1] * columns].reshape(window[1], columns, 3)


@allocating
def search_pair(
    nodes, slave, slave_columns, master, master_columns, extents, lodm_profile, lodm_width, smooth, direct, parabolic,
    mirrored, rotation, shift, slave_is_pinion, penalty, count, slave_centre, master_centre, clearance, largest_gap,
    foot_step, memory_element, memory_guess, lists,
):  # fmt: skip
    """List the slave points of one tooth pair that penetrate, or nearly do.

    The rows of slave points are visited outwards from the kinematic contact; flanks separate quadratically from there,
    so a direction ends at the first row that is clear of the master.

    Parameters
    ----------
    nodes : ndarray, shape (n, 3)
        Deformed nodes of all windows, each in its own tooth's frame, mm.
    slave, master : ndarray of int, shape (6,)
        Windows (module docstring).
    slave_columns, master_columns : int
        Node columns of the windows.
    extents : ndarray, shape (slave points along the window's rows, points along the width, 4)
        Half distances from each slave point to its neighbours towards root, tip, -z and +z, mm; their products are
        the point's share of area.
    lodm_profile, lodm_width, smooth, parabolic, mirrored
        As in `refine` and `node_normals`.
    direct : bool
        Project on the master's patches themselves; else on bilinear facets through its refined points (the paper).
    rotation, shift : ndarray, shape (3, 3), (3,)
        Carry the slave tooth's frame into the master tooth's frame; `shift` is a point of the slave's axis there.
    slave_is_pinion : bool
    penalty : float
        N/mm^3.
    count : int
        How many active points there are already; new ones are written behind them.
    slave_centre, master_centre : float
        Kinematic contact in element rows of the two windows, from the first element row of each.
    clearance : float
        Gap beyond which a row and those behind it cannot touch, mm.
    largest_gap : float
        Points with a gap below it are listed: 0 for those that penetrate, mm.
    foot_step : float
        See `project`.
    memory_element, memory_guess : ndarray, shape (slave rows, points along the width, 2)
        Where each slave point was projected the last time (element -1: not yet); updated.
    lists : tuple of ndarrays (index, weight, gap, stiffness, lever, mate_lever, place)
        Filled for each active point: node numbers (8), gradient of the gap by the nodes' displacements (8, 3), gap
        (mm), penalty stiffness (N/mm), derivative of the gap by the pinion's rotation and lever arm of the force on
        the wheel (mm), and (slave row, slave column, master element row, master element column) of the point.

    Returns
    -------
    count : int
        Active points so far.
    smallest : float
        Smallest gap met, mm (infinite if nothing projects).
    touches_border : bool
        Contact reaches the end of a window that is not the edge of its flank: the window is too small.
    """
    slave_nodes, surface = _window_nodes(nodes, slave, slave_columns), _window_nodes(nodes, master, master_columns)
    slave_rows, slave_across = np.empty((slave[1], slave_columns, 2, 3)), np.empty((slave[1], slave_columns, 2, 3))
    along_rows, along_columns = np.empty((master[1], master_columns, 2, 3)), np.empty((master[1], master_columns, 2, 3))
    prepare_surface(slave_nodes, slave[4] == 1, slave[5] == 1, smooth, parabolic, mirrored, slave_rows, slave_across)
    prepare_surface(surface, master[4] == 1, master[5] == 1, smooth, parabolic, mirrored, along_rows, along_columns)
    first, patches = master[2], master[3]
    detail = (lodm_profile, lodm_width, 1, 1)
    if not direct:
        refined = np.empty((master[3] * lodm_profile + 1, (master_columns - 1) * lodm_width + 1, 3))
        refine(surface, along_rows, along_columns, smooth, master[2], master[3], lodm_profile, lodm_width, refined)
        surface, first, patches = refined, 0, master[3] * lodm_profile
        detail = (lodm_profile, lodm_width, lodm_profile, lodm_width)
    surfaces = (slave_nodes, slave_rows, slave_across, surface, along_rows, along_columns, first, patches)
    points = np.empty(((slave_columns - 1) * lodm_width + 1, 3))
    work = (np.empty(3), np.empty(3), np.empty(3), np.empty(3), points)
    element, guess = np.empty(2, dtype=np.int64), np.empty(2)
    rows = slave[3] * lodm_profile + 1
    centre = min(max(int(round(slave_centre * lodm_profile)), 0), rows - 1)
    smallest, touches_border = np.inf, False
    for direction in (1, -1):
        row, met_master = (centre, False) if direction == 1 else (centre - 1, smallest < np.inf)
        while 0 <= row < rows:
            # Towards the tip of the slave is towards the root of the master, by about as many elements.
            place = (master_centre + slave_centre - row / lodm_profile) * detail[2]
            element[0] = first + min(max(int(place), 0), patches - 1)
            guess[0] = min(max(place - element[0] + first, -0.5), 1.5)
            count, row_smallest, at_border = _search_row(
                row, surfaces, slave, master, extents, smooth, direct, detail, rotation, shift, slave_is_pinion,
                penalty, largest_gap, foot_step, count, element, guess, memory_element, memory_guess, work, lists,
            )  # fmt: skip
            smallest, touches_border = min(smallest, row_smallest), touches_border or at_border
            if row_smallest > clearance and (met_master or row_smallest < np.inf):
                break
            met_master = met_master or row_smallest < np.inf
            row += direction
    return count, smallest, touches_border


@inlined
def _transfer(window, columns, ei, ek, s, t, nx, ny, nz, point, at, index, weight):
    """Nodes of an element and the bilinear shares of a force n at (s, t) in it (the paper's force transfer)."""
    node = window[0] + (window[2] + ei) * columns + ek
    for a in range(4):
        share = (s if a >= 2 else 1.0 - s) * (t if a % 2 == 1 else 1.0 - t)
        index[point, at + a] = node + (columns if a >= 2 else 0) + a % 2
        weight[point, at + a, 0], weight[point, at + a, 1] = share * nx, share * ny
        weight[point, at + a, 2] = share * nz


# Windows: which tooth pairs can touch, and which element rows of their flanks. `geometry` holds the length of the
# line of action (mm), the working pressure angle, the centre distance (mm), the angular pitch of the pinion, the first
# and last roll position of the path of contact, the bottom of the radii of curvature (mm), the local share of the
# approach, the largest distance between rows of contact points (mm); then the misalignment: offset of the wheel's axis
# at mid width, z = 0, along x and y (mm), its slope along x and y, and the angle by which the unloaded pinion is ahead
# when the flanks first touch, at one of the faces (rad), from which the lead counts. Each of the two `gears`
# is a tuple: nodes, roll angles of the node rows, extents of the refined points, (base radius, roll angle at the form
# circle and at the tip circle, half the tooth's angle on the base circle, compliance of line contact), and, for contact
# in sections, the constant of the approach at each row and the width that each column stands for.


@compiled
def _roll_angle(geometry, gears, gear, roll_position):
    """Roll angle of the kinematic contact point, continued beyond the path of contact."""
    pinion = roll_position + gears[0][3][3] + geometry[1]
    return pinion if gear == 0 else (geometry[0] - pinion * gears[0][3][0]) / gears[1][3][0]


@compiled
def _on_flank(gears, gear, roll):
    return min(max(roll, gears[gear][3][1]), gears[gear][3][2])


@compiled
def relative_radius(geometry, gears, roll_position):
    """Relative radius of curvature of the flanks where a pair at a roll position (rad) touches, mm."""
    curvature = 0.0
    for gear in range(2):
        roll = _on_flank(gears, gear, _roll_angle(geometry, gears, gear, roll_position))
        curvature += 1.0 / max(roll * gears[gear][3][0], geometry[6])
    return 1.0 / curvature


@compiled
def overshoot(geometry, gears, depth):
    """How far beyond the path of contact an approach `depth` (mm) makes a pair touch, rad of roll position."""
    radius = max(relative_radius(geometry, gears, geometry[4]), relative_radius(geometry, gears, geometry[5]))
    return min(np.sqrt(2.0 * depth * radius) / gears[0][3][0], 0.5 * geometry[3])


@compiled
def _place_window(flank_roll, base_radius, roll, half, window, columns, offset):
    """Cut the element rows within the arc length `half` of a roll angle; return the first row and its centre."""
    rows = len(flank_roll) - 1
    reach = 2.0 * half / base_radius  # arc length s = r_b u^2 / 2
    low = np.searchsorted(flank_roll, np.sqrt(max(roll**2 - reach, 0.0)), side="right") - 1
    high = np.searchsorted(flank_roll, np.sqrt(roll**2 + reach), side="left")
    low = min(max(low, 0), rows - 1)
    high = min(max(high, low + 1), rows)
    node_low, node_high = max(low - 1, 0), min(high + 1, rows)
    window[0], window[1], window[2], window[3] = offset, node_high - node_low + 1, low - node_low, high - low
    window[4], window[5] = 1 if low == 0 else 0, 1 if high == rows else 0
    row = min(max(np.searchsorted(flank_roll, roll, side="right") - 1, 0), rows - 1)
    return low, row + (roll - flank_roll[row]) / (flank_roll[row + 1] - flank_roll[row])


@compiled
def place_windows(phi, depth, geometry, gears, indices, windows, first_row, centre):
    """Find the tooth pairs and windows that can touch at pinion angle `phi` (rad) for an approach `depth` (mm).

    Parameters
    ----------
    geometry, gears
        See above.
    indices : ndarray of int, shape (P,)
        Filled with the tooth pairs.
    windows : ndarray of int, shape (P, 2, 6)
        Filled with the windows of pinion and wheel.
    first_row : ndarray of int, shape (P, 2)
        Filled with the element row of the flank with which each window's elements begin.
    centre : ndarray, shape (P, 2)
        Filled with the kinematic contact in element rows of the flank.

    Returns
    -------
    pairs, nodes : int
        Number of pairs and of window nodes.
    """
    pitch, margin = geometry[3], overshoot(geometry, gears, depth)
    low = int(np.ceil((geometry[4] - margin - phi) / pitch - 1e-12))
    high = int(np.floor((geometry[5] + margin - phi) / pitch + 1e-12))
    count, offset = 0, 0
    for index in range(low, high + 1):
        roll_position = phi + index * pitch
        # Wherever contact lies, a row of points on either side of it is inside, not on the border.
        half = np.sqrt(2.0 * geometry[7] * depth * relative_radius(geometry, gears, roll_position))
        half = max(half, 1.5 * geometry[8])
        for gear in range(2):
            roll = _on_flank(gears, gear, _roll_angle(geometry, gears, gear, roll_position))
            first_row[count, gear], centre[count, gear] = _place_window(
                gears[gear][1], gears[gear][3][0], roll, half, windows[count, gear], gears[gear][0].shape[1], offset
            )
            offset += windows[count, gear, 1] * gears[gear][0].shape[1]
        indices[count] = index
        count += 1
    return count, offset


@allocating
def relative_motion(geometry, gears, roll_position, lead, rotation, shift):
    """Rigid motion from the pinion tooth's frame into the mating wheel tooth's frame; fills `rotation` and `shift`.

    A point at x on the pinion's tooth turns by the pinion's angle, is seen from the wheel's axis, which is offset and
    tilted, and turns back by the wheel's angle. `shift` is a point of the pinion's axis, ``rotation[:, 2]`` its
    direction.
    """
    wheel_roll = _roll_angle(geometry, gears, 1, roll_position)
    wheel_rotation = np.pi + wheel_roll - gears[1][3][3] - geometry[1]
    angle = roll_position + lead + geometry[13] - wheel_rotation
    c, s = np.cos(angle), np.sin(angle)
    rotation[:] = 0.0
    rotation[0, 0] = rotation[1, 1] = c
    rotation[1, 0], rotation[0, 1], rotation[2, 2] = s, -s, 1.0
    cw, sw = np.cos(wheel_rotation), np.sin(wheel_rotation)
    x, y = -geometry[9], -geometry[2] - geometry[10]
    shift[0], shift[1], shift[2] = cw * x + sw * y, -sw * x + cw * y, 0.0
    along_x, along_y = geometry[11], geometry[12]
    if along_x == 0.0 and along_y == 0.0:
        return
    # The rotation that carries the z axis onto the wheel's axis, transposed, in the frame turned with the wheel.
    tilt_x, tilt_y = cw * along_x + sw * along_y, -sw * along_x + cw * along_y
    cosine = 1.0 / np.sqrt(1.0 + along_x**2 + along_y**2)
    bend = cosine**2 / (1.0 + cosine)
    turned = np.empty((3, 4))
    turned[:, :3], turned[:, 3] = rotation, shift
    for column in range(4):
        px, py, pz = turned[0, column], turned[1, column], turned[2, column]
        across = bend * (tilt_x * px + tilt_y * py) + cosine * pz
        lifted = cosine * (tilt_x * px + tilt_y * py + pz)
        turned[0, column], turned[1, column], turned[2, column] = px - tilt_x * across, py - tilt_y * across, lifted
    rotation[:], shift[:] = turned[:, :3], turned[:, 3]


@compiled
def section_offset(geometry, gears, z):
    """Effect of the misalignment in the transverse section at z (mm), where the wheel's axis is at another place.

    About an axis at another distance, in another direction, the same involutes are conjugate again, at a pressure angle
    and on a line of action of their own.

    Returns
    -------
    x, y : float
        Offset of the wheel's axis, mm.
    turn : float
        By which the roll angles at the line of action, of both gears, exceed those of the aligned pair, rad.
    opening : float
        Gap along that line at zero lead, mm.
    """
    x, y = geometry[9] + geometry[11] * z, geometry[10] + geometry[12] * z
    if x == 0.0 and y == 0.0 and geometry[13] == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    base = gears[0][3][0] + gears[1][3][0]
    distance = np.hypot(x, geometry[2] + y)
    turn = np.arccos(base / distance) - geometry[1] + np.arctan2(x, geometry[2] + y)
    opening = np.sqrt(distance**2 - base**2) - geometry[0] - base * turn - gears[0][3][0] * geometry[13]
    return x, y, turn, opening


@compiled
def section_motion(geometry, gears, roll_position, lead, z, rotation, shift, back, back_shift):
    """Rigid motion within the transverse section at z (mm), from the pinion tooth's frame into the wheel's and back.

    Returns
    -------
    turn, opening : float
        As `section_offset` gives them.
    """
    x, y, turn, opening = section_offset(geometry, gears, z)
    wheel_rotation = np.pi + _roll_angle(geometry, gears, 1, roll_position) - gears[1][3][3] - geometry[1]
    angle = roll_position + lead + geometry[13] - wheel_rotation
    c, s = np.cos(angle), np.sin(angle)
    cw, sw = np.cos(wheel_rotation), np.sin(wheel_rotation)
    x, y = -x, -geometry[2] - y
    rotation[0, 0] = rotation[1, 1] = back[0, 0] = back[1, 1] = c
    rotation[1, 0], rotation[0, 1], back[1, 0], back[0, 1] = s, -s, -s, s
    shift[0], shift[1] = cw * x + sw * y, -sw * x + cw * y
    back_shift[0], back_shift[1] = -c * shift[0] - s * shift[1], s * shift[0] - c * shift[1]
    return turn, opening


@compiled
def pinion_slave_share(geometry, slave_mode, roll_position):
    """Share of the penalty with which the pinion is the slave.

    A negative mode makes the gear whose tip is nearer the slave, so that a tip corner always meets the smooth flank of
    its mate, on either gear alike; the two hand over smoothly in the middle fifth of the path of contact.
    """
    if slave_mode >= 0.0:
        return slave_mode
    x = min(max(5.0 * (roll_position - geometry[4]) / (geometry[5] - geometry[4]) - 2.0, 0.0), 1.0)
    return x * x * (3.0 - 2.0 * x)


# Transverse sections: the schemes "line" and "strip". Both take the flanks for the involutes they are, displaced by the
# nodal displacements that a cubic along the profile interpolates, with slopes of the parabola through each node and its
# neighbours (C1 in the arc length). A section is one column of nodes. To first order in the displacements: normals,
# levers and closest points are those of the undeformed involutes, which are parallel curves about their base circles
# and therefore need no iteration. In a tooth's frame the involute at roll angle u is at r_b (e + u e'), with e the unit
# vector at the angle half - u from +y and e' the one at right angles, which is also the outward normal.


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
def _involute_foot(gears, slave, u, rotation, shift, at):
    """Project the point of the slave's involute at roll angle u on the master's involute.

    Fills `at`: gap (mm), roll angles on pinion and wheel, direction in which a displacement of the pinion's and of the
    wheel's point opens the gap (x, y in its tooth's frame each), derivative of the gap by the pinion's rotation and
    lever arm of the force on the wheel (mm).
    """
    own, mate, master = gears[slave][3], gears[1 - slave][3], 1 - slave
    angle = own[3] - u
    px, py = own[0] * (-np.sin(angle) - u * np.cos(angle)), own[0] * (np.cos(angle) - u * np.sin(angle))
    x = rotation[0, 0] * px + rotation[0, 1] * py + shift[0]
    y = rotation[1, 0] * px + rotation[1, 1] * py + shift[1]
    roll = np.sqrt(max((x * x + y * y) / mate[0] ** 2 - 1.0, 0.0))
    offset = np.arctan2(-x, y) - (mate[3] - roll + np.arctan(roll))
    turn = mate[3] - roll + offset
    nx, ny = -np.cos(turn), -np.sin(turn)
    # The foot is on the mate's flank, not on the parallel involute through the point.
    at[0], at[1 + slave], at[1 + master] = mate[0] * offset, u, roll - offset
    # Undeformed: the same normal carries the force on both, whether the point is inside a flank or its corner.
    at[3 + 2 * slave] = rotation[0, 0] * nx + rotation[1, 0] * ny
    at[4 + 2 * slave] = rotation[0, 1] * nx + rotation[1, 1] * ny
    at[3 + 2 * master], at[4 + 2 * master] = -nx, -ny
    slave_arm = (x - shift[0]) * ny - (y - shift[1]) * nx
    at[7], at[8] = (slave_arm, mate[0]) if slave == 0 else (-mate[0], -slave_arm)


@compiled
def _closest_approach(geometry, gears, roll_position, lead, z, motion, at):
    """Closest approach of two undeformed flanks in the section at z; fills `at` as `_involute_foot` does.

    Between the tips it lies on the line of action, which each flank meets at its own roll angle; beyond, a tip corner
    meets the mate. `motion` is room for `section_motion`.
    """
    forward, shift, back, back_shift = motion
    turn, opening = section_motion(geometry, gears, roll_position, lead, z, forward, shift, back, back_shift)
    ahead = lead + geometry[13] + turn
    roll = (
        _roll_angle(geometry, gears, 0, roll_position) + ahead, _roll_angle(geometry, gears, 1, roll_position) + turn
    )  # fmt: skip
    if roll[0] > gears[0][3][2]:
        _involute_foot(gears, 0, gears[0][3][2], forward, shift, at)
    elif roll[1] > gears[1][3][2]:
        _involute_foot(gears, 1, gears[1][3][2], back, back_shift, at)
    else:
        at[0], at[7], at[8] = opening - gears[0][3][0] * lead, -gears[0][3][0], gears[1][3][0]
        for gear in range(2):
            at[1 + gear] = roll[gear]
            angle = gears[gear][3][3] - roll[gear]
            at[3 + 2 * gear], at[4 + 2 * gear] = np.cos(angle), np.sin(angle)


@compiled
def _carriers(gears, windows, first_row, at, rows, weights):
    """Rows and weights of the nodes that carry a point of both flanks; return whether it is inside both windows."""
    inside = True
    for gear in range(2):
        roll, low = gears[gear][1], first_row[gear]
        high = low + windows[gear, 3]
        rows[gear] = cubic_rows(roll, at[1 + gear], low, high, weights[gear])
        beyond_low = windows[gear, 4] == 0 and at[1 + gear] < roll[low]
        inside = inside and not beyond_low and not (windows[gear, 5] == 0 and at[1 + gear] > roll[high])
    return inside


@compiled
def _opening(moved, gears, windows, first_row, at, rows, weights, column):
    """Change of the gap by the displacements in one section."""
    change = 0.0
    for gear in range(2):
        columns, first = gears[gear][0].shape[1], first_row[gear] - windows[gear, 2]
        for a in range(4):
            if weights[gear, a] != 0.0:
                node = moved[windows[gear, 0] + (rows[gear] + a - first) * columns + column]
                change += weights[gear, a] * (at[3 + 2 * gear] * node[0] + at[4 + 2 * gear] * node[1])
    return change


@compiled
def _list_section_point(gears, windows, first_row, at, rows, weights, column, slave, gap, stiffness, count, lists):
    """Write a point of a section into the lists of `search_pair`."""
    lists[2][count], lists[3][count], lists[4][count], lists[5][count] = gap, stiffness, at[7], at[8]
    index, weight, place = lists[0], lists[1], lists[6]
    for side in range(2):
        gear = slave ^ side
        columns, first = gears[gear][0].shape[1], first_row[gear] - windows[gear, 2]
        for a in range(4):
            row = min(rows[gear] + a - first, windows[gear, 1] - 1)
            index[count, 4 * side + a] = windows[gear, 0] + row * columns + column
            weight[count, 4 * side + a, 0] = weights[gear, a] * at[3 + 2 * gear]
            weight[count, 4 * side + a, 1] = weights[gear, a] * at[4 + 2 * gear]
            weight[count, 4 * side + a, 2] = 0.0
        place[count, 2 * side], place[count, 2 * side + 1] = rows[gear] - first_row[gear], column


@compiled
def line_load(penetration, compliance, constant, least):
    """Line load and its derivative for an approach of the flanks (`pmor.contact.line_contact`).

    Solves penetration = C w (A - ln(w) / 2), C the compliance, A the constant. Below the load `least` the logarithm is
    held (the contact is then narrower than any roughness); where the half-width comes near the depth of the layer,
    beyond A - ln(w) / 2 = 1, the law goes on linearly, so that Newton finds its way back from there.

    Returns
    -------
    load, slope : float
        N/mm, N/mm^2.
    """
    secant = compliance * (constant - 0.5 * np.log(least))
    if penetration <= secant * least:
        return max(penetration, 0.0) / secant, 1.0 / secant
    widest = np.exp(2.0 * constant - 2.0)
    if penetration >= compliance * widest:
        return widest + 2.0 * (penetration / compliance - widest), 2.0 / compliance
    load = penetration / secant
    for _ in range(50):
        shape = constant - 0.5 * np.log(load)
        step = (penetration - compliance * load * shape) / (compliance * (shape - 0.5))
        load = min(load + step, widest)
        if abs(step) <= 1e-15 * load:
            break
    return load, 1.0 / (compliance * (constant - 0.5 * np.log(load) - 0.5))


@compiled
def _line_law(gears, at, rows, weights):
    """Compliance and constant of `line_load` where two flanks meet, and the load below which it is linear."""
    compliance, constant, curvature = 0.0, 0.0, 0.0
    for gear in range(2):
        circles, value = gears[gear][3], 0.0
        for a in range(4):
            row = min(rows[gear] + a, len(gears[gear][4]) - 1)
            value += weights[gear, a] * gears[gear][4][row]
        compliance += circles[4]
        constant += circles[4] * value
        curvature += 1.0 / max(circles[0] * at[1 + gear], 1e-3 * circles[0])
    constant = constant / compliance - 0.5 * np.log(2.0 * compliance / curvature)
    return compliance, constant, 1e-9 / (compliance * curvature)


@compiled
def _search_line(
    moved, geometry, gears, windows, first_row, roll_position, lead, motion, at, twice, count, largest_gap, rows,
    weights, lists,
):  # fmt: skip
    """List the sections of a tooth pair, one point each, at the closest approach; see `search_pair`.

    The load is not proportional to the gap. Listed are the tangent stiffness and the gap that, times it, gives the
    load: a Newton step on these is the exact tangent of the nonlinear law.
    """
    smallest, border, inside = np.inf, False, True
    compliance, constant, least = 0.0, 0.0, 0.0
    alike = geometry[11] == 0.0 and geometry[12] == 0.0
    for column in range(gears[0][0].shape[1]):
        if column == 0 or not alike:
            _closest_approach(geometry, gears, roll_position, lead, gears[0][0][0, column, 2], motion, at)
            inside = _carriers(gears, windows, first_row, at, rows, weights)
            compliance, constant, least = _line_law(gears, at, rows, weights)
        gap = at[0] + _opening(moved, gears, windows, first_row, at, rows, weights, column)
        smallest = min(smallest, gap)
        if gap >= largest_gap:
            continue
        border = border or (gap < 0.0 and not inside)
        load, slope = line_load(-gap, compliance, constant, least)
        stiffness = twice * slope * gears[0][5][column]
        effective = gap if gap >= 0.0 else -load / slope
        _list_section_point(
            gears, windows, first_row, at, rows, weights, column, 0, effective, stiffness, count, lists
        )
        count += 1
    return count, smallest, border


@compiled
def _strip_gap(moved, gears, windows, first_row, slave, u, rotation, shift, column, at, rows, weights):
    """Gap of the slave's point at roll angle u in a section; return it and whether both windows hold the point."""
    _involute_foot(gears, slave, u, rotation, shift, at)
    inside = _carriers(gears, windows, first_row, at, rows, weights)
    return at[0] + _opening(moved, gears, windows, first_row, at, rows, weights, column), inside


@compiled
def _strip_end(moved, gears, windows, first_row, slave, low, gap_low, high, gap_high, rotation, shift, column, work):
    """Where the gap changes sign between two roll angles, by false position with halving (Illinois)."""
    at, rows, weights = work
    side, u = 0, low
    for _ in range(60):
        u = (low * gap_high - high * gap_low) / (gap_high - gap_low)
        gap, _inside = _strip_gap(
            moved, gears, windows, first_row, slave, u, rotation, shift, column, at, rows, weights
        )
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
def _strip_borders(geometry, gears, windows, first_row, slave, roll_position, turn, rotation, shift, at, borders):
    """Roll angles of the slave between which the gap is smooth, in order; return their number.

    The node rows of the window, the closest approach, and the place that faces the master's tip, where the list ends
    or begins.
    """
    roll, master = gears[slave][1], 1 - slave
    low, high = roll[first_row[slave]], roll[first_row[slave] + windows[slave, 3]]
    tip = gears[master][3][2]
    # Towards the slave's root is towards the master's tip.
    start = low
    for _ in range(20):
        _involute_foot(gears, slave, start, rotation, shift, at)
        beyond = at[1 + master] - tip
        if (beyond <= 0.0 and start <= low) or abs(beyond) < 1e-14:
            break
        start = max(start + beyond * gears[master][3][0] / gears[slave][3][0], low)
    centre = _roll_angle(geometry, gears, slave, roll_position) + turn
    count = 0
    for i in range(windows[slave, 3] + 1):
        u = roll[first_row[slave] + i]
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


@allocating
def _search_strip(
    moved, geometry, gears, windows, first_row, slave, roll_position, lead, motion, penalty, count, abscissas,
    at, rows, weights, lists,
):  # fmt: skip
    """Integrate the penalty pressure over the strips in which the gap is negative; see `search_pair`.

    In each section the strip is cut at node rows, at the closest approach and at its own ends, and each piece has
    Gauss points: force is a smooth function of everything, and no refinement enters.
    """
    borders, work = np.empty(windows[slave, 3] + 4), (at, rows, weights)
    forward, forward_shift, back, back_shift = motion
    rotation, shift = (forward, forward_shift) if slave == 0 else (back, back_shift)
    smallest, border, borders_count = np.inf, False, 0
    alike = geometry[11] == 0.0 and geometry[12] == 0.0
    for column in range(gears[slave][0].shape[1]):
        before = 0.0
        if column == 0 or not alike:
            turn, _opening = section_motion(
                geometry, gears, roll_position, lead, gears[slave][0][0, column, 2], forward, forward_shift, back,
                back_shift,
            )  # fmt: skip
            borders_count = _strip_borders(
                geometry, gears, windows, first_row, slave, roll_position, turn, rotation, shift, at, borders
            )
        for i in range(borders_count):
            gap, inside = _strip_gap(
                moved, gears, windows, first_row, slave, borders[i], rotation, shift, column, at, rows, weights
            )
            smallest = min(smallest, gap)
            cut_off = (i == 0 and windows[slave, 4] == 0 and borders[0] <= gears[slave][1][first_row[slave]]) or (
                i == borders_count - 1 and windows[slave, 5] == 0
            )
            border = border or (gap < 0.0 and (cut_off or not inside))
            if i > 0 and (gap < 0.0 or before < 0.0):
                low, high = borders[i - 1], borders[i]
                if before * gap < 0.0:
                    end = _strip_end(
                        moved, gears, windows, first_row, slave, low, before, high, gap, rotation, shift, column, work
                    )
                    low, high = (end, high) if gap < 0.0 else (low, end)
                for a in range(len(abscissas)):
                    u = 0.5 * (low + high) + 0.5 * (high - low) * abscissas[a, 0]
                    value, _inside = _strip_gap(
                        moved, gears, windows, first_row, slave, u, rotation, shift, column, at, rows, weights
                    )
                    # An element of the involute's length is r_b u du.
                    length = 0.5 * (high - low) * abscissas[a, 1] * gears[slave][3][0] * u
                    stiffness = penalty * length * gears[slave][5][column]
                    _list_section_point(
                        gears, windows, first_row, at, rows, weights, column, slave, value, stiffness, count, lists
                    )
                    count += 1
            before = gap
    return count, smallest, border


@compiled
def point_room(pairs, windows, gears, scheme):
    """Return how many points `search_all` can list, and the grid on which it remembers feet (profile, width)."""
    elements = 0
    for p in range(pairs):
        elements = max(elements, windows[p, 0, 3], windows[p, 1, 3])
    columns = max(gears[0][0].shape[1], gears[1][0].shape[1])
    if scheme[9] == 2:
        return pairs * columns, 0, 0
    if scheme[9] == 1:
        return 2 * pairs * (elements + 3) * len(scheme[10]) * columns, 0, 0
    profile_points, width_points = elements * scheme[0] + 1, (columns - 1) * scheme[1] + 1
    return 2 * pairs * profile_points * width_points, profile_points, width_points


@allocating
def search_all(
    phi, lead, nodes, pairs, indices, windows, first_row, centre, geometry, gears, scheme, clearance, largest_gap,
    memory_element, memory_guess, point_pair, point_slave, lists,
):  # fmt: skip
    """List the points of all tooth pairs in reach that penetrate, or nearly do.

    Parameters
    ----------
    phi, lead : float
        Kinematic pinion angle and rotation ahead of it, rad.
    nodes : ndarray, shape (n, 3)
        Deformed nodes of all windows, mm; for exact flanks (kinds 1 and 2) their displacements alone, which small loads
        would lose among the digits of the coordinates.
    pairs, indices, windows, first_row, centre
        As `place_windows` gives them.
    geometry, gears
        See above.
    scheme : tuple
        (lodm_profile, lodm_width, smooth, direct, parabolic, mirrored, penalty, foot step, slave mode, kind, Gauss
        points and weights); mirrored: the windows hold half the width, and each point stands for its mirror image too;
        kind: 0 nodal, 1 strip, 2 line.
    clearance, largest_gap : float
        mm, see `search_pair`.
    memory_element, memory_guess : ndarray, shape (P, 2, points along the profile, points along the width, 2)
    point_pair, point_slave : ndarray of int
        Filled with the pair and the slave gear of each active point.
    lists : tuple
        See `search_pair`.

    Returns
    -------
    count, smallest, touches_border
    """
    lodm_profile, lodm_width, smooth, direct, parabolic, mirrored, penalty, foot_step = scheme[:8]
    slave_mode, kind, gauss = scheme[8:]
    twice = 2.0 if mirrored else 1.0
    at, rows, weights = np.empty(9), np.empty(2, dtype=np.int64), np.empty((2, 4))
    forward, back, shift, back_shift = np.empty((3, 3)), np.empty((3, 3)), np.empty(3), np.empty(3)
    count, smallest, touches_border = 0, np.inf, False
    motion = (forward, shift, back, back_shift)
    for p in range(pairs):
        roll_position = phi + indices[p] * geometry[3]
        if kind == 2:
            before = count
            count, nearest, at_border = _search_line(
                nodes, geometry, gears, windows[p], first_row[p], roll_position, lead, motion, at, twice, count,
                largest_gap, rows, weights, lists,
            )  # fmt: skip
            smallest, touches_border = min(smallest, nearest), touches_border or at_border
            point_pair[before:count], point_slave[before:count] = p, 0
            continue
        if kind == 0:
            relative_motion(geometry, gears, roll_position, lead, forward, shift)
            for d in range(3):
                turned = 0.0
                for e in range(3):
                    back[d, e] = forward[e, d]
                    turned += forward[e, d] * shift[e]
                back_shift[d] = -turned
        share = pinion_slave_share(geometry, slave_mode, roll_position)
        for slave in range(2):
            portion = twice * (share if slave == 0 else 1.0 - share)
            if portion == 0.0:
                continue
            master, before = 1 - slave, count
            if kind == 1:
                count, nearest, at_border = _search_strip(
                    nodes, geometry, gears, windows[p], first_row[p], slave, roll_position, lead, motion,
                    portion * penalty, count, gauss, at, rows, weights, lists,
                )  # fmt: skip
                smallest, touches_border = min(smallest, nearest), touches_border or at_border
                point_pair[before:count], point_slave[before:count] = p, slave
                continue
            first = first_row[p, slave] * lodm_profile
            extents = gears[slave][2][first : first + windows[p, slave, 3] * lodm_profile + 1]
            count, nearest, at_border = search_pair(
                nodes, windows[p, slave], gears[slave][0].shape[1], windows[p, master], gears[master][0].shape[1],
                extents, lodm_profile, lodm_width, smooth, direct, parabolic, mirrored,
                forward if slave == 0 else back, shift if slave == 0 else back_shift, slave == 0, portion * penalty,
                count, centre[p, slave] - first_row[p, slave], centre[p, master] - first_row[p, master], clearance,
                largest_gap, foot_step, memory_element[p, slave], memory_guess[p, slave], lists,
            )  # fmt: skip
            smallest, touches_border = min(smallest, nearest), touches_border or at_border
            point_pair[before:count], point_slave[before:count] = p, slave
    return count, smallest, touches_border


# The reduced pair. Its unknowns are the amplitudes of *members*: the shapes in reach at a position, in one of two
# families, and the pinion's rotation. `family` is the tuple (by_line, lines, positions, beside):
#
# * by_line: which of the two; the arrays of the other one are empty;
# * lines: for pinion and wheel (start, displacement, gram) of `pmor.reduction.flank_lines.GearLines`. A member
#   belongs to one gear;
# * positions: (first roll position, step, loaded, displacement, gram, turn, angle), the first five of
#   `pmor.reduction.contact_shapes.ContactShapes`, turn and angle of its `pmor.reduction.grassmann.Geodesics`, empty
#   where each member is interpolated by itself. A member belongs to both gears;
# * beside: how many lines beside the elements of a window have members too (0 or 1).
#
# `members` describes those of a position: (kept, ranges, gram, factor, fields). kept[j] = pair x slots + slot numbers
# member j, with `slots` shapes that a pair can have at all; ranges[gear] are the first and the last but one member
# that move the gear; gram and its upper Cholesky factor; fields[j - ranges[gear, 0], 3 node + d] the displacement.


@compiled
def member_slots(family):
    """Return how many shapes a tooth pair can have at all."""
    by_line, lines, positions, _ = family
    return lines[0][1].shape[1] + lines[1][1].shape[1] if by_line else positions[2].shape[1]


@compiled
def most_members(family, pairs, windows):
    """Return how many members a position can have at most."""
    by_line, lines, positions, beside = family
    if not by_line:
        return pairs * positions[2].shape[1]
    total = 0
    for gear in range(2):
        start, widest = lines[gear][0], 0
        for i in range(len(start) - 1):
            widest = max(widest, start[i + 1] - start[i])
        for p in range(pairs):
            total += widest * (windows[p, gear, 3] + 1 + 2 * beside)
    return total


@compiled
def _window_shapes(start, window, first_row, beside):
    """First and last but one shape of the lines that bound a window's elements, and of those beside them."""
    low = max(first_row - beside, 0)
    high = min(first_row + window[3] + beside, len(start) - 2)
    return start[low], start[high + 1]


@compiled
def _cholesky(matrix, low, high, factor):
    """Upper Cholesky factor of the block [low, high) of a symmetric matrix, of which the upper half is read.

    All inner loops run along rows of known beginning, without sums: vector registers can take them.
    """
    for i in range(low, high):
        row, source = factor[i, i:high], matrix[i, i:high]
        for k in range(high - i):
            row[k] = source[k]
    for j in range(low, high):
        pivot = factor[j, j:high]
        inverse = 1.0 / np.sqrt(pivot[0])
        for k in range(high - j):
            pivot[k] *= inverse
        for i in range(1, high - j):
            row, value, rest = factor[j + i, j + i : high], pivot[i], pivot[i:]
            for k in range(high - j - i):
                row[k] -= value * rest[k]


@compiled
def _drop_dependent(low, high, members):
    """Keep the members from `low` on that are independent to working precision, and factor their Gram matrix.

    Without the local dent, loads on lines that are close together move the tooth alike. A dropped line's load is
    carried by the others; what that misses of its energy is below the tolerance.
    """
    kept, _, gram, factor, fields = members
    size = low
    for j in range(low, high):
        pivot = gram[j, j]
        for i in range(low, size):
            value = gram[i, j]
            for e in range(low, i):
                value -= factor[e, size] * factor[e, i]
            factor[i, size] = value / factor[i, i]
            pivot -= factor[i, size] ** 2
        if pivot <= 1e-10 * gram[j, j]:
            continue
        if size < j:
            kept[size] = kept[j]
            for dof in range(fields.shape[1]):
                fields[size - low, dof] = fields[j - low, dof]
            for i in range(low, high):
                gram[size, i] = gram[j, i]
            for i in range(low, size + 1):
                gram[i, size] = gram[i, j]
                gram[size, i] = gram[i, size]
        factor[size, size] = np.sqrt(pivot)
        size += 1
    return size


@allocating
def gather_lines(pairs, indices, windows, first_row, gears, lines, beside, members):
    """Collect the shapes of the lines in reach; return the number of members.

    Parameters
    ----------
    pairs, indices, windows, first_row
        As `place_windows` gives them.
    gears, lines, beside, members
        See above; `members` is filled.
    """
    kept, ranges, gram, factor, fields = members
    slots = lines[0][1].shape[1] + lines[1][1].shape[1]
    size = 0
    first_member, first_shape = np.empty((pairs + 1,), dtype=np.int64), np.empty((pairs,), dtype=np.int64)
    for gear in range(2):
        start, displacement, products = lines[gear]
        reach, columns = (displacement.shape[0] - 1) // 2, gears[gear][0].shape[1]
        low, before = size, 0 if gear == 0 else lines[0][1].shape[1]
        for p in range(pairs):
            first_member[p] = size
            first_shape[p], last_shape = _window_shapes(start, windows[p, gear], first_row[p, gear], beside)
            for m in range(first_shape[p], last_shape):
                kept[size] = p * slots + before + m
                size += 1
        first_member[pairs] = size
        for q in range(pairs):
            from_q, to_q = first_member[q], first_member[q + 1]
            shape_q = first_shape[q]
            for p in range(pairs):
                ahead = indices[p] - indices[q] if gear == 0 else indices[q] - indices[p]
                shape_p = first_shape[p] - first_member[p]
                for i in range(first_member[p], first_member[p + 1]):
                    for j in range(from_q, to_q):
                        gram[i, j] = products[reach + ahead, shape_p + i, shape_q + j - from_q]
                first, at = 3 * (first_row[p, gear] - windows[p, gear, 2]) * columns, 3 * windows[p, gear, 0]
                for j in range(to_q - from_q):
                    source, target = displacement[reach + ahead, shape_q + j], fields[from_q - low + j]
                    for dof in range(3 * windows[p, gear, 1] * columns):
                        target[at + dof] = source[first + dof]
        size = _drop_dependent(low, size, members)
        ranges[gear, 0], ranges[gear, 1] = low, size
    for i in range(ranges[1, 0]):
        for j in range(ranges[1, 0], size):
            gram[i, j] = gram[j, i] = factor[i, j] = 0.0
    return size


@compiled
def _cubic_weights(x, weights):
    """Weights of the Lagrange cubic through four neighbours, x between the inner two (0 to 1)."""
    weights[0], weights[1] = -x * (x - 1.0) * (x - 2.0) / 6.0, (x + 1.0) * (x - 1.0) * (x - 2.0) / 2.0
    weights[2], weights[3] = -(x + 1.0) * x * (x - 2.0) / 2.0, (x + 1.0) * x * (x - 1.0) / 6.0


@allocating
def _geodesic_weights(turn, angle, fraction, low, high, weights):
    """Mix the shapes loaded on both sides into members along a geodesic; see `pmor.reduction.grassmann`."""
    count = len(angle)
    shares = np.empty((2, count))
    for j in range(count):
        sine = np.sin(angle[j])
        shares[0, j], shares[1, j] = 1.0 - fraction, fraction
        if sine > 1e-6:
            shares[0, j] = np.sin((1.0 - fraction) * angle[j]) / sine
            shares[1, j] = np.sin(fraction * angle[j]) / sine
    for s in range(count):
        for t in range(count):
            if low[s] and high[s] and low[t] and high[t]:
                for a in range(2):
                    weights[a, s, t] = 0.0
                    for j in range(count):
                        weights[a, s, t] += turn[s, j] * shares[a, j] * turn[t, j]


@compiled
def _member_weights(positions, roll_position, weights):
    """First grid position of the stencil and weights (S, T, T) of shapes in members; see `ContactShapes.combination`.

    Unless members lie on a geodesic, each belongs to one shape: only the weights [:, t, t] are written.
    """
    first, step, loaded, turn, angle = positions[0], positions[1], positions[2], positions[5], positions[6]
    before = positions[4].shape[2] // 2 - 1
    place = (roll_position - first) / step
    nearest = np.rint(place)
    if abs(place - nearest) < 1e-9:
        place = nearest
    k = min(max(int(np.floor(place)), 0), loaded.shape[0] - 2)
    fraction = place - k
    for t in range(loaded.shape[1]):
        low = 1.0 - fraction if loaded[k, t] else 0.0
        high = fraction if loaded[k + 1, t] else 0.0
        weights[:, t, t] = 0.0
        if fraction < 0.0 or fraction > 1.0 or low + high <= 0.0:
            continue
        weights[before, t, t], weights[before + 1, t, t] = low / (low + high), high / (low + high)
        if before == 1 and 0 < k < loaded.shape[0] - 2 and loaded[k - 1, t] and low * high != 0.0 and loaded[k + 2, t]:
            _cubic_weights(fraction, weights[:, t, t])
    if len(angle) and 0.0 < fraction < 1.0:
        _geodesic_weights(turn[k], angle[k], fraction, loaded[k], loaded[k + 1], weights)
    return k - before


@compiled
def _independent_members(products, count, kept, gram, factor):
    """Keep the members that are independent to working precision, with their Gram matrix and its factor."""
    size = 0
    for j in range(count):
        if products[j, j] <= 0.0:
            continue
        pivot = products[j, j]
        for i in range(size):
            value = products[j, kept[i]]
            for e in range(i):
                value -= factor[e, size] * factor[e, i]
            factor[i, size] = value / factor[i, i]
            pivot -= factor[i, size] ** 2
        if pivot > 1e-10 * products[j, j]:
            factor[size, size] = np.sqrt(pivot)
            kept[size] = j
            size += 1
    for i in range(size):
        for j in range(size):
            gram[i, j] = products[kept[i], kept[j]]
    return size


@allocating
def interpolate_positions(phi, pairs, indices, windows, first_row, geometry, gears, positions, members):
    """Interpolate the shapes of all pairs in reach over their roll positions; return the number of members.

    Parameters
    ----------
    phi, pairs, indices, windows, first_row, geometry, gears
        As in `search_all`.
    positions, members
        See above; `members` is filled.
    """
    kept, ranges, gram, factor, fields = members
    displacement, products = positions[3], positions[4]
    torques, reach, stencil = displacement.shape[1], (displacement.shape[3] - 1) // 2, products.shape[2]
    before = stencil // 2 - 1
    # On a geodesic a member is made of all shapes, else of its own.
    mixed = len(positions[6]) > 0
    weights, places = np.zeros((pairs, stencil, torques, torques)), np.empty(pairs, dtype=np.int64)
    for p in range(pairs):
        places[p] = _member_weights(positions, phi + indices[p] * geometry[3], weights[p])
    work = np.zeros((pairs * torques, pairs * torques))
    for p in range(pairs):
        for q in range(p, pairs):
            for t in range(torques):
                from_t, to_t = (0, torques) if mixed else (t, t + 1)
                for u in range(torques):
                    from_u, to_u = (0, torques) if mixed else (u, u + 1)
                    value = 0.0
                    for a in range(stencil):
                        for b in range(stencil):
                            product = products[indices[q] - indices[p], places[p] + before, a, b]
                            for s in range(from_t, to_t):
                                for v in range(from_u, to_u):
                                    value += weights[p, a, s, t] * weights[q, b, v, u] * product[s, v]
                    work[p * torques + t, q * torques + u] = work[q * torques + u, p * torques + t] = value
    size = _independent_members(work, pairs * torques, kept, gram, factor)
    for gear in range(2):
        ranges[gear, 0], ranges[gear, 1] = 0, size
    for p in range(pairs):
        for gear in range(2):
            columns = gears[gear][0].shape[1]
            start = 3 * (first_row[p, gear] - windows[p, gear, 2]) * columns
            count, offset = 3 * windows[p, gear, 1] * columns, 3 * windows[p, gear, 0]
            for j in range(size):
                q, t = kept[j] // torques, kept[j] % torques
                from_t, to_t = (0, torques) if mixed else (t, t + 1)
                ahead = indices[p] - indices[q]
                tooth = reach + (ahead if gear == 0 else -ahead)
                target = fields[j]
                target[offset : offset + count] = 0.0
                for a in range(stencil):
                    for s in range(from_t, to_t):
                        weight = weights[q, a, s, t]
                        if weight == 0.0:
                            continue
                        source = displacement[places[q] + a, s, gear, tooth]
                        for dof in range(count):
                            target[offset + dof] += weight * source[start + dof]
    return size


@compiled
def _solve_transposed(factor, size, vector):
    """Solve with the transpose of an upper factor."""
    for i in range(size):
        row = factor[i]
        vector[i] /= row[i]
        value = vector[i]
        for k in range(i + 1, size):
            vector[k] -= row[k] * value


@compiled
def _solve_upper(factor, size, vector):
    for i in range(size - 1, -1, -1):
        for k in range(i + 1, size):
            vector[i] -= factor[i, k] * vector[k]
        vector[i] /= factor[i, i]


@compiled
def _deform(undeformed, position, members, coordinates, nodes):
    """Deformed nodes, or displacements alone where `undeformed` is zero."""
    pairs, windows, gears = position[1], position[3], position[8]
    ranges, fields = members[1], members[4]
    flat, before = nodes.reshape(nodes.size), undeformed.reshape(undeformed.size)
    for dof in range(flat.size):
        flat[dof] = before[dof]
    for p in range(pairs):
        for gear in range(2):
            low = 3 * windows[p, gear, 0]
            high = low + 3 * windows[p, gear, 1] * gears[gear][0].shape[1]
            for j in range(ranges[gear, 1] - ranges[gear, 0]):
                # Slices from 0 on: a compiler must allow for a negative start and does not use vector registers then.
                amplitude, field, moved = coordinates[ranges[gear, 0] + j], fields[j, low:high], flat[low:high]
                for dof in range(len(moved)):
                    moved[dof] += amplitude * field[dof]


@compiled
def _project_points(count, size, members, slave, lists, columns):
    """Derivatives of the gaps by the members' amplitudes, shape (count, size)."""
    ranges, fields, index, weight = members[1], members[4], lists[0], lists[1]
    for n in range(count):
        row = columns[n]
        for j in range(size):
            row[j] = 0.0
        for side in range(2):
            low, high = ranges[slave[n] ^ side, 0], ranges[slave[n] ^ side, 1]
            for j in range(high - low):
                field, value = fields[j], 0.0
                for a in range(4 * side, 4 * side + 4):
                    first = 3 * index[n, a]
                    for d in range(3):
                        value += weight[n, a, d] * field[first + d]
                row[low + j] += value


@compiled
def _residuals(count, size, members, columns, coordinates, lists, torque, lead, target, difference):
    """Penetrating points, force residual (energy norm), torque residual, potential energy."""
    gram, factor = members[2], members[3]
    gap, stiffness, lever = lists[2], lists[3], lists[4]
    target[:size] = 0.0
    touching, moment, potential = 0, 0.0, -torque * lead
    for n in range(count):
        if gap[n] >= 0.0:
            continue
        touching += 1
        force = -stiffness[n] * gap[n]
        for j in range(size):
            target[j] += force * columns[n, j]
        moment += force * lever[n]
        potential -= 0.5 * force * gap[n]
    norm = 0.0
    for j in range(size):
        difference[j] = target[j]
    for i in range(size):
        row, amplitude = gram[i], coordinates[i]
        for j in range(size):
            difference[j] -= amplitude * row[j]
    for i in range(size):
        norm += (target[i] - difference[i]) * coordinates[i]
    _solve_transposed(factor, size, target)
    _solve_transposed(factor, size, difference)
    unbalanced = target_norm = 0.0
    for i in range(size):
        unbalanced += difference[i] ** 2
        target_norm += target[i] ** 2
    scale = max(target_norm, norm)
    force_residual = np.sqrt(unbalanced / scale) if scale > 0.0 else 0.0
    return touching, force_residual, abs(moment + torque) / torque, potential + 0.5 * norm


@compiled
def _add_point(n, sign, size, columns, free_gap, lists, matrix, rhs):
    """Add a point's tangent and force to the Newton matrix (upper half) and the right-hand side, or take them off."""
    row, k, lever = columns[n, :size], sign * lists[3][n], lists[4][n]
    for i in range(size):
        scaled, line, rest = k * row[i], matrix[i, i:size], row[i:]
        for j in range(size - i):
            line[j] += scaled * rest[j]
        matrix[i, size] += scaled * lever
        rhs[i] -= scaled * free_gap[n]
    matrix[size, size] += k * lever**2
    rhs[size] -= k * lever * free_gap[n]


@compiled
def _newton_step(count, size, members, columns, coordinates, lists, active, free_gap, torque, work):
    """New amplitudes and additional rotation: the linearised contact problem, active points and all; in `work[2]`.

    The geometry is the expensive part of a step, so which points are active is settled on the linearised gaps; points
    that stand off a little are in the lists for that.
    """
    gram, gap, lever = members[2], lists[2], lists[4]
    solution, rhs = work[2], work[4]
    matrix, factor = work[5 : 6 + size], work[6 + size :]
    for i in range(size):
        for j in range(i, size):
            matrix[i, j] = gram[i, j]
        matrix[i, size] = rhs[i] = 0.0
    matrix[size, size], rhs[size] = 0.0, torque
    for n in range(count):
        active[n] = gap[n] < 0.0
        free_gap[n] = gap[n]
        for j in range(size):
            free_gap[n] -= columns[n, j] * coordinates[j]
        if active[n]:
            _add_point(n, 1.0, size, columns, free_gap, lists, matrix, rhs)
    for _ in range(8):
        _cholesky(matrix, 0, size + 1, factor)
        for i in range(size + 1):
            solution[i] = rhs[i]
        _solve_transposed(factor, size + 1, solution)
        _solve_upper(factor, size + 1, solution)
        changed, left = False, False
        for n in range(count):
            predicted = free_gap[n] + lever[n] * solution[size]
            for j in range(size):
                predicted += columns[n, j] * solution[j]
            left = left or predicted < 0.0
            if active[n] != (predicted < 0.0):
                changed, active[n] = True, predicted < 0.0
                _add_point(n, 1.0 if active[n] else -1.0, size, columns, free_gap, lists, matrix, rhs)
        if not changed or not left:
            return


@compiled
def _search_state(state, position, problem, members, coordinates, lead):
    """Deform, search, project; return (count, touching, smallest, border, force and torque residual, potential)."""
    undeformed, nodes, columns, work, feet, points, lists = state
    phi, pairs, indices, windows, first_row, centre, clear, size, gears = position
    geometry, scheme, torque = problem
    _deform(undeformed, position, members, coordinates, nodes)
    count, smallest, border = search_all(
        phi, lead, nodes, pairs, indices, windows, first_row, centre, geometry, gears, scheme, clear, 0.4 * clear,
        feet[0], feet[1], points[0], points[1], lists,
    )  # fmt: skip
    _project_points(count, size, members, points[1], lists, columns)
    touching, force_residual, torque_residual, potential = _residuals(
        count, size, members, columns, coordinates, lists, torque, lead, work[0], work[1]
    )
    return count, touching, smallest, border, force_residual, torque_residual, potential


@allocating
def _last_step(count, position, members, state, coordinates, torque):
    """Take a step without evaluating the geometry again: `coordinates` and the gaps are updated, the lead returned.

    A step costs a fifth of an evaluation and gains a factor of about 40 close to the solution.
    """
    columns, work, points, lists, size = state[2], state[3], state[5], state[6], position[7]
    solution, gap, free_gap, lever = work[2], lists[2], lists[7], lists[4]
    _newton_step(count, size, members, columns, coordinates, lists, points[2], free_gap, torque, work)
    for n in range(count):
        gap[n] = free_gap[n] + lever[n] * solution[size]
        for j in range(size):
            gap[n] += columns[n, j] * solution[j]
    coordinates[:size] = solution[:size]
    return solution[size]


@allocating
def _solve_state(state, position, problem, members, approach, coordinates, lead, max_steps, tolerance):
    """Damped Newton; `coordinates` is updated. Return (lead, steps, converged, points listed, border touched).

    The residuals that are held against the tolerance are evaluated; one more step is taken on top of that state.
    """
    columns, work, points, lists, size = state[2], state[3], state[5], state[6], position[7]
    base_radius, torque = position[8][0][3][0], problem[2]
    solution, trial = work[2], work[3]
    count, touching, smallest, border, force, moment, potential = _search_state(
        state, position, problem, members, coordinates, lead
    )
    for step in range(max_steps + 1):
        if max(force, moment) <= tolerance:
            lead += _last_step(count, position, members, state, coordinates, torque)
            return lead, step, True, count, border
        if touching == 0:
            if not np.isfinite(smallest):
                return lead, step, False, count, border
            lead += (smallest + approach) / base_radius
            count, touching, smallest, border, force, moment, potential = _search_state(
                state, position, problem, members, coordinates, lead
            )
            continue
        _newton_step(count, size, members, columns, coordinates, lists, points[2], lists[7], torque, work)
        fraction, worst, energy, rotation = 1.0, max(force, moment), potential, solution[size]
        for _ in range(12):
            for j in range(size):
                trial[j] = coordinates[j] + fraction * (solution[j] - coordinates[j])
            count, touching, smallest, border, force, moment, potential = _search_state(
                state, position, problem, members, trial, lead + fraction * rotation
            )
            # A step that loses contact altogether is no progress, however low its potential.
            if touching > 0 and (max(force, moment) < worst or potential < energy):
                break
            fraction *= 0.5
        lead += fraction * rotation
        coordinates[:size] = trial[:size]
    return lead, max_steps, False, count, border


@compiled
def _load_windows(pairs, windows, first_row, gears, undeformed):
    for p in range(pairs):
        for gear in range(2):
            nodes, offset = gears[gear][0], windows[p, gear, 0]
            low = first_row[p, gear] - windows[p, gear, 2]
            for i in range(windows[p, gear, 1]):
                for k in range(nodes.shape[1]):
                    for d in range(3):
                        undeformed[offset + i * nodes.shape[1] + k, d] = nodes[low + i, k, d]


@compiled
def _line_amplitude(start, line, order, before, amplitude):
    """Amplitude of the shape number `order` of a line; 0 beyond the flank and where the line has no such shape."""
    if line < 0 or line >= len(start) - 1 or start[line] + order >= start[line + 1]:
        return 0.0
    return amplitude[before + start[line] + order]


@allocating
def _warm_start(family, size, kept, indices, centre, amplitude, base, centre_before, coordinates):
    """Amplitudes of the neighbouring position, carried along with the contact where they belong to lines."""
    by_line, lines, _, _ = family
    slots, weights = amplitude.shape[1], np.empty(4)
    for j in range(size):
        p, slot = kept[j] // slots, kept[j] % slots
        pair = indices[p] - base
        if pair < 0 or pair >= amplitude.shape[0]:
            coordinates[j] = 0.0
        elif by_line:
            gear = 0 if slot < lines[0][1].shape[1] else 1
            start, before = lines[gear][0], 0 if gear == 0 else lines[0][1].shape[1]
            line = np.searchsorted(start, slot - before, side="right") - 1
            order = slot - before - start[line]
            source = line - (centre[p, gear] - centre_before[pair, gear])
            below = int(np.floor(source))
            _cubic_weights(source - below, weights)
            coordinates[j] = 0.0
            for a in range(4):
                coordinates[j] += weights[a] * _line_amplitude(start, below - 1 + a, order, before, amplitude[pair])
        else:
            coordinates[j] = amplitude[pair, slot]


@compiled
def gather_members(phi, pairs, indices, windows, first_row, geometry, gears, family, members):
    """Collect the shapes in reach, of whichever family; return the number of members."""
    if family[0]:
        return gather_lines(pairs, indices, windows, first_row, gears, family[1], family[3], members)
    return interpolate_positions(phi, pairs, indices, windows, first_row, geometry, gears, family[2], members)


@allocating
def place_position(phi, depth, reachable, geometry, gears, scheme, family, clearance):
    """Set up all that one position needs, for any torque.

    Parameters
    ----------
    phi, depth : float
        Pinion angle (rad), and approach for which windows are cut (mm).
    reachable : int
        Tooth pairs that can be in reach at most.
    geometry, gears, scheme, family
        See above.
    clearance : float
        Share of the depth that counts as clear.

    Returns
    -------
    state : tuple
        Work space of a solution: undeformed and deformed nodes, derivatives of the gaps, vectors and matrix, feet,
        marks of the points, lists of `search_pair` with the gaps free of elastic deformation.
    position : tuple
        (phi, pairs, indices, windows, first_row, centre, clear gap, members' number, gears).
    members : tuple
        See above.
    """
    indices, windows = np.zeros(reachable, dtype=np.int64), np.zeros((reachable, 2, 6), dtype=np.int64)
    first_row, centre = np.zeros((reachable, 2), dtype=np.int64), np.zeros((reachable, 2))
    pairs, nodes = place_windows(phi, depth, geometry, gears, indices, windows, first_row, centre)
    most = most_members(family, pairs, windows)
    members = (
        np.empty(most, dtype=np.int64), np.zeros((2, 2), dtype=np.int64), np.empty((most, most)),
        np.empty((most, most)), np.empty((most, 3 * nodes)),
    )  # fmt: skip
    size = gather_members(phi, pairs, indices, windows, first_row, geometry, gears, family, members)
    undeformed = np.zeros((nodes, 3))
    if scheme[9] == 0:
        _load_windows(pairs, windows, first_row, gears, undeformed)
    room, profile_points, width_points = point_room(pairs, windows, gears, scheme)
    lists = (
        np.empty((room, 8), dtype=np.int64), np.empty((room, 8, 3)), np.empty(room), np.empty(room),
        np.empty(room), np.empty(room), np.empty((room, 4), dtype=np.int64), np.empty(room),
    )  # fmt: skip
    feet = (
        np.full((pairs, 2, profile_points, width_points, 2), -1),
        np.empty((pairs, 2, profile_points, width_points, 2)),
    )
    points = (np.empty(room, dtype=np.int64), np.empty(room, dtype=np.int64), np.empty(room, dtype=np.bool_))
    state = (
        undeformed, np.empty((nodes, 3)), np.empty((room, size)), np.empty((2 * size + 7, size + 1)), feet, points,
        lists,
    )  # fmt: skip
    position = (phi, pairs, indices, windows, first_row, centre, clearance * depth, size, gears)
    return state, position, members


@inlined
def _exchanged_work(blocks, ahead, force, change, to, start_to, low_to, high_to, by, start_by, low_by, high_by, work):
    """Sum of f_to^T C f'_by and f'_to^T C f_by for the forces f and f' on two windows.

    `to` and `by` are the first unknowns of the windows in `force` and `change`, `start_to` and `start_by` their first
    unknowns on the flank; the unknowns from low to high carry load. `work` is room for two rows.
    """
    width = high_by - low_by
    if width <= 0 or high_to <= low_to:
        return 0.0
    # Rows of known beginning and end: the loops over them then run in vector registers, at twice the speed.
    first, second = work[0, :width], work[1, :width]
    first[:], second[:] = 0.0, 0.0
    for i in range(low_to, high_to):
        value, slope = force[to + i], change[to + i]
        line = blocks[ahead, start_to + i, start_by + low_by : start_by + high_by]
        for j in range(width):
            first[j] += value * line[j]
            second[j] += slope * line[j]
    total = 0.0
    for j in range(width):
        total += first[j] * change[by + low_by + j] + second[j] * force[by + low_by + j]
    return total


@allocating
def discarded_energy_slope(count, position, state, coordinates, compliance, room):
    """Derivative by the torque of the energy of the contact forces that the members do not carry, rad.

    With r the nodal forces that are left over, it is r^T C dr/dT (`pmor.reduction.error_estimate`). How all changes
    with the torque follows from the last Newton matrix, and what the members carry from that step's solution, which
    balances the forces on them.

    Parameters
    ----------
    count, position, state, coordinates
        A solved state.
    compliance : two ndarrays, shape (reach + 1, n, n)
        Compliance between the loaded flanks of teeth 0, 1, ... apart, of pinion and wheel, mm/N; two or three unknowns
        for each flank node.
    room : ndarray, shape (4, 3 nodes)
    """
    pairs, indices, windows, first_row, size, gears = (
        position[1], position[2], position[3], position[4], position[7], position[8]
    )  # fmt: skip
    columns, vectors, points, lists = state[2], state[3], state[5], state[6]
    index, weight, gap, stiffness, lever = lists[:5]
    response, factor = vectors[2], vectors[6 + size :]
    response[:size], response[size] = 0.0, 1.0
    _solve_transposed(factor, size + 1, response)
    _solve_upper(factor, size + 1, response)
    across = gears[0][0].shape[1]
    parts = compliance[0].shape[1] // (gears[0][0].shape[0] * across)
    force, change, work = room[0], room[1], room[2:]
    force[:], change[:] = 0.0, 0.0
    loaded = np.zeros((pairs, 2, 2), dtype=np.int64)
    loaded[:, :, 0] = room.shape[1]
    total = 0.0
    for n in range(count):
        if gap[n] >= 0.0:
            continue
        moved, opening, row = 0.0, lever[n] * response[size], columns[n]
        for j in range(size):
            moved += row[j] * coordinates[j]
            opening += row[j] * response[j]
        load, slope = -stiffness[n] * gap[n], -stiffness[n] * opening
        total -= moved * slope
        p = points[0][n]
        for side in range(2):
            gear = points[1][n] ^ side
            for a in range(4 * side, 4 * side + 4):
                first = parts * index[n, a]
                for d in range(parts):
                    force[first + d] += load * weight[n, a, d]
                    change[first + d] += slope * weight[n, a, d]
            # The first and the last of the four nodes are the first and the last in the window too.
            start = windows[p, gear, 0]
            loaded[p, gear, 0] = min(loaded[p, gear, 0], parts * (index[n, 4 * side] - start))
            loaded[p, gear, 1] = max(loaded[p, gear, 1], parts * (index[n, 4 * side + 3] - start + 1))
    for gear in range(2):
        for p in range(pairs):
            for q in range(p + 1):
                # Of the wheel, whose teeth count against the pairs, it is the transpose.
                to, by = (p, q) if gear == 0 else (q, p)
                both = _exchanged_work(
                    compliance[gear], indices[p] - indices[q], force, change,
                    parts * windows[to, gear, 0], parts * across * (first_row[to, gear] - windows[to, gear, 2]),
                    loaded[to, gear, 0], loaded[to, gear, 1],
                    parts * windows[by, gear, 0], parts * across * (first_row[by, gear] - windows[by, gear, 2]),
                    loaded[by, gear, 0], loaded[by, gear, 1], work,
                )  # fmt: skip
                total += 0.5 * both if p == q else both
    return total


@compiled
def solve_cold(state, position, problem, members, approach, coordinates, max_steps, tolerance):
    """Solve from the undeformed pair at the expected approach; see `_solve_state`."""
    coordinates[:] = 0.0
    lead = approach / position[8][0][3][0]
    return _solve_state(state, position, problem, members, approach, coordinates, lead, max_steps, tolerance)


@allocating
def repeat_phase(phase, repeats, state, position, problem, members, family, coordinates, lead):
    """Repeat one phase of a solution, for benchmarks; returns the points listed.

    Phases: 0 shapes in reach, 1 deformed surfaces, 2 surfaces and search, 3 deformation and derivatives of the gaps,
    4 residuals, 5 Newton step.
    """
    undeformed, nodes, columns, work, feet, points, lists = state
    phi, pairs, indices, windows, first_row, centre, clear, size, gears = position
    geometry, scheme, torque = problem
    count = _search_state(state, position, problem, members, coordinates, lead)[0]
    for _ in range(repeats):
        if phase == 0:
            gather_members(phi, pairs, indices, windows, first_row, geometry, gears, family, members)
        elif phase == 1:
            for p in range(pairs):
                for gear in range(2):
                    across = gears[gear][0].shape[1]
                    grid = _window_nodes(nodes, windows[p, gear], across)
                    rows, columns_ = np.empty((*grid.shape[:2], 2, 3)), np.empty((*grid.shape[:2], 2, 3))
                    prepare_surface(
                        grid, windows[p, gear, 4] == 1, windows[p, gear, 5] == 1, scheme[2], scheme[4], scheme[5],
                        rows, columns_,
                    )  # fmt: skip
        elif phase == 2:
            search_all(
                phi, lead, nodes, pairs, indices, windows, first_row, centre, geometry, gears, scheme, clear,
                0.4 * clear, feet[0], feet[1], points[0], points[1], lists,
            )  # fmt: skip
        elif phase == 3:
            _deform(undeformed, position, members, coordinates, nodes)
            _project_points(count, size, members, points[1], lists, columns)
        elif phase == 4:
            _residuals(count, size, members, columns, coordinates, lists, torque, lead, work[0], work[1])
        else:
            _newton_step(count, size, members, columns, coordinates, lists, points[2], lists[7], torque, work)
    return count


@allocating
def sweep_reduced(
    phi, torques, approach_per_torque, geometry, gears, scheme, family, compliance, margin, surface_error, clearance,
    max_steps, tolerance, lead_out, steps_out, converged_out, pair_out, pair_torque_out, slope_out,
):  # fmt: skip
    """Reduced equilibria over angles and torques, each started from its neighbour.

    Parameters
    ----------
    phi, torques : ndarray
        Pinion angles (rad) and torques (N mm).
    approach_per_torque : float
        Expected approach of the flanks per torque, mm / (N mm).
    geometry, gears, scheme, family
        See above.
    compliance : two ndarrays
        See `discarded_energy_slope`; of length 0 when that is not asked for.
    margin, surface_error, clearance : float
        Windows are cut for the depth margin x approach at the largest torque + surface error (mm); share of the depth
        that counts as clear.
    max_steps, tolerance
        Of Newton.
    lead_out, steps_out, converged_out : ndarray, shape (torques, angles)
    pair_out : ndarray of int, shape (angles, P)
        Tooth pairs in reach.
    pair_torque_out : ndarray, shape (torques, angles, P)
        Torque on the pinion that each of them carries, N mm; 0 beyond their number.
    slope_out : ndarray, shape (torques, angles)
        Of `discarded_energy_slope`, rad; left alone where there is none.
    """
    reachable, slots = pair_out.shape[1], member_slots(family)
    amplitudes, known = np.zeros((len(torques), reachable, slots)), np.zeros(len(torques), dtype=np.bool_)
    leads, base, centre_before = np.zeros(len(torques)), 0, np.zeros((reachable, 2))
    for i in range(len(phi)):
        depth = margin * approach_per_torque * torques.max() + surface_error
        while True:
            state, position, members = place_position(
                phi[i], depth, reachable, geometry, gears, scheme, family, clearance
            )
            pairs, indices, centre, size = position[1], position[2], position[5], position[7]
            points, lists, kept = state[5], state[6], members[0]
            any_border, coordinates = False, np.zeros(size)
            room = np.empty((4, members[4].shape[1] if len(compliance[0]) > 0 else 0))
            for t in range(len(torques)):
                torque, approach = torques[t], approach_per_torque * torques[t]
                problem, scaled = (geometry, scheme, torque), t > 0 and converged_out[t - 1, i]
                lead, steps, converged, count, border = 0.0, 0, False, 0, False
                for cold in range(0 if known[t] or scaled else 1, 2):
                    if cold == 1:
                        lead = approach / gears[0][3][0]
                        coordinates[:] = 0.0
                    elif known[t]:
                        lead = leads[t]
                        _warm_start(
                            family, size, kept, indices, centre, amplitudes[t], base, centre_before, coordinates
                        )
                    else:
                        lead = lead_out[t - 1, i] * torque / torques[t - 1]
                        coordinates *= torque / torques[t - 1]
                    lead, steps, converged, count, border = _solve_state(
                        state, position, problem, members, approach, coordinates, lead, max_steps, tolerance
                    )
                    if converged:
                        break
                any_border = any_border or border
                lead_out[t, i], steps_out[t, i], converged_out[t, i] = lead, steps, converged
                pair_torque_out[t, i] = 0.0
                if converged:
                    for n in range(count):
                        force = lists[3][n] * min(lists[2][n], 0.0)
                        pair_torque_out[t, i, points[0][n]] += force * lists[4][n]
                    amplitudes[t] = 0.0
                    for j in range(size):
                        amplitudes[t, kept[j] // slots, kept[j] % slots] = coordinates[j]
                    leads[t] = lead
                    if len(compliance[0]) > 0:
                        slope_out[t, i] = discarded_energy_slope(
                            count, position, state, coordinates, compliance, room
                        )
            for t in range(len(torques)):
                known[t] = converged_out[t, i]
            base = indices[0] if pairs > 0 else 0
            centre_before[:pairs] = centre[:pairs]
            if not any_border:
                break
            depth *= 3.0
        pair_out[i, :pairs] = indices[:pairs]
        pair_out[i, pairs:] = base - 1
