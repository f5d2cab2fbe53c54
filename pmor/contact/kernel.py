"""Compiled contact search of the nodal scheme: refine both flanks, project the slave's points, list what penetrates.

Everything here is one call tree in one file (numba's cache does not notice an edit in another one) and sees arrays and
scalars only. The scheme is the paper's: node to surface, penalty (Cosco et al. 2016, eq. 1-4), on flanks refined by
bicubic Ferguson patches through the *deformed* nodes (eq. 5-21) or by bilinear facets.

Layout of a *window*, the part of a flank that can touch: a grid of nodes ``(rows, columns)``, rows from the root
towards the tip, columns along +z. Beside the rows of its elements a window holds one neighbouring row on either side
where the flank has one, because node normals are averaged over the elements around a node.

Integer description of a window (`window`, shape (6,)): offset of its first node in the flat node list; number of
node rows; index of the first element row inside; number of element rows; 1 if the first element row is the first of
the flank; 1 if the last element row is the last of the flank.
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True)
def _unit_cross(a, b, out):
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]
    length = np.sqrt(out[0] ** 2 + out[1] ** 2 + out[2] ** 2)
    for d in range(3):
        out[d] /= length


@njit(cache=True)
def _parabola_tangent(p0, p1, p2, out):
    """Tangent at p0 of the parabola through three points, parametrised by chord length."""
    h1 = h2 = 0.0
    for d in range(3):
        h1 += (p1[d] - p0[d]) ** 2
        h2 += (p2[d] - p1[d]) ** 2
    h1, h2 = np.sqrt(h1), np.sqrt(h2)
    share = h1 / (h1 + h2)
    for d in range(3):
        out[d] = (p1[d] - p0[d]) / h1 * (1.0 + share) - (p2[d] - p1[d]) / h2 * share


@njit(cache=True)
def _edge_tangent(nodes, i, k, step_i, step_k, out):
    """Tangent along (step_i, step_k) at an edge node, pointing into the grid; a chord where three nodes are missing."""
    rows, columns = nodes.shape[0], nodes.shape[1]
    if 0 <= i + 2 * step_i < rows and 0 <= k + 2 * step_k < columns:
        _parabola_tangent(
            nodes[i, k], nodes[i + step_i, k + step_k], nodes[i + 2 * step_i, k + 2 * step_k], out
        )
    else:
        for d in range(3):
            out[d] = nodes[i + step_i, k + step_k, d] - nodes[i, k, d]


@njit(cache=True)
def _tangent(nodes, i, k, along_rows, out):
    """Tangent at a node along the rows or the columns: parabolic at the grid's edges, central inside."""
    count = nodes.shape[0] if along_rows else nodes.shape[1]
    index = i if along_rows else k
    di, dk = (1, 0) if along_rows else (0, 1)
    if index == 0:
        _edge_tangent(nodes, i, k, di, dk, out)
    elif index == count - 1:
        _edge_tangent(nodes, i, k, -di, -dk, out)
        for d in range(3):
            out[d] = -out[d]
    else:
        for d in range(3):
            out[d] = nodes[i + di, k + dk, d] - nodes[i - di, k - dk, d]


@njit(cache=True)
def node_normals(nodes, low_edge, high_edge, parabolic, out):
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
    out : ndarray, shape (rows, columns, 3)
    """
    rows, columns = nodes.shape[0], nodes.shape[1]
    a, b, normal = np.empty(3), np.empty(3), np.empty(3)
    for i in range(rows):
        for k in range(columns):
            on_edge = (i == 0 and low_edge) or (i == rows - 1 and high_edge) or k == 0 or k == columns - 1
            if parabolic and on_edge:
                _tangent(nodes, i, k, True, a)
                _tangent(nodes, i, k, False, b)
                _unit_cross(b, a, out[i, k])
                continue
            for d in range(3):
                out[i, k, d] = 0.0
            for ei in range(max(i - 1, 0), min(i + 1, rows - 1)):
                for ek in range(max(k - 1, 0), min(k + 1, columns - 1)):
                    for d in range(3):
                        a[d] = nodes[ei + 1, ek + 1, d] - nodes[ei, ek, d]
                        b[d] = nodes[ei, ek + 1, d] - nodes[ei + 1, ek, d]
                    _unit_cross(b, a, normal)
                    for d in range(3):
                        out[i, k, d] += normal[d]
            length = np.sqrt(out[i, k, 0] ** 2 + out[i, k, 1] ** 2 + out[i, k, 2] ** 2)
            for d in range(3):
                out[i, k, d] /= length


@njit(cache=True)
def edge_tangents(nodes, normals, along_rows, along_columns):
    """Tangents N x S x N of all element edges at both their ends (eq. 11 of the paper).

    A chord S without its part along the unit normal N. `along_rows[i, k, e]` belongs to the edge from node (i, k) to
    (i + 1, k), end e; `along_columns[i, k, e]` to the edge from (i, k) to (i, k + 1).
    """
    rows, columns = nodes.shape[0], nodes.shape[1]
    for i in range(rows):
        for k in range(columns):
            for end in range(2):
                if i < rows - 1:
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


@njit(cache=True)
def surface_point(nodes, along_rows, along_columns, smooth, i, k, s, t, point, tangent_s, tangent_t):
    """Point and tangents of the surface over element (i, k) at (s, t): one object gives all three.

    Smooth: the bicubic Ferguson patch with zero twist. Else: the bilinear facet. Parameters a little outside [0, 1]
    continue the surface.
    """
    for d in range(3):
        point[d] = tangent_s[d] = tangent_t[d] = 0.0
    if not smooth:
        for d in range(3):
            p00, p01, p10, p11 = nodes[i, k, d], nodes[i, k + 1, d], nodes[i + 1, k, d], nodes[i + 1, k + 1, d]
            tangent_s[d] = (1.0 - t) * (p10 - p00) + t * (p11 - p01)
            tangent_t[d] = (1.0 - s) * (p01 - p00) + s * (p11 - p10)
            point[d] = (1.0 - t) * p00 + t * p01 + s * tangent_s[d]
        return
    for di in range(2):
        if di == 0:
            hs, dhs = (1.0 + 2.0 * s) * (1.0 - s) ** 2, 6.0 * s * (s - 1.0)
            gs, dgs = s * (1.0 - s) ** 2, (1.0 - s) * (1.0 - 3.0 * s)
        else:
            hs, dhs = s * s * (3.0 - 2.0 * s), 6.0 * s * (1.0 - s)
            gs, dgs = s * s * (s - 1.0), s * (3.0 * s - 2.0)
        for dk in range(2):
            if dk == 0:
                ht, dht = (1.0 + 2.0 * t) * (1.0 - t) ** 2, 6.0 * t * (t - 1.0)
                gt, dgt = t * (1.0 - t) ** 2, (1.0 - t) * (1.0 - 3.0 * t)
            else:
                ht, dht = t * t * (3.0 - 2.0 * t), 6.0 * t * (1.0 - t)
                gt, dgt = t * t * (t - 1.0), t * (3.0 * t - 2.0)
            for d in range(3):
                node = nodes[i + di, k + dk, d]
                row, column = along_rows[i, k + dk, di, d], along_columns[i + di, k, dk, d]
                point[d] += hs * ht * node + gs * ht * row + hs * gt * column
                tangent_s[d] += dhs * ht * node + dgs * ht * row + dhs * gt * column
                tangent_t[d] += hs * dht * node + gs * dht * row + hs * dgt * column


@njit(cache=True)
def prepare_surface(nodes, low_edge, high_edge, smooth, parabolic, along_rows, along_columns):
    """Edge tangents of a window of deformed nodes, when its surface is smooth; arguments as in `refine`."""
    if smooth:
        normals = np.empty_like(nodes)
        node_normals(nodes, low_edge, high_edge, parabolic, normals)
        edge_tangents(nodes, normals, along_rows, along_columns)


@njit(cache=True)
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
    elements_across = nodes.shape[1] - 1
    tangent_s, tangent_t = np.empty(3), np.empty(3)
    for row in range(count * lodm_profile + 1):
        i = min(row // lodm_profile, count - 1)
        s = (row - i * lodm_profile) / lodm_profile
        for column in range(elements_across * lodm_width + 1):
            k = min(column // lodm_width, elements_across - 1)
            t = (column - k * lodm_width) / lodm_width
            surface_point(nodes, along_rows, along_columns, smooth, first + i, k, s, t, out[row, column],
                          tangent_s, tangent_t)  # fmt: skip


@njit(cache=True)
def _foot_on_patch(nodes, along_rows, along_columns, smooth, i, k, x, guess, tangent_s, tangent_t, foot):
    """Foot of the perpendicular on one (continued) patch by Gauss-Newton; updates `guess` = (s, t).

    The neglected curvature term is the gap over the radius of curvature: each step gains that factor.
    """
    for _ in range(20):
        surface_point(nodes, along_rows, along_columns, smooth, i, k, guess[0], guess[1], foot, tangent_s, tangent_t)
        ss = tt = st = rs = rt = 0.0
        for d in range(3):
            residual = x[d] - foot[d]
            rs += residual * tangent_s[d]
            rt += residual * tangent_t[d]
            ss += tangent_s[d] ** 2
            tt += tangent_t[d] ** 2
            st += tangent_s[d] * tangent_t[d]
        det = ss * tt - st * st
        ds, dt = (rs * tt - rt * st) / det, (rt * ss - rs * st) / det
        if abs(ds) + abs(dt) < 1e-12:
            return
        # A cubic continued far outside its patch turns back: stay near, the caller walks on to the neighbour.
        s, t = min(max(guess[0] + ds, -0.75), 1.75), min(max(guess[1] + dt, -0.75), 1.75)
        if s == guess[0] and t == guess[1]:
            return
        guess[0], guess[1] = s, t


@njit(cache=True)
def project(nodes, along_rows, along_columns, smooth, first, count, x, element, guess, tangent_s, tangent_t, foot):
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
    """
    last_i, last_k = first + count - 1, nodes.shape[1] - 2
    before_i = before_k = -1
    for _ in range(2 * (count + last_k) + 10):
        _foot_on_patch(nodes, along_rows, along_columns, smooth, element[0], element[1], x, guess,
                       tangent_s, tangent_t, foot)  # fmt: skip
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


@njit(cache=True)
def _inside_share(overshoot, extent_out, extent_in):
    """Share of a slave point's interval that lies on the master, when the point is `overshoot` beyond its edge."""
    total = extent_out + extent_in
    return min(max((extent_in - overshoot) / total, 0.0), 1.0)


@njit(cache=True)
def _edge_overshoot(nodes, edge_row, inner_row, k, t, foot):
    """Distance of a foot beyond an edge row of the master (negative inside), along the outward chord there."""
    overshoot = length = 0.0
    for d in range(3):
        at_edge = (1.0 - t) * nodes[edge_row, k, d] + t * nodes[edge_row, k + 1, d]
        outward = at_edge - ((1.0 - t) * nodes[inner_row, k, d] + t * nodes[inner_row, k + 1, d])
        overshoot += (foot[d] - at_edge) * outward
        length += outward**2
    return overshoot / np.sqrt(length)


@njit(cache=True)
def _share_on_master(master, nodes, first, count, element, guess, width, extents, foot):
    """Share of a slave point's area that faces the master's patches; 0 outside the window or beyond its edges.

    Flanks face each other: towards the slave's root is towards the master's tip.
    """
    share = 1.0
    beyond_tip = _edge_overshoot(nodes, first + count, first + count - 1, element[1], guess[1], foot)
    if master[5] == 1:
        share *= _inside_share(beyond_tip, extents[0], extents[1])
    elif beyond_tip > 0.0:
        return 0.0
    beyond_root = _edge_overshoot(nodes, first, first + 1, element[1], guess[1], foot)
    if master[4] == 1:
        share *= _inside_share(beyond_root, extents[1], extents[0])
    elif beyond_root > 0.0:
        return 0.0
    across = element[1] + guess[1]
    share *= _inside_share((across - (nodes.shape[1] - 1)) * width, extents[3], extents[2])
    return share * _inside_share(-across * width, extents[2], extents[3])


@njit(cache=True)
def search_pair(
    nodes, slave, slave_columns, master, master_columns, extents, lodm_profile, lodm_width, smooth, direct, parabolic,
    rotation, shift, slave_is_pinion, penalty, count,
    index, weight, gap, stiffness, lever, mate_lever, place,
):  # fmt: skip
    """List the penetrating slave points of one tooth pair.

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
    lodm_profile, lodm_width, smooth, parabolic
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
    index, weight, gap, stiffness, lever, mate_lever, place : ndarray
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
        An active point lies in an outermost element row that is not the edge of its flank: the window is too small.
    """
    slave_nodes = nodes[slave[0] : slave[0] + slave[1] * slave_columns].reshape(slave[1], slave_columns, 3)
    surface = nodes[master[0] : master[0] + master[1] * master_columns].reshape(master[1], master_columns, 3)
    slave_rows, slave_across = np.empty((slave[1], slave_columns, 2, 3)), np.empty((slave[1], slave_columns, 2, 3))
    along_rows, along_columns = np.empty((master[1], master_columns, 2, 3)), np.empty((master[1], master_columns, 2, 3))
    points = np.empty((slave[3] * lodm_profile + 1, (slave_columns - 1) * lodm_width + 1, 3))
    prepare_surface(slave_nodes, slave[4] == 1, slave[5] == 1, smooth, parabolic, slave_rows, slave_across)
    refine(slave_nodes, slave_rows, slave_across, smooth, slave[2], slave[3], lodm_profile, lodm_width, points)
    prepare_surface(surface, master[4] == 1, master[5] == 1, smooth, parabolic, along_rows, along_columns)
    first, patches, detail_profile, detail_width = master[2], master[3], 1, 1
    if not direct:
        refined = np.empty((master[3] * lodm_profile + 1, (master_columns - 1) * lodm_width + 1, 3))
        refine(surface, along_rows, along_columns, smooth, master[2], master[3], lodm_profile, lodm_width, refined)
        surface, first, patches = refined, 0, master[3] * lodm_profile
        detail_profile, detail_width = lodm_profile, lodm_width
    on_patches = smooth and direct

    x, foot, normal, tangent_s, tangent_t = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    element, guess = np.zeros(2, dtype=np.int64), np.full(2, 0.5)
    row_element, row_guess = np.zeros(2, dtype=np.int64), np.full(2, 0.5)
    row_element[0] = first + patches - 1
    smallest, touches_border = np.inf, False
    for row in range(points.shape[0]):
        element[0], element[1], guess[0], guess[1] = row_element[0], row_element[1], row_guess[0], row_guess[1]
        for column in range(points.shape[1]):
            for d in range(3):
                x[d] = shift[d]
                for e in range(3):
                    x[d] += rotation[d, e] * points[row, column, e]
            project(surface, along_rows, along_columns, on_patches, first, patches, x, element, guess,
                    tangent_s, tangent_t, foot)  # fmt: skip
            if column == 0:
                row_element[0], row_element[1] = element[0], element[1]
                row_guess[0], row_guess[1] = guess[0], guess[1]
            width = np.sqrt(tangent_t[0] ** 2 + tangent_t[1] ** 2 + tangent_t[2] ** 2)
            extent = extents[row, column]
            share = _share_on_master(master, surface, first, patches, element, guess, width, extent, foot)
            if share == 0.0:
                continue
            _unit_cross(tangent_t, tangent_s, normal)
            g = 0.0
            for d in range(3):
                g += normal[d] * (x[d] - foot[d])
            smallest = min(smallest, g)
            if g >= 0.0:
                continue
            gap[count] = g
            stiffness[count] = penalty * share * (extent[0] + extent[1]) * (extent[2] + extent[3])
            # Each point turns about its own gear's axis.
            slave_arm = (x[0] - shift[0]) * normal[1] - (x[1] - shift[1]) * normal[0]
            master_arm = foot[0] * normal[1] - foot[1] * normal[0]
            lever[count] = slave_arm if slave_is_pinion else -master_arm
            mate_lever[count] = master_arm if slave_is_pinion else -slave_arm
            ei, ek = min(row // lodm_profile, slave[3] - 1), min(column // lodm_width, slave_columns - 2)
            _bilinear(slave, slave_columns, ei, ek, row / lodm_profile - ei, column / lodm_width - ek,
                      index[count, :4], weight[count, :4, 0])  # fmt: skip
            mi, mk = (element[0] - first) // detail_profile, element[1] // detail_width
            s, t = (element[0] - first + guess[0]) / detail_profile - mi, (element[1] + guess[1]) / detail_width - mk
            _bilinear(master, master_columns, mi, mk, s, t, index[count, 4:], weight[count, 4:, 0])
            for a in range(4):
                slave_weight, master_weight = weight[count, a, 0], weight[count, 4 + a, 0]
                for d in range(3):
                    turned = rotation[0, d] * normal[0] + rotation[1, d] * normal[1] + rotation[2, d] * normal[2]
                    weight[count, a, d] = slave_weight * turned
                    weight[count, 4 + a, d] = -master_weight * normal[d]
            place[count, 0], place[count, 1], place[count, 2], place[count, 3] = row, column, mi, mk
            if (ei == 0 and slave[4] == 0) or (ei == slave[3] - 1 and slave[5] == 0):
                touches_border = True
            if (mi == 0 and master[4] == 0) or (mi == master[3] - 1 and master[5] == 0):
                touches_border = True
            count += 1
    return count, smallest, touches_border


@njit(cache=True)
def _bilinear(window, columns, ei, ek, s, t, index, weight):
    """Nodes of an element and the bilinear weights of a point in it (the paper's force transfer)."""
    node = window[0] + (window[2] + ei) * columns + ek
    index[0], index[1], index[2], index[3] = node, node + 1, node + columns, node + columns + 1
    weight[0], weight[1] = (1.0 - s) * (1.0 - t), (1.0 - s) * t
    weight[2], weight[3] = s * (1.0 - t), s * t
