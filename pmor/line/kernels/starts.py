"""Where the solution of line loads begins (`pmor.line.kernels.loads`): sections that carry, and their forces."""

from __future__ import annotations

import numpy as np

from pmor.core.compiling import compiled, inlined

# Sections are made ready that stand off by less than this share of the approach, were the flanks rigid.
NEARBY = 0.2
# Of the load of a section before: less is not expected of it under the next one.
FADING = 0.1


@inlined
def set_free(lines, i, deviation, workspace):
    """Fill the gaps under no load at q = 0."""
    for n in range(len(workspace.free)):
        workspace.free[n] = lines.gap[i, n] + (deviation[i, n] if len(deviation) > 0 else 0.0)


@compiled
def likely_sections(lines, meshes, flexibility, deviation, loads, held, likely, workspace):
    """Fill those sections that the loads let begin to carry, at all angles, and are not ready; return their number."""
    angles, size = lines.gap.shape
    count = 0
    for i in range(angles):
        set_free(lines, i, deviation, workspace)
        first = 0
        while first < size:
            mesh, last, touch, reach = meshes.mesh[first], first, np.inf, -np.inf
            while last < size and meshes.mesh[last] == mesh:
                touch = min(touch, workspace.free[last] / -lines.lever[i, last])
                last += 1
            for d in range(len(loads)):
                reach = max(reach, _expected(lines, i, meshes, loads[d, i], held, first, touch)[0])
            for n in range(first, last):
                near = workspace.free[n] + lines.lever[i, n] * reach < 0.0
                likely[i, n] = near and not flexibility.ready[i, n]
                count += likely[i, n]
            first = last
    return count


@inlined
def _expected(lines, i, meshes, load, held, first, touch):
    """Return the advance of a mesh to expect, or where it is held, and the force; rigid flanks touch at `touch`."""
    mesh, advance, mean = meshes.mesh[first], 0.0, 0.0
    for k in range(len(load)):
        advance += meshes.ahead[mesh, k] * load[k]
        mean += meshes.share[mesh, k] * load[k]
    return (advance, 0.0) if held else (touch + mean * meshes.softness[mesh] / -lines.lever[i, first], mean)


@compiled
def follow(loads, d, i, results, force):
    """Fill the forces to expect from those under the loads before, along a line through two of them."""
    before, last = results.force[d - 1, i], loads[d - 1, i]
    along, square = 0.0, 0.0
    for k in range(len(last)):
        along += loads[d, i, k] * last[k]
        square += last[k] ** 2
    ratio, further = along / square if square > 0.0 else 1.0, 0.0
    if d > 1 and results.converged[d - 2, i]:
        earlier = 0.0
        for k in range(len(last)):
            earlier += loads[d - 2, i, k] * last[k]
        further = (along - square) / (square - earlier) if square != earlier else 0.0
    for n in range(len(force)):
        new = before[n] * ratio
        if further != 0.0:
            new = before[n] + further * (before[n] - results.force[d - 2, i, n])
        force[n] = max(new, FADING * ratio * before[n])


@compiled
def start_with(lines, i, meshes, load, held, warm, force, moved, workspace):
    """Choose the sections to begin with and their forces, each mesh by itself; return the gap up to which others count.

    Where `warm`, those that `force` holds, at the movements before: where hubs stand off by much more than flanks give
    way, each mesh by itself does not tell how far its gears turn.
    """
    free, carries, size, depth, first = workspace.free, workspace.carries, len(workspace.free), 0.0, 0
    for k in range(len(moved)):
        moved[k] = load[k] if held else moved[k] if warm else 0.0
    while first < size:
        mesh, last, touch = meshes.mesh[first], first, np.inf
        while last < size and meshes.mesh[last] == mesh:
            touch = min(touch, free[last] / -lines.lever[i, last])
            last += 1
        advance, mean = _expected(lines, i, meshes, load, held, first, touch)
        if warm:
            advance = 0.0
            for k in range(len(moved)):
                advance += meshes.ahead[mesh, k] * moved[k]
        deepest, count = 0.0, 0
        for n in range(first, last):
            rigid = free[n] + lines.lever[i, n] * advance
            carries[n], workspace.ahead[n] = force[n] > 0.0 if warm else rigid < 0.0, advance
            deepest, count = max(deepest, -rigid), count + carries[n]
        mean = deepest / meshes.softness[mesh] if held else mean
        for n in range(first, last if not warm else first):
            force[n] = mean * lines.lever[i, first] / (lines.lever[i, n] * count) if carries[n] else 0.0
        depth, first = max(depth, deepest), last
    return NEARBY * depth
