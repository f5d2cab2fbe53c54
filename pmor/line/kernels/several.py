"""Line loads of several meshes at once: gears that share bodies, free rotations and floating members.

The equations are those of `pmor.line.kernels.loads`; the advance of the one pinion becomes the movements q of all
bodies that are free: rotations, and displacements of members that float. With l a row of levers for each section,

    g = g_0 + e + l q + D F + delta(w),      -l^T F = T,                                                        (1)

T what acts on each movement from outside: torques, and nothing on planets, idlers and a floating sun. D has the blocks
of all meshes, and between them what bodies that they share give way (`couple`), and what hubs stand on. It is the
minimum of a convex energy: line loads are unique. So are movements, but for bodies that nothing touches.

Derivatives follow from the same matrices at a solution, as those of a pair do. With M = D + delta'/width of the
sections that carry, S = l^T M^-1 l - l_t F (l_t the slopes of levers that turn), and a figure whose derivatives are a
by the movements and c by the forces,

    d figure / d e = -M^-1 (c - l v),    v = S^-1 (l^T M^-1 c - a):                                                 (2)

one right-hand side for all deviations. With c = 0 and a of one rotation, it is Maxwell's: a deviation turns a gear as a
torque on the gear loads the section that deviates.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.core.compiling import allocating, compiled
from pmor.core.linear import solve_transposed, solve_upper
from pmor.line.kernels.loads import (
    LEAST,
    NEARBY,
    PATIENCE,
    ROUND_OFF,
    TOLERANCE,
    accept,
    begin,
    gap_of,
    linearise,
    new_workspace,
    set_free,
    touch,
)
from pmor.line.kernels.movements import (
    Movements,
    let_go,
    newton_step,
    out_of_balance,
    place_at,
    solve_held,
    stiffness,
)

# Steps that change one section each. Sets of seven planets of which three carry take up to 250.
MOST_SINGLE_STEPS = 600
# Of the largest force of a section: what rounding leaves of one that stands at its neighbours' gap and carries nothing.
NOTHING = 1e-9


class SeveralResults(NamedTuple):
    """Results of `solve_meshes` under D loads.

    Attributes
    ----------
    movement : ndarray, shape (D, A, K)
        q, rad or mm.
    steps : ndarray of int, shape (D, A)
    converged : ndarray of bool, shape (D, A)
    force : ndarray, shape (D, A, N)
        Along the transverse line of action, N; 0 where not converged.
    loose : ndarray of int, shape (D, A)
        Number of the movement whose forces and loads do not balance; -1 where all do.
    """

    movement: FloatArray
    steps: IntArray
    converged: BoolArray
    force: FloatArray
    loose: IntArray


@allocating
def solve_meshes(lines, levers, flexibility, deviation, loads, mean_force, softness, width, unused, corners, results):
    """Solve all angles under all loads.

    Parameters
    ----------
    lines : Lines
        Of all meshes one after the other, their corners numbered as in `corners`.
    levers : Levers
    flexibility : Flexibility
        Sections that are not ready are left out.
    deviation : ndarray, shape (A, N) or (0, 0)
        mm.
    loads : ndarray, shape (D, K)
        T, N mm or N.
    mean_force : ndarray, shape (D, M)
        Force of each mesh to expect, N.
    softness : ndarray, shape (M,)
        Approach of its flanks to expect by force, mm/N.
    width : ndarray, shape (N,)
        mm.
    unused : two ndarrays
        Compliance of a pair, which nothing is made ready from.
    corners : tuple of Corner
    results : SeveralResults
        Filled.
    """
    size = levers.rows.shape[1]
    workspace, movements = new_workspace(size), _new_movements(size, levers.rows.shape[2])
    for i in range(len(lines.first_pair)):
        for d in range(len(loads)):
            set_free(lines, i, deviation, workspace)
            for n in range(size):
                if not flexibility.ready[i, n]:
                    workspace.free[n] = np.inf
            force, moved, loose, steps = results.force[d, i], results.movement[d, i], -1, 0
            for single in (False, True):
                round_off = _start(lines, i, levers, mean_force[d], softness, force, workspace)
                moved[:] = 0.0
                found, loose, done = _solve(
                    lines, i, levers, flexibility, loads[d], round_off, width, unused, corners, force, moved, single,
                    workspace, movements,
                )  # fmt: skip
                steps += done
                if found:
                    break
            results.converged[d, i], results.loose[d, i], results.steps[d, i] = found, loose, steps
            if not found:
                force[:] = 0.0


@allocating
def _new_movements(size, count):
    return Movements(np.empty(count), np.empty((count, size)), np.empty((count, count)), np.empty(count))


@compiled
def _solve(
    lines, i, levers, flexibility, load, round_off, width, unused, corners, force, moved, single, workspace, movements
):
    """Newton with an active set; return whether it converged, the movement out of balance or -1, and the steps.

    All sections that pull or overlap change sides after each step: it takes a few steps, but may go round in a circle,
    and drop so many that nothing holds a movement on which a load works; then it ends. Or they change singly, which
    takes long and gets there: all meshes begin in contact, so that their forces balance; along each step to the next
    section that lets go the energy of forces in balance falls, and sections that overlap begin one after the other
    (Nocedal & Wright, Numerical Optimization 2006, ch. 16.5). What is loose nevertheless, as levers turn, moves on
    until it touches.
    """
    loose, most = -1, MOST_SINGLE_STEPS if single else PATIENCE
    for step in range(1, most + 1):
        carried = linearise(lines, flexibility, i, force, width, unused, corners, workspace)
        newton_step(lines, i, levers, load, force, carried, moved, workspace, movements)
        if single:
            settled, error = _accept_to_first(lines, i, carried, width, force, workspace)
        else:
            settled, error = accept(lines, i, carried, width, force, workspace)
        place_at(lines, i, levers, moved, workspace)
        loose = -1
        if settled and error <= TOLERANCE:
            loose = out_of_balance(lines, i, levers, load, force, carried, workspace)
        if loose >= 0 and movements.loose[loose] != 0.0:
            if not single:
                return False, loose, step
            touching = let_go(lines, i, levers, flexibility, force, carried, moved, workspace, movements)
            if touching < 0:
                return False, loose, step
            begin(lines, i, touching, width, force, workspace)
            place_at(lines, i, levers, moved, workspace)
            continue
        if not single:
            settled = (
                touch(lines, flexibility, i, 1e300, round_off, carried, width, unused, force, False, workspace)
                and settled
            )
        elif settled and error <= TOLERANCE and loose < 0:
            settled = _touch_deepest(lines, i, flexibility, round_off, carried, width, force, workspace)
        if settled and error <= TOLERANCE and loose < 0:
            return True, -1, step
    return False, loose, most


@allocating
def differentiate_meshes(
    lines, levers, flexibility, deviation, width, unused, corners, found, by_movement, by_force, by_deviation
):
    """Fill the derivatives of a figure of movements and forces by the deviation of each section, under fixed loads.

    Parameters
    ----------
    lines, levers, flexibility, deviation, width, unused, corners
        As in `solve_meshes`.
    found : SeveralResults
        Converged states; others get derivatives of 0.
    by_movement : ndarray, shape (D, A, K)
        Derivatives of the figure in each state by its movements.
    by_force : ndarray, shape (D, A, N)
        By its forces.
    by_deviation : ndarray, shape (D, A, N)
        Filled, per mm.
    """
    size, count = levers.rows.shape[1:]
    workspace, movements = new_workspace(size), _new_movements(size, count)
    for i in range(len(lines.first_pair)):
        for d in range(len(found.converged)):
            rates, force, moved = by_deviation[d, i], found.force[d, i], found.movement[d, i]
            rates[:] = 0.0
            if not found.converged[d, i]:
                continue
            set_free(lines, i, deviation, workspace)
            for n in range(size):
                workspace.carries[n] = force[n] > 0.0
            place_at(lines, i, levers, moved, workspace)
            carried = linearise(lines, flexibility, i, force, width, unused, corners, workspace)
            stiffness(lines, i, levers, force, carried, workspace, movements)
            adjoint, step = workspace.loaded, movements.step
            for a in range(carried):
                adjoint[a] = by_force[d, i, workspace.active[a]]
            solve_transposed(workspace.factor, carried, adjoint)
            for k in range(count):
                step[k] = -by_movement[d, i, k]
                for a in range(carried):
                    step[k] += movements.lever[k, a] * adjoint[a]
            solve_held(movements.matrix, step, movements.loose)
            for k in range(count):
                for a in range(carried):
                    adjoint[a] -= step[k] * movements.lever[k, a]
            solve_upper(workspace.factor, carried, adjoint)
            for a in range(carried):
                rates[workspace.active[a]] = -adjoint[a]


@compiled
def _start(lines, i, levers, mean_force, softness, force, workspace):
    """Choose the sections to begin with, each mesh by itself; return the gap that has no sign."""
    free, size, first, depth = workspace.free, len(workspace.free), 0, 0.0
    while first < size:
        mesh, last, advance = levers.mesh[first], first, np.inf
        while last < size and levers.mesh[last] == mesh:
            advance = min(advance, free[last] / -lines.lever[i, last])
            last += 1
        approach = mean_force[mesh] * softness[mesh]
        advance += approach / -lines.lever[i, first]
        count = 0
        for n in range(first, last):
            rigid = free[n] + lines.lever[i, n] * advance
            workspace.carries[n], workspace.ahead[n] = rigid < 0.0, advance
            count, depth = count + (rigid < 0.0), max(depth, -rigid)
        for n in range(first, last):
            force[n] = mean_force[mesh] / count if workspace.carries[n] else 0.0
        first = last
    return ROUND_OFF * NEARBY * depth


@compiled
def _accept_to_first(lines, i, carried, width, force, workspace):
    """Go towards the new forces until a first section lets go; return whether none did, and the change."""
    largest, share, first, error = 0.0, 1.0, -1, 0.0
    for a in range(carried):
        largest = max(largest, workspace.loaded[a])
    for a in range(carried):
        n, new = workspace.active[a], workspace.loaded[a]
        if new < -NOTHING * largest and force[n] < share * (force[n] - new):
            share, first = force[n] / (force[n] - new), n
    for a in range(carried):
        n = workspace.active[a]
        least = lines.law[i, n, LEAST] * width[n % len(width)]
        new = max(force[n] + share * (workspace.loaded[a] - force[n]), 0.0)
        error = max(error, (new - force[n]) ** 2 / (max(new, least) * largest))
        force[n] = new
    if first >= 0:
        workspace.carries[first], force[first] = False, 0.0
    return first < 0, error


@compiled
def _touch_deepest(lines, i, flexibility, round_off, carried, width, force, workspace):
    """Let the section carry that overlaps most; return whether there was none."""
    deepest, depth = -1, -round_off
    for n in range(len(force)):
        if not workspace.carries[n]:
            gap = gap_of(flexibility, i, n, carried, force, workspace)
            if gap < depth:
                deepest, depth = n, gap
    if deepest >= 0:
        begin(lines, i, deepest, width, force, workspace)
    return deepest < 0
