"""The error estimate of a reduced solution in plain numpy: the twin of `pmor.penalty.kernels.estimate`."""

from __future__ import annotations

import numpy as np

from pmor.body.flank_compliance import FlankCompliance
from pmor.core.arrays import FloatArray
from pmor.penalty.elasticity import ReducedElasticity
from pmor.penalty.position import Position
from pmor.penalty.search import Contact


def discarded_energy_slope(
    compliance: FlankCompliance, position: Position, elasticity: ReducedElasticity, contact: Contact
) -> float:
    """Return r^T C dr/dT at a reduced solution (eq. 2 without r_b), rad."""
    # The linearised problem under a unit torque, with no gaps: how the solution changes with the torque.
    coordinates, rotation = elasticity.newton_step(contact, np.zeros(len(contact.gap)), 1.0)
    opening = contact.gap_change(elasticity.displacement(coordinates)) + contact.lever * rotation
    change = -contact.stiffness * opening
    return _discarded_product(compliance, position, elasticity, contact, contact.force, change)


def _discarded_product(
    compliance: FlankCompliance, position: Position, elasticity: ReducedElasticity, contact: Contact,
    first: FloatArray, second: FloatArray,
) -> float:  # fmt: skip
    """Energy product of what the shapes do not carry of two sets of point forces."""
    product = -float(elasticity.coordinates_of(contact, first) @ elasticity.coordinates_of(contact, second))
    to, by = (contact.nodal_forces(force, len(position.nodes)) for force in (first, second))
    components = compliance.components
    for gear, blocks in enumerate(compliance.gears):
        for a, index_a in enumerate(position.pair_index):
            for b, index_b in enumerate(position.pair_index):
                ahead = int(index_a - index_b) * (1 if gear == 0 else -1)
                block = blocks[ahead] if ahead >= 0 else blocks[-ahead].T
                rows, columns = (
                    (components * position.flank_nodes[p][gear][:, None] + np.arange(components)).ravel()
                    for p in (a, b)
                )
                left = to[position.window_slice(a, gear), :components].ravel()
                right = by[position.window_slice(b, gear), :components].ravel()
                product += float(left @ block[np.ix_(rows, columns)] @ right)
    return product
