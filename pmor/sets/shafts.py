"""Gears on one shaft: displacements of their hubs by those of the shaft, which stands where its first gear does.

A shaft is rigid, but for the twist between its gears where that is given.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.line.hubs import HUB
from pmor.sets.model import SetBody


def at_place(z: float) -> FloatArray:
    """Return the displacement of a place so far along a shaft by that of its origin, (6, 6), mm and rad."""
    moved = np.eye(HUB)
    moved[0, 4], moved[1, 3] = z, -z
    return moved


def shaft_of(bodies: Sequence[SetBody]) -> list[int]:
    """Return the number of the body that stands for the shaft of each one."""
    return [number if body.on is None else body.on for number, body in enumerate(bodies)]


def onto_bodies(bodies: Sequence[SetBody]) -> FloatArray:
    """Return the displacements of all hubs by those of the H shafts, in the order of their first gears, (6 B, 6 H)."""
    on = shaft_of(bodies)
    first = sorted(set(on))
    moved = np.zeros((HUB * len(bodies), HUB * len(first)))
    for number, (body, shaft) in enumerate(zip(bodies, on, strict=True)):
        column = HUB * first.index(shaft)
        moved[HUB * number : HUB * (number + 1), column : column + HUB] = at_place(body.z - bodies[shaft].z)
    return moved
