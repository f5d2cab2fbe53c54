"""The transverse sections in which line contact is evaluated, and how the columns of nodes carry them.

On spur gears that share their columns of nodes each column is a section, with its share of the width by the rule of the
elements. A tilted face carries most about a depth of the layer from its end: where the whole width is meshed, so that
load may lean to one end, an end element that is longer is split there, for sections and not for the mesh. The contact
lines of helical gears run across the columns, and their ends lie between them: there, and where the gears' columns
differ, sections are Gauss points over the common face, and displacements between columns follow a cubic with slopes of
the parabola through three neighbours, as along the profile.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.fe.element import tributary_widths
from pmor.line.kernels.types import Sections

# First columns that carry points at places z between columns, and the shares of each.
Carriers = Callable[[FloatArray, FloatArray], tuple[IntArray, FloatArray]]
# Sections per column of elements: of a helical pair with 8 columns one makes the peak-to-peak STE 9 % wrong, two 3 %.
GAUSS_POINTS = 2
# Columns that carry a section between them.
CUBIC = 4
# Depths of the layer that the last interval with Gauss points is long.
GAUSS_END = 0.7


def flank_sections(
    pinion_z: FloatArray, wheel_z: FloatArray, helical: bool, order: int = 1, depth: float = math.inf
) -> Sections:
    """Return the sections of a pair.

    Parameters
    ----------
    pinion_z, wheel_z : ndarray, shape (m + 1,)
        Columns of nodes, rising, mm.
    order : int
        Intervals between columns that an element spans.
    depth : float
        Of the layers below spur flanks that end freely at both ends of the width, mm.
    """
    if not helical and np.array_equal(pinion_z, wheel_z):
        z = _with_middles(_split_at_ends(pinion_z[::order], depth), order)
        width = tributary_widths(z, order)
        if len(z) == len(pinion_z):
            column = np.arange(len(z))
            return Sections(pinion_z, width, np.stack([column, column]), np.ones((2, len(z), 1)))
        carriers: Carriers = partial(_carriers_of_elements, order)
    else:
        low, high = max(pinion_z[0], wheel_z[0]), min(pinion_z[-1], wheel_z[-1])
        finest = min(float(np.diff(z).min()) for z in (pinion_z, wheel_z))
        edges = np.linspace(low, high, round((high - low) / finest + 0.499) + 1)
        edges = _split_at_ends(edges, GAUSS_END * depth)
        points, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
        half = 0.5 * np.diff(edges)
        z = (0.5 * (edges[1:] + edges[:-1])[:, None] + half[:, None] * points).ravel()
        width = np.outer(half, weights).ravel()
        carriers = _carriers if order == 1 else partial(_carriers_of_elements, order)
    carried = [carriers(columns, z) for columns in (pinion_z, wheel_z)]
    return Sections(z, width, np.stack([c[0] for c in carried]), np.stack([c[1] for c in carried]))


def _split_at_ends(edges: FloatArray, length: float) -> FloatArray:
    """Edges of elements, of which the first and the last are split, if longer, at that length from the ends."""
    first = float(edges[1] - edges[0])
    if first <= length:
        return edges
    end = min(length, first / (2.0 if len(edges) > 2 else 3.0))
    return np.concatenate([[edges[0], edges[0] + end], edges[1:-1], [edges[-1] - end, edges[-1]]])


def _with_middles(edges: FloatArray, order: int) -> FloatArray:
    """Columns of nodes of elements: their edges, and the middles of quadratic ones."""
    return edges if order == 1 else np.sort(np.concatenate([edges, 0.5 * (edges[1:] + edges[:-1])]))


def loaded_components(exact_flanks: bool, helical: bool) -> int:
    """Return how many components contact forces have: those on exact flanks of spur gears have none along the axis."""
    return 2 if exact_flanks and not helical else 3


def _carriers(columns: FloatArray, z: FloatArray) -> tuple[np.ndarray, FloatArray]:
    """First column and weights, (S, `CUBIC`), of the columns that carry points at z; two columns are taken linearly."""
    last = len(columns) - 1
    interval = np.clip(np.searchsorted(columns, z, side="right") - 1, 0, last - 1)
    first = np.clip(interval - 1, 0, max(last - CUBIC + 1, 0))
    shares = np.zeros((len(z), CUBIC))
    for n, (i, base) in enumerate(zip(interval, first, strict=True)):
        h = columns[i + 1] - columns[i]
        s = (z[n] - columns[i]) / h
        row = np.zeros(last + 1)
        if last < 2:
            row[i], row[i + 1] = 1.0 - s, s
        else:
            row[i], row[i + 1] = (1.0 + 2.0 * s) * (1.0 - s) ** 2, s * s * (3.0 - 2.0 * s)
            row += h * s * (1.0 - s) ** 2 * _slope(columns, i) + h * s * s * (s - 1.0) * _slope(columns, i + 1)
        used = row[base : base + CUBIC]
        shares[n, : len(used)] = used
    return first, shares


def _carriers_of_elements(order: int, columns: FloatArray, z: FloatArray) -> tuple[np.ndarray, FloatArray]:
    """First column and weights, (S, order + 1), of the columns that carry points at z: those of the elements."""
    first = order * np.clip(np.searchsorted(columns[::order], z, side="right") - 1, 0, (len(columns) - 1) // order - 1)
    s = (z - columns[first]) / (columns[first + order] - columns[first])
    lines, parabolas = (1.0 - s, s), ((1.0 - s) * (1.0 - 2.0 * s), 4.0 * s * (1.0 - s), s * (2.0 * s - 1.0))
    return first, np.stack(lines if order == 1 else parabolas, axis=-1)


def _slope(columns: FloatArray, i: int) -> FloatArray:
    """Weights of all columns for the slope at column i, of the parabola through it and its neighbours."""
    centre = min(max(i, 1), len(columns) - 2)
    before, after = columns[centre] - columns[centre - 1], columns[centre + 1] - columns[centre]
    t = columns[i] - columns[centre]
    weights = np.zeros(len(columns))
    weights[centre - 1] = (2.0 * t - after) / (before * (before + after))
    weights[centre] = -(2.0 * t + before - after) / (before * after)
    weights[centre + 1] = (2.0 * t + before) / (after * (before + after))
    return weights
