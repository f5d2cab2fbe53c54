"""Compliance between the flanks of a pair: the part of two elastic gears that line loads and error estimates keep."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from pmor.core.arrays import FloatArray

if TYPE_CHECKING:
    from pmor.body.elastic_gear import ElasticGear
    from pmor.body.support import Support


@dataclass(frozen=True)
class FlankCompliance:
    """Compliance between loaded flanks, where contact forces act.

    Parameters
    ----------
    gears : two ndarrays, shape (neighbours + 1, n, n)
        Of pinion and wheel: displacement of the tooth 0, 1, ... teeth counter-clockwise from the loaded one, mm/N; two
        or three components at each flank node. The same object for identical gears.
    support : Support or None
        The part of low rank, of the gears' blanks; None of solid ones. `gears` are without it.
    """

    gears: tuple[FloatArray, FloatArray]
    components: int
    support: Support | None = None

    def between(self, gear: int, offset: int) -> FloatArray:
        """Return the displacement of tooth `offset` of a gear under unit forces on tooth 0, shape (n, n), mm/N.

        Teeth beyond the neighbours do not move.
        """
        blocks = self.gears[gear]
        if abs(offset) >= len(blocks):
            return np.zeros(blocks.shape[1:])
        return np.asarray(blocks[offset] if offset >= 0 else blocks[-offset].T)


def flank_compliance(
    bodies: tuple[ElasticGear, ElasticGear], components: int, support: Support | None = None
) -> FlankCompliance:
    """Take the compliance of the flanks from two elastic gears.

    Parameters
    ----------
    bodies : two ElasticGear
        Pinion and wheel; the same object when they are identical.
    components : int
        Of the displacement at a node: 2 or 3.
    support : Support, optional
        For three components at each node.
    """
    pinion, wheel = bodies
    first = _loaded_part(pinion, components)
    second = first if wheel is pinion else _loaded_part(wheel, components)
    if support is not None:
        by_node = support.rows.reshape(2, -1, 3, len(support.compliance))
        support = replace(support, rows=by_node[:, :, :components].reshape(2, -1, by_node.shape[3]))
    return FlankCompliance((first, second), components, support)


def _loaded_part(body: ElasticGear, components: int) -> FloatArray:
    blocks = body.compliance[body.neighbours :]
    used = (3 * np.arange(blocks.shape[1] // 3)[:, None] + np.arange(components)).ravel()
    return np.ascontiguousarray(blocks[:, used[:, None], used])
