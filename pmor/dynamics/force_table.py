"""A force law in a table that is as fine as it must be: a tree of cells over phase and displacement.

The force has kinks where a further tooth pair comes into contact, along curves that no regular grid follows. Cells are
therefore halved, over the phase or over the displacement, until a bicubic through 4 x 4 values holds in each; on the
way to smaller neighbours a cell's own border is kept, so that the force is continuous everywhere. The
error of the table is measured at the points between, and again at places drawn at random.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.core.errors import ConvergenceError
from pmor.core.threads import in_order
from pmor.dynamics.force_law import forces_at
from pmor.dynamics.kernels.laws import CELL, DISPLACEMENT, PHASE, ForceTable
from pmor.dynamics.table_cells import COLUMNS, CYCLE, RANGE, ROWS, Cells, cubics, join, roots, together
from pmor_online.mesh_force import Forces

# Error of cells at the points between their values, over the largest force. A quarter more was measured elsewhere.
TOLERANCE = 5e-5
# How far from a watched load a cell counts as beside it, over the range of its own forces: a longer one, lower by this
# factor at most, gives the cell at the load its border.
BESIDE = 2.0
# Per mesh cycle: beyond which a law is none that a table could hold.
MOST_CELLS = 100_000
# Displacements at which it is tried whether the flanks bear a load, mm, each so much larger than the last; phases.
SMALLEST_RANGE, LARGEST_RANGE, RANGE_STEP, RANGE_PHASES = 1e-8, 10.0, 1.1, 8

# Phases that are handed to an executor together.
PHASES_AT_ONCE = 32

_PLACES = np.arange(7)


@dataclass(frozen=True)
class TableError:
    """Table less law, between the values of cells, over the largest force."""

    largest: float
    rms: float


@dataclass(frozen=True)
class Watched:
    """A load under which the displacement is to be known better than the range as a whole."""

    load: float
    allowed: float  # Error of the force where it is about that load


def range_under(forces: Forces, load: float, spread: float, multiple: float, touch: float = 0.0) -> tuple[float, float]:
    """Return the range of displacements that a table needs for motion under a load along the line of action.

    Parameters
    ----------
    spread : float
        Most that flanks deviate by: nothing touches as far as that before the flanks of the drawing do.
    multiple : float
        Of the displacement that the load makes, from where flanks touch: how far motion may go beyond them.
    touch : float
        Displacement at which plain flanks on the same axes first touch.

    Raises
    ------
    ConvergenceError
        Where the flanks do not bear the load at any displacement.
    """
    phases = 2.0 * np.pi / RANGE_PHASES * np.arange(RANGE_PHASES)
    beyond, free = SMALLEST_RANGE, 0.0
    while beyond < LARGEST_RANGE:
        touching = np.array([forces(phase, np.array([touch + beyond - spread]))[0] for phase in phases])
        if np.isnan(touching).any():
            break
        free = beyond if touching.max() == 0.0 else free
        if touching.min() >= load:
            low = touch - spread
            return low - SMALLEST_RANGE, low + beyond + (multiple - 1.0) * (beyond - free)
        beyond *= RANGE_STEP
    raise ConvergenceError(f"the flanks do not bear a load of {load:.6g} N along the line of action")


def tabulate(
    forces: Forces, lowest: float, highest: float, watched: Sequence[Watched] = (), tolerance: float = TOLERANCE,
    backlash: float = np.inf, alike: Sequence[int] = (0,), executor: Executor | None = None,
) -> ForceTable:  # fmt: skip
    """Tabulate a force law.

    Parameters
    ----------
    lowest, highest : float
        Range of displacements: flanks touch at none of the phases below the first.
    tolerance : float
        Of the largest force in the range.
    backlash : float
        See `ForceTable`.
    alike : sequence of int
        Of each mesh cycle after which the law repeats: the number of its kind, counted as they first come. Only the
        first of a kind is solved; cycles of a kind have neighbours of the same kinds.
    executor : concurrent.futures.Executor, optional
        Shares out the phases; of processes where `forces` can be pickled, or of threads.

    Raises
    ------
    ConvergenceError
        Where the law gives no force, or needs too many cells.
    """
    kinds = np.asarray(alike)
    law = _Law(forces, np.unique(kinds, return_index=True)[1], lowest, (highest - lowest) / (RANGE), executor)
    waiting = roots(int(kinds.max()) + 1)
    root = np.arange(len(waiting.phase)).reshape(-1, COLUMNS, ROWS)[kinds]
    node_kinds, following, cells, values = list[IntArray](), list[IntArray](), list[Cells](), list[FloatArray]()
    nodes, held, limit = len(waiting.phase), 0, 0.0
    while len(waiting.phase):
        law_forces = law.at(waiting)
        limit = limit or tolerance * float(law_forces.max())
        over_phase, over_displacement, both = _interpolation_error(law_forces)
        fits = np.maximum(np.maximum(over_phase, over_displacement), both) <= _allowed(law_forces, limit, watched)
        kind = np.where(fits, CELL, np.where(over_phase > over_displacement, PHASE, DISPLACEMENT))
        node_kinds.append(kind)
        following.append(np.where(fits, held + np.cumsum(fits) - 1, nodes + 2 * (np.cumsum(~fits) - 1)))
        cells.append(waiting.at(fits))
        values.append(law_forces[fits][:, ::2, ::2])
        held += int(fits.sum())
        waiting = waiting.at(~fits).halves(kind[~fits] == PHASE)
        nodes += len(waiting.phase)
        if nodes > MOST_CELLS * len(law.first):
            raise ConvergenceError(f"the force law needs more than {MOST_CELLS} cells of a table per mesh cycle")
    table = ForceTable(
        lowest, highest, root, np.concatenate(node_kinds), np.concatenate(following), np.concatenate(values), backlash
    )
    join(table, together(cells), kinds)
    return table


def table_error(table: ForceTable, forces: Forces, places: int, rng: np.random.Generator) -> TableError:
    """Measure a table against its law at so many phases, drawn at random, and at as many displacements at each."""
    differences, top = [], 0.0
    for phase in rng.uniform(0.0, 2.0 * np.pi * len(table.root), places):
        x = table.low + (table.high - table.low) * rng.uniform(0.0, 1.0, places)
        exact = forces(phase, x)
        differences.append(forces_at(table, np.full(places, phase), x)[0] - exact)
        top = max(top, float(exact.max()))
    error = np.concatenate(differences) / top
    return TableError(float(np.abs(error).max()), float(np.sqrt((error**2).mean())))


class _Law:
    """A force law at places counted in steps; solved places are kept.

    Parameters
    ----------
    first : ndarray of int
        The first mesh cycle of each kind.
    lowest, step : float
        Displacement at 0, and per step.
    """

    def __init__(
        self, forces: Forces, first: IntArray, lowest: float, step: float, executor: Executor | None
    ) -> None:  # fmt: skip
        self.forces, self.first, self.lowest, self.step, self.executor = forces, first, lowest, step, executor
        self.keys, self.values = np.empty(0, dtype=np.int64), np.empty(0)

    def at(self, cells: Cells) -> FloatArray:
        """Forces at 7 x 7 places of each cell, its border included, (n, 7, 7)."""
        phase = cells.phase[:, None] + cells.width[:, None] // 6 * _PLACES
        x = cells.x[:, None] + cells.height[:, None] // 6 * _PLACES
        # The end of a cycle is its own, not the beginning of the next kind.
        cycle = cells.phase // CYCLE
        column = (phase + cycle[:, None])[:, :, None]
        keys = column * (RANGE + 1) + x[:, None, :]
        self._solve(np.setdiff1d(keys, self.keys))
        return np.asarray(self.values[np.searchsorted(self.keys, keys)])

    def _solve(self, keys: IntArray) -> None:
        if not len(keys):
            return
        column, x = np.divmod(keys, RANGE + 1)
        ends = np.flatnonzero(np.diff(column)) + 1
        kind, phase = np.divmod(column[np.append(0, ends)], CYCLE + 1)
        angle = 2.0 * np.pi * (self.first[kind] + phase / CYCLE)
        rows = list(zip(angle.tolist(), np.split(self.lowest + self.step * x, ends), strict=True))
        parts = [rows[i : i + PHASES_AT_ONCE] for i in range(0, len(rows), PHASES_AT_ONCE)]
        solved = np.concatenate(list(in_order(partial(_row, self.forces), parts, self.executor)))
        every = np.concatenate([self.keys, keys])
        order = np.argsort(every, kind="stable")
        self.keys, self.values = every[order], np.concatenate([self.values, solved])[order]


def _row(forces: Forces, rows: Sequence[tuple[float, FloatArray]]) -> FloatArray:
    """Forces at displacements of some phases, one after the other."""
    row = []
    for angle, at in rows:
        force = np.asarray(forces(angle, at))
        if not np.isfinite(force).all():
            hole = at[np.isnan(force)][0]
            raise ConvergenceError(
                f"no force at a displacement of {hole:.6g} mm at {angle / (2.0 * np.pi):.6g} of the mesh cycle"
            )
        row.append(force)
    return np.concatenate(row)


def _allowed(force: FloatArray, limit: float, watched: Sequence[Watched]) -> FloatArray:
    """Allowed errors of cells, (n,): less where a watched load is among their forces or those of cells beside."""
    low, high = force.min(axis=(1, 2)), force.max(axis=(1, 2))
    margin = BESIDE * (high - low)
    allowed = np.full(len(force), limit)
    for watch in watched:
        near = (low - margin <= watch.load) & (watch.load <= high + margin)
        allowed[near] = np.minimum(allowed[near], watch.allowed)
    return allowed


def _interpolation_error(force: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Errors of bicubics through every other value at the rest: between phases, displacements, and both; (n,) each."""
    weights = cubics(_PLACES[1::2] / 6.0)
    known = force[:, ::2, ::2]
    phase, displacement = weights @ known, known @ weights.T
    missed = (
        phase - force[:, 1::2, ::2], displacement - force[:, ::2, 1::2], weights @ displacement - force[:, 1::2, 1::2]
    )  # fmt: skip
    one, two, both = (np.abs(part).max(axis=(1, 2)) for part in missed)
    return one, two, both
