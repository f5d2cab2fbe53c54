"""The force law of a pair in a table that is as fine as it must be: a tree of cells over phase and displacement.

The force has kinks where a further tooth pair comes into contact, along curves that no regular grid follows: between
256 knots over the mesh cycle the force of a spur pair is 0.6 % off there, and that falls with the first power of their
number alone. Cells are therefore halved, over the phase or over the displacement, until a bicubic through 4 x 4 values
holds in each. What it leaves out is measured at the points between.

On the cases of this project 5e-5 of the largest force takes 50 to 500 kB, 700 to 6 000 cells.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pmor.arrays import FloatArray, IntArray
from pmor.errors import ConvergenceError, OutputError

#: forces at phases (0 to 1, a mesh cycle) and displacements, (p,), (x,) to (p, x), N
Forces = Callable[[FloatArray, FloatArray], FloatArray]

# Of the largest force: what cells may leave out at the points between their values. A quarter more was measured
# elsewhere.
TOLERANCE = 5e-5
# Cells to begin with, over phase and displacement.
COLUMNS, ROWS = 8, 4
# Beyond which a law is none that a table could hold.
MOST_CELLS = 100_000
# Of a node of the tree: halved over the phase, over the displacement, or a cell with values.
PHASE, DISPLACEMENT, CELL = 0, 1, 2

_PLACES = np.arange(7) / 6.0


def _cubics(t: FloatArray) -> FloatArray:
    """Cubics that are 1 at one of 0, 1/3, 2/3, 1 and 0 at the others, shape (..., 4)."""
    a, b, c, d = t, 3.0 * t - 1.0, 3.0 * t - 2.0, t - 1.0
    return np.stack([-0.5 * b * c * d, 4.5 * a * c * d, -4.5 * a * b * d, 0.5 * a * b * c], axis=-1)


@dataclass(frozen=True)
class ForceTable:
    """A force law over the phase, with period 1, and a range of displacements; above the touch, 0 below.

    Attributes
    ----------
    low, high : float
        Range of displacements, mm; below it nothing touches.
    kind : (n,) int
        Of each node: `PHASE`, `DISPLACEMENT` or `CELL`; the first ``COLUMNS * ROWS`` are the roots, phase by phase.
    next : (n,) int
        First of the two halves of a node, which lie beside each other, or the number of its values.
    values : (m, 4, 4) float32
        Forces of cells at thirds of phase and displacement, N.
    """

    low: float
    high: float
    kind: IntArray
    next: IntArray
    values: FloatArray

    @property
    def largest(self) -> float:
        """Largest force that it holds, N."""
        return float(self.values.max())

    def force(self, phase: FloatArray, displacement: FloatArray) -> FloatArray:
        """Return the force, N; NaN above the range of displacements.

        Parameters
        ----------
        phase : ndarray, shape (n,)
        displacement : ndarray, shape (n,)
            mm.
        """
        x = (np.asarray(displacement, dtype=float) - self.low) / (self.high - self.low)
        column, t = np.divmod(COLUMNS * (np.asarray(phase, dtype=float) % 1.0), 1.0)
        row = np.clip(np.floor(ROWS * x), 0, ROWS - 1)
        u = np.clip(ROWS * x - row, 0.0, 1.0)
        node = ((column.astype(np.int64) % COLUMNS) * ROWS + row.astype(np.int64)).ravel()
        while (halved := self.kind[node] != CELL).any():
            over_phase = self.kind[node] == PHASE
            doubled = 2.0 * np.where(over_phase, t, u)
            upper = (doubled >= 1.0) & halved
            rest = doubled - upper
            t, u = np.where(halved & over_phase, rest, t), np.where(halved & ~over_phase, rest, u)
            node = np.where(halved, self.next[node] + upper, node)
        values = self.values[self.next[node]].astype(float)
        force = np.einsum("na,nab,nb->n", _cubics(t), values, _cubics(u))
        return np.where(x < 0.0, 0.0, np.where(x <= 1.0, force, np.nan))


def tabulate(forces: Forces, low: float, high: float, tolerance: float = TOLERANCE) -> ForceTable:
    """Tabulate a force law.

    Parameters
    ----------
    forces : callable
    low, high : float
        Range of displacements, mm: nothing touches below the first at any phase.
    tolerance : float
        Of the largest force at `high`.

    Raises
    ------
    ConvergenceError
        Where the law gives no force.
    OutputError
        When the law needs too many cells.
    """
    largest = float(forces(np.arange(8 * COLUMNS) / (8 * COLUMNS), np.array([high])).max())
    kind, following, values = list[int](), list[int](), list[FloatArray]()
    # Of each node that waits to be looked at: its bounds over phase and displacement.
    waiting = [(i / COLUMNS, (i + 1) / COLUMNS, j / ROWS, (j + 1) / ROWS) for i in range(COLUMNS) for j in range(ROWS)]
    for start, end, lower, upper in waiting:
        x = low + (high - low) * (lower + (upper - lower) * _PLACES)
        force = forces(start + (end - start) * _PLACES, x)
        _refuse_holes(force, start, x)
        over_phase, over_displacement, both = _left_out(force / largest)
        if max(over_phase, over_displacement, both) <= tolerance:
            kind.append(CELL)
            following.append(len(values))
            values.append(force[::2, ::2].astype(np.float32))
            continue
        following.append(len(waiting))
        kind.append(PHASE if over_phase > over_displacement else DISPLACEMENT)
        if kind[-1] == PHASE:
            middle = 0.5 * (start + end)
            waiting += [(start, middle, lower, upper), (middle, end, lower, upper)]
        else:
            middle = 0.5 * (lower + upper)
            waiting += [(start, end, lower, middle), (start, end, middle, upper)]
        if len(waiting) > MOST_CELLS:
            raise OutputError(f"the force law needs more than {MOST_CELLS} cells of a table: lower the torque")
    return ForceTable(low, high, np.array(kind), np.array(following), np.array(values))


def _left_out(force: FloatArray) -> tuple[float, float, float]:
    """What a bicubic through every other value misses of the rest: between phases, displacements, and both."""
    weights = _cubics(_PLACES[1::2])
    known = force[::2, ::2]
    phase, displacement = weights @ known, known @ weights.T
    missed = phase - force[1::2, ::2], displacement - force[::2, 1::2], weights @ displacement - force[1::2, 1::2]
    return tuple(float(np.abs(part).max()) for part in missed)  # type: ignore[return-value]


def _refuse_holes(force: FloatArray, phase: float, x: FloatArray) -> None:
    if not np.isfinite(force).all():
        raise ConvergenceError(
            f"no force between displacements of {x[0]:.6g} and {x[-1]:.6g} mm at {phase:.6g} of the mesh cycle", []
        )
