"""A force law in a table: from forces at given displacements, periodic over the cycle, smooth over the displacement.

Between knots run cubics over phase and s = sqrt((x - touch) / reach), with the slopes over s that the forces themselves
have. What the table leaves out is measured between its knots.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from pmor.arrays import FloatArray
from pmor.dynamics.force_law import forces_at
from pmor.dynamics.kernels.laws import ForceTable
from pmor.errors import ConvergenceError
from pmor.threads import in_order

#: forces at a phase (rad) and at displacements along the line of action: (displacements,) to (displacements,)
Forces = Callable[[float, FloatArray], FloatArray]

# Where flanks first touch: intervals that a range is cut into, again and again.
CUTS, ROUNDS = 8, 9
# Displacements on either side of a knot, over its distance from first touch: forces there give value and slope, the
# value to the square of this.
OFFSET = 1e-4
# Displacements at which it is tried whether the flanks bear a load, mm, each so much larger than the last; phases.
SMALLEST_RANGE, LARGEST_RANGE, RANGE_STEP, RANGE_PHASES = 1e-8, 10.0, 1.1, 8
# Of a stencil of five points for the derivative by the phase.
STENCIL = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / 12.0


@dataclass(frozen=True)
class TableError:
    """Table less law, between knots, over the largest force.

    Parameters
    ----------
    largest, rms : float
    """

    largest: float
    rms: float


def range_under(forces: Forces, load: float, spread: float, multiple: float) -> tuple[float, float]:
    """Return displacements between which a table knows the motion under a load along the line of action.

    Parameters
    ----------
    forces : callable
    load : float
    spread : float
        Most that flanks deviate by: nothing touches as far as that before the flanks of the drawing do.
    multiple : float
        Of the displacement that the load makes, from where flanks touch: how far motion may go beyond them.

    Returns
    -------
    tuple of float

    Raises
    ------
    ConvergenceError
        Where the flanks do not bear the load at any displacement.
    """
    phases = 2.0 * np.pi / RANGE_PHASES * np.arange(RANGE_PHASES)
    beyond, free = SMALLEST_RANGE, 0.0
    while beyond < LARGEST_RANGE:
        found = np.array([forces(phase, np.array([beyond - spread]))[0] for phase in phases])
        if np.isnan(found).any():
            break
        free = beyond if found.max() == 0.0 else free
        if found.min() >= load:
            return -(spread + SMALLEST_RANGE), beyond - spread + (multiple - 1.0) * (beyond - free)
        beyond *= RANGE_STEP
    raise ConvergenceError(f"the flanks do not bear a load of {load:.6g} N along the line of action")


def tabulate(
    forces: Forces, lowest: float, highest: float, phases: int, displacements: int, backlash: float = np.inf,
    executor: Executor | None = None,
) -> ForceTable:  # fmt: skip
    """Tabulate a force law.

    Parameters
    ----------
    forces : callable
    lowest, highest : float
        Displacements: flanks touch at none of the phases below the first, and at all of them below the second, up to
        which the table reaches everywhere.
    phases, displacements : int
        Numbers of knots.
    backlash : float
        See `ForceTable`.
    executor : concurrent.futures.Executor, optional
        Of threads; shares out the phases.

    Returns
    -------
    ForceTable

    Raises
    ------
    ValueError
        Where the law gives no force, or none at `highest`.
    """
    angle = 2.0 * np.pi * np.arange(phases) / phases
    touch = np.array(list(in_order(lambda at: _first_touch(forces, at, lowest, highest), angle.tolist(), executor)))
    reach = highest - touch.min()
    s = np.linspace(0.0, 1.0, displacements)
    beyond = reach * s[1:] ** 2
    near = np.concatenate([beyond * (1.0 - OFFSET), beyond * (1.0 + OFFSET)])

    def row(place: int) -> FloatArray:
        return np.asarray(forces(float(angle[place]), touch[place] + near)).reshape(2, -1)

    knots = np.zeros((phases, displacements, 4))
    for i, (below, above) in enumerate(in_order(row, range(phases), executor)):
        knots[i, 1:, 0] = 0.5 * (below + above)
        knots[i, 1:, 2] = (above - below) / (2.0 * OFFSET * beyond) * 2.0 * reach * s[1:]
    if not np.isfinite(knots).all():
        raise ValueError("the law gives no force somewhere in the range of the table")
    knots[:, :, 1], knots[:, :, 3] = _by_phase(knots[:, :, 0]), _by_phase(knots[:, :, 2])
    return ForceTable(np.column_stack([touch, _by_phase(touch)]), reach, knots, backlash)


def table_error(table: ForceTable, forces: Forces, places: int, rng: np.random.Generator) -> TableError:
    """Measure a table against its law at so many phases, drawn at random, and at as many displacements at each."""
    differences, top = [], 0.0
    low = table.touch[:, 0].min()
    for phase in rng.uniform(0.0, 2.0 * np.pi, places):
        x = low + table.reach * (1.0 - 1e-9) * rng.uniform(0.0, 1.0, places)
        exact = forces(phase, x)
        differences.append(forces_at(table, np.full(places, phase), x)[0] - exact)
        top = max(top, float(exact.max()))
    error = np.concatenate(differences) / top
    return TableError(float(np.abs(error).max()), float(np.sqrt((error**2).mean())))


def _first_touch(forces: Forces, phase: float, lowest: float, highest: float) -> float:
    """Find the displacement above which there is a force."""
    low, high = lowest, highest
    for _ in range(ROUNDS):
        x = np.linspace(low, high, CUTS + 1)
        carries = forces(phase, x) > 0.0
        if carries[0] or not carries[-1]:
            raise ValueError(f"flanks do not first touch between displacements {lowest:g} and {highest:g}")
        first = int(carries.argmax())
        low, high = x[first - 1], x[first]
    return 0.5 * float(low + high)


def _by_phase(values: FloatArray) -> FloatArray:
    """Derivative by the phase of values at even steps over the cycle, along the first axis."""
    step = 2.0 * np.pi / len(values)
    return np.asarray(sum(w * np.roll(values, 2 - k, axis=0) for k, w in enumerate(STENCIL)) / step)
