"""Line contact with the line loads themselves as unknowns: exact, nothing trained, nothing interpolated over the angle.

To first order in the displacements all but the law of the line load is linear: with F the forces of the sections
that carry load (along the transverse line of action, w = F / width), their gaps are

    g = g_0 + e + l lead + D F + delta(w),    D = W C W^T,                                                        (1)

g_0 between the undeformed flanks in their kinematic position, e what the flanks deviate by, l the levers, W the shares
and directions by which nodes carry the sections, C the compliance between flank nodes, delta the approach of
`pmor.contact.line_contact`. (Under a pinion's corner l turns with the lead, and so little that nothing below depends on
it.) Sought are F > 0 with g = 0, and g >= 0 elsewhere, in balance with the torque, -l F = T, or
under a given lead. delta rises with the load, and D with its slopes is symmetric and positive definite
(`pmor.fe.surface_layer`): it is the minimum of a strictly convex energy, so there is one solution, and Newton with an
active set finds it (Johnson, Contact Mechanics 1985, ch. 4; Portugal, Judice & Vicente, Math. Comp. 63 (1994) 625).
Neither D nor g_0 depends on torque or deviations.

Derivatives follow from a factor of the same matrix: with M = D + delta'/width of the sections that carry, l_t the
slopes of levers that turn, and y = M^-1 l,

    d torque / d lead = l y - l_t F,    d lead / d e_n = -y_n / (d torque / d lead),                               (2)

the second at the same torque: a deviation moves the lead as the torque moves the section that deviates (Maxwell). They
are those of the present sections: both jump a little where one begins to carry, as soft as the law's delta' under the
least load, and where a patch of contact comes to a sharp edge, with the law's slope there.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pmor.arrays import BoolArray, FloatArray, IntArray
from pmor.contact.kernels.compiling import allocating, compiled, inlined
from pmor.contact.kernels.line import approach_of
from pmor.contact.kernels.linear import cholesky, solve_factored
from pmor.contact.kernels.tip_corner import LineLaw, stored_law

# Newton steps, and after how many of them sections change sides singly.
MAX_STEPS, PATIENCE = 60, 20
# The change of the forces by the last step, squared, over the force and the largest one: the law is quadratic in it.
TOLERANCE = 1e-11
# Sections are looked at that stand off by less than this share of the approach, were the flanks rigid.
NEARBY = 0.2
# Of that distance: gaps below it have no sign.
ROUND_OFF = 1e-9
# Where a stored law has its least load, and the share of it with which a section begins: on the law's linear part, from
# where one step finds any load that is smaller still. The least load itself is, to rounding, beyond it.
LEAST, BEGINNING = LineLaw._fields.index("least"), 0.5


class LineResults(NamedTuple):
    """What `solve_lines` fills, for D torques or leads.

    Attributes
    ----------
    lead : ndarray, shape (D, A)
        rad.
    steps : ndarray of int, shape (D, A)
    converged : ndarray of bool, shape (D, A)
    force : ndarray, shape (D, A, N)
        Along the transverse line of action, N.
    stiffness : ndarray, shape (D, A)
        Tangent d torque / d lead of the nonlinear solution, N mm / rad; 0 where nothing carries.
    sensitivity : ndarray, shape (D, A, N) or (0, 0, 0)
        d lead / d deviation of each section at the same torque, rad/mm; not filled where it is of size 0.
    """

    lead: FloatArray
    steps: IntArray
    converged: BoolArray
    force: FloatArray
    stiffness: FloatArray
    sensitivity: FloatArray


class _Room(NamedTuple):
    """Work space of one solution with N unknowns at most.

    Attributes
    ----------
    free : ndarray, shape (N,)
        Gaps under no load at lead 0, mm.
    carries : ndarray of bool, shape (N,)
    active : ndarray of int, shape (N,)
        Those that carry, in order.
    matrix, factor : ndarray, shape (N, N)
    loaded, levered : ndarray, shape (N,)
        Solutions with the gaps and with the levers on the right-hand side.
    """

    free: FloatArray
    carries: BoolArray
    active: IntArray
    matrix: FloatArray
    factor: FloatArray
    loaded: FloatArray
    levered: FloatArray


@inlined
def _product(block, to_row, to, by_row, by, parts):
    """Product of two gradients with the compliance between the rows of two sections, shape (rows c, rows c)."""
    # With a size that the compiler knows loops are unrolled: half the time of a sweep.
    if parts == 2:
        return _bilinear(8, block, parts * to_row, to, parts * by_row, by)
    return _bilinear(12, block, parts * to_row, to, parts * by_row, by)


@inlined
def _bilinear(size, block, first, to, start, by):
    """Sum of to[a] block[first + a, start + b] by[b], four columns at a time."""
    total = 0.0
    for b in range(0, size, 4):
        one = two = three = four = 0.0
        for a in range(size):
            value, line = to[a], block[first + a]
            one += value * line[start + b]
            two += value * line[start + b + 1]
            three += value * line[start + b + 2]
            four += value * line[start + b + 3]
        total += one * by[b] + two * by[b + 1] + three * by[b + 2] + four * by[b + 3]
    return total


@inlined
def _between(lines, i, n, m, compliance, sections):
    """Flexibility between two sections."""
    low, high = min(n, m), max(n, m)
    apart = high // sections - low // sections
    if apart >= len(compliance[0]):
        return 0.0
    s, t, parts = low % sections, high % sections, lines.gradient.shape[3] // 4
    row, gradient = lines.row[i], lines.gradient[i]
    # Pinion teeth count as tooth pairs do, wheel teeth against them.
    total = _product(compliance[0][apart, t, s], row[high, 0], gradient[high, 0], row[low, 0], gradient[low, 0], parts)
    return total + _product(compliance[1][apart, s, t], row[low, 1], gradient[low, 1], row[high, 1], gradient[high, 1],
                            parts)  # fmt: skip


@compiled
def _make_ready(lines, i, n, compliance, sections):
    """Fill the flexibility between section `n` and all those that are ready."""
    flexibility = lines.flexibility[i]
    lines.ready[i, n] = True
    for m in range(len(lines.gap[i])):
        if lines.ready[i, m]:
            flexibility[n, m] = flexibility[m, n] = _between(lines, i, n, m, compliance, sections)


@compiled
def _make_likely_ready(lines, deviation, drive, held, rate, force, width, compliance, likely, room):
    """Make those sections ready that a drive lets begin to carry, at all angles.

    The compliance between two sections is larger than the memory next to the processor: it is read once for all angles.
    """
    angles, size = lines.gap.shape
    count = 0
    for i in range(angles):
        _set_free(lines, i, deviation, room)
        _start(lines, i, drive, held, rate, force, False, room)
        for n in range(size):
            likely[i, n] = room.carries[n] and not lines.ready[i, n]
            count += likely[i, n]
    if count == 0:
        return
    for n in range(size):
        for i in range(angles):
            lines.ready[i, n] |= likely[i, n]
        for m in range(n + 1):
            for i in range(angles):
                if lines.ready[i, n] and lines.ready[i, m] and (likely[i, n] or likely[i, m]):
                    value = _between(lines, i, n, m, compliance, len(width))
                    lines.flexibility[i, n, m] = lines.flexibility[i, m, n] = value


@inlined
def _set_free(lines, i, deviation, room):
    for n in range(len(room.free)):
        room.free[n] = lines.gap[i, n] + (deviation[i, n] if len(deviation) > 0 else 0.0)


@allocating
def solve_lines(lines, deviation, drives, held, rate, width, compliance, corners, results):
    """Solve all angles under all torques or leads.

    Parameters
    ----------
    lines : Lines
        Flexibilities are made ready as they are needed.
    deviation : ndarray, shape (A, N) or (0, 0)
        What both flanks deviate by, mm.
    drives : ndarray, shape (D,)
        Torques (N mm) or leads (rad).
    held : bool
        Whether they are leads.
    rate : float
        Approach of the flanks to expect per torque, mm / (N mm).
    width : ndarray, shape (S,)
        Of the sections, with their images, mm.
    compliance : two ndarrays, shape (reach + 1, S, S, rows c, rows c)
        Between sections of the flanks of teeth 0, 1, ... apart, of pinion and wheel, mm/N.
    corners : two Corner
        Of the flanks of pinion and wheel.
    results : LineResults
        Filled.
    """
    size = lines.gap.shape[1]
    room = _Room(
        np.empty(size), np.empty(size, dtype=np.bool_), np.empty(size, dtype=np.int64), np.empty((size, size)),
        np.empty((size, size)), np.empty(size), np.empty(size),
    )  # fmt: skip
    likely = np.empty(lines.gap.shape, dtype=np.bool_)
    _make_likely_ready(
        lines, deviation, np.max(drives), held, rate, results.force[0, 0], width, compliance, likely, room
    )
    for i in range(len(lines.first_pair)):
        _set_free(lines, i, deviation, room)
        for d in range(len(drives)):
            force = results.force[d, i]
            lead, steps, count, stiffness = _solve(
                lines, i, drives[d], held, rate, width, compliance, corners, force, False, room
            )
            results.lead[d, i], results.steps[d, i], results.converged[d, i] = lead, steps, count >= 0
            results.stiffness[d, i] = stiffness
            if results.sensitivity.size > 0 and count > 0:
                results.stiffness[d, i] = _differentiate(
                    lines, i, lead, force, width, compliance, corners, room, results.sensitivity[d, i]
                )


@allocating
def solve_leads(lines, deviation, leads, rate, width, compliance, corners, force, torque, stiffness):
    """Solve each angle under a lead of its own, from the forces found there before.

    Parameters
    ----------
    lines, deviation, rate, width, compliance, corners
        As in `solve_lines`.
    leads : ndarray, shape (A,)
        rad.
    force : ndarray, shape (A, N)
        Replaced: forces to begin with, N; an angle where all are 0 starts cold.
    torque, stiffness : ndarray, shape (A,)
        Filled: N mm, and its derivative by the lead, N mm / rad; NaN where it does not converge.
    """
    size = lines.gap.shape[1]
    room = _Room(
        np.empty(size), np.empty(size, dtype=np.bool_), np.empty(size, dtype=np.int64), np.empty((size, size)),
        np.empty((size, size)), np.empty(size), np.empty(size),
    )  # fmt: skip
    for i in range(len(leads)):
        _set_free(lines, i, deviation, room)
        warm, count, slope = np.max(force[i]) > 0.0, -1, 0.0
        if warm:
            _, _, count, slope = _solve(
                lines, i, leads[i], True, rate, width, compliance, corners, force[i], True, room
            )
        # Sections that all let go on the way may find no way back.
        if count <= 0:
            _, _, count, slope = _solve(
                lines, i, leads[i], True, rate, width, compliance, corners, force[i], False, room
            )
        torque[i], stiffness[i] = 0.0, slope
        for n in range(size):
            further, turning = _turning(lines, i, n, leads[i])
            torque[i] -= (lines.lever[i, n] + turning * further) * force[i, n]
        if count < 0:
            torque[i] = stiffness[i] = np.nan
            force[i] = 0.0


@compiled
def _differentiate(lines, i, lead, force, width, compliance, corners, room, sensitivity):
    """Fill the derivatives of the lead at a solution; return the stiffness there."""
    # The factor of the last step is that of the state before it, and makes them up to 1e-5 wrong.
    count = _linearise(lines, i, lead, force, width, compliance, corners, room)
    for a in range(count):
        sensitivity[room.active[a]] = room.levered[a]
    solve_factored(room.factor, count, room.levered)
    stiffness = 0.0
    for a in range(count):
        n = room.active[a]
        _, turning = _turning(lines, i, n, lead)
        stiffness += sensitivity[n] * room.levered[a] - turning * force[n]
    for a in range(count):
        sensitivity[room.active[a]] = -room.levered[a] / stiffness
    return stiffness


@compiled
def _start(lines, i, drive, held, rate, force, warm, room):
    """Choose the sections to begin with and their forces; return the lead, and the gap up to which others count.

    Where `warm`, those are what `force` holds.
    """
    free, lever, carries, size = room.free, lines.lever[i], room.carries, len(room.free)
    lead = drive
    if not held:
        touch = np.inf  # the least lead at which rigid flanks touch
        for n in range(size):
            touch = min(touch, free[n] / -lever[n])
        lead = touch + drive * rate / -lever[0]
    depth, count = 0.0, 0
    for n in range(size):
        rigid = free[n] + lever[n] * lead
        carries[n] = force[n] > 0.0 if warm else rigid < 0.0
        depth, count = max(depth, -rigid), count + carries[n]
    if warm:
        return lead, NEARBY * depth
    torque = depth / rate / -lever[0] if held else drive
    for n in range(size):
        force[n] = torque / (-lever[n] * count) if carries[n] else 0.0
    return lead, NEARBY * depth


@compiled
def _solve(lines, i, drive, held, rate, width, compliance, corners, force, warm, room):
    """Newton with an active set at one angle; return lead, steps, sections that carry, and the stiffness.

    `force` is filled, and ``room.levered`` with M^-1 l of the sections that carry; there are -1 where it does not
    converge.
    """
    lead, nearby = _start(lines, i, drive, held, rate, force, warm, room)
    for step in range(1, MAX_STEPS + 1):
        count = _linearise(lines, i, lead, force, width, compliance, corners, room)
        if count == 0:
            return lead, step, 0 if held else -1, 0.0
        lead, stiffness = _newton_step(lines, i, drive, held, lead, force, count, room)
        settled, error = _accept(lines, i, count, width, force, room)
        single = step > PATIENCE
        if not (single and error > TOLERANCE):
            settled = _touch(lines, i, lead, nearby, count, width, compliance, force, single, room) and settled
        if settled and error <= TOLERANCE:
            return lead, step, count, stiffness
    return lead, MAX_STEPS, -1, 0.0


@compiled
def _turning(lines, i, n, lead):
    """How far the lead is beyond the one that brings the pinion's corner into contact, and the lever's slope there."""
    further = lead - lines.corner_lead[i, n]
    return (further, lines.lever_slope[i, n]) if further > 0.0 else (0.0, 0.0)


@compiled
def _linearise(lines, i, lead, force, width, compliance, corners, room):
    """Gather the linearised equations of the sections that carry; return their number."""
    sections, law, flexibility, active = len(width), lines.law[i], lines.flexibility[i], room.active
    count = 0
    for n in range(len(room.free)):
        if room.carries[n]:
            if not lines.ready[i, n]:
                _make_ready(lines, i, n, compliance, sections)
            active[count] = n
            count += 1
    for a in range(count):
        n = active[a]
        across = width[n % sections]
        load = force[n] / across
        approach, slope = approach_of(load, stored_law(law[n]), corners)
        further, turning = _turning(lines, i, n, lead)
        # The gap 1/2 turning further^2 linearised about the present lead.
        room.loaded[a] = room.free[n] + turning * further * (0.5 * further - lead) + approach - slope * load
        room.levered[a] = lines.lever[i, n] + turning * further
        line = room.matrix[a]
        for b in range(a, count):
            line[b] = flexibility[n, active[b]]
        line[a] += slope / across
    cholesky(room.matrix, count, room.factor)
    return count


@compiled
def _newton_step(lines, i, drive, held, lead, force, count, room):
    """Solve the linearised equations; return the lead and the stiffness. New forces are left in ``room.loaded``."""
    solve_factored(room.factor, count, room.loaded)
    solve_factored(room.factor, count, room.levered)
    torque, stiffness = drive, 0.0
    for a in range(count):
        n = room.active[a]
        further, turning = _turning(lines, i, n, lead)
        lever = lines.lever[i, n] + turning * further
        torque -= lever * room.loaded[a] + turning * force[n] * lead
        stiffness += lever * room.levered[a] - turning * force[n]
    if not held:
        lead = torque / stiffness
    for a in range(count):
        room.loaded[a] = -room.loaded[a] - lead * room.levered[a]
    return lead, stiffness


@compiled
def _accept(lines, i, count, width, force, room):
    """Take over the new forces; sections that would pull let go. Return whether none did, and the change."""
    settled, error, largest = True, 0.0, 0.0
    for a in range(count):
        largest = max(largest, room.loaded[a])
    for a in range(count):
        n = room.active[a]
        least = lines.law[i, n, LEAST] * width[n % len(width)]
        new = room.loaded[a]
        if new > 0.0:
            error = max(error, (new - force[n]) ** 2 / (max(new, least) * largest))
            force[n] = new
            continue
        settled = False
        # The law is steeper the smaller the load: what pulls here may still push there.
        room.carries[n] = force[n] > least
        force[n] = BEGINNING * least if room.carries[n] else 0.0
    return settled, error


@compiled
def _touch(lines, i, lead, nearby, count, width, compliance, force, single, room):
    """Let sections carry whose gaps have closed, one at a time where `single`; return whether there was none."""
    settled, size = True, len(room.free)
    for n in range(size):
        further, turning = _turning(lines, i, n, lead)
        rigid = room.free[n] + lines.lever[i, n] * lead + 0.5 * turning * further**2
        if room.carries[n] or rigid > nearby:
            continue
        if not lines.ready[i, n]:
            _make_ready(lines, i, n, compliance, len(width))
        gap, line = rigid, lines.flexibility[i, n]
        for a in range(count):
            gap += line[room.active[a]] * force[room.active[a]]
        if gap < -ROUND_OFF * nearby:
            room.carries[n], settled = True, False
            force[n] = BEGINNING * lines.law[i, n, LEAST] * width[n % len(width)]
            if single:
                break
    return settled
