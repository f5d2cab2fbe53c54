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
    MAX_STEPS,
    NEARBY,
    PATIENCE,
    ROUND_OFF,
    TOLERANCE,
    accept,
    linearise,
    new_workspace,
    set_free,
    touch,
    turning,
)

# Of a movement's own stiffness: what other movements leave of it where they hold it not at all.
LOOSE = 1e-12


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
    """

    movement: FloatArray
    steps: IntArray
    converged: BoolArray
    force: FloatArray


class _Movements(NamedTuple):
    """Workspace of K movements: loads (K,), rows of their levers (K, N), matrix (K, K)."""

    step: FloatArray
    lever: FloatArray
    matrix: FloatArray


class Gathered(NamedTuple):
    """Where sections press on bodies, two places for each: on the pinion and on the wheel of its mesh.

    Attributes
    ----------
    body : ndarray of int, shape (N, 2)
    image : ndarray of int, shape (N, 2)
        0 on the flanks that lie counter-clockwise, 1 on the others, which are seen in their image.
    tooth : ndarray of int, shape (A, N, 2)
        Its number in the frame in which the flank lies counter-clockwise.
    shapes : ndarray, shape (A, N, 2, r)
        Forces on the body's shapes by a unit force in the section; r those of the body with most, the rest is 0.
    """

    body: IntArray
    image: IntArray
    tooth: IntArray
    shapes: FloatArray


@allocating
def gather(lines, ready, carried, first, gathered):
    """Fill the forces on the bodies' shapes by unit forces in the sections of a mesh that are ready.

    Parameters
    ----------
    lines : Lines
        Of the mesh.
    ready : ndarray of bool, shape (A, N)
        Of all meshes.
    carried : two ndarrays, shape (S, rows, c, r)
        Shapes of pinion and wheel at the rows of nodes of each section.
    first : int
        Of the mesh's sections among all.
    gathered : Gathered
        Its `shapes` are filled.
    """
    for gear in range(2):
        shapes = carried[gear]
        sections, _, parts, rank = shapes.shape
        for i in range(lines.gap.shape[0]):
            for n in range(lines.gap.shape[1]):
                if not ready[i, first + n]:
                    continue
                out, own, row = gathered.shapes[i, first + n, gear], shapes[n % sections], lines.row[i, n, gear]
                out[:] = 0.0
                for a in range(4):
                    for c in range(parts):
                        value, line = lines.gradient[i, n, gear, parts * a + c], own[row + a, c]
                        for k in range(rank):
                            out[k] += value * line[k]


@allocating
def couple(between, ready, mesh, gathered, count, teeth, alike, backs):
    """Add what bodies give way between sections of different meshes that are ready.

    Parameters
    ----------
    between : ndarray, shape (A, N, N)
        Filled, mm/N.
    ready : ndarray of bool, shape (A, N)
    mesh : ndarray of int, shape (N,)
    gathered : Gathered
    count, teeth : ndarray of int, shape (B,)
        Shapes and teeth of each body.
    alike : ndarray, shape (B, 2, z, r, r)
        Of flanks, and of their images, of `pmor.body.far_compliance.FarCompliance`, mm/N.
    backs : ndarray, shape (B, 2, z, r, r)
        Of the other flank by the flank, rows and columns exchanged, and as it is.
    """
    moved = np.empty(alike.shape[3])
    for i in range(between.shape[0]):
        for m in range(between.shape[1]):
            if not ready[i, m]:
                continue
            for b in range(2):
                body, last, before = gathered.body[m, b], -1, 0
                rank = count[body]
                for n in range(m + 1 if rank > 0 else between.shape[1], between.shape[1]):
                    if mesh[n] == mesh[m] or not ready[i, n]:
                        continue
                    a = 0 if gathered.body[n, 0] == body else 1
                    if gathered.body[n, a] != body:
                        continue
                    # The same for all sections of a tooth, which follow each other.
                    place = 2 * gathered.tooth[i, n, a] + gathered.image[n, a]
                    if last < 0 or place != before or mesh[n] != mesh[last]:
                        _move(gathered, i, n, a, m, b, rank, teeth[body], alike[body], backs[body], moved)
                        last, before = n, place
                    total, own = 0.0, gathered.shapes[i, n, a]
                    for k in range(rank):
                        total += own[k] * moved[k]
                    between[i, n, m] += total
                    between[i, m, n] += total


@compiled
def _move(gathered, i, n, a, m, b, rank, teeth, alike, backs, moved):
    """Fill the movement of the shapes of the tooth of section n by a unit force in section m, on one body."""
    by, image = gathered.shapes[i, m, b], gathered.image[m, b]
    # Blocks with their rows and columns exchanged: the loop runs along rows. That of teeth as far the other way is.
    if gathered.image[n, a] == image:
        block = alike[image, (gathered.tooth[i, m, b] - gathered.tooth[i, n, a]) % teeth]
    else:  # in its image a tooth has the opposite number
        block = backs[image, (-gathered.tooth[i, n, a] - gathered.tooth[i, m, b]) % teeth]
    moved[:rank] = 0.0
    for k in range(rank):
        value, line = by[k], block[k]
        for c in range(rank):
            moved[c] += value * line[c]


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
    size, count = levers.rows.shape[1:]
    workspace, movements = (
        new_workspace(size),
        _Movements(np.empty(count), np.empty((count, size)), np.empty((count, count))),
    )
    for i in range(len(lines.first_pair)):
        for d in range(len(loads)):
            set_free(lines, i, deviation, workspace)
            for n in range(size):
                if not flexibility.ready[i, n]:
                    workspace.free[n] = np.inf
            force, moved = results.force[d, i], results.movement[d, i]
            round_off = _start(lines, i, levers, mean_force[d], softness, force, workspace)
            moved[:] = 0.0
            found = False
            for step in range(1, MAX_STEPS + 1):
                results.steps[d, i] = step
                carried = linearise(lines, flexibility, i, force, width, unused, corners, workspace)
                if carried == 0:
                    break
                _newton_step(lines, i, levers, loads[d], force, carried, moved, workspace, movements)
                settled, error = accept(lines, i, carried, width, force, workspace)
                single = step > PATIENCE
                _place(lines, i, levers, moved, workspace)
                if not (single and error > TOLERANCE):
                    settled = (
                        touch(lines, flexibility, i, 1e300, round_off, carried, width, unused, force, single, workspace)
                        and settled
                    )
                if settled and error <= TOLERANCE:
                    found = True
                    break
            results.converged[d, i] = found
            if not found:
                force[:] = 0.0


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
    workspace, movements = (
        new_workspace(size),
        _Movements(np.empty(count), np.empty((count, size)), np.empty((count, count))),
    )
    for i in range(len(lines.first_pair)):
        for d in range(len(found.converged)):
            rates, force, moved = by_deviation[d, i], found.force[d, i], found.movement[d, i]
            rates[:] = 0.0
            if not found.converged[d, i]:
                continue
            set_free(lines, i, deviation, workspace)
            for n in range(size):
                workspace.carries[n] = force[n] > 0.0
            _place(lines, i, levers, moved, workspace)
            carried = linearise(lines, flexibility, i, force, width, unused, corners, workspace)
            _stiffness(lines, i, levers, force, carried, workspace, movements)
            adjoint, step = workspace.loaded, movements.step
            for a in range(carried):
                adjoint[a] = by_force[d, i, workspace.active[a]]
            solve_transposed(workspace.factor, carried, adjoint)
            for k in range(count):
                step[k] = -by_movement[d, i, k]
                for a in range(carried):
                    step[k] += movements.lever[k, a] * adjoint[a]
            _solve_held(movements.matrix, step)
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
def _stiffness(lines, i, levers, force, carried, workspace, movements):
    """Fill what U^-T makes of the levers, U the factor of the sections that carry, and d load / d movement."""
    active, rows, count = workspace.active, levers.rows[i], len(movements.step)
    lever, matrix = movements.lever, movements.matrix
    for k in range(count):
        line = lever[k]
        for a in range(carried):
            n = active[a]
            line[a] = rows[n, k]
            further, turn = turning(lines, i, n, workspace.ahead[n])
            if turn != 0.0:
                line[a] += turn * further * levers.ahead[levers.mesh[n], k]
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
def _newton_step(lines, i, levers, load, force, carried, moved, workspace, movements):
    """Solve the linearised equations; change the movements. New forces are in ``workspace.loaded``."""
    active, count = workspace.active, len(moved)
    lever, matrix, step = movements.lever, movements.matrix, movements.step
    # With the factor U^T U all that is needed between movements are products of what U^-T makes of levers and gaps.
    _stiffness(lines, i, levers, force, carried, workspace, movements)
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
    _solve_held(matrix, step)
    for k in range(count):
        moved[k] += step[k]
        for a in range(carried):
            workspace.loaded[a] += moved[k] * lever[k, a]
    solve_upper(workspace.factor, carried, workspace.loaded)
    for a in range(carried):
        workspace.loaded[a] = -workspace.loaded[a]


@compiled
def _solve_held(matrix, vector):
    """Solve a symmetric system in place; movements that nothing holds get 0."""
    size = len(vector)
    for k in range(size):
        own = matrix[k, k]
        for m in range(k):
            own -= matrix[m, k] ** 2
        loose = own <= LOOSE * matrix[k, k]
        matrix[k, k] = np.sqrt(own) if not loose else 1.0
        for j in range(k + 1, size):
            rest = matrix[k, j]
            for m in range(k):
                rest -= matrix[m, k] * matrix[m, j]
            matrix[k, j] = 0.0 if loose else rest / matrix[k, k]
        if loose:
            vector[k] = 0.0
            for m in range(k):
                matrix[m, k] = 0.0
        for m in range(k):
            vector[k] -= matrix[m, k] * vector[m]
        vector[k] /= matrix[k, k]
    for k in range(size - 1, -1, -1):
        for m in range(k + 1, size):
            vector[k] -= matrix[k, m] * vector[m]
        vector[k] /= matrix[k, k]


@compiled
def _place(lines, i, levers, moved, workspace):
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
