"""Compliance between teeth of a gear that are far from each other, in the few shapes in which they move.

A gear that meshes with several others carries load at several places of its circumference, an idler or a planet on both
flanks of its teeth. A tooth feels a load far away as its side faces move, and of their movement little is left after a
tooth or two but that of a rigid body and some bending (Saint-Venant): with U a few dozen shapes of a flank,

    C_(k,0) = U M_k U^T    to `LEFT_OUT`.                                                                (1)

The other flank of a tooth is the image of the loaded one, in the plane through the tooth's middle and the axis. It is
seen in that image, x to -x, where it is a flank as any other, teeth count clockwise, and the shapes are the same U.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pmor.core.arrays import FloatArray

# Of the largest movement of a far tooth: movements that are not followed.
LEFT_OUT = 1e-7
# Loads, drawn at random, under which the movements are looked at: several times as many as shapes are found.
DRAWN = 96

FaceCompliance = Callable[[int], FloatArray]


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
    faces: FaceCompliance, flank: FloatArray, back: FloatArray, teeth: int, asked: FarTeeth
) -> FarCompliance:
    """Find the shapes of far teeth, and the compliance between them.

    Parameters
    ----------
    faces : callable
        Displacement of the side face k by unit forces on side face 0, shape (s, s), mm/N.
    flank, back : ndarray, shape (2 s, n)
        Forces on the left and on the right side face of a held sector by unit forces on either flank; of the back in
        its image. `back` has no columns where nothing is asked for there.
    teeth : int
    """
    kinds = (
        (flank, flank, _both_ways(asked.flanks, teeth)),
        (back, back, _both_ways(asked.images, teeth)),
        (back, flank, sorted({k % teeth for k in asked.backs})),
    )
    drawn = np.random.default_rng(30).standard_normal((flank.shape[1], min(DRAWN, flank.shape[1])))
    moved = [there.T @ _between(faces, k, loaded @ drawn) for there, loaded, offsets in kinds for k in offsets]
    moved += [flank.T @ _between(faces, -k, back @ drawn) for k in kinds[2][2]]
    shapes, size, _ = np.linalg.svd(np.hstack(moved), full_matrices=False)
    shapes = np.ascontiguousarray(shapes[:, size > LEFT_OUT * size[0]])
    between = [np.full((teeth, shapes.shape[1], shapes.shape[1]), np.nan) for _ in kinds]
    for found, (there, loaded, offsets) in zip(between, kinds, strict=True):
        for k in offsets:
            found[k] = (there @ shapes).T @ _between(faces, k, loaded @ shapes)
    flanks, images, backs = between
    # In the image teeth count clockwise.
    return FarCompliance(shapes, flanks, np.ascontiguousarray(np.roll(images[::-1], 1, axis=0)), backs)


def _both_ways(offsets: tuple[int, ...], teeth: int) -> list[int]:
    return sorted({sign * k % teeth for k in offsets for sign in (1, -1)})


def _between(faces: FaceCompliance, k: int, forces: FloatArray) -> FloatArray:
    """Displacement of the side faces of sector k, left and right, under forces on those of sector 0."""
    left, right = np.split(forces, 2)
    here = faces(k)
    return np.concatenate([here @ left + faces(k + 1) @ right, faces(k - 1) @ left + here @ right])
