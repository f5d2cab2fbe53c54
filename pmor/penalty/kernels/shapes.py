"""Active shapes of the reduced pair: their energy products and displacements.

The unknowns of the reduced pair are the amplitudes of its active_shapes, and the pinion's rotation.
"""

from __future__ import annotations

import numpy as np

from pmor.core.compiling import allocating, compiled
from pmor.penalty.kernels.state import ActiveShapes
from pmor.penalty.kernels.types import ELEMENT_ROWS, FIRST, FIRST_ROW, NODE_ROWS, OFFSET

# Share of a shape's energy that it must have beyond that of the active shapes before it.
INDEPENDENT = 1e-10


@compiled
def shape_slots(family):
    """Return how many shapes a tooth pair can have at all."""
    if family.by_line:
        return family.lines[0].displacement.shape[1] + family.lines[1].displacement.shape[1]
    return family.positions.loaded.shape[1]


@compiled
def _most_active_shapes(family, patches):
    """Return how many active shapes a position can have at most."""
    if not family.by_line:
        return patches.pairs * family.positions.loaded.shape[1]
    total = 0
    for gear in range(2):
        start, widest = family.lines[gear].start, 0
        for i in range(len(start) - 1):
            widest = max(widest, start[i + 1] - start[i])
        for p in range(patches.pairs):
            total += widest * (patches.windows[p, gear, ELEMENT_ROWS] + 1)
    return total


@compiled
def _drop_dependent(low, high, slot, gram, factor):
    """Keep the active shapes from `low` on that are independent, with their Gram matrix and its factor.

    Without the local dent, loads on lines that are close together move the tooth alike. A dropped line's load is
    carried by the others; the energy lost is below the tolerance.
    """
    size = low
    for j in range(low, high):
        pivot = gram[j, j]
        for i in range(low, size):
            value = gram[i, j]
            for e in range(low, i):
                value -= factor[e, size] * factor[e, i]
            factor[i, size] = value / factor[i, i]
            pivot -= factor[i, size] ** 2
        if pivot <= INDEPENDENT * gram[j, j]:
            continue
        if size < j:
            slot[size] = slot[j]
            for i in range(low, high):
                gram[size, i] = gram[j, i]
            for i in range(low, size + 1):
                gram[i, size] = gram[i, j]
                gram[size, i] = gram[i, size]
        factor[size, size] = np.sqrt(pivot)
        size += 1
    return size


@allocating
def gather_active_shapes(columns, pitch, patches, nodes, family):
    """Collect the active shapes.

    Parameters
    ----------
    columns : two int
        Columns of nodes of the pinion's and the wheel's flank.
    pitch : float
        Angular pitch of the pinion, rad.
    patches : ActivePatches
    nodes : int
        Of all windows.
    family : Family

    Returns
    -------
    ActiveShapes
    """
    most = _most_active_shapes(family, patches)
    slot, ranges = np.empty(most, dtype=np.int64), np.zeros((2, 2), dtype=np.int64)
    gram, factor, fields = np.empty((most, most)), np.empty((most, most)), np.empty((most, 3 * nodes))
    active_shapes = ActiveShapes(0, slot, ranges, gram, factor, fields)
    if family.by_line:
        size = _gather_lines(columns, patches, family, active_shapes)
    else:
        size = _interpolate_positions(columns, pitch, patches, family.positions, active_shapes)
    return ActiveShapes(size, slot, ranges, gram, factor, fields)


@allocating
def _gather_lines(columns, patches, family, active_shapes):
    """Collect the shapes of the active lines; fill `active_shapes`, return their number."""
    size, before, gram = 0, 0, active_shapes.gram
    first = np.empty(patches.pairs + 1, dtype=np.int64)
    for gear in range(2):
        low = size
        _list_lines(gear, patches, family, low, before, active_shapes.slot, first)
        _line_energy(gear, patches, family, before, first, active_shapes)
        size = _drop_dependent(low, first[patches.pairs], active_shapes.slot, gram, active_shapes.factor)
        active_shapes.ranges[gear, 0], active_shapes.ranges[gear, 1] = low, size
        _line_fields(gear, columns[gear], patches, family, before, active_shapes)
        before += family.lines[gear].displacement.shape[1]
    for i in range(active_shapes.ranges[1, 0]):
        for j in range(active_shapes.ranges[1, 0], size):
            gram[i, j] = gram[j, i] = active_shapes.factor[i, j] = 0.0
    return size


@compiled
def _list_lines(gear, patches, family, size, before, slot, first):
    """List the shapes of the lines that bound the windows' elements.

    Fills the `slot` of each from number `size` on, and the `first` number of each pair, shape (pairs + 1,). `before` is
    the first slot of the gear.
    """
    start, slots = family.lines[gear].start, shape_slots(family)
    for p in range(patches.pairs):
        first[p], window = size, patches.windows[p, gear]
        for shape in range(start[window[FIRST_ROW]], start[window[FIRST_ROW] + window[ELEMENT_ROWS] + 1]):
            slot[size] = p * slots + before + shape
            size += 1
    first[patches.pairs] = size


@compiled
def _teeth_ahead(gear, patches, p, q):
    """How many teeth, counter-clockwise, that of pair p is ahead of that of pair q: the wheel's count against pairs."""
    ahead = patches.tooth_pair[p] - patches.tooth_pair[q]
    return ahead if gear == 0 else -ahead


@compiled
def _line_energy(gear, patches, family, before, first, active_shapes):
    """Fill the Gram matrix of a gear's active_shapes, those of pair p from number ``first[p]`` on."""
    products, slots = family.lines[gear].gram, shape_slots(family)
    centre, slot, gram = (products.shape[0] - 1) // 2, active_shapes.slot, active_shapes.gram
    for q in range(patches.pairs):
        shape_q = slot[first[q]] % slots - before - first[q]
        for p in range(patches.pairs):
            shape_p = slot[first[p]] % slots - before - first[p]
            product = products[centre + _teeth_ahead(gear, patches, p, q)]
            for i in range(first[p], first[p + 1]):
                for j in range(first[q], first[q + 1]):
                    gram[i, j] = product[shape_p + i, shape_q + j]


@compiled
def _line_fields(gear, columns, patches, family, before, active_shapes):
    """Fill the displacements of a gear's active shapes."""
    displacement, slots = family.lines[gear].displacement, shape_slots(family)
    centre, low = (displacement.shape[0] - 1) // 2, active_shapes.ranges[gear, 0]
    for j in range(active_shapes.ranges[gear, 1] - low):
        q, shape = active_shapes.slot[low + j] // slots, active_shapes.slot[low + j] % slots - before
        for p in range(patches.pairs):
            window = patches.windows[p, gear]
            first, at = 3 * (window[FIRST_ROW] - window[FIRST]) * columns, 3 * window[OFFSET]
            source = displacement[centre + _teeth_ahead(gear, patches, p, q), shape]
            target = active_shapes.fields[j]
            for dof in range(3 * window[NODE_ROWS] * columns):
                target[at + dof] = source[first + dof]


@compiled
def cubic_weights(x):
    """Weights of the Lagrange cubic through four neighbours, x between the inner two (0 to 1)."""
    return (
        -x * (x - 1.0) * (x - 2.0) / 6.0, (x + 1.0) * (x - 1.0) * (x - 2.0) / 2.0,
        -(x + 1.0) * x * (x - 2.0) / 2.0, (x + 1.0) * x * (x - 1.0) / 6.0,
    )  # fmt: skip


@compiled
def shape_weights(positions, roll_position, weights):
    """Fill the weights (S, T) of the shapes; return the first grid position of the stencil.

    Cubic (Lagrange) where all four neighbours carry load, else linear; where a pair carries no load at one of the two
    inner neighbours, the other is used alone. Outside the trained range, and where neither is loaded, the weights are
    zero; grid positions beyond the grid have none.
    """
    loaded, before = positions.loaded, positions.gram.shape[2] // 2 - 1
    place = (roll_position - positions.first) / positions.step
    nearest = np.rint(place)  # on the grid, to round-off, that training position stands alone
    if abs(place - nearest) < 1e-9:
        place = nearest
    k = min(max(int(np.floor(place)), 0), loaded.shape[0] - 2)
    fraction = place - k
    for t in range(loaded.shape[1]):
        low = 1.0 - fraction if loaded[k, t] else 0.0
        high = fraction if loaded[k + 1, t] else 0.0
        weights[:, t] = 0.0
        if fraction < 0.0 or fraction > 1.0 or low + high <= 0.0:
            continue
        weights[before, t], weights[before + 1, t] = low / (low + high), high / (low + high)
        if before == 1 and 0 < k < loaded.shape[0] - 2 and loaded[k - 1, t] and low * high != 0.0 and loaded[k + 2, t]:
            cubic = cubic_weights(fraction)
            for a in range(4):
                weights[a, t] = cubic[a]
    return k - before


@allocating
def _interpolate_positions(columns, pitch, patches, positions, active_shapes):
    """Interpolate the shapes of all pairs over their roll positions; fill `active_shapes`, return their number."""
    shapes, stencil = positions.displacement.shape[1], positions.gram.shape[2]
    weights, places = np.zeros((patches.pairs, stencil, shapes)), np.empty(patches.pairs, dtype=np.int64)
    for p in range(patches.pairs):
        roll_position = patches.phi + patches.tooth_pair[p] * pitch
        places[p] = shape_weights(positions, roll_position, weights[p])
    for j in range(patches.pairs * shapes):
        active_shapes.slot[j] = j
    _position_energy(patches, positions, weights, places, active_shapes.gram)
    size = _drop_dependent(0, patches.pairs * shapes, active_shapes.slot, active_shapes.gram, active_shapes.factor)
    for gear in range(2):
        active_shapes.ranges[gear, 0], active_shapes.ranges[gear, 1] = 0, size
        _position_fields(gear, columns[gear], patches, positions, weights, places, active_shapes)
    return size


@compiled
def _position_energy(patches, positions, weights, places, gram):
    """Fill the Gram matrix of the active shapes of all pairs."""
    products, stencil, shapes = positions.gram, weights.shape[1], weights.shape[2]
    before = stencil // 2 - 1
    for p in range(patches.pairs):
        for q in range(p, patches.pairs):
            for t in range(shapes):
                for u in range(shapes):
                    value = 0.0
                    for a in range(stencil):
                        for b in range(stencil):
                            product = products[patches.tooth_pair[q] - patches.tooth_pair[p], places[p] + before, a, b]
                            value += weights[p, a, t] * weights[q, b, u] * product[t, u]
                    gram[p * shapes + t, q * shapes + u] = gram[q * shapes + u, p * shapes + t] = value


@compiled
def _position_fields(gear, columns, patches, positions, weights, places, active_shapes):
    """Fill the displacements of one gear."""
    displacement, stencil, shapes = positions.displacement, weights.shape[1], weights.shape[2]
    centre = (displacement.shape[3] - 1) // 2
    for p in range(patches.pairs):
        window = patches.windows[p, gear]
        start = 3 * (window[FIRST_ROW] - window[FIRST]) * columns
        count, offset = 3 * window[NODE_ROWS] * columns, 3 * window[OFFSET]
        for j in range(active_shapes.ranges[gear, 1]):
            q, t = active_shapes.slot[j] // shapes, active_shapes.slot[j] % shapes
            tooth, target = centre + _teeth_ahead(gear, patches, p, q), active_shapes.fields[j]
            target[offset : offset + count] = 0.0
            for a in range(stencil):
                weight = weights[q, a, t]
                if weight == 0.0:
                    continue
                source = displacement[places[q] + a, t, gear, tooth]
                for dof in range(count):
                    target[offset + dof] += weight * source[start + dof]
