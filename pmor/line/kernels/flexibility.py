"""Flexibility between the sections of line contact: gathered from the compliance of the gears as it is needed.

Between sections of one mesh it is that between flanks of neighbouring teeth; sections of different meshes meet through
what a body that both share gives way between far teeth (`pmor.body.far_compliance`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.core.compiling import allocating, compiled, inlined

# What `Compliance.layout` says of a mesh: its first section, sections of a tooth pair, for how many teeth there are
# blocks, and of pinion and wheel where they begin and how many rows and columns each has.
LAYOUT = 7


class Compliance(NamedTuple):
    """Compliance of all gears that M meshes of N sections have.

    Attributes
    ----------
    blocks : two ndarrays, shape (n,)
        Of pinions and wheels: between sections of the flanks of teeth 0, 1, ... apart, (teeth, S, S, r c, r c) of each
        mesh one after the other, mm/N (`pmor.line.pair.line_compliance_between`).
    layout : ndarray of int, shape (M, 7)
    mesh : ndarray of int, shape (N,)
        Of each section; sections of a mesh follow each other.
    body : ndarray of int, shape (N, 2)
        Of the pinion and of the wheel of its mesh.
    image : ndarray of int, shape (N, 2)
        0 on the flanks that lie counter-clockwise, 1 on the others, which are seen in their image.
    rank, teeth : ndarray of int, shape (B,)
        Shapes of the far compliance and teeth of each body; empty where no body is shared.
    alike : ndarray, shape (B, 2, z, r, r)
        Of flanks, and of their images, of `pmor.body.far_compliance.FarCompliance`, mm/N.
    backs : ndarray, shape (B, 2, z, r, r)
        Of the other flank by the flank, rows and columns exchanged, and as it is.
    """

    blocks: tuple[FloatArray, FloatArray]
    layout: IntArray
    mesh: IntArray
    body: IntArray
    image: IntArray
    rank: IntArray
    teeth: IntArray
    alike: FloatArray
    backs: FloatArray


class Flexibility(NamedTuple):
    """Workspace of `solve_lines` that further solutions at the same angles take up again.

    Attributes
    ----------
    between : ndarray, shape (A, N, N)
        D, of the sections that are `ready`, mm/N; of the others the part of low rank alone.
    ready : ndarray of bool, shape (A, N)
    further : ndarray, shape (A, N, N) or (0, 0, 0)
        What bodies whose teeth differ add to it for the teeth that are in mesh.
    tooth : ndarray of int, shape (A, N, 2)
        Of bodies that meshes share: its number in the frame in which the flank lies counter-clockwise.
    shapes : ndarray, shape (A, N, 2, r)
        Forces on their shapes by a unit force in the section; r those of the body with most, the rest is 0.
    moved : ndarray, shape (r,)
        Room for the movement of a tooth.
    """

    between: FloatArray
    ready: BoolArray
    further: FloatArray
    tooth: IntArray
    shapes: FloatArray
    moved: FloatArray


@inlined
def _product(blocks, base, size, to_row, to, by_row, by, parts):
    """Product of two gradients with the compliance between the rows of two sections, `size` rows in all."""
    # With a size that the compiler knows loops are unrolled: half the time of a sweep.
    first = base + parts * to_row * size + parts * by_row
    if parts == 2:
        return _bilinear(8, blocks, first, size, to, by)
    return _bilinear(12, blocks, first, size, to, by)


@inlined
def _bilinear(count, blocks, first, size, to, by):
    """Sum of to[a] block[a, b] by[b], four columns at a time."""
    total = 0.0
    for a in range(count):
        start = first + a * size
        line = blocks[start : start + count]
        one = two = three = four = 0.0
        for b in range(0, count, 4):
            one += line[b] * by[b]
            two += line[b + 1] * by[b + 1]
            three += line[b + 2] * by[b + 2]
            four += line[b + 3] * by[b + 3]
        total += to[a] * (one + two + three + four)
    return total


@inlined
def _between(lines, i, n, m, compliance, layout):
    """Flexibility between two sections of a mesh."""
    low, high, sections = min(n, m) - layout[0], max(n, m) - layout[0], layout[1]
    apart, s, t = high // sections - low // sections, low % sections, high % sections
    if apart >= layout[2]:
        return 0.0
    parts, row, gradient = lines.gradient.shape[3] // 4, lines.row[i], lines.gradient[i]
    low, high, apart = min(n, m), max(n, m), apart * sections
    # Pinion teeth count as tooth pairs do, wheel teeth against them.
    base = layout[3] + ((apart + t) * sections + s) * layout[4] ** 2
    total = _product(compliance.blocks[0], base, layout[4], row[high, 0], gradient[high, 0], row[low, 0],
                     gradient[low, 0], parts)  # fmt: skip
    base = layout[5] + ((apart + s) * sections + t) * layout[6] ** 2
    return total + _product(compliance.blocks[1], base, layout[6], row[low, 1], gradient[low, 1], row[high, 1],
                            gradient[high, 1], parts)  # fmt: skip


@compiled
def make_ready(lines, compliance, flexibility, i, n):
    """Add the flexibility of the gears between section `n` and all those that are ready."""
    between, ready, mesh = flexibility.between[i], flexibility.ready[i], compliance.mesh
    ready[n], layout = True, compliance.layout[mesh[n]]
    for m in range(len(ready)):
        if ready[m] and mesh[m] == mesh[n]:
            value = between[n, m] + _between(lines, i, n, m, compliance, layout)
            between[n, m] = between[m, n] = value
    if len(compliance.rank) > 0:
        _couple(compliance, flexibility, i, n, len(ready), ready, True)


@allocating
def make_all_ready(lines, compliance, flexibility, wanted):
    """Make those sections ready that are `wanted`, (A, N), and are not yet.

    The compliance between two sections is larger than the memory next to the processor: it is read once for all angles.
    """
    between, ready, mesh = flexibility.between, flexibility.ready, compliance.mesh
    angles, size = ready.shape
    for i in range(angles):
        for n in range(size):
            wanted[i, n] &= not ready[i, n]
    for n in range(size):
        for i in range(angles):
            ready[i, n] |= wanted[i, n]
        layout = compliance.layout[mesh[n]]
        for m in range(layout[0], n + 1):
            for i in range(angles):
                if ready[i, n] and ready[i, m] and (wanted[i, n] or wanted[i, m]):
                    value = between[i, n, m] + _between(lines, i, n, m, compliance, layout)
                    between[i, n, m] = between[i, m, n] = value
        if len(compliance.rank) > 0:
            for i in range(angles):
                if ready[i, n]:
                    _couple(compliance, flexibility, i, n, layout[0], wanted[i], wanted[i, n])


@allocating
def gather(lines, carried, first, shapes):
    """Fill the forces on the bodies' shapes by unit forces in the sections of a mesh.

    Parameters
    ----------
    lines : Lines
        Of the mesh.
    carried : two ndarrays, shape (S, rows, c, r)
        Shapes of pinion and wheel at the rows of nodes of each section.
    first : int
        Of the mesh's sections among all.
    shapes : ndarray, shape (A, N, 2, r)
        Filled, as in `Flexibility`.
    """
    for gear in range(2):
        of_gear = carried[gear]
        sections, _, parts, rank = of_gear.shape
        for i in range(lines.gap.shape[0]):
            for n in range(lines.gap.shape[1]):
                out, own, row = shapes[i, first + n, gear], of_gear[n % sections], lines.row[i, n, gear]
                if not np.isfinite(lines.gap[i, n]):
                    continue
                for a in range(4):
                    for c in range(parts):
                        value, line = lines.gradient[i, n, gear, parts * a + c], own[row + a, c]
                        for k in range(rank):
                            out[k] += value * line[k]


@compiled
def _couple(compliance, flexibility, i, n, last, wanted, all_wanted):
    """Add what bodies give way between section `n` and those before `last` of other meshes that are ready.

    Of these only those that are `wanted`, unless all are.
    """
    between, ready, mesh, moved = flexibility.between[i], flexibility.ready[i], compliance.mesh, flexibility.moved
    tooth, image, body = flexibility.tooth[i], compliance.image, compliance.body
    for b in range(2):
        on, of_mesh, before = body[n, b], -1, 0
        rank = compliance.rank[on]
        for m in range(last if rank > 0 else 0):
            if mesh[m] == mesh[n] or not ready[m] or not (all_wanted or wanted[m]):
                continue
            a = 0 if body[m, 0] == on else 1
            if body[m, a] != on:
                continue
            # The same for all sections of a tooth, which follow each other.
            place = 2 * tooth[m, a] + image[m, a]
            if mesh[m] != of_mesh or place != before:
                _move(compliance, flexibility, i, m, a, n, b, rank)
                of_mesh, before = mesh[m], place
            total, own = 0.0, flexibility.shapes[i, m, a]
            for k in range(rank):
                total += own[k] * moved[k]
            between[n, m] += total
            between[m, n] += total


@compiled
def _move(compliance, flexibility, i, m, a, n, b, rank):
    """Fill the movement of the shapes of the tooth of section m by a unit force in section n, on one body."""
    by, tooth, moved = flexibility.shapes[i, n, b], flexibility.tooth[i], flexibility.moved
    body, image = compliance.body[n, b], compliance.image[n, b]
    teeth = compliance.teeth[body]
    # Blocks with their rows and columns exchanged: the loop runs along rows. That of teeth as far the other way is.
    if compliance.image[m, a] == image:
        block = compliance.alike[body, image, (tooth[n, b] - tooth[m, a]) % teeth]
    else:  # in its image a tooth has the opposite number
        block = compliance.backs[body, image, (-tooth[m, a] - tooth[n, b]) % teeth]
    moved[:rank] = 0.0
    for k in range(rank):
        value, line = by[k], block[k]
        for c in range(rank):
            moved[c] += value * line[c]
