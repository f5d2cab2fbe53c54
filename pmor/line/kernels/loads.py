"""Line contact with the line loads themselves as unknowns: exact, nothing trained, nothing interpolated over the angle.

To first order in the displacements all but the law of the line load is linear: with F the forces of the sections
that carry load (along the transverse line of action, w = F / width), their gaps are

    g = g_0 + e + l advance + D F + delta(w),    D = W C W^T,                                                        (1)

g_0 between the undeformed flanks in their kinematic position, e the deviations of the flanks, l the levers, W the
shares and directions by which nodes carry the sections, C the compliance between flank nodes, delta the approach of
`pmor.line.hertz`. (Under a pinion's corner l turns with the advance, and so little that nothing below depends on it.)
Sought are F > 0 with g = 0, and g >= 0 elsewhere, in balance with the torque, -l F = T, or under a given advance. delta
rises with the load, and D with its slopes is symmetric and positive definite (`pmor.line.face_ends`): it is the
minimum of a strictly convex energy, so there is one solution, and Newton with an active set finds it (Johnson, Contact
Mechanics 1985, ch. 4; Portugal, Judice & Vicente, Math. Comp. 63 (1994) 625). Neither D nor g_0 depends on torque or
deviations.

Derivatives follow from a factor of the same matrix: with M = D + delta'/width of the sections that carry, l_t the
slopes of levers that turn, and y = M^-1 l,

    d torque / d advance = l y - l_t F,    d advance / d e_n = -y_n / (d torque / d advance),                       (2)

the second at the same torque: a deviation moves the advance as the torque moves the section that deviates (Maxwell).
They are those of the present sections: both jump a little where one begins to carry, as soft as the law's delta' under
the least load, and where a patch of contact comes to a sharp edge, with the law's slope there.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.core.compiling import allocating, compiled, inlined
from pmor.core.linear import cholesky, solve_factored
from pmor.line.kernels.flexibility import make_all_ready, make_ready
from pmor.line.kernels.law import approach_of
from pmor.line.kernels.tip_corner import LineLaw, stored_law

# Newton steps, and after how many of them sections change sides singly.
MAX_STEPS, PATIENCE = 60, 20
# The change of the forces by the last step, squared, over the force and the largest one: the law is quadratic in it.
TOLERANCE = 1e-11
# Of the torque, what forces may leave over: they may settle in the step that brings a corner into contact.
BALANCED = 1e-8
# Sections are looked at that stand off by less than this share of the approach, were the flanks rigid.
NEARBY = 0.2
# Gaps below this share of that distance have no sign, nor have those below a share of the flanks' own way.
ROUND_OFF, LAST_DIGITS = 1e-9, 1e-15
# Where a stored law has its least load, and the share of it with which a section begins: on the law's linear part, from
# where one step finds any load that is smaller still. The least load itself is, to rounding, beyond it.
LEAST, BEGINNING = LineLaw._fields.index("least"), 0.5


class LineResults(NamedTuple):
    """Results of `solve_lines`, for D torques or advances.

    Attributes
    ----------
    advance : ndarray, shape (D, A)
        rad.
    steps : ndarray of int, shape (D, A)
    converged : ndarray of bool, shape (D, A)
    force : ndarray, shape (D, A, N)
        Along the transverse line of action, N; 0 where not converged.
    torque : ndarray, shape (D, A, P)
        On the pinion by the forces of each tooth pair, N mm.
    stiffness : ndarray, shape (D, A)
        Tangent d torque / d advance of the nonlinear solution, N mm / rad; 0 where nothing carries.
    sensitivity : ndarray, shape (D, A, N) or (0, 0, 0)
        d advance / d deviation of each section at the same torque, rad/mm; not filled where it is of size 0.
    """

    advance: FloatArray
    steps: IntArray
    converged: BoolArray
    force: FloatArray
    torque: FloatArray
    stiffness: FloatArray
    sensitivity: FloatArray


class Workspace(NamedTuple):
    """Workspace of one solution with N unknowns at most.

    Attributes
    ----------
    free, rigid : ndarray, shape (N,)
        Gaps under no load at advance 0, and at the present one, mm.
    ahead : ndarray, shape (N,)
        Advance of each section, rad: the same everywhere in a single pair.
    carries : ndarray of bool, shape (N,)
    active : ndarray of int, shape (N,)
        Those that carry, in order.
    matrix, factor : ndarray, shape (N, N)
    loaded, levered : ndarray, shape (N,)
        Solutions with the gaps and with the levers on the right-hand side.
    """

    free: FloatArray
    rigid: FloatArray
    ahead: FloatArray
    carries: BoolArray
    active: IntArray
    matrix: FloatArray
    factor: FloatArray
    loaded: FloatArray
    levered: FloatArray


@allocating
def new_workspace(size):
    """Return the workspace of a solution with so many unknowns at most."""
    return Workspace(
        free=np.empty(size), rigid=np.empty(size), ahead=np.empty(size), carries=np.empty(size, dtype=np.bool_),
        active=np.empty(size, dtype=np.int64), matrix=np.empty((size, size)), factor=np.empty((size, size)),
        loaded=np.empty(size), levered=np.empty(size),
    )  # fmt: skip


@compiled
def _make_likely_ready(lines, flexibility, deviation, loads, held, rate, width, compliance, likely, workspace):
    """Make those sections ready that the largest load lets begin to carry, at all angles."""
    angles, size = lines.gap.shape
    count = 0
    for i in range(angles):
        set_free(lines, i, deviation, workspace)
        largest = loads[0, i]
        for d in range(1, len(loads)):
            largest = max(largest, loads[d, i])
        _start(lines, i, largest, held, rate, workspace.loaded, False, workspace)
        for n in range(size):
            likely[i, n] = workspace.carries[n] and not flexibility.ready[i, n]
            count += likely[i, n]
    if count > 0:
        make_all_ready(lines, flexibility, likely, compliance, len(width))


@inlined
def set_free(lines, i, deviation, workspace):
    """Fill the gaps under no load at advance 0."""
    for n in range(len(workspace.free)):
        workspace.free[n] = lines.gap[i, n] + (deviation[i, n] if len(deviation) > 0 else 0.0)


@allocating
def solve_lines(lines, flexibility, deviation, loads, held, warm, rate, width, compliance, corners, results):
    """Solve all angles under torques or advances.

    Parameters
    ----------
    lines : Lines
    flexibility : Flexibility
        Workspace of these lines; made ready as it is needed.
    deviation : ndarray, shape (A, N) or (0, 0)
        Deviations of both flanks, added up, mm.
    loads : ndarray, shape (D, A)
        Torques (N mm) or advances (rad) at each angle.
    held : bool
        Whether they are advances.
    warm : bool
        Whether to begin with the forces that the results hold; where these are 0, and where that fails, it begins cold.
    rate : float
        Approach of the flanks to expect per torque, mm / (N mm).
    width : ndarray, shape (S,)
        Of the sections, with their images, mm.
    compliance : two ndarrays, shape (neighbours + 1, S, S, rows c, rows c)
        Between sections of the flanks of teeth 0, 1, ... apart, of pinion and wheel, mm/N.
    corners : two or four Corner
        Of the flanks of pinion and wheel.
    results : LineResults
        Filled.
    """
    size = lines.gap.shape[1]
    workspace = new_workspace(size)
    if not warm:
        likely = np.empty(lines.gap.shape, dtype=np.bool_)
        _make_likely_ready(lines, flexibility, deviation, loads, held, rate, width, compliance, likely, workspace)
    for i in range(len(lines.first_pair)):
        set_free(lines, i, deviation, workspace)
        for d in range(len(loads)):
            force, load, count = results.force[d, i], loads[d, i], -1
            advance, steps, stiffness = 0.0, 0, 0.0
            if warm and np.max(force) > 0.0:
                advance, steps, count, stiffness = _solve(
                    lines, flexibility, i, load, held, rate, width, compliance, corners, force, True, workspace
                )
            # If the active set empties, restart cold.
            if count <= 0:
                advance, steps, count, stiffness = _solve(
                    lines, flexibility, i, load, held, rate, width, compliance, corners, force, False, workspace
                )
            results.advance[d, i], results.steps[d, i], results.converged[d, i] = advance, steps, count >= 0
            results.stiffness[d, i] = stiffness
            if results.sensitivity.size > 0 and count > 0:
                results.stiffness[d, i] = _differentiate(
                    lines, flexibility, i, advance, force, width, compliance, corners, workspace,
                    results.sensitivity[d, i],
                )  # fmt: skip
            if count < 0:
                force[:] = 0.0
            _sum_torques(lines, i, advance, force, results.torque[d, i])


@compiled
def _sum_torques(lines, i, advance, force, torque):
    """Fill the torque on the pinion by the forces of each tooth pair."""
    sections = len(force) // len(torque)
    for pair in range(len(torque)):
        total = 0.0
        for n in range(pair * sections, (pair + 1) * sections):
            if force[n] > 0.0:
                further, turn = turning(lines, i, n, advance)
                total -= (lines.lever[i, n] + turn * further) * force[n]
        torque[pair] = total


@compiled
def _differentiate(lines, flexibility, i, advance, force, width, compliance, corners, workspace, sensitivity):
    """Fill the derivatives of the advance at a solution; return the stiffness there."""
    # The factor of the last step is that of the state before it, and makes them up to 1e-5 wrong.
    count = _linearise_at(lines, flexibility, i, advance, force, width, compliance, corners, workspace)
    for a in range(count):
        sensitivity[workspace.active[a]] = workspace.levered[a]
    solve_factored(workspace.factor, count, workspace.levered)
    stiffness = 0.0
    for a in range(count):
        n = workspace.active[a]
        _, turn = turning(lines, i, n, advance)
        stiffness += sensitivity[n] * workspace.levered[a] - turn * force[n]
    for a in range(count):
        sensitivity[workspace.active[a]] = -workspace.levered[a] / stiffness
    return stiffness


@compiled
def _start(lines, i, load, held, rate, force, warm, workspace):
    """Choose the sections to begin with and their forces; return the advance, and the gap up to which others count.

    Where `warm`, those that `force` holds.
    """
    free, lever, carries, size = workspace.free, lines.lever[i], workspace.carries, len(workspace.free)
    advance = load
    if not held:
        touch = np.inf  # the least advance at which rigid flanks touch
        for n in range(size):
            touch = min(touch, free[n] / -lever[n])
        advance = touch + load * rate / -lever[0]
    depth, count = 0.0, 0
    for n in range(size):
        rigid = free[n] + lever[n] * advance
        carries[n] = force[n] > 0.0 if warm else rigid < 0.0
        depth, count = max(depth, -rigid), count + carries[n]
    if warm:
        return advance, NEARBY * depth
    torque = depth / rate / -lever[0] if held else load
    for n in range(size):
        force[n] = torque / (-lever[n] * count) if carries[n] else 0.0
    return advance, NEARBY * depth


@compiled
def _solve(lines, flexibility, i, load, held, rate, width, compliance, corners, force, warm, workspace):
    """Newton with an active set at one angle; return advance, steps, sections that carry, and the stiffness.

    `force` is filled, and ``workspace.levered`` with M^-1 l of the sections that carry; there are -1 where it does not
    converge.
    """
    advance, nearby = _start(lines, i, load, held, rate, force, warm, workspace)
    for step in range(1, MAX_STEPS + 1):
        count = _linearise_at(lines, flexibility, i, advance, force, width, compliance, corners, workspace)
        if count == 0:
            return advance, step, 0 if held else -1, 0.0
        before = advance
        advance, stiffness = _newton_step(lines, i, load, held, advance, force, count, workspace)
        settled, error = accept(lines, i, count, width, force, workspace)
        single = step > PATIENCE
        if not (single and error > TOLERANCE):
            settled = (
                _touch_at(lines, flexibility, i, advance, nearby, count, width, compliance, force, single, workspace)
                and settled
            )
        if (
            settled
            and error <= TOLERANCE
            and (held or _balanced(lines, i, load, before, advance, force, count, workspace))
        ):
            return advance, step, count, stiffness
    return advance, MAX_STEPS, -1, 0.0


@compiled
def _balanced(lines, i, load, before, advance, force, count, workspace):
    """Return whether levers at an advance are those that were linearised before it, so that forces balance the torque.

    They are, but for corners that came into contact or left it; round-off of light loads has no part in it.
    """
    left = 0.0
    for a in range(count):
        n = workspace.active[a]
        further, turn = turning(lines, i, n, before)
        expected = turn * (further + advance - before)
        further, turn = turning(lines, i, n, advance)
        left += (turn * further - expected) * force[n]
    return abs(left) <= BALANCED * abs(load)


@compiled
def turning(lines, i, n, advance):
    """Return the advance beyond the one that brings the pinion's corner into contact, and the lever's slope there."""
    further = advance - lines.corner_advance[i, n]
    return (further, lines.lever_slope[i, n]) if further > 0.0 else (0.0, 0.0)


@compiled
def _linearise_at(lines, flexibility, i, advance, force, width, compliance, corners, workspace):
    """Gather the linearised equations and the levers of the sections that carry; return their number."""
    workspace.ahead[:] = advance
    count = linearise(lines, flexibility, i, force, width, compliance, corners, workspace)
    for a in range(count):
        n = workspace.active[a]
        further, turn = turning(lines, i, n, advance)
        workspace.levered[a] = lines.lever[i, n] + turn * further
    return count


@compiled
def linearise(lines, flexibility, i, force, width, compliance, corners, workspace):
    """Gather the linearised equations of the sections that carry, and factor their matrix; return their number."""
    sections, law, between, active = len(width), lines.law[i], flexibility.between[i], workspace.active
    count = 0
    for n in range(len(workspace.free)):
        if workspace.carries[n]:
            if not flexibility.ready[i, n]:
                make_ready(lines, flexibility, i, n, compliance, sections)
            active[count] = n
            count += 1
    for a in range(count):
        n = active[a]
        across = width[n % sections]
        load = force[n] / across
        approach, slope = approach_of(load, stored_law(law[n]), corners)
        further, turn = turning(lines, i, n, workspace.ahead[n])
        # The gap 1/2 turn further^2 linearised about the present advance.
        workspace.loaded[a] = (
            workspace.free[n] + turn * further * (0.5 * further - workspace.ahead[n]) + approach - slope * load
        )
        line = workspace.matrix[a]
        for b in range(a, count):
            line[b] = between[n, active[b]]
        line[a] += slope / across
    cholesky(workspace.matrix, count, workspace.factor)
    return count


@compiled
def _newton_step(lines, i, load, held, advance, force, count, workspace):
    """Solve the linearised equations; return advance and stiffness. New forces are in ``workspace.loaded``."""
    solve_factored(workspace.factor, count, workspace.loaded)
    solve_factored(workspace.factor, count, workspace.levered)
    torque, stiffness = load, 0.0
    for a in range(count):
        n = workspace.active[a]
        further, turn = turning(lines, i, n, advance)
        lever = lines.lever[i, n] + turn * further
        torque -= lever * workspace.loaded[a] + turn * force[n] * advance
        stiffness += lever * workspace.levered[a] - turn * force[n]
    if not held:
        advance = torque / stiffness
    for a in range(count):
        workspace.loaded[a] = -workspace.loaded[a] - advance * workspace.levered[a]
    return advance, stiffness


@compiled
def accept(lines, i, count, width, force, workspace):
    """Take over the new forces; sections that would pull let go. Return whether none did, and the change."""
    settled, error, largest = True, 0.0, 0.0
    for a in range(count):
        largest = max(largest, workspace.loaded[a])
    for a in range(count):
        n = workspace.active[a]
        least = lines.law[i, n, LEAST] * width[n % len(width)]
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
def _touch_at(lines, flexibility, i, advance, nearby, count, width, compliance, force, single, workspace):
    """Let sections carry whose gaps have closed at an advance; return whether there was none."""
    for n in range(len(workspace.free)):
        further, turn = turning(lines, i, n, advance)
        workspace.rigid[n] = workspace.free[n] + lines.lever[i, n] * advance + 0.5 * turn * further**2
    round_off = max(ROUND_OFF * nearby, LAST_DIGITS * abs(lines.lever[i, 0] * advance))
    return touch(lines, flexibility, i, nearby, round_off, count, width, compliance, force, single, workspace)


@compiled
def touch(lines, flexibility, i, nearby, round_off, count, width, compliance, force, single, workspace):
    """Let sections carry whose gaps have closed, one at a time where `single`; return whether there was none.

    Those that stand off by more than `nearby` without any deflection are not looked at; gaps below `round_off` have no
    sign.
    """
    settled = True
    for n in range(len(workspace.free)):
        if workspace.carries[n] or workspace.rigid[n] > nearby:
            continue
        if not flexibility.ready[i, n]:
            make_ready(lines, flexibility, i, n, compliance, len(width))
        if gap_of(flexibility, i, n, count, force, workspace) < -round_off:
            begin(lines, i, n, width, force, workspace)
            settled = False
            if single:
                break
    return settled


@inlined
def gap_of(flexibility, i, n, count, force, workspace):
    """Return the gap of a section that does not carry: without deflection, and by all that carry."""
    gap, line = workspace.rigid[n], flexibility.between[i, n]
    for a in range(count):
        gap += line[workspace.active[a]] * force[workspace.active[a]]
    return gap


@inlined
def begin(lines, i, n, width, force, workspace):
    """Let a section begin to carry."""
    workspace.carries[n] = True
    force[n] = BEGINNING * lines.law[i, n, LEAST] * width[n % len(width)]
