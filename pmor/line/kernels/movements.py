"""Movements of bodies that several meshes hold: how sections answer to them, their stiffness, their balance.

The equations are those of `pmor.line.kernels.several`. Where sections that carry leave a movement loose, the stiffness
S is singular: with S d = 0 none of their gaps changes along d, and forces balance there only if the loads do no work,
d T = 0.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.core.compiling import compiled
from pmor.core.linear import solve_transposed, solve_upper
from pmor.line.kernels.loads import gap_of, turning

# Of a movement's own stiffness: what other movements leave of it where they hold it not at all.
LOOSE = 1e-12
# Of the forces of all meshes, times the lever of a movement: what is left on a movement in balance. Rounding leaves
# less, and states that are read off a hundred times as much.
BALANCED = 1e-8


class Levers(NamedTuple):
    """How N sections of M meshes answer to K movements.

    Attributes
    ----------
    rows : ndarray, shape (A, N, K)
        l: change of their gaps, mm or 1.
    ahead : ndarray, shape (M, K)
        Advance of each mesh's pinion against its wheel that closes the flanks as much, rad.
    mesh : ndarray of int, shape (N,)
        Of each section; sections of a mesh follow each other.
    """

    rows: FloatArray
    ahead: FloatArray
    mesh: IntArray


class Movements(NamedTuple):
    """Workspace of K movements and N sections.

    Attributes
    ----------
    step : ndarray, shape (K,)
    lever : ndarray, shape (K, N)
        Of the sections that carry, one row for each movement.
    matrix : ndarray, shape (K, K)
        Stiffness, then its upper factor.
    loose : ndarray, shape (K,)
        Work of the loads along what each movement is loose in: N mm or N; 0 where it is held.
    """

    step: FloatArray
    lever: FloatArray
    matrix: FloatArray
    loose: FloatArray


@compiled
def lever_of(lines, i, levers, n, ahead, k):
    """Return the lever of a section on a movement, turned where the pinion's corner carries."""
    further, turn = turning(lines, i, n, ahead)
    return levers.rows[i, n, k] + turn * further * levers.ahead[levers.mesh[n], k]


@compiled
def stiffness(lines, i, levers, force, carried, workspace, movements):
    """Fill what U^-T makes of the levers, U the factor of the sections that carry, and d load / d movement."""
    active, count, lever, matrix = workspace.active, len(movements.step), movements.lever, movements.matrix
    for k in range(count):
        line = lever[k]
        for a in range(carried):
            n = active[a]
            line[a] = lever_of(lines, i, levers, n, workspace.ahead[n], k)
        solve_transposed(workspace.factor, carried, line)
        for m in range(k + 1):
            total, other = 0.0, lever[m]
            for a in range(carried):
                total += line[a] * other[a]
            matrix[k, m] = matrix[m, k] = total
    for a in range(carried):
        n = active[a]
        _, turn = turning(lines, i, n, workspace.ahead[n])
        if turn != 0.0:
            ahead = levers.ahead[levers.mesh[n]]
            for k in range(count):
                for m in range(count):
                    matrix[k, m] -= turn * force[n] * ahead[k] * ahead[m]


@compiled
def newton_step(lines, i, levers, load, force, carried, moved, workspace, movements):
    """Solve the linearised equations; change the movements. New forces are in ``workspace.loaded``."""
    active, count = workspace.active, len(moved)
    lever, matrix, step = movements.lever, movements.matrix, movements.step
    # With the factor U^T U all that is needed between movements are products of what U^-T makes of levers and gaps.
    stiffness(lines, i, levers, force, carried, workspace, movements)
    solve_transposed(workspace.factor, carried, workspace.loaded)
    for k in range(count):
        step[k] = load[k]
        for a in range(carried):
            step[k] -= lever[k, a] * workspace.loaded[a]
    for a in range(carried):
        n = active[a]
        _, turn = turning(lines, i, n, workspace.ahead[n])
        if turn != 0.0:
            ahead = levers.ahead[levers.mesh[n]]
            for k in range(count):
                step[k] -= turn * force[n] * ahead[k] * workspace.ahead[n]
    for k in range(count):
        for m in range(count):
            step[k] -= matrix[k, m] * moved[m]
    solve_held(matrix, step, movements.loose)
    for k in range(count):
        moved[k] += step[k]
        for a in range(carried):
            workspace.loaded[a] += moved[k] * lever[k, a]
    solve_upper(workspace.factor, carried, workspace.loaded)
    for a in range(carried):
        workspace.loaded[a] = -workspace.loaded[a]


@compiled
def solve_held(matrix, vector, loose):
    """Solve a symmetric system in place: the matrix becomes its factor, and movements that nothing holds get 0.

    `loose` is filled with what is left of the vector along those.
    """
    size = len(vector)
    for k in range(size):
        own = matrix[k, k]
        for m in range(k):
            own -= matrix[m, k] ** 2
            vector[k] -= matrix[m, k] * vector[m]
        held = own > LOOSE * matrix[k, k]
        matrix[k, k] = np.sqrt(own) if held else 1.0
        for j in range(k + 1, size):
            rest = matrix[k, j]
            for m in range(k):
                rest -= matrix[m, k] * matrix[m, j]
            matrix[k, j] = rest / matrix[k, k] if held else 0.0
        loose[k] = 0.0 if held else vector[k]
        vector[k] = vector[k] / matrix[k, k] if held else 0.0
    _solve_back(matrix, vector)


@compiled
def _solve_back(matrix, vector):
    """Solve with the upper factor of `solve_held`; movements that nothing holds keep their own."""
    size = len(vector)
    for k in range(size - 1, -1, -1):
        for m in range(k + 1, size):
            vector[k] -= matrix[k, m] * vector[m]
        vector[k] /= matrix[k, k]


@compiled
def place_at(lines, i, levers, moved, workspace):
    """Fill the advances and the gaps without deflection at some movements."""
    mesh, advance = -1, 0.0
    for n in range(len(workspace.free)):
        if levers.mesh[n] != mesh:
            mesh, advance = levers.mesh[n], 0.0
            for k in range(len(moved)):
                advance += levers.ahead[mesh, k] * moved[k]
        workspace.ahead[n] = advance
        further, turn = turning(lines, i, n, advance)
        rigid = workspace.free[n] + 0.5 * turn * further**2
        for k in range(len(moved)):
            rigid += levers.rows[i, n, k] * moved[k]
        workspace.rigid[n] = rigid


@compiled
def out_of_balance(lines, i, levers, load, force, carried, workspace):
    """Return the number of the movement on which forces and loads balance least; -1 where they do on all."""
    total, worst, most = 0.0, -1, BALANCED
    for a in range(carried):
        total += force[workspace.active[a]]
    for k in range(len(load)):
        left, arm = load[k], 0.0
        for a in range(carried):
            n = workspace.active[a]
            lever = lever_of(lines, i, levers, n, workspace.ahead[n], k)
            left += lever * force[n]
            arm = max(arm, abs(lever))
        if abs(left) > most * max(arm * total, abs(load[k])):
            worst, most = k, abs(left) / max(arm * total, abs(load[k]))
    return worst


@compiled
def let_go(lines, i, levers, flexibility, force, carried, moved, workspace, movements):
    """Move what is loose as the loads drive it until a section touches; return its number, -1 where none is in the way.

    `newton_step` has left the factor, and what the loads do along each loose movement. Forces stay as they are.
    """
    step, touching, far = movements.step, -1, np.inf
    for k in range(len(step)):
        arm = 0.0
        for n in range(len(force)):
            arm = max(arm, abs(levers.rows[i, n, k]))
        # As far in mm for the same force, of rotations at the levers of the meshes.
        step[k] = movements.loose[k] / arm**2 if arm > 0.0 else 0.0
    _solve_back(movements.matrix, step)
    for n in range(len(force)):
        closing = 0.0
        if not workspace.carries[n]:
            for k in range(len(step)):
                closing -= lever_of(lines, i, levers, n, workspace.ahead[n], k) * step[k]
        if closing > 0.0:
            until = max(gap_of(flexibility, i, n, carried, force, workspace), 0.0) / closing
            if until < far:
                touching, far = n, until
    if touching >= 0:
        for k in range(len(step)):
            moved[k] += far * step[k]
    return touching
