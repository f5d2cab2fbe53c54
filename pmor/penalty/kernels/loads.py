"""Contact forces of solved states, point by point, and where on the flanks they act."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.core.compiling import allocating, compiled
from pmor.penalty.kernels.types import FIRST, FIRST_ROW, OFFSET


class Loads(NamedTuple):
    """Forces at contact points, one state behind the other, in N, mm and rad: see `pmor.results.loads.ContactLoads`."""

    pair: IntArray
    slave: IntArray
    column: IntArray
    force: FloatArray
    lever: FloatArray
    mate_lever: FloatArray
    roll: FloatArray
    z: FloatArray


@allocating
def empty_loads(size):
    """Return uninitialised loads."""
    return Loads(
        pair=np.empty(size, dtype=np.int64), slave=np.empty(size, dtype=np.int64),
        column=np.empty(size, dtype=np.int64), force=np.empty(size), lever=np.empty(size), mate_lever=np.empty(size),
        roll=np.empty((size, 2)), z=np.empty(size),
    )  # fmt: skip


@compiled
def _copy_loads(loads, count, to):
    for n in range(count):
        to.pair[n], to.slave[n], to.column[n] = loads.pair[n], loads.slave[n], loads.column[n]
        to.force[n], to.lever[n], to.mate_lever[n] = loads.force[n], loads.lever[n], loads.mate_lever[n]
        to.roll[n, 0], to.roll[n, 1], to.z[n] = loads.roll[n, 0], loads.roll[n, 1], loads.z[n]


@allocating
def with_space(loads, size):
    """Return loads of at least `size`, doubled where the present ones are fewer."""
    if size <= len(loads.z):
        return loads
    larger = empty_loads(max(size, 2 * len(loads.z)))
    _copy_loads(loads, len(loads.z), larger)
    return larger


@allocating
def trimmed(loads, size):
    """Return the first `size` loads alone."""
    exact = empty_loads(size)
    _copy_loads(loads, size, exact)
    return exact


@compiled
def list_loads(listed, gears, patches, points, count, loads):
    """Write the forces of a solved state behind the first `count`; return how many there are then.

    Where a force acts is the average of the nodes that carry it, by their shares: over the width exactly, over the
    profile by arc length, which is proportional to the square of the roll angle.
    """
    for n in range(listed):
        if points.gap[n] >= 0.0:
            continue
        p, slave = points.pair[n], points.slave[n]
        loads.pair[count], loads.slave[count] = patches.tooth_pair[p], slave
        loads.column[count], loads.force[count] = points.place[n, 1], -points.stiffness[n] * points.gap[n]
        loads.lever[count], loads.mate_lever[count] = points.lever[n], points.mate_lever[n]
        for side in range(2):
            gear = slave ^ side
            square, z = _place_on_flank(gears[gear], patches.windows[p, gear], points, n, side)
            loads.roll[count, gear] = np.sqrt(square)
            if side == 0:
                loads.z[count] = z
        count += 1
    return count


@compiled
def _place_on_flank(flank, window, points, n, side):
    """Squared roll angle and z, averaged over the nodes of one side of point `n` by their shares."""
    columns, weight, half = flank.nodes.shape[1], points.weight, points.node.shape[1] // 2
    first = half * side
    normal_x = normal_y = normal_z = square = z = 0.0
    for a in range(first, first + half):  # the shares add up to 1, and leave the direction
        normal_x += weight[n, a, 0]
        normal_y += weight[n, a, 1]
        normal_z += weight[n, a, 2]
    scale = 1.0 / (normal_x**2 + normal_y**2 + normal_z**2)
    for a in range(first, first + half):
        share = weight[n, a, 0] * normal_x + weight[n, a, 1] * normal_y + weight[n, a, 2] * normal_z
        number = points.node[n, a] - window[OFFSET]
        row = number // columns + window[FIRST_ROW] - window[FIRST]
        share *= scale
        square += share * flank.roll[row] ** 2
        z += share * flank.nodes[row, number % columns, 2]
    return square, z
