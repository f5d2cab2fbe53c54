"""Evaluate the contact of all tooth pairs in reach for given displacements and pinion rotation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pmor.arrays import FloatArray, IntArray
from pmor.contact.flank import ContactScheme, MeshedPair
from pmor.contact.kernel import point_room, search_all
from pmor.contact.position import Position

# The search goes outwards from the kinematic contact and ends at the first row of points that is clear of the mate by
# this share of the depth for which the windows were cut: flanks separate quadratically, so all rows behind are clear.
SMOOTH_CLEARANCE = 0.04
# Facets stand off the involute between their edges, by at most the surface error that the depth contains.
FACET_CLEARANCE = 1.0


@dataclass(frozen=True)
class Contact:
    """Slave points that penetrate, or nearly do (n of them), over all tooth pairs.

    Parameters
    ----------
    pair : ndarray of int, shape (n,)
        Number of the tooth pair in the position's list.
    slave : ndarray of int, shape (n,)
        Gear that the point belongs to: 0 pinion, 1 wheel.
    index : ndarray of int, shape (n, 8)
        Window nodes that carry the point: four of the slave's element, four of the master's.
    weight : ndarray, shape (n, 8, 3)
        Gradient of the gap by the displacements of these nodes.
    gap : ndarray, shape (n,)
        Negative: penetration, mm.
    stiffness : ndarray, shape (n,)
        Penalty times share of area, N/mm.
    lever, mate_lever : ndarray, shape (n,)
        Derivative of the gap by the pinion's rotation; lever arm of the force on the wheel, mm.
    place : ndarray of int, shape (n, 4)
        Slave point (row, column in the window) and master element (row, column in the window).
    smallest_gap : float
        Over all points, touching or not, mm; infinite when no point projects.
    touches_border : bool
        Whether contact reaches the end of a window that is not an edge of the flank.
    """

    pair: IntArray
    slave: IntArray
    index: IntArray
    weight: FloatArray
    gap: FloatArray
    stiffness: FloatArray
    lever: FloatArray
    mate_lever: FloatArray
    place: IntArray
    smallest_gap: float
    touches_border: bool

    @property
    def force(self) -> FloatArray:
        """Normal force at each point by the penalty law, shape (n,), N."""
        return -self.stiffness * self.gap

    def nodal_forces(self, force: FloatArray, n_nodes: int) -> FloatArray:
        """Return the window nodes' forces for given point forces, shape (n_nodes, 3), N."""
        nodal = np.zeros((n_nodes, 3))
        np.add.at(nodal, self.index, self.weight * force[:, None, None])
        return nodal

    def gap_change(self, displacement: FloatArray) -> FloatArray:
        """Return the linearised change of the gaps, shape (n, ...), for displacements of shape (n_nodes, 3, ...)."""
        return np.einsum("nad,nad...->n...", self.weight, displacement[self.index])


def clearance(scheme: ContactScheme) -> float:
    """Return the share of the windows' depth at which a row of points counts as clear of the mate."""
    return SMOOTH_CLEARANCE if scheme.smooth or scheme.exact else FACET_CLEARANCE


def search_contact(
    meshed: MeshedPair, position: Position, displacement: FloatArray, lead: float, largest_gap: float = 0.0
) -> Contact:
    """Find all penetrating points, and those that stand off a little.

    Parameters
    ----------
    meshed : MeshedPair
    position : Position
    displacement : ndarray, shape (n, 3)
        Displacements of the position's nodes, in each tooth's frame, mm.
    lead : float
        Rotation of the pinion ahead of its kinematic position, rad.
    largest_gap : float
        Points with a gap below it are listed, mm.

    Returns
    -------
    Contact
    """
    pairs = len(position.pair_index)
    scheme = meshed.kernel_scheme
    room, *grid = point_room(pairs, position.windows, meshed.gears, scheme)
    memory = (pairs, 2, *grid, 2)
    index, place = np.empty((room, 8), dtype=np.int64), np.empty((room, 4), dtype=np.int64)
    weight, gap, stiffness = np.empty((room, 8, 3)), np.empty(room), np.empty(room)
    lever, mate_lever = np.empty(room), np.empty(room)
    pair, slave = np.empty(room, dtype=np.int64), np.empty(room, dtype=np.int64)
    nodes = displacement if meshed.scheme.exact else position.nodes + displacement
    count, smallest, touches_border = search_all(
        position.phi, lead, nodes, pairs, position.pair_index, position.windows,
        position.first_row, position.centre, position.kinematics, meshed.gears, scheme,
        clearance(meshed.scheme) * position.depth, largest_gap, np.full(memory, -1), np.empty(memory), pair, slave,
        (index, weight, gap, stiffness, lever, mate_lever, place, np.empty(room)),
    )  # fmt: skip
    return Contact(
        pair[:count], slave[:count], index[:count], weight[:count], gap[:count], stiffness[:count], lever[:count],
        mate_lever[:count], place[:count], smallest, touches_border,
    )  # fmt: skip
