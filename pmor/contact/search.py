"""Evaluate the contact of all tooth pairs in reach for given displacements and pinion rotation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pmor.contact.flank import MeshedPair
from pmor.contact.kernel import search_pair
from pmor.contact.position import Position, relative_motion
from pmor.gear.conventions import FloatArray, IntArray


@dataclass(frozen=True)
class Contact:
    """Slave points that penetrate (n of them), over all tooth pairs.

    Parameters
    ----------
    pair : ndarray of int, shape (n,)
        Number of the tooth pair in the position's list.
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
        Whether contact reaches the border of a window that is not an edge of the flank.
    """

    pair: IntArray
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


def search_contact(meshed: MeshedPair, position: Position, displacement: FloatArray, lead: float) -> Contact:
    """Find all penetrating points.

    Parameters
    ----------
    meshed : MeshedPair
    position : Position
    displacement : ndarray, shape (n, 3)
        Displacements of the position's nodes, in each tooth's frame, mm.
    lead : float
        Rotation of the pinion ahead of its kinematic position, rad.

    Returns
    -------
    Contact
    """
    scheme, windows = meshed.scheme, position.windows
    columns = meshed.pinion.columns
    points = np.array([w[3] * scheme.lodm_profile + 1 for w in windows[:, 0]]) * (
        (columns - 1) * scheme.lodm_width + 1
    )
    room = int(points.sum())
    index, place = np.empty((room, 8), dtype=np.int64), np.empty((room, 4), dtype=np.int64)
    weight = np.empty((room, 8, 3))
    gap, stiffness, lever, mate_lever = (np.empty(room) for _ in range(4))
    nodes = position.nodes + displacement
    count, smallest, touches_border, counts = 0, np.inf, False, []
    for p, pair_index in enumerate(position.pair_index):
        roll_position = position.phi + pair_index * meshed.pair.pitch
        rotation, shift = relative_motion(meshed, roll_position, lead)
        first = position.first_row[p, 0] * scheme.lodm_profile
        extents = meshed.pinion.extents[first : first + windows[p, 0, 3] * scheme.lodm_profile + 1]
        before = count
        count, nearest, at_border = search_pair(
            nodes, windows[p, 0], columns, windows[p, 1], meshed.wheel.columns, extents,
            scheme.lodm_profile, scheme.lodm_width, scheme.smooth, scheme.direct, scheme.parabolic,
            rotation, shift, True, scheme.penalty, count,
            index, weight, gap, stiffness, lever, mate_lever, place,
        )  # fmt: skip
        counts.append(count - before)
        smallest, touches_border = min(smallest, nearest), touches_border or at_border
    pair = np.repeat(np.arange(len(counts)), counts)
    return Contact(pair, index[:count], weight[:count], gap[:count], stiffness[:count], lever[:count],
                   mate_lever[:count], place[:count], smallest, touches_border)  # fmt: skip
