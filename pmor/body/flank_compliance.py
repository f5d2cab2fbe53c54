"""Compliance between the flanks of a pair: the part of two elastic gears that line loads and error estimates keep."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from pmor.core.arrays import FloatArray, IntArray

if TYPE_CHECKING:
    from pmor.body.elastic_gear import ElasticGear
    from pmor.body.rim import RimMotion
    from pmor.body.support import Support


@dataclass(frozen=True)
class FlankCompliance:
    """Compliance between loaded flanks, where contact forces act.

    Parameters
    ----------
    gears : two ndarrays, shape (neighbours + 1, n, n)
        Of pinion and wheel: displacement of the tooth 0, 1, ... teeth counter-clockwise from the loaded one, mm/N; two
        or three components at each flank node. The same object for identical gears.
    supports : two Support or None
        The part of low rank of pinion and wheel, of holes; None without. `gears` are without it.
    """

    gears: tuple[FloatArray, FloatArray]
    components: int
    supports: tuple[Support | None, Support | None] = (None, None)

    def between(self, gear: int, offset: int) -> FloatArray:
        """Return the displacement of tooth `offset` of a gear under unit forces on tooth 0, shape (n, n), mm/N.

        Teeth beyond the neighbours do not move.
        """
        blocks = self.gears[gear]
        if abs(offset) >= len(blocks):
            return np.zeros(blocks.shape[1:])
        return np.asarray(blocks[offset] if offset >= 0 else blocks[-offset].T)


def flank_compliance(bodies: tuple[ElasticGear, ElasticGear], components: int) -> FlankCompliance:
    """Take the compliance of the flanks from two elastic gears.

    Parameters
    ----------
    bodies : two ElasticGear
        Pinion and wheel; the same object when they are identical.
    components : int
        Of the displacement at a node: 2 or 3.
    """
    pinion, wheel = bodies
    first = loaded_part(pinion.compliance, components)
    second = first if wheel is pinion else loaded_part(wheel.compliance, components)
    return FlankCompliance(
        (first, second), components, (loaded_support(pinion, components), loaded_support(wheel, components))
    )


def loaded_part(compliance: FloatArray, components: int) -> FloatArray:
    """Return the compliance of a gear, or of its other flanks, as `FlankCompliance.gears` has it."""
    used = _loaded_unknowns(compliance, components)
    return np.ascontiguousarray(compliance[len(compliance) // 2 :, used[:, None], used])


def loaded_support(body: ElasticGear, components: int) -> Support | None:
    """Return the part of low rank in the components that contact forces have; None of a gear whose teeth are alike."""
    if body.support is None:
        return None
    used, own = _loaded_unknowns(body.compliance, components), body.support
    backs = None if own.backs is None else np.ascontiguousarray(own.backs[used])
    return replace(own, rows=np.ascontiguousarray(own.rows[used]), backs=backs)


def loaded_rim(body: ElasticGear, components: int) -> RimMotion | None:
    """Return the motion of a ring's rim under the components that contact forces have; None of other gears."""
    if body.rim_motion is None:
        return None
    used = _loaded_unknowns(body.compliance, components)
    return replace(body.rim_motion, rows=np.ascontiguousarray(body.rim_motion.rows[used]))


def _loaded_unknowns(compliance: FloatArray, components: int) -> IntArray:
    return (3 * np.arange(compliance.shape[1] // 3)[:, None] + np.arange(components)).ravel()
