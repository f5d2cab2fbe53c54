r"""How far the reduced model is from full FE, from the reduced solution alone.

Notation: u displacements of the flanks, C their compliance (both gears), theta the pinion's advance, T its torque,
g = g_0 + W u + l theta the gaps, psi(g) the convex energy of the contact law, with forces p = -psi'(g) and nodal forces
f = W^T p. Equilibrium minimises

    Pi(u, theta) = 1/2 u^T C^-1 u + psi(g_0 + W u + l theta) - T theta,

the reduced model over the displacements u = C F q of its shapes F alone. At its solution the contact law asks for the
forces f, the shapes carry F q, and r = f - F q is left over.

*Bound.* The contact forces of the reduced solution balance the torque exactly, theta being free in both models. They
are therefore admissible in the dual problem, whose value is at most the minimum of Pi, and the difference of the two
values is the hypercircle's (Prager & Synge, Quart. Appl. Math. 5 (1947) 241):

    0 <= Pi_reduced - Pi_full <= 1/2 r^T C r,        r^T C r = f^T C f - q^T F^T C F q.                           (1)

The last form needs the compliance only where contact forces act, because r is orthogonal to the shapes in energy.

*Estimate.* By the envelope theorem theta = -d Pi / dT. So the error of the STE is the derivative of the difference of
energies by the torque, at a fixed angle, and (1), which is nearly an equation when r is small, gives

    STE_full - STE_reduced = r_b d(Pi_reduced - Pi_full)/dT ~ r_b d/dT(1/2 r^T C r) = r_b r^T C dr/dT.             (2)

The change of everything with the torque is a solution with the last Newton matrix of the reduced problem. Where r grows
with the torque, dr/dT = r/T, and (2) becomes r_b r^T C r / T, which is never negative. It is not used: contact that
spreads over the width under load leaves an r that comes and goes, the error can have either sign, and that form was off
by factors of 10 and in sign on tilted axes, where (2) stayed within a factor of 2 or 3.

*Where (1) is a bound.* Where psi is convex and g linear. Points transfer forces by bilinear shares that are not the
derivative of their gaps, and at a tip corner the levers turn with the advance: there it is an estimate. (2) is an
estimate everywhere, with a sign. Points that have only just come to carry let r grow steeply with the torque until the
row is complete, and (2) with it, while the STE goes on as before: up to 0.17 um on 6 x 2 elements, where the largest
error was 0.01 um. Neither includes the discretisation error of full FE.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.core.compiling import allocating, compiled, inlined
from pmor.core.linear import solve_factored
from pmor.penalty.kernels.types import FIRST, FIRST_ROW, OFFSET


class _Patch(NamedTuple):
    """Where a window's unknowns are.

    Attributes
    ----------
    first : int
        Of the window, among the unknowns of all windows.
    on_flank : int
        Of the window, on its flank.
    low, high : int
        Unknowns of the window that carry load: first and last but one.
    """

    first: int
    on_flank: int
    low: int
    high: int


@inlined
def _exchanged_work(block, force, change, to, by, work):
    """Sum of f_to^T C f'_by and f'_to^T C f_by for the forces f and f' on two patches; `work` holds two rows."""
    width = by.high - by.low
    if width <= 0 or to.high <= to.low:
        return 0.0
    # Rows of known beginning and end: the loops over them then run in vector registers, at twice the speed.
    first, second = work[0, :width], work[1, :width]
    first[:], second[:] = 0.0, 0.0
    for i in range(to.low, to.high):
        value, slope = force[to.first + i], change[to.first + i]
        line = block[to.on_flank + i, by.on_flank + by.low : by.on_flank + by.high]
        for j in range(width):
            first[j] += value * line[j]
            second[j] += slope * line[j]
    total = 0.0
    for j in range(width):
        total += first[j] * change[by.first + by.low + j] + second[j] * force[by.first + by.low + j]
    return total


class Discarded(NamedTuple):
    """Workspace for the forces that the active shapes do not carry.

    Attributes
    ----------
    force, change : ndarray, shape (unknowns of all windows,)
        Nodal contact forces, and their derivatives by the torque, N and 1/mm.
    rows : ndarray, shape (2, unknowns of all windows)
    loaded : ndarray of int, shape (pairs, 2, 2)
        Unknowns of each window that carry load: first and last but one.
    """

    force: FloatArray
    change: FloatArray
    rows: FloatArray
    loaded: IntArray


@allocating
def discarded_workspace(position, gears, compliance):
    """Return the workspace of `discarded_energy_slope`; empty where there is no compliance."""
    unknowns = 0
    if len(compliance[0]) > 0:
        unknowns = len(position.work.nodes) * _parts(gears, compliance)
    rows = np.empty((4, unknowns))
    return Discarded(rows[0], rows[1], rows[2:], np.empty((position.patches.pairs, 2, 2), dtype=np.int64))


@compiled
def _parts(gears, compliance):
    """Return how many unknowns a node has."""
    return compliance[0].shape[1] // (gears[0].nodes.shape[0] * gears[0].nodes.shape[1])


@compiled
def discarded_energy_slope(count, gears, patches, active_shapes, work, coordinates, compliance, discarded):
    """Derivative by the torque of the energy of the contact forces that the active shapes do not carry, rad.

    With r the nodal forces that are left over, it is r^T C dr/dT (eq. 2). The change of the state with the torque
    follows from the last Newton matrix, and the part that the active shapes carry from that step's solution, which
    balances the forces on them.

    Parameters
    ----------
    count : int
        Points of the solved state.
    gears : two Gear
    patches, active_shapes, work, coordinates
        As `solve_state` leaves them.
    compliance : two ndarrays, shape (neighbours + 1, n, n)
        Compliance between the loaded flanks of teeth 0, 1, ... apart, of pinion and wheel, mm/N; two or three unknowns
        for each flank node.
    discarded : Discarded
    """
    size, points, response = active_shapes.size, work.workspace.points, work.solution
    response[:size], response[size] = 0.0, 1.0
    solve_factored(work.factor, size + 1, response)
    across, parts = gears[0].nodes.shape[1], _parts(gears, compliance)
    force, change, rows, loaded = discarded.force, discarded.change, discarded.rows, discarded.loaded
    force[:], change[:], loaded[:, :, 0], loaded[:, :, 1] = 0.0, 0.0, len(force), 0
    total, half = 0.0, points.node.shape[1] // 2
    for n in range(count):
        if points.gap[n] >= 0.0:
            continue
        moved, opening, row = 0.0, points.lever[n] * response[size], work.slope[n]
        for j in range(size):
            moved += row[j] * coordinates[j]
            opening += row[j] * response[j]
        load, slope = -points.stiffness[n] * points.gap[n], -points.stiffness[n] * opening
        total -= moved * slope
        p, node = points.pair[n], points.node[n]
        for side in range(2):
            gear = points.slave[n] ^ side
            for a in range(half * side, half * side + half):
                first = parts * node[a]
                for d in range(parts):
                    force[first + d] += load * points.weight[n, a, d]
                    change[first + d] += slope * points.weight[n, a, d]
            # The first and the last of its nodes are the first and the last in the window too.
            start = patches.windows[p, gear, OFFSET]
            loaded[p, gear, 0] = min(loaded[p, gear, 0], parts * (node[half * side] - start))
            loaded[p, gear, 1] = max(loaded[p, gear, 1], parts * (node[half * side + half - 1] - start + 1))
    for gear in range(2):
        for p in range(patches.pairs):
            for q in range(p + 1):
                # Of the wheel, whose teeth count against the pairs, it is the transpose.
                to = _patch(patches, p if gear == 0 else q, gear, parts, across, loaded)
                by = _patch(patches, q if gear == 0 else p, gear, parts, across, loaded)
                block = compliance[gear][patches.tooth_pair[p] - patches.tooth_pair[q]]
                both = _exchanged_work(block, force, change, to, by, rows)
                total += 0.5 * both if p == q else both
    return total


@inlined
def _patch(patches, p, gear, parts, across, loaded):
    window = patches.windows[p, gear]
    on_flank = parts * across * (window[FIRST_ROW] - window[FIRST])
    return _Patch(parts * window[OFFSET], on_flank, loaded[p, gear, 0], loaded[p, gear, 1])
