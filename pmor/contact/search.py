"""Evaluate the contact of all tooth pairs in reach for given displacements and pinion rotation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pmor.contact.flank import ContactScheme, Flank, MeshedPair
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
        Whether contact reaches the border of a window that is not an edge of the flank.
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
    flanks = meshed.pinion, meshed.wheel
    passes = [(p, slave, weight) for p in range(len(windows)) for slave, weight in _passes(meshed, position, p)]
    room = sum(_points(scheme, windows[p, slave], flanks[slave]) for p, slave, _ in passes)
    index, place = np.empty((room, 8), dtype=np.int64), np.empty((room, 4), dtype=np.int64)
    weight = np.empty((room, 8, 3))
    gap, stiffness, lever, mate_lever = (np.empty(room) for _ in range(4))
    nodes = position.nodes + displacement
    count, smallest, touches_border, counts = 0, np.inf, False, []
    for p, slave, share in passes:
        roll_position = position.phi + position.pair_index[p] * meshed.pair.pitch
        rotation, shift = relative_motion(meshed, roll_position, lead)
        if slave == 1:
            rotation, shift = np.ascontiguousarray(rotation.T), -rotation.T @ shift
        master = 1 - slave
        first = position.first_row[p, slave] * scheme.lodm_profile
        extents = flanks[slave].extents[first : first + windows[p, slave, 3] * scheme.lodm_profile + 1]
        before = count
        count, nearest, at_border = search_pair(
            nodes, windows[p, slave], flanks[slave].columns, windows[p, master], flanks[master].columns, extents,
            scheme.lodm_profile, scheme.lodm_width, scheme.smooth, scheme.direct, scheme.parabolic,
            rotation, shift, slave == 0, share * scheme.penalty, count,
            index, weight, gap, stiffness, lever, mate_lever, place,
        )  # fmt: skip
        counts.append(count - before)
        smallest, touches_border = min(smallest, nearest), touches_border or at_border
    pair, slave_gear = (np.repeat(np.array([q[i] for q in passes], dtype=np.int64), counts) for i in (0, 1))
    return Contact(pair, slave_gear, index[:count], weight[:count], gap[:count], stiffness[:count], lever[:count],
                   mate_lever[:count], place[:count], smallest, touches_border)  # fmt: skip


def _passes(meshed: MeshedPair, position: Position, pair: int) -> list[tuple[int, float]]:
    """Slave gear (0: pinion, 1: wheel) and share of the penalty of each pass over a tooth pair."""
    roll_position = position.phi + position.pair_index[pair] * meshed.pair.pitch
    share = pinion_slave_share(meshed, roll_position)
    return [(slave, weight) for slave, weight in ((0, share), (1, 1.0 - share)) if weight > 0.0]


def pinion_slave_share(meshed: MeshedPair, roll_position: float) -> float:
    """Return the share of the penalty with which the pinion is the slave; the wheel has the rest.

    Slave ``tip``: the gear whose tip is nearer to the contact is the slave, so that a tip corner always meets the
    smooth flank of its mate, on either gear alike. The two hand over smoothly in the middle third of the path of
    contact.
    """
    fixed = {"pinion": 1.0, "wheel": 0.0, "both": 0.5}
    if meshed.scheme.slave in fixed:
        return fixed[meshed.scheme.slave]
    first, last = meshed.pair.roll_position_range
    x = min(max(3.0 * (roll_position - first) / (last - first) - 1.0, 0.0), 1.0)
    return x * x * (3.0 - 2.0 * x)


def _points(scheme: ContactScheme, window: IntArray, flank: Flank) -> int:
    return int(window[3] * scheme.lodm_profile + 1) * ((flank.columns - 1) * scheme.lodm_width + 1)
