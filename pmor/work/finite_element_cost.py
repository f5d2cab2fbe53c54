"""Memory and time of a gear's finite elements, counted from the sizes of its mesh.

Memory is that of the arrays that live at the same time, time that of the operations of nested dissection and of the
ring on one core of `FLOPS` operations per second; other computers differ. Both were fitted on the cases of
`pmor.lab.core.stages`, and hold within a factor of two there.
"""

from __future__ import annotations

import math
from functools import cache

from pmor.fe.nested_dissection import UNDIVIDED
from pmor.work.sizes import BlankSize, GearSize, PairSize

DOUBLE = 8  # bytes
# Operations per second on dense matrices, of one core of the reference computer.
FLOPS = 13e9
# Of linear and of quadratic elements: unknowns of one; its matrix with intermediate results.
ELEMENT_UNKNOWNS, ELEMENT_BYTES = {1: 24, 2: 60}, {1: 7_000, 2: 40_000}
# Operations on a row of a blank's section, over the cube of its unknowns; matrices over amplitudes of holes at a time.
SECTION, MATRICES = 20.0, 7
# *Measured*: operations of holes, of the sector of the web around one among them, to those of their dense matrices.
HOLES = 2.3
ELEMENT_S, FILLET_S = {1: 90e-6, 2: 250e-6}, 0.1


def held_bytes(size: PairSize) -> int:
    """Bytes of the models of the gears that finite elements are solved for."""
    return sum(_kept(gear, size.neighbours) for gear in size.gears)


def solving_bytes(size: PairSize) -> int:
    """Bytes while the gears are solved one after the other."""
    solving = [_solving(gear, size.neighbours) for gear in size.gears]
    before = [0, _kept(size.gears[0], size.neighbours)]
    return max(a + b for a, b in zip(solving, before, strict=False))


def solving_seconds(size: PairSize) -> float:
    """Return the time of the finite elements of all gears."""
    return sum(map(_solving_seconds, size.gears))


def _solving(gear: GearSize, neighbours: int) -> int:
    """Bytes while a gear is condensed and the ring is closed."""
    flank, side, across = gear.known * gear.flank, gear.known * gear.side, _across(gear)
    rest, elements = flank + 2 * side + _interface(gear), ELEMENT_BYTES[gear.order] * gear.elements
    fronts = (across + rest) ** 2 + (across + flank) ** 2 + (across + 2 * side) ** 2
    ring = 2 * rest**2 + (neighbours + 8) * side**2 + 8 * side * flank + (6 * neighbours + 6) * gear.flank**2
    stresses = 3 * gear.stresses * (rest + gear.flank)
    of_blank = DOUBLE * (ring + stresses) + _blank_bytes(gear.blank) if gear.blank else 0
    return int(max(elements + DOUBLE * fronts, DOUBLE * (ring + stresses), of_blank))


def _kept(gear: GearSize, neighbours: int) -> int:
    """Bytes of a gear's model: compliance, condensed stiffness, surface layer."""
    flank, side = gear.known * gear.flank, gear.known * gear.side
    stresses = 3 * gear.stresses * gear.flank
    return int(DOUBLE * ((2 * neighbours + 2) * gear.flank**2 + (flank + 2 * side) ** 2 + stresses))


def _solving_seconds(gear: GearSize) -> float:
    """Time of a gear's finite elements: the eliminations, the harmonics of the ring, its compliance."""
    flank, side = gear.known * gear.flank, gear.known * gear.side
    (tooth_rows, tooth_columns), (ring_rows, ring_columns) = (
        tuple((count - 1) // gear.order for count in block) for block in (gear.tooth, gear.ring)
    )
    layers = (gear.layers - 1) // gear.order
    # The tooth goes on into the ring and ends at its flank, the ring at its side faces; the bore is held.
    total = _dissection((tooth_rows, tooth_columns, layers), (True, False, True, False, False, False), gear.order)
    total += _dissection((ring_rows, ring_columns, layers), (False, True, True, True, False, False), gear.order)
    total += _elimination(_across(gear), flank + 2 * side)
    if gear.blank is None:
        total += 3.0 * flank**3 + 20.0 * side * flank**2 + 30.0 * side**2 * flank + gear.teeth / 2.0 * side**3
    else:
        total += _elimination(_across(gear), flank + 2 * side + _interface(gear)) - _elimination(_across(gear), side)
        total += 3.0 * flank**3 + _blank_operations(gear, gear.blank)
    # The stresses are carried through the elimination, and then over to the forces on three teeth.
    total += 12.0 * gear.stresses * (flank + 2 * side) * flank
    return total / FLOPS + ELEMENT_S[gear.order] * gear.elements + (FILLET_S if gear.stresses else 0.0)


def _interface(gear: GearSize) -> float:
    """Unknowns of a sector's interface with a blank."""
    return 0.0 if gear.blank is None else gear.known * gear.blank.interface


def _blank_operations(gear: GearSize, blank: BlankSize) -> float:
    """Operations of a blank's harmonics, of the ring on it, and of its holes: complex ones are four."""
    layers, harmonics = gear.layers, 2 * blank.largest + 1
    section = sum(rows * (6 * columns + 3) ** 3 for rows, columns in blank.blocks)
    ring = gear.known * gear.side + 3 * layers * harmonics / gear.teeth
    total = SECTION * (blank.largest + 1) * section
    total += gear.teeth / 2.0 * (4.0 / 3.0 * ring**3 + 8.0 * ring**2 * gear.known * gear.flank)
    amplitudes, circles, side = blank.holes
    return total + HOLES * (16.0 * amplitudes * circles * (circles + 2 * side) + 11.0 * amplitudes**3)


def _blank_bytes(blank: BlankSize) -> int:
    """Bytes of what holes take: complex matrices over all amplitudes, several at a time."""
    return 2 * DOUBLE * MATRICES * blank.holes[0] ** 2


def _across(gear: GearSize) -> float:
    """Unknowns of the face that tooth and ring share."""
    return 3 * gear.known * gear.layers * gear.tooth[1]


@cache
def _dissection(sizes: tuple[int, ...], shared: tuple[bool, ...], order: int) -> float:
    """Operations that eliminate the inside of a block of elements, as `pmor.fe.nested_dissection` divides it.

    `sizes` are its elements along each axis, `shared` tells which of its six faces (two to an axis) others share.
    """
    faces = [_face(sizes, axis, order) for axis in range(3)]
    border = sum(faces[face // 2] for face in range(6) if shared[face])
    if math.prod(sizes) * ELEMENT_UNKNOWNS[order] <= UNDIVIDED:
        every = 3.0 * _nodes(sizes, order)
        return _elimination(max(every - border, 0.0), min(border, every))
    axis = max(range(3), key=lambda i: sizes[i])
    total = _elimination(faces[axis], border)
    for half, end in ((sizes[axis] // 2, 1), (sizes[axis] - sizes[axis] // 2, 0)):
        cut = tuple(half if i == axis else size for i, size in enumerate(sizes))
        total += _dissection(cut, tuple(s or face == 2 * axis + end for face, s in enumerate(shared)), order)
    return total


def _face(sizes: tuple[int, ...], axis: int, order: int) -> float:
    """Unknowns of a face of a block of elements across an axis."""
    p, q = (size for i, size in enumerate(sizes) if i != axis)
    return 3.0 * ((order * p + 1) * (order * q + 1) - (order - 1) * p * q)


def _nodes(sizes: tuple[int, ...], order: int) -> float:
    """Nodes of a block of elements: quadratic ones have some on each edge, those of linear ones are the corners."""
    corners = math.prod(size + 1 for size in sizes)
    edges = sum(size * corners / (size + 1) for size in sizes)
    return corners + (order - 1) * edges


def _elimination(front: float, rest: float) -> float:
    """Operations that eliminate a front which is coupled to the rest."""
    return front**3 / 3.0 + front**2 * rest + front * rest**2
