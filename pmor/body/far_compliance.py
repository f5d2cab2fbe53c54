"""Compliance between teeth of a gear that are far from each other, in the few shapes in which they move.

A gear that meshes with several others carries load at several places of its circumference, an idler or a planet on both
flanks of its teeth. A tooth feels a load far away as its side faces move, and of their movement little is left after a
tooth or two but that of a rigid body and some bending (Saint-Venant): with U a few dozen shapes of a flank,

    C_(k,0) = U M_k U^T    to `LEFT_OUT`.                                                                (1)

The other flank of a tooth is the image of the loaded one, in the plane through the tooth's middle and the axis. It is
seen in that image, x to -x, where it is a flank as any other, teeth count clockwise, and the shapes are the same U.

The compliance between sections of flanks, for line loads, is that of the flank nodes, interpolated over the width.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pmor.core.arrays import FloatArray, IntArray

# Of the largest movement of a far tooth: movements that are not followed.
LEFT_OUT = 1e-7
# Loads, drawn at random, under which the movements are looked at: several times as many as shapes are found.
DRAWN = 96

# Displacement of the faces of sector k, a callable of k, by forces on those of sector 0, (s, m).
FaceResponse = Callable[[FloatArray], Callable[[int], FloatArray]]


class FarTeeth(NamedTuple):
    """Teeth that are loaded together.

    Attributes
    ----------
    flanks, images : tuple of int
        How many teeth a tooth is from another one that is loaded on the same side: on the flank, or on the other one.
    backs : tuple of int
        How many teeth, counter-clockwise, one that is loaded on its other flank is from one that is on its flank.
    """

    flanks: tuple[int, ...] = ()
    images: tuple[int, ...] = ()
    backs: tuple[int, ...] = ()


@dataclass(frozen=True)
class FarCompliance:
    """Compliance between flanks that are far from each other, mm/N; NaN where it was not asked for.

    Parameters
    ----------
    shapes : ndarray, shape (n, r)
        U: of the components that contact forces have at each node of a flank; orthonormal.
    flanks, images : ndarray, shape (z, r, r)
        M_k between flanks on the same side of teeth: of the flank of the tooth k counter-clockwise from the loaded one,
        and, all seen in the image, of the other flank.
    backs : ndarray, shape (z, r, r)
        M_k of the other flank of the tooth k counter-clockwise from one that is loaded on its flank.
    """

    shapes: FloatArray
    flanks: FloatArray
    images: FloatArray
    backs: FloatArray


def far_compliance(
    faces: FaceResponse, flank: FloatArray, back: FloatArray, teeth: int, asked: FarTeeth
) -> FarCompliance:
    """Find the shapes of far teeth, and the compliance between them.

    Parameters
    ----------
    faces : callable
        Displacement of the faces of a sector k by forces on those of sector 0, mm.
    flank, back : ndarray, shape (s, n)
        Forces on the faces of a held sector by unit forces on either flank; of the back in its image. `back` has no
        columns where nothing is asked for there.
    teeth : int
    """
    alike, backs = _both_ways(asked.flanks, teeth), sorted({k % teeth for k in asked.backs})
    drawn = np.random.default_rng(30).standard_normal((flank.shape[1], min(DRAWN, flank.shape[1])))
    by = _by_either(faces, flank, back, drawn)
    moved = [flank.T @ by(k)[0] for k in alike]
    moved += [back.T @ by(k)[1] for k in _both_ways(asked.images, teeth)]
    moved += [back.T @ by(k)[0] for k in backs] + [flank.T @ by(-k)[1] for k in backs]
    shapes, size, _ = np.linalg.svd(np.hstack(moved), full_matrices=False)
    shapes = np.ascontiguousarray(shapes[:, size > LEFT_OUT * size[0]])
    by = _by_either(faces, flank, back, shapes)
    kinds = (flank, 0, alike), (back, 1, _both_ways(asked.images, teeth)), (back, 0, backs)
    between = [np.full((teeth, shapes.shape[1], shapes.shape[1]), np.nan) for _ in kinds]
    for block, (there, loaded, offsets) in zip(between, kinds, strict=True):
        for k in offsets:
            block[k] = (there @ shapes).T @ by(k)[loaded]
    flanks, images, of_backs = between
    # In the image teeth count clockwise.
    return FarCompliance(shapes, flanks, np.ascontiguousarray(np.roll(images[::-1], 1, axis=0)), of_backs)


def _by_either(
    faces: FaceResponse, flank: FloatArray, back: FloatArray, shapes: FloatArray
) -> Callable[[int], list[FloatArray]]:
    """Displacement of the faces of sector k by shapes of forces on the flank of sector 0, and on its other flank."""
    loads = [loaded @ shapes for loaded in (flank, back) if loaded.size]
    moved = faces(np.hstack(loads))
    return lambda k: np.split(moved(k), len(loads), axis=1)


def _both_ways(offsets: tuple[int, ...], teeth: int) -> list[int]:
    return sorted({sign * k % teeth for k in offsets for sign in (1, -1)})


# Rows of nodes that carry a section.
ROWS = 4


def section_compliance(
    gears: tuple[FloatArray, FloatArray], components: int, sections: tuple[IntArray, FloatArray], rows: tuple[int, int]
) -> tuple[FloatArray, FloatArray]:
    """Return displacements at each section's rows of nodes under unit forces there.

    Parameters
    ----------
    gears : two ndarrays
    components : int
        As in `pmor.body.flank_compliance.FlankCompliance`.
    sections : (ndarray of int, shape (2, S); ndarray, shape (2, S, b))
        First column of nodes that carries each section on pinion and wheel, and the shares of b columns from there on.
    rows : (int, int)
        Rows of nodes on the pinion's and the wheel's flank.

    Returns
    -------
    two ndarrays, shape (neighbours + 1, S, S, r c, r c)
        Displaced section, loaded section; r rows, at least four, of c components, mm/N. The same array for gears that
        share their compliance and whose columns carry the sections alike.
    """
    first, share = sections
    pinion = _of_gear(gears[0], components, rows[0], first[0], share[0])
    if gears[1] is gears[0] and np.array_equal(*first) and np.array_equal(*share):
        return pinion, pinion
    return pinion, _of_gear(gears[1], components, rows[1], first[1], share[1])


def section_shares(first: IntArray, share: FloatArray, columns: int) -> FloatArray:
    """Return the share of each column of nodes in each section, shape (S, columns).

    Parameters
    ----------
    first : ndarray of int, shape (S,)
        First column of nodes that carries each section.
    share : ndarray, shape (S, b)
        Of the b columns from there on; zero beyond the last one.
    """
    shares = np.zeros((len(first), columns))
    for section, (start, weights) in enumerate(zip(first, share, strict=True)):
        used = weights[: columns - start]
        shares[section, start : start + len(used)] = used
    return shares


def _of_gear(blocks: FloatArray, components: int, rows: int, first: IntArray, share: FloatArray) -> FloatArray:
    columns = blocks.shape[1] // (rows * components)
    shares = section_shares(first, share, columns)
    size, held = rows * components, max(rows, ROWS) * components
    between = np.zeros((len(blocks), len(shares), len(shares), held, held))
    for apart, block in enumerate(blocks):
        whole = block.reshape(rows, columns, components, rows, columns, components)
        loaded = np.tensordot(whole, shares, axes=(4, 1))  # rows, columns, parts, rows, parts, sections
        both = np.tensordot(shares, loaded, axes=(1, 1))  # sections, rows, parts, rows, parts, sections
        between[apart, :, :, :size, :size] = both.transpose(0, 5, 1, 2, 3, 4).reshape(
            len(shares), len(shares), size, size
        )
    return between
