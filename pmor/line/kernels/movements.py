"""Movements of bodies that meshes hold: how sections answer to them, their balance, and what nothing holds.

The equations are those of `pmor.line.kernels.loads`. Where sections that carry leave a movement loose, the stiffness
S is singular: with S d = 0 none of their gaps changes along d, and forces balance there only if the loads do no work,
d T = 0.
"""

from __future__ import annotations

import numpy as np

from pmor.core.compiling import compiled
from pmor.core.linear import solve_upper

# Of a movement's own stiffness: what other movements leave of it where they hold it not at all.
LOOSE = 1e-12
# Of the forces of all meshes, times the lever of a movement: what is left on a movement in balance. Rounding leaves
# less, and states that are read off a hundred times as much.
BALANCED = 1e-8
# Of what the movements' own way takes, by their stiffness: rounding of gaps, next to which light loads are small.
ROUNDING = 1e-14


@compiled
def turning(lines, i, n, advance):
    """Return the advance beyond the one that brings the pinion's corner into contact, and the lever's slope there."""
    beyond = advance - lines.corner_advance[i, n]
    return (beyond, lines.lever_slope[i, n]) if beyond > 0.0 else (0.0, 0.0)


@compiled
def _lever_of(lines, i, rows, meshes, n, ahead, k):
    """Return the lever of a section on a movement, turned where the pinion's corner carries."""
    beyond, turn = turning(lines, i, n, ahead)
    return rows[i, n, k] + turn * beyond * meshes.ahead[meshes.mesh[n], k]


@compiled
def take_stiffness(count, workspace):
    """Fill d load / d movement from factored equations."""
    stiffness = workspace.stiffness
    for k in range(len(stiffness)):
        for m in range(k, len(stiffness)):
            stiffness[k, m] = stiffness[m, k] = -workspace.matrix[count + k, count + m]


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
    solve_upper(matrix, size, vector)


@compiled
def place_at(lines, i, rows, meshes, moved, workspace):
    """Fill the advances and the gaps without deflection at some movements."""
    mesh, advance = -1, 0.0
    for n in range(len(workspace.free)):
        if meshes.mesh[n] != mesh:
            mesh, advance = meshes.mesh[n], 0.0
            for k in range(len(moved)):
                advance += meshes.ahead[mesh, k] * moved[k]
        workspace.ahead[n] = advance
        beyond, turn = turning(lines, i, n, advance)
        rigid = workspace.free[n] + 0.5 * turn * beyond**2
        for k in range(len(moved)):
            rigid += rows[i, n, k] * moved[k]
        workspace.rigid[n] = rigid


@compiled
def out_of_balance(lines, i, rows, meshes, load, force, carried, moved, workspace):
    """Return the number of the movement on which forces and loads balance least; -1 where they do on all."""
    matrix, total, worst, most = workspace.matrix, 0.0, -1, BALANCED
    for a in range(carried):
        total += force[workspace.active[a]]
    for k in range(len(load)):
        left, arm, way = load[k], 0.0, 0.0
        for a in range(carried):
            n = workspace.active[a]
            lever = _lever_of(lines, i, rows, meshes, n, workspace.ahead[n], k)
            left += lever * force[n]
            arm = max(arm, abs(lever))
        for m in range(len(load)):
            way += abs(matrix[carried + min(k, m), carried + max(k, m)] * moved[m])
        left, scale = abs(left) - ROUNDING * way, max(arm * total, abs(load[k]))
        if left > most * scale:
            worst, most = k, left / scale
    return worst


@compiled
def let_go(lines, i, rows, meshes, force, moved, workspace):
    """Move what is loose as the loads drive it until a section touches; return its number, -1 where none is in the way.

    A step has left the factor, and what the loads do along each loose movement. Forces stay as they are, and gaps are
    those under them.
    """
    step, touching, far = workspace.step, -1, np.inf
    for k in range(len(step)):
        arm = 0.0
        for n in range(len(force)):
            arm = max(arm, abs(rows[i, n, k]))
        # As far in mm for the same force, of rotations at the levers of the meshes.
        step[k] = workspace.loose[k] / arm**2 if arm > 0.0 else 0.0
    solve_upper(workspace.stiffness, len(step), step)
    for n in range(len(force)):
        closing = 0.0
        if not workspace.carries[n]:
            for k in range(len(step)):
                closing -= _lever_of(lines, i, rows, meshes, n, workspace.ahead[n], k) * step[k]
        if closing > 0.0:
            until = max(workspace.gap[n], 0.0) / closing
            if until < far:
                touching, far = n, until
    if touching >= 0:
        for k in range(len(step)):
            moved[k] += far * step[k]
    return touching
