"""Motion over time, step by step: the free motion of masses on springs is exact, meshes kick them between.

A step is half a drift, the kick of the meshes, and another half (Strang 1968). The kick is that of forces less h^2 / 12
of how much they change along the acceleration that they make: then what is left of order h^2 moves the places at which
states are looked at, no frequency (Rowlands, J. Comput. Phys. 97 (1991) 235). Where flanks part and meet, and the
force has a kink, an error of that order stays.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import types
from numba.extending import overload

from pmor.core.arrays import FloatArray
from pmor.core.compiling import allocating, compiled
from pmor.dynamics.kernels.hub_table import PER_MESH, ClosedMeshes, closed_forces
from pmor.dynamics.kernels.laws import mesh_force


class FreeMotion(NamedTuple):
    """Motion of n displacements about rest without meshes, in cycles, and what r coordinates of meshes are of it.

    The speed is even in each of C cycles. Drifts are four numbers for each mode where these are by themselves,
    displacement by displacement and by velocity, velocity by both: (C, 4, n); else matrices from columns to rows,
    (C, 2n, 2n).
    """

    half: FloatArray  # Over half a step
    whole: FloatArray
    step: FloatArray  # shape (C,): Length of a step, s
    lever: FloatArray  # shape (r, n): Coordinates by displacements
    push: FloatArray  # shape (r, n): Accelerations per force of the meshes
    mobility: FloatArray  # shape (r, r): Accelerations of the coordinates against their forces
    # shape (r,): Coordinates and forces at rest
    along: FloatArray
    force: FloatArray


class Pushed(NamedTuple):
    """Coordinates of the meshes, their forces (r,), the slopes of these (r, r), and work space."""

    along: FloatArray
    force: FloatArray
    slope: FloatArray
    approach: FloatArray
    one: FloatArray
    beyond: FloatArray
    matrix: FloatArray


@compiled
def _push_of_pair(law, place, pushed):
    pushed.force[0], pushed.slope[0, 0] = mesh_force(law, 2.0 * np.pi * place, pushed.along[0])
    return not np.isnan(pushed.force[0])


@compiled
def _push_of_meshes(law, place, pushed):
    size, matrix = len(pushed.force), pushed.matrix
    known = closed_forces(law, place, pushed.along, pushed.approach, pushed.one, pushed.beyond, matrix, pushed.force)
    for a in range(size):
        for b in range(size):
            pushed.slope[a, b] = 0.0
            for c in range(size):
                pushed.slope[a, b] += pushed.beyond[a, c] * matrix[c, size + 1 + b]
    return known


def push(law, place, pushed):
    """Fill the forces of meshes and their slopes at a place of the cycle and at coordinates; whether they are known."""
    return (_push_of_meshes if isinstance(law, ClosedMeshes) else _push_of_pair)(law, place, pushed)


@overload(push)
def _compiled_push(law, place, pushed):
    meshes = isinstance(law, types.NamedTuple) and law.instance_class is ClosedMeshes
    kernel = _push_of_meshes if meshes else _push_of_pair
    return lambda law, place, pushed: kernel(law, place, pushed)


@compiled
def _drift(values, state, new):
    """Carry displacements and velocities through a drift."""
    size, n = len(state), len(state) // 2
    if values.shape[1] == n:
        for k in range(n):
            z, v = state[k], state[n + k]
            state[k] = values[0, k] * z + values[1, k] * v
            state[n + k] = values[2, k] * z + values[3, k] * v
        return
    for i in range(size):
        new[i] = 0.0
    for k in range(size):
        for i in range(size):
            new[i] += values[k, i] * state[k]
    for i in range(size):
        state[i] = new[i]


@compiled
def _kick(law, free, place, step, state, pushed):
    """Change the velocities by the meshes' impulse of a step; whether their forces are known."""
    size, n = free.lever.shape
    for a in range(size):
        along = free.along[a]
        for i in range(n):
            along += free.lever[a, i] * state[i]
        pushed.along[a] = along
    if not push(law, place, pushed):
        return False
    for a in range(size):
        pushed.force[a] -= free.force[a]
    for a in range(size):
        impulse = pushed.force[a]
        for b in range(size):
            for c in range(size):
                impulse -= step * step / 12.0 * pushed.slope[a, b] * free.mobility[b, c] * pushed.force[c]
        for i in range(n):
            state[n + i] += step * impulse * free.push[a, i]
    return True


@allocating
def march(law, free, first, steps, state, seen):
    """Carry displacements and velocities about rest through cycles; whether all forces were known.

    Parameters
    ----------
    law : force law
    free : FreeMotion
    first : float
        Cycles before these.
    steps : int
        Of each sample.
    state : ndarray, shape (2n,)
        That at the end in the end.
    seen : ndarray, shape (C, samples, 2n)
        Filled: states at the ends of the samples of each cycle. Of no length along the last axis: they are not kept.
    """
    size, samples, kept = len(free.lever), seen.shape[1], seen.shape[2]
    new = np.empty(len(state))
    pushed = Pushed(
        np.empty(size), np.empty(size), np.empty((size, size)), free.along.copy(), np.empty((PER_MESH, 3)),
        np.empty((size, size)), np.empty((size, 2 * size + 1)),
    )  # fmt: skip
    for c in range(len(free.step)):
        for s in range(samples):
            _drift(free.half[c], state, new)
            for k in range(steps):
                place = first + c + (s + (k + 0.5) / steps) / samples
                if not _kick(law, free, place, free.step[c], state, pushed):
                    return False
                _drift(free.whole[c] if k + 1 < steps else free.half[c], state, new)
            for i in range(kept):
                seen[c, s, i] = state[i]
    return True
