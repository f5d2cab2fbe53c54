"""Line contact with the line loads themselves as unknowns: exact, nothing trained, nothing interpolated over the angle.

Of one mesh or of several whose gears share bodies, with K movements q of all bodies that are free: the advance of the
one pinion; rotations, and displacements of members that float. To first order in the displacements all but the law of
the line load is linear: with F the forces of the sections that carry load (along the transverse line of action, w = F /
width), their gaps are

    g = g_0 + e + l q + D F + delta(w),    D = W C W^T,                                                              (1)

g_0 between the undeformed flanks in their kinematic position, e the deviations of the flanks, l a row of levers for
each section, W the shares and directions by which nodes carry the sections, C the compliance between flank nodes and
of what bodies that meshes share give way, delta the approach of `pmor.line.hertz`. (Under a pinion's corner l turns
with the advance, and so little that nothing below depends on it.)
Sought are F > 0 with g = 0, and g >= 0 elsewhere, in balance with what acts on each movement from outside, -l^T F = T
(torques, and nothing on planets, idlers and a floating sun), or under given movements. delta rises with the load, and D
with its slopes is symmetric and positive definite (`pmor.line.face_ends`): it is the minimum of a strictly convex
energy, so there is one solution, and Newton with an active set finds it (Johnson, Contact Mechanics 1985, ch. 4;
Portugal, Judice & Vicente, Math. Comp. 63 (1994) 625). Movements are unique too, but for bodies that nothing touches.
Neither D nor g_0 depends on loads or deviations.

With M = D + delta'/width of the sections that carry and l_t the slopes of levers that turn, the stiffness is S = l^T
M^-1 l - l_t F. Derivatives of a figure whose own are a by the movements and c by the forces follow from the same
factor, under the same loads:

    d figure / d e = -M^-1 (c - l v),    v = S^-1 (l^T M^-1 c - a):                                                  (2)

one right-hand side for all deviations. With c = 0 and a of one rotation, it is Maxwell's: a deviation turns a gear as a
torque on the gear loads the section that deviates. They are those of the present sections: they jump a little where one
begins to carry, as soft as the law's delta' under the least load, and where a patch of contact comes to a sharp edge,
with the law's slope there.
"""

from __future__ import annotations

import numpy as np

from pmor.core.compiling import allocating, compiled, inlined
from pmor.core.linear import copy_vector, eliminate, solve_upper
from pmor.line.kernels.flexibility import make_all_ready, make_ready
from pmor.line.kernels.law import approach_of
from pmor.line.kernels.movements import let_go, out_of_balance, place_at, solve_held, take_stiffness, turning
from pmor.line.kernels.starts import follow, likely_sections, set_free, start_with
from pmor.line.kernels.tip_corner import LineLaw, stored_law
from pmor.line.kernels.workspace import new_workspace

# Steps in which all sections change sides that have to, and further ones that change one section each. Sets of seven
# planets of which three carry take up to 250 of these.
PATIENCE, MOST_SINGLE_STEPS = 20, 600
# The change of the forces by the last step, squared, over the force and the largest one: the law is quadratic in it.
TOLERANCE = 1e-11
# Gaps below this share of that distance have no sign, nor have those below a share of the flanks' own way.
ROUND_OFF, LAST_DIGITS = 1e-9, 1e-15
# Where a stored law has its least load, and the share of it with which a section begins: on the law's linear part, from
# where one step finds any load that is smaller still. The least load itself is, to rounding, beyond it.
LEAST, BEGINNING = LineLaw._fields.index("least"), 0.5
# Of the largest force of a section: what rounding leaves of one that stands at its neighbours' gap and carries nothing.
NOTHING = 1e-9
# How a solution begins: with equal forces; with those that the results hold; with those under the load before.
COLD, WARM, FOLLOWING = 0, 1, 2


@allocating
def solve_lines(lines, rows, meshes, compliance, flexibility, deviation, loads, held, start, results):
    """Solve all angles under loads or at movements.

    Parameters
    ----------
    lines : Lines
        Of all meshes one after the other.
    rows : ndarray, shape (A, N, K)
        l: change of the gaps by each movement, mm or 1.
    meshes : Meshes
    compliance : Compliance
    flexibility : Flexibility
        Workspace of these lines; made ready as it is needed.
    deviation : ndarray, shape (A, N) or (0, 0)
        Deviations of both flanks, added up, mm.
    loads : ndarray, shape (D, A, K)
        T at each angle, N mm or N; or movements, rad or mm.
    held : bool
        Whether they are movements.
    start : int
        `COLD`; `WARM`; or `FOLLOWING`, in the order of the loads. Where that has no forces, or fails, it begins cold.
    results : LineResults
        Filled.
    """
    size, count = rows.shape[1:]
    workspace = new_workspace(size, count)
    if start != WARM:
        likely = np.empty(lines.gap.shape, dtype=np.bool_)
        if likely_sections(lines, meshes, flexibility, deviation, loads, held, likely, workspace) > 0:
            make_all_ready(lines, compliance, flexibility, likely)
    for i in range(len(lines.first_pair)):
        set_free(lines, i, deviation, workspace)
        for d in range(len(loads)):
            force, moved, load = results.force[d, i], results.movement[d, i], loads[d, i]
            converged, loose, steps, carried = False, -1, 0, 0
            follows = start == FOLLOWING and d > 0 and results.converged[d - 1, i]
            if follows:
                follow(loads, d, i, results, force)
                copy_vector(results.movement[d - 1, i], moved)
            warm = (start == WARM or follows) and _is_loaded(force)
            copy_vector(force, workspace.force_before)
            copy_vector(moved, workspace.moved_before)
            for attempt in range(4):
                from_before, single = attempt % 2 == 0, attempt > 1
                if from_before and not warm:
                    continue
                if from_before:
                    copy_vector(workspace.force_before, force)
                    copy_vector(workspace.moved_before, moved)
                nearby = start_with(lines, i, meshes, load, held, from_before, force, moved, workspace)
                converged, loose, done, carried = _solve(
                    lines, rows, meshes, compliance, flexibility, i, load, held, nearby, single, force, moved,
                    workspace,
                )  # fmt: skip
                steps += done
                if converged:
                    break
            results.converged[d, i], results.loose[d, i], results.steps[d, i] = converged, loose, steps
            if not converged:
                force[:] = 0.0
            if results.stiffness.size > 0:
                for k in range(count):
                    for m in range(k, count):
                        value = -workspace.matrix[carried + k, carried + m] if converged else 0.0
                        results.stiffness[d, i, k, m] = results.stiffness[d, i, m, k] = value
            if results.torque.size > 0:
                _sum_torques(lines, i, meshes, force, results.torque[d, i], workspace)


@compiled
def _is_loaded(force):
    for n in range(len(force)):
        if force[n] > 0.0:
            return True
    return False


@compiled
def _sum_torques(lines, i, meshes, force, torque, workspace):
    """Fill the torque on the pinion by the forces of each tooth pair."""
    torque[:] = 0.0
    for n in range(len(force)):
        if force[n] > 0.0:
            beyond, turn = turning(lines, i, n, workspace.ahead[n])
            torque[meshes.tooth_pair[n]] -= (lines.lever[i, n] + turn * beyond) * force[n]


@compiled
def _solve(lines, rows, meshes, compliance, flexibility, i, load, held, nearby, single, force, moved, workspace):
    """Newton with an active set; return whether it converged, the movement out of balance or -1, steps, what carries.

    All sections that pull or overlap change sides after each step: it takes a few steps, but may go round in a circle,
    and drop so many that nothing holds a movement on which a load works; then it ends. Or they change singly, which
    takes long and gets there: all meshes begin in contact, so that their forces balance; along each step to the next
    section that lets go the energy of forces in balance falls, and sections that overlap begin one after the other
    (Nocedal & Wright, Numerical Optimization 2006, ch. 16.5). What is loose nevertheless, as levers turn, moves on
    until it touches.
    """
    loose, most, carried = -1, MOST_SINGLE_STEPS if single else PATIENCE, 0
    for step in range(1, most + 1):
        carried = linearise(lines, rows, meshes, compliance, flexibility, i, force, workspace)
        _newton_step(load, held, carried, moved, workspace)
        if single:
            settled, error = _accept_to_first(lines, i, meshes, carried, force, workspace)
        else:
            settled, error = _accept(lines, i, meshes, carried, force, workspace)
        place_at(lines, i, rows, meshes, moved, workspace)
        done, loose = settled and error <= TOLERANCE, -1
        if done and not held:
            loose = out_of_balance(lines, i, rows, meshes, load, force, carried, moved, workspace)
        if loose >= 0 and workspace.loose[loose] != 0.0:
            if not single:
                return False, loose, step, carried
            _deflect(lines, compliance, flexibility, i, nearby, carried, force, workspace)
            touching = let_go(lines, i, rows, meshes, force, moved, workspace)
            if touching < 0:
                return False, loose, step, carried
            _begin(lines, i, meshes, touching, force, workspace)
            place_at(lines, i, rows, meshes, moved, workspace)
            continue
        if not single or (done and loose < 0):
            _deflect(lines, compliance, flexibility, i, nearby, carried, force, workspace)
            done = _touch(lines, i, meshes, nearby, single, force, workspace) and done
        if done and loose < 0:
            return True, -1, step, carried
    return False, loose, most, carried


@compiled
def linearise(lines, rows, meshes, compliance, flexibility, i, force, workspace):
    """Gather the linearised equations of the sections that carry, and factor them; return their number."""
    count = fill_equations(lines, rows, meshes, compliance, flexibility, i, force, workspace)
    last = count + rows.shape[2]
    eliminate(workspace.matrix, count, last, last + 1)
    return count


@compiled
def fill_equations(lines, rows, meshes, compliance, flexibility, i, force, workspace):
    """Gather the linearised equations of the sections that carry; return their number."""
    law, between, active, matrix = lines.law[i], flexibility.between[i], workspace.active, workspace.matrix
    count, movements = 0, rows.shape[2]
    for n in range(len(workspace.free)):
        if workspace.carries[n]:
            if not flexibility.ready[i, n]:
                make_ready(lines, compliance, flexibility, i, n)
            active[count] = n
            count += 1
    last = count + movements
    for k in range(count, last):
        for m in range(k, last + 1):
            matrix[k, m] = 0.0
    for a in range(count):
        n = active[a]
        row, own, mesh, across = matrix[a], between[n], meshes.mesh[n], meshes.width[n]
        for b in range(a, count):
            row[b] = own[active[b]]
        if len(flexibility.further) > 0:
            for b in range(a, count):
                row[b] += flexibility.further[i, n, active[b]]
        load, ahead = force[n] / across, workspace.ahead[n]
        approach, slope = approach_of(load, stored_law(law[n]), meshes.corners, mesh)
        row[a] += slope / across
        beyond, turn = turning(lines, i, n, ahead)
        for k in range(movements):
            row[count + k] = rows[i, n, k] + turn * beyond * meshes.ahead[mesh, k]
        # The gap 1/2 turn beyond^2 linearised about the present advance.
        row[last] = workspace.free[n] + turn * beyond * (0.5 * beyond - ahead) + approach - slope * load
        if turn != 0.0:
            for k in range(movements):
                weight = turn * force[n] * meshes.ahead[mesh, k]
                for m in range(k, movements):
                    matrix[count + k, count + m] += weight * meshes.ahead[mesh, m]
                matrix[count + k, last] -= weight * ahead
    return count


@compiled
def _newton_step(load, held, count, moved, workspace):
    """Solve the factored equations; change the movements. New forces are in ``workspace.loaded``."""
    matrix, stiffness, step, loaded = workspace.matrix, workspace.stiffness, workspace.step, workspace.loaded
    movements = len(moved)
    last = count + movements
    if not held:
        take_stiffness(count, workspace)
        for k in range(movements):
            step[k] = load[k] + matrix[count + k, last]
            for m in range(movements):
                step[k] -= stiffness[k, m] * moved[m]
        solve_held(stiffness, step, workspace.loose)
        for k in range(movements):
            moved[k] += step[k]
    for a in range(count):
        row = matrix[a]
        value = row[last]
        for k in range(movements):
            value += moved[k] * row[count + k]
        loaded[a] = value
    solve_upper(matrix, count, loaded)
    for a in range(count):
        loaded[a] = -loaded[a]


@compiled
def _accept(lines, i, meshes, count, force, workspace):
    """Take over the new forces; sections that would pull let go. Return whether none did, and the change."""
    settled, error, largest = True, 0.0, 0.0
    for a in range(count):
        largest = max(largest, workspace.loaded[a])
    for a in range(count):
        n = workspace.active[a]
        least = lines.law[i, n, LEAST] * meshes.width[n]
        new = workspace.loaded[a]
        if new > 0.0:
            error = max(error, (new - force[n]) ** 2 / (max(new, least) * largest))
            force[n] = new
            continue
        settled = False
        # The law is steeper the smaller the load: a section that pulls here may still push there.
        workspace.carries[n] = force[n] > least
        force[n] = BEGINNING * least if workspace.carries[n] else 0.0
    return settled, error


@compiled
def _accept_to_first(lines, i, meshes, count, force, workspace):
    """Go towards the new forces until a first section lets go; return whether none did, and the change."""
    largest, share, first, error = 0.0, 1.0, -1, 0.0
    for a in range(count):
        largest = max(largest, workspace.loaded[a])
    for a in range(count):
        n, new = workspace.active[a], workspace.loaded[a]
        if new < -NOTHING * largest and force[n] < share * (force[n] - new):
            share, first = force[n] / (force[n] - new), n
    for a in range(count):
        n = workspace.active[a]
        least = lines.law[i, n, LEAST] * meshes.width[n]
        new = max(force[n] + share * (workspace.loaded[a] - force[n]), 0.0)
        error = max(error, (new - force[n]) ** 2 / (max(new, least) * largest))
        force[n] = new
    if first >= 0:
        workspace.carries[first], force[first] = False, 0.0
    return first < 0, error


@compiled
def _deflect(lines, compliance, flexibility, i, nearby, count, force, workspace):
    """Fill the gaps of sections that do not carry, with the deflection by all that carry.

    Those that stand off by less than `nearby` but for the deflection of their own mesh are made ready.
    """
    gap, active, between, size = workspace.gap, workspace.active, flexibility.between[i], len(workspace.free)
    for n in range(size):
        gap[n] = workspace.rigid[n]
    for a in range(count):
        load, row = force[active[a]], between[active[a]]
        for n in range(size):
            gap[n] += load * row[n]
    if len(flexibility.further) > 0:
        for a in range(count):
            for n in range(size):
                gap[n] += force[active[a]] * flexibility.further[i, active[a], n]
    for n in range(size):
        if not workspace.carries[n] and not flexibility.ready[i, n] and gap[n] <= nearby:
            make_ready(lines, compliance, flexibility, i, n)
            gap[n] = workspace.rigid[n]
            for a in range(count):
                gap[n] += between[n, active[a]] * force[active[a]]
                if len(flexibility.further) > 0:
                    gap[n] += flexibility.further[i, n, active[a]] * force[active[a]]


@compiled
def _touch(lines, i, meshes, nearby, single, force, workspace):
    """Let sections carry whose gaps have closed, where `single` the one that overlaps most; return whether none had."""
    deepest, depth, settled = -1, 0.0, True
    for n in range(len(force)):
        round_off = max(ROUND_OFF * nearby, LAST_DIGITS * abs(workspace.rigid[n] - workspace.free[n]))
        if not workspace.carries[n] and workspace.gap[n] < -round_off:
            settled = False
            if not single:
                _begin(lines, i, meshes, n, force, workspace)
            elif workspace.gap[n] < depth:
                deepest, depth = n, workspace.gap[n]
    if deepest >= 0:
        _begin(lines, i, meshes, deepest, force, workspace)
    return settled


@inlined
def _begin(lines, i, meshes, n, force, workspace):
    """Let a section begin to carry."""
    workspace.carries[n] = True
    force[n] = BEGINNING * lines.law[i, n, LEAST] * meshes.width[n]
