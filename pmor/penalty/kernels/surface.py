"""Nodal scheme: bicubic Ferguson patches or bilinear facets through deformed nodes (Cosco et al. 2016, eq. 5-21)."""

from __future__ import annotations

import numpy as np

from pmor.core.compiling import allocating, compiled, inlined
from pmor.penalty.kernels.state import Surface


@inlined
def unit_cross(a, b):
    """Unit vector along a x b."""
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
def node_normals(nodes, at_root, at_tip, parabolic, mirrored, out):
    """Outward normals at the nodes of a window.

    Parameters
    ----------
    nodes : ndarray, shape (rows, columns, 3)
    at_root, at_tip : bool
        Whether the first and last row are edges of the flank (else they are rows of neighbouring elements, whose
        own normals are not needed).
    parabolic, mirrored : bool
        See `Scheme`.
    out : ndarray, shape (rows, columns, 3)
    """
    rows, columns = nodes.shape[0], nodes.shape[1]
    out[:] = 0.0
    for i in range(rows - 1):
        for k in range(columns - 1):
            normal = unit_cross(_chord(nodes[i + 1, k], nodes[i, k + 1]), _chord(nodes[i, k], nodes[i + 1, k + 1]))
            for di in range(2):
                for dk in range(2):
                    for d in range(3):
                        out[i + di, k + dk, d] += normal[d]
    for i in range(rows):
        for k in range(columns):
            in_mirror = mirrored and k == columns - 1
            on_edge = (i == 0 and at_root) or (i == rows - 1 and at_tip) or k == 0 or k == columns - 1
            if parabolic and on_edge and not (in_mirror and 0 < i < rows - 1):
                if in_mirror:
                    across = 0.0, 0.0, 1.0
                elif mirrored and k == 0 and columns == 2:  # the third node is the mirror image of the first
                    image = nodes[i, 0, 0], nodes[i, 0, 1], 2.0 * nodes[i, 1, 2] - nodes[i, 0, 2]
                    across = _parabola_tangent(nodes[i, 0], nodes[i, 1], image)
                else:
                    across = _tangent(nodes, i, k, 0, 1)
                out[i, k, 0], out[i, k, 1], out[i, k, 2] = unit_cross(across, _tangent(nodes, i, k, 1, 0))
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
                    _along_surface(nodes[i, k], nodes[i + 1, k], normals[i + end, k], along_rows[i, k, end])
                if k < columns - 1:
                    _along_surface(nodes[i, k], nodes[i, k + 1], normals[i, k + end], along_columns[i, k, end])


@inlined
def _along_surface(start, end, normal, out):
    """Fill `out` with a chord without its part along the normal."""
    along = 0.0
    for d in range(3):
        along += normal[d] * (end[d] - start[d])
    for d in range(3):
        out[d] = end[d] - start[d] - along * normal[d]


@inlined
def surface_point(surface, i, k, s, t, point, tangent_s, tangent_t):
    """Point and tangents of the surface over element (i, k) at (s, t): one object gives all three.

    Smooth: the bicubic Ferguson patch with zero twist. Else: the bilinear facet. Parameters a little outside [0, 1]
    continue the surface.
    """
    nodes, along_rows, along_columns = surface.nodes, surface.along_rows, surface.along_columns
    if not surface.smooth:
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
def prepare_surface(nodes, at_root, at_tip, smooth, parabolic, mirrored):
    """Return the surface over a window of deformed nodes; see `node_normals`.

    Tangents of edges that no element of the window needs are left open.
    """
    along_rows, along_columns = np.empty((*nodes.shape[:2], 2, 3)), np.empty((*nodes.shape[:2], 2, 3))
    if smooth:
        normals = np.empty_like(nodes)
        node_normals(nodes, at_root, at_tip, parabolic, mirrored, normals)
        low, high = 0 if at_root else 1, nodes.shape[0] - (1 if at_tip else 2)
        edge_tangents(nodes, normals, low, high, along_rows, along_columns)
    return Surface(nodes, along_rows, along_columns, smooth)


@inlined
def row_points(surface, i, s, lodm_width, out):
    """Points of a surface along the width at parameter s of element row i; the same points as `surface_point` gives.

    One direction of the patch is done once for the whole row, so that a row of slave points is cheap.
    """
    nodes, along_rows, along_columns, smooth = surface.nodes, surface.along_rows, surface.along_columns, surface.smooth
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
def refine(surface, first, count, lodm_profile, lodm_width, out):
    """Points of the refined surface over the element rows of a window.

    Parameters
    ----------
    surface : Surface
    first, count : int
        First element row inside the window, number of element rows.
    lodm_profile, lodm_width : int
        Subdivisions of an element along the profile and the width.
    out : ndarray, shape (count lodm_profile + 1, (columns - 1) lodm_width + 1, 3)
    """
    for row in range(count * lodm_profile + 1):
        i = min(row // lodm_profile, count - 1)
        s = (row - i * lodm_profile) / lodm_profile
        row_points(surface, first + i, s, lodm_width, out[row])
