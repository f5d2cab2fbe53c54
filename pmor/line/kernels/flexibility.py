"""Flexibility between the sections of line contact: gathered from the compliance between flanks as it is needed."""

from __future__ import annotations

from typing import NamedTuple

from pmor.core.arrays import BoolArray, FloatArray
from pmor.core.compiling import compiled, inlined


class Flexibility(NamedTuple):
    """Workspace of `solve_lines` that further solutions at the same angles take up again.

    Attributes
    ----------
    between : ndarray, shape (A, N, N)
        D, of the sections that are `ready`, mm/N; of the others the part of low rank alone.
    ready : ndarray of bool, shape (A, N)
    """

    between: FloatArray
    ready: BoolArray


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
def make_ready(lines, flexibility, i, n, compliance, sections):
    """Add the flexibility of the gears' cyclic part between section `n` and all those that are ready."""
    between, ready = flexibility.between[i], flexibility.ready[i]
    ready[n] = True
    for m in range(len(ready)):
        if ready[m]:
            value = between[n, m] + _between(lines, i, n, m, compliance, sections)
            between[n, m] = between[m, n] = value


@compiled
def make_all_ready(lines, flexibility, wanted, compliance, sections):
    """Make those sections ready that are `wanted`, (A, N), and are not yet.

    The compliance between two sections is larger than the memory next to the processor: it is read once for all angles.
    """
    between, ready = flexibility
    angles, size = ready.shape
    for n in range(size):
        for i in range(angles):
            ready[i, n] |= wanted[i, n]
        for m in range(n + 1):
            for i in range(angles):
                if ready[i, n] and ready[i, m] and (wanted[i, n] or wanted[i, m]):
                    value = between[i, n, m] + _between(lines, i, n, m, compliance, sections)
                    between[i, n, m] = between[i, m, n] = value
