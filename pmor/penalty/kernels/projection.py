"""Nodal scheme: the closest point on a grid of patches, and how much of a slave point's area faces the master."""

from __future__ import annotations

import numpy as np

from pmor.core.compiling import inlined
from pmor.penalty.kernels.surface import surface_point
from pmor.penalty.kernels.types import AT_ROOT, AT_TIP, TO_HIGH_Z, TO_LOW_Z, TO_ROOT, TO_TIP


@inlined
def _foot_on_patch(surface, x, foot, foot_step):
    """Foot of the perpendicular on one (continued) patch, `foot.element`, by Gauss-Newton; updates `foot.guess`.

    The neglected curvature term is the gap over the radius of curvature: each step gains that factor. It ends with the
    first step below `foot_step` elements, which changes the gap by its square times the element's sagitta; the foot
    and the tangents are those before that step, `foot.guess` has it in.
    """
    i, k = foot.element[0], foot.element[1]
    guess, point, tangent_s, tangent_t = foot.guess, foot.point, foot.tangent_s, foot.tangent_t
    for _ in range(20):
        surface_point(surface, i, k, guess[0], guess[1], point, tangent_s, tangent_t)
        sx, sy, sz = tangent_s[0], tangent_s[1], tangent_s[2]
        tx, ty, tz = tangent_t[0], tangent_t[1], tangent_t[2]
        rx, ry, rz = x[0] - point[0], x[1] - point[1], x[2] - point[2]
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
def project(surface, first, count, x, foot, foot_step):
    """Closest point on a grid of patches, walking from patch to patch.

    On the outer patches the parameters may leave [0, 1]: the surface is continued there and the caller decides. At a
    convex edge between two facets neither of which holds the foot, the foot is put on the edge.

    Parameters
    ----------
    surface : Surface
    first, count : int
        Element rows of the grid that may be used.
    x : ndarray, shape (3,)
    foot : Foot
        Its element and guess say where to start; filled.
    foot_step : float
        Of the last step to the foot, in elements.
    """
    element, guess = foot.element, foot.guess
    last_i, last_k = first + count - 1, surface.nodes.shape[1] - 2
    before_i = before_k = -1
    for _ in range(2 * (count + last_k) + 10):
        _foot_on_patch(surface, x, foot, foot_step)
        # The tolerance keeps a foot on a shared edge with the patch that was tried first: neighbouring facets have
        # slightly different normals, and flipping between them by round-off would stop Newton short.
        next_i = element[0] + (1 if guess[0] > 1.0 + 1e-5 else (-1 if guess[0] < -1e-5 else 0))
        next_k = element[1] + (1 if guess[1] > 1.0 + 1e-5 else (-1 if guess[1] < -1e-5 else 0))
        next_i, next_k = min(max(next_i, first), last_i), min(max(next_k, 0), last_k)
        if next_i == element[0] and next_k == element[1]:
            return
        if next_i == before_i and next_k == before_k:
            guess[0], guess[1] = min(max(guess[0], 0.0), 1.0), min(max(guess[1], 0.0), 1.0)
            surface_point(
                surface, element[0], element[1], guess[0], guess[1], foot.point, foot.tangent_s, foot.tangent_t
            )
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
def _edge_overshoot(nodes, edge_row, inner_row, k, t, point, in_length):
    """Distance of a foot beyond an edge row of the master (negative inside), along the outward chord there.

    Not `in_length`: times the length of that chord, which is enough for the sign.
    """
    overshoot = length = 0.0
    for d in range(3):
        at_edge = (1.0 - t) * nodes[edge_row, k, d] + t * nodes[edge_row, k + 1, d]
        outward = at_edge - ((1.0 - t) * nodes[inner_row, k, d] + t * nodes[inner_row, k + 1, d])
        overshoot += (point[d] - at_edge) * outward
        length += outward**2
    return overshoot / np.sqrt(length) if in_length else overshoot


@inlined
def _across(x, foot):
    """Width of a patch across the profile, and how far beyond its foot a point is there, where the foot was held."""
    s, t = foot.tangent_s, foot.tangent_t
    skew = (s[0] * t[0] + s[1] * t[1] + s[2] * t[2]) / (s[0] ** 2 + s[1] ** 2 + s[2] ** 2)
    width = beyond = 0.0
    for d in range(3):
        across = t[d] - skew * s[d]
        width += across**2
        beyond += across * (x[d] - foot.point[d])
    width = np.sqrt(width)
    return width, beyond / width


@inlined
def share_on_master(window, nodes, first, count, x, foot, extents):
    """Share of a slave point's area that faces the master; 0 beyond its edges, -1 on the master but off the window.

    Flanks face each other: towards the slave's root is towards the master's tip.

    Parameters
    ----------
    window : ndarray of int, shape (7,)
        Of the master.
    nodes : ndarray, shape (rows, columns, 3)
        Grid of the master's patches.
    first, count : int
        Its element rows that may be used.
    x : ndarray, shape (3,)
        The slave point.
    foot : Foot
    extents : ndarray, shape (4,)
        Of the slave point.
    """
    element, guess, share = foot.element, foot.guess, 1.0
    if element[0] == first + count - 1:
        at_edge = window[AT_TIP] == 1
        beyond = _edge_overshoot(nodes, first + count, first + count - 1, element[1], guess[1], foot.point, at_edge)
        if at_edge:
            share *= _inside_share(beyond, extents[TO_ROOT], extents[TO_TIP])
        elif beyond > 0.0:
            return -1.0
    if element[0] == first:
        at_edge = window[AT_ROOT] == 1
        beyond = _edge_overshoot(nodes, first, first + 1, element[1], guess[1], foot.point, at_edge)
        if at_edge:
            share *= _inside_share(beyond, extents[TO_TIP], extents[TO_ROOT])
        elif beyond > 0.0:
            return -1.0
    last = nodes.shape[1] - 2
    if element[1] == 0 or element[1] == last:
        width, beyond = _across(x, foot)
        low, high = extents[TO_LOW_Z], extents[TO_HIGH_Z]
        if element[1] == last:
            share *= _inside_share((guess[1] - 1.0) * width + beyond, high, low)
        if element[1] == 0:
            share *= _inside_share(-guess[1] * width - beyond, low, high)
    return share
