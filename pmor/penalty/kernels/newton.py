"""The reduced pair in equilibrium under a torque: damped Newton on forces.

The equilibrium of the penalty law is the minimum of an energy; halving a step that neither lowers it nor the residuals
keeps Newton from losing contact. The unknowns are the amplitudes of `ActiveShapes`, and the advance.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pmor.core.compiling import compiled, merged
from pmor.core.linear import cholesky, solve_factored, solve_transposed
from pmor.penalty.kernels.search import search_all
from pmor.penalty.kernels.types import NODE_ROWS, OFFSET

# Points are listed that stand off by this share of the gap that counts as clear.
NEARBY = 0.4
# Rounds in which points may change sides within a linearised problem, and those without progress before they change
# singly (Portugal, Judice & Vicente, Math. Comp. 63 (1994) 625); halvings of a step.
ROUNDS, PATIENCE, HALVINGS = 20, 3, 12


class State(NamedTuple):
    """A state of the pair, evaluated.

    Attributes
    ----------
    listed : int
        Points.
    touching : int
        Points that penetrate.
    smallest : float
        Smallest gap, mm.
    border : bool
        Contact reaches the border of a window.
    residual : float
        The larger of the force's (energy norm) and the torque's, relative.
    potential : float
        Elastic energy, half the points' forces times their penetrations, less the work of the torque, N mm.
    """

    listed: int
    touching: int
    smallest: float
    border: bool
    residual: float
    potential: float


class Solution(NamedTuple):
    """Where Newton ended.

    Attributes
    ----------
    advance : float
        rad.
    listed : int
        Points.
    border : bool
        Contact reaches the border of a window.
    """

    advance: float
    steps: int
    converged: bool
    listed: int
    border: bool


@compiled
def deform(columns, patches, active_shapes, work, coordinates):
    """Fill ``work.nodes`` with the deformed nodes; `columns` of nodes of both gears."""
    ranges, fields = active_shapes.ranges, active_shapes.fields
    flat, before = work.nodes.reshape(work.nodes.size), work.undeformed.reshape(work.undeformed.size)
    for dof in range(flat.size):
        flat[dof] = before[dof]
    for p in range(patches.pairs):
        for gear in range(2):
            window = patches.windows[p, gear]
            low = 3 * window[OFFSET]
            high = low + 3 * window[NODE_ROWS] * columns[gear]
            for j in range(ranges[gear, 1] - ranges[gear, 0]):
                # Slices from 0 on: a compiler must allow for a negative start and does not use vector registers then.
                amplitude, field, moved = coordinates[ranges[gear, 0] + j], fields[j, low:high], flat[low:high]
                for dof in range(len(moved)):
                    moved[dof] += amplitude * field[dof]


@compiled
def project_points(count, active_shapes, work):
    """Fill ``work.slope``: derivatives of the gaps by the active shapes' amplitudes, shape (count, active_shapes)."""
    ranges, fields, points = active_shapes.ranges, active_shapes.fields, work.workspace.points
    node, weight, slave, half = points.node, points.weight, points.slave, points.node.shape[1] // 2
    for n in range(count):
        row = work.slope[n]
        for j in range(active_shapes.size):
            row[j] = 0.0
        for side in range(2):
            low, high = ranges[slave[n] ^ side, 0], ranges[slave[n] ^ side, 1]
            for j in range(high - low):
                field, value = fields[j], 0.0
                for a in range(half * side, half * side + half):
                    first = 3 * node[n, a]
                    for d in range(3):
                        value += weight[n, a, d] * field[first + d]
                row[low + j] += value


@compiled
def residuals(count, active_shapes, work, coordinates, advance, load):
    """Penetrating points, residual and potential; see `State`."""
    size, gram, factor = active_shapes.size, active_shapes.gram, active_shapes.factor
    target, difference, slope = work.target, work.difference, work.slope
    gap, stiffness, lever = work.workspace.points.gap, work.workspace.points.stiffness, work.workspace.points.lever
    target[:size] = 0.0
    touching, moment, potential = 0, 0.0, -load.torque * advance
    for n in range(count):
        if gap[n] >= 0.0:
            continue
        touching += 1
        force = -stiffness[n] * gap[n]
        for j in range(size):
            target[j] += force * slope[n, j]
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
    solve_transposed(factor, size, target)
    solve_transposed(factor, size, difference)
    unbalanced = target_norm = 0.0
    for i in range(size):
        unbalanced += difference[i] ** 2
        target_norm += target[i] ** 2
    scale = max(target_norm, norm)
    residual = np.sqrt(unbalanced / scale) if scale > 0.0 else 0.0
    residual = max(residual, abs(moment + load.torque) / load.torque)
    return touching, residual, potential + 0.5 * norm


@compiled
def _add_point(n, sign, size, work):
    """Add a point's tangent and force to the Newton matrix (upper half) and the right-hand side, or take them off."""
    points, matrix, rhs, free_gap = work.workspace.points, work.matrix, work.rhs, work.free_gap
    row, k, lever = work.slope[n, :size], sign * points.stiffness[n], points.lever[n]
    for i in range(size):
        scaled, line, rest = k * row[i], matrix[i, i:size], row[i:]
        for j in range(size - i):
            line[j] += scaled * rest[j]
        matrix[i, size] += scaled * lever
        rhs[i] -= scaled * free_gap[n]
    matrix[size, size] += k * lever**2
    rhs[size] -= k * lever * free_gap[n]


@compiled
def newton_step(count, active_shapes, work, coordinates, load):
    """Fill ``work.solution``, amplitudes and rotation of the linearised problem, its gaps and active points.

    The geometry is the expensive part of a step, so which points are active is settled on the linearised gaps; points
    that stand off a little are in the lists for that.
    """
    size, gram, slope, points = active_shapes.size, active_shapes.gram, work.slope, work.workspace.points
    solution, rhs, matrix, active, free_gap = work.solution, work.rhs, work.matrix, work.active, work.free_gap
    unknowns = size + 1
    for i in range(size):
        for j in range(i, size):
            matrix[i, j] = gram[i, j]
        matrix[i, size] = rhs[i] = 0.0
    matrix[size, size], rhs[size] = 0.0, load.torque
    for n in range(count):
        active[n] = points.gap[n] < 0.0
        free_gap[n] = points.gap[n]
        for j in range(size):
            free_gap[n] -= slope[n, j] * coordinates[j]
        if active[n]:
            _add_point(n, 1.0, size, work)
    fewest, patience = count + 1, PATIENCE
    for _ in range(ROUNDS):
        cholesky(matrix, unknowns, work.factor)
        for i in range(unknowns):
            solution[i] = rhs[i]
        solve_factored(work.factor, unknowns, solution)
        wrong, last, touching = 0, 0, 0
        for n in range(count):
            gap = free_gap[n] + points.lever[n] * solution[size]
            for j in range(size):
                gap += slope[n, j] * solution[j]
            points.gap[n] = gap
            touching += gap < 0.0
            if active[n] != (gap < 0.0):
                wrong, last = wrong + 1, n
        # Without any point the torque has nothing to balance it.
        if wrong == 0 or touching == 0:
            return
        patience = PATIENCE if wrong < fewest else patience - 1
        fewest = min(fewest, wrong)
        for n in range(last if patience < 0 else 0, last + 1):
            if active[n] != (points.gap[n] < 0.0):
                active[n] = points.gap[n] < 0.0
                _add_point(n, 1.0 if active[n] else -1.0, size, work)


@compiled
def evaluate(pair, position, coordinates, advance, load):
    """Deform, search, project; return the `State`."""
    patches, active_shapes, work = position.patches, position.active_shapes, position.work
    columns = pair.gears[0].nodes.shape[1], pair.gears[1].nodes.shape[1]
    deform(columns, patches, active_shapes, work, coordinates)
    found = search_all(pair, patches, advance, work.nodes, NEARBY * patches.clear, work.workspace)
    project_points(found.listed, active_shapes, work)
    touching, residual, potential = residuals(found.listed, active_shapes, work, coordinates, advance, load)
    return State(found.listed, touching, found.smallest, found.border, residual, potential)


@merged
def _last_step(count, active_shapes, work, coordinates, load):
    """Take a step without evaluating the geometry again: `coordinates` and the gaps are updated, the rotation returned.

    A step costs a fifth of an evaluation and gains a factor of about 40 close to the solution.
    """
    newton_step(count, active_shapes, work, coordinates, load)
    for j in range(active_shapes.size):
        coordinates[j] = work.solution[j]
    return work.solution[active_shapes.size]


@compiled
def solve_state(pair, position, load, coordinates, advance, max_steps, tolerance):
    """Damped Newton.

    The residual that is held against the tolerance is evaluated; one more step is taken on top of that state.

    Parameters
    ----------
    pair : Pair
    position : Position
        Its work space holds the points and the last Newton matrix of the solution.
    load : Load
    coordinates : ndarray, shape (active_shapes,)
        Amplitudes to start from; updated.
    advance : float
        To start from, rad.
    max_steps : int
    tolerance : float

    Returns
    -------
    Solution
    """
    active_shapes, work = position.active_shapes, position.work
    size, solution, trial = active_shapes.size, work.solution, work.trial
    state = evaluate(pair, position, coordinates, advance, load)
    for step in range(max_steps + 1):
        if state.residual <= tolerance:
            advance += _last_step(state.listed, active_shapes, work, coordinates, load)
            return Solution(advance, step, np.isfinite(advance), state.listed, state.border)
        if state.touching == 0:
            if not np.isfinite(state.smallest):
                return Solution(advance, step, False, state.listed, state.border)
            advance += (state.smallest + load.approach) / pair.gears[0].base_radius
            state = evaluate(pair, position, coordinates, advance, load)
            continue
        newton_step(state.listed, active_shapes, work, coordinates, load)
        fraction, before, rotation = 1.0, state, solution[size]
        for _ in range(HALVINGS):
            for j in range(size):
                trial[j] = coordinates[j] + fraction * (solution[j] - coordinates[j])
            state = evaluate(pair, position, trial, advance + fraction * rotation, load)
            better = state.residual < before.residual or state.potential < before.potential
            # A step that loses contact altogether is no progress, however low its potential.
            if better and state.touching > 0:
                break
            fraction *= 0.5
        advance += fraction * rotation
        for j in range(size):
            coordinates[j] = trial[j]
    return Solution(advance, max_steps, False, state.listed, state.border)
