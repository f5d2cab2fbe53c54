"""Force laws of a mesh by displacement, F(psi, x): named tuples, each with a kernel of its own.

Whatever is compiled for a law takes it as an argument and calls `mesh_force`; numba compiles it once per kind of law. A
law returns NaN where it knows nothing: no solver takes that for a force.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import types
from numba.extending import overload

from pmor.core.arrays import FloatArray, IntArray
from pmor.core.compiling import compiled

# Of a node of a table's tree: halved over the phase, over the displacement, or a cell with values.
PHASE, DISPLACEMENT, CELL = 0, 1, 2


class VaryingStiffness(NamedTuple):
    """A spring that cannot pull, its stiffness varying over the cycle: (1 + variation cos psi) stiffness max(x, 0)."""

    stiffness: float  # Mean
    variation: float  # Amplitude over the mean
    pulls: bool  # Whether the spring pulls too: then the oscillator is linear, Mathieu's


class ForceTable(NamedTuple):
    """A force law in cells over phase and displacement, as fine as each place needs them: the leaves of a tree.

    In a cell the force is a bicubic through 4 x 4 values, and continuous from cell to cell.
    """

    # Range of displacements: below it nothing touches, above it the table knows nothing
    low: float
    high: float
    # shape (C, columns, rows): Nodes to begin with: of the C mesh cycles after which the law repeats, columns over the
    # phase, rows over the displacement. Cycles that are alike share theirs.
    root: IntArray
    kind: IntArray  # shape (n,): Of each node: `PHASE`, `DISPLACEMENT` or `CELL`
    # shape (n,): First of the two halves of a node, which lie beside each other, or the number of its values
    next: IntArray
    values: FloatArray  # shape (m, 4, 4): Forces of cells at thirds of phase and displacement
    # Displacement from where the working flanks of the drawing touch to where their backs do; infinite for none
    backlash: float


@compiled
def _varying_stiffness(law, phase, x):
    if x <= 0.0 and not law.pulls:
        return 0.0, 0.0
    stiffness = law.stiffness * (1.0 + law.variation * np.cos(phase))
    return stiffness * x, stiffness


@compiled
def _cubics(t):
    """Cubics that are 1 at one of 0, 1/3, 2/3, 1 and 0 at the others."""
    b, c, d = 3.0 * t - 1.0, 3.0 * t - 2.0, t - 1.0
    return -0.5 * b * c * d, 4.5 * t * c * d, -4.5 * t * b * d, 0.5 * t * b * c


@compiled
def _cubic_slopes(t):
    b, c, d = 3.0 * t - 1.0, 3.0 * t - 2.0, t - 1.0
    return (
        -0.5 * (3.0 * (c + b) * d + b * c), 4.5 * (c * d + 3.0 * t * d + t * c), -4.5 * (b * d + 3.0 * t * d + t * b),
        0.5 * (b * c + 3.0 * t * (c + b)),
    )  # fmt: skip


@compiled
def _flank_force(law, phase, x):
    """Force of the flanks on one side, and its derivative by the displacement."""
    if x <= law.low:
        return 0.0, 0.0
    if not x <= law.high:
        return np.nan, np.nan
    cycles, columns, rows = law.root.shape
    place = phase / (2.0 * np.pi)
    cycle = np.floor(place)
    t, rate = columns * (place - cycle), rows / (law.high - law.low)
    u = rate * (x - law.low)
    column, row = min(int(t), columns - 1), min(int(u), rows - 1)
    t, u = t - column, u - row
    node = law.root[int(cycle) % cycles, column, row]
    while law.kind[node] != CELL:
        if law.kind[node] == PHASE:
            upper = t >= 0.5
            t = 2.0 * t - upper
        else:
            upper = u >= 0.5
            u = 2.0 * u - upper
            rate *= 2.0
        node = law.next[node] + upper
    values, over, along, slopes = law.values[law.next[node]], _cubics(t), _cubics(u), _cubic_slopes(u)
    force = slope = 0.0
    for a in range(4):
        line = values[a]
        force += over[a] * (line[0] * along[0] + line[1] * along[1] + line[2] * along[2] + line[3] * along[3])
        slope += over[a] * (line[0] * slopes[0] + line[1] * slopes[1] + line[2] * slopes[2] + line[3] * slopes[3])
    # In a cell across the first touch the cubics oscillate about zero; flanks do not pull.
    return (force, rate * slope) if force > 0.0 else (0.0, 0.0)


@compiled
def _tabulated(law, phase, x):
    """Working flanks, and their mirror images beyond the backlash.

    At phase 0 a tooth is centred on the line of centres: mirrored there, the back flanks are working flanks that run
    the other way, from the same place.
    """
    if x > -0.5 * law.backlash:
        return _flank_force(law, phase, x)
    force, slope = _flank_force(law, -phase, -x - law.backlash)
    return -force, slope


_KERNELS = {VaryingStiffness: _varying_stiffness, ForceTable: _tabulated}


def mesh_force(law, phase, x):
    """Return the force of a law and its derivative by the displacement; NaN where the law knows nothing."""
    return _KERNELS[type(law)](law, phase, x)


@overload(mesh_force)
def _compiled_mesh_force(law, phase, x):
    if isinstance(law, types.NamedTuple | types.NamedUniTuple) and law.instance_class in _KERNELS:
        kernel = _KERNELS[law.instance_class]
        return lambda law, phase, x: kernel(law, phase, x)
    return None


@compiled
def mesh_forces(law, phase, x, force, slope):
    """Fill the forces and their derivatives at phases and displacements."""
    for i in range(len(phase)):
        force[i], slope[i] = mesh_force(law, phase[i], x[i])
