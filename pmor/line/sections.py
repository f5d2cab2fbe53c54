"""The transverse sections in which line contact is evaluated, and how the columns of nodes carry them.

On spur gears that share their columns of nodes each column is a section, with its share of the width by the trapezoidal
rule. The contact lines of helical gears run across the columns, and their ends lie between them: there, and where the
gears' columns differ, sections are Gauss points over the common face, and displacements between columns follow a cubic
with slopes of the parabola through three neighbours, as along the profile.
"""

from __future__ import annotations

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.fe.element import tributary_widths
from pmor.line.kernels.types import Sections

# Sections per column of elements: of a helical pair with 8 columns one makes the peak-to-peak STE 9 % wrong, two 3 %.
GAUSS_POINTS = 2
# Columns that carry a section between them.
CUBIC = 4


def flank_sections(pinion_z: FloatArray, wheel_z: FloatArray, helical: bool, order: int = 1) -> Sections:
    """Return the sections of a pair.

    Parameters
    ----------
    pinion_z, wheel_z : ndarray, shape (m + 1,)
        Columns of nodes, rising, mm.
    order : int
        Intervals between columns that an element spans.
    """
    if not helical and np.array_equal(pinion_z, wheel_z):
        column = np.arange(len(pinion_z))
        return Sections(
            pinion_z, tributary_widths(pinion_z, order), np.stack([column, column]), np.ones((2, len(pinion_z), 1))
        )
    low, high = max(pinion_z[0], wheel_z[0]), min(pinion_z[-1], wheel_z[-1])
    finest = min(float(np.diff(z).min()) for z in (pinion_z, wheel_z))
    edges = np.linspace(low, high, round((high - low) / finest + 0.499) + 1)
    points, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    half = 0.5 * np.diff(edges)
    z = (0.5 * (edges[1:] + edges[:-1])[:, None] + half[:, None] * points).ravel()
    carriers = _carriers if order == 1 else _carriers_of_parabolas
    carried = [carriers(columns, z) for columns in (pinion_z, wheel_z)]
    return Sections(z, np.outer(half, weights).ravel(), np.stack([c[0] for c in carried]),
                    np.stack([c[1] for c in carried]))  # fmt: skip


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


def _carriers_of_parabolas(columns: FloatArray, z: FloatArray) -> tuple[np.ndarray, FloatArray]:
    """First column and weights, (S, 3), of the columns that carry points at z on quadratic elements."""
    first = 2 * np.clip(np.searchsorted(columns[::2], z, side="right") - 1, 0, len(columns) // 2 - 1)
    s = (z - columns[first]) / (columns[first + 2] - columns[first])
    parabolas = (1.0 - s) * (1.0 - 2.0 * s), 4.0 * s * (1.0 - s), s * (2.0 * s - 1.0)
    return first, np.stack(parabolas, axis=-1)


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
