"""Active patches: which tooth pairs can touch at a pinion angle, and which rows of their flanks.

Everything follows from the kinematics. Near the contact point two conjugate flanks separate by ``s^2 / (2 rho)``, with
s the distance along the flank and rho the relative radius of curvature, so an approach `depth` is confined to
``s <= sqrt(2 rho depth)``. Nothing outside is deformed or evaluated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pmor.contact.flank import Flank, MeshedPair
from pmor.gear.conventions import FloatArray, IntArray, rotation_z
from pmor.gear.tooth import Tooth


@dataclass(frozen=True)
class Position:
    """The windows of all tooth pairs in reach at one pinion angle.

    Parameters
    ----------
    phi : float
        Pinion angle, rad.
    pair_index : ndarray of int, shape (p,)
        Tooth pairs in reach.
    windows : ndarray of int, shape (p, 2, 6)
        Pinion's and wheel's window of each pair (`pmor.contact.kernel`).
    first_row : ndarray of int, shape (p, 2)
        Element row of the flank with which each window's elements begin.
    flank_nodes : tuple of ndarray of int
        For each pair the flank-grid numbers (row-major) of the pinion window's and the wheel window's nodes.
    nodes : ndarray, shape (n, 3)
        Undeformed nodes of all windows, each in its tooth's frame, mm.
    """

    phi: float
    pair_index: IntArray
    windows: IntArray
    first_row: IntArray
    flank_nodes: tuple[tuple[IntArray, IntArray], ...]
    nodes: FloatArray

    def window_slice(self, pair: int, gear: int) -> slice:
        """Return the nodes of a window (gear 0: pinion, 1: wheel) in `nodes`."""
        offset = int(self.windows[pair, gear, 0])
        return slice(offset, offset + len(self.flank_nodes[pair][gear]))


def active_patches(meshed: MeshedPair, phi: float, depth: float) -> Position:
    """Find the windows that can touch.

    Parameters
    ----------
    meshed : MeshedPair
    phi : float
        Pinion angle, rad.
    depth : float
        Largest approach of the flanks to allow for: deflection, penetration and surface error, mm.

    Returns
    -------
    Position
    """
    pair = meshed.pair
    indices = pair.pairs_in_reach(phi, overshoot(meshed, depth))
    windows = np.zeros((len(indices), 2, 6), dtype=np.int64)
    first_row = np.zeros((len(indices), 2), dtype=np.int64)
    flank_nodes, coordinates, offset = [], [], 0
    for p, index in enumerate(indices):
        rolls = pair.contact_roll_angles(np.array(phi + index * pair.pitch))
        half = math.sqrt(2.0 * depth * _relative_radius(meshed, rolls))
        numbers = []
        for gear, (flank, tooth) in enumerate(((meshed.pinion, pair.pinion), (meshed.wheel, pair.wheel))):
            low, high = _element_rows(flank, tooth, float(rolls[gear]), half)
            node_low, node_high = max(low - 1, 0), min(high + 1, flank.element_rows)
            windows[p, gear] = (offset, node_high - node_low + 1, low - node_low, high - low,
                                low == 0, high == flank.element_rows)  # fmt: skip
            first_row[p, gear] = low
            grid = np.arange(node_low, node_high + 1)[:, None] * flank.columns + np.arange(flank.columns)
            numbers.append(grid.ravel())
            coordinates.append(flank.nodes[node_low : node_high + 1].reshape(-1, 3))
            offset += grid.size
        flank_nodes.append((numbers[0], numbers[1]))
    nodes = np.concatenate(coordinates) if coordinates else np.empty((0, 3))
    return Position(phi, indices, windows, first_row, tuple(flank_nodes), nodes)


def overshoot(meshed: MeshedPair, depth: float) -> float:
    """Return how far beyond the path of contact an approach `depth` (mm) makes a pair touch, rad of roll position."""
    pair = meshed.pair
    radius = max(
        _relative_radius(meshed, pair.contact_roll_angles(np.array(end))) for end in pair.roll_position_range
    )
    return min(math.sqrt(2.0 * depth * radius) / pair.pinion.base_radius, 0.5 * pair.pitch)


def relative_motion(meshed: MeshedPair, roll_position: float, lead: float) -> tuple[FloatArray, FloatArray]:
    """Return the rigid motion from the pinion tooth's frame into the mating wheel tooth's frame.

    Parameters
    ----------
    meshed : MeshedPair
    roll_position : float
        Kinematic roll position of the pinion tooth, rad.
    lead : float
        Rotation of the pinion ahead of its kinematic position, rad.

    Returns
    -------
    rotation : ndarray, shape (3, 3)
    shift : ndarray, shape (3,)
        ``x_wheel = rotation x_pinion + shift``; `shift` is also where the pinion's axis is, mm.
    """
    wheel_rotation = math.pi + meshed.pair.wheel_tooth_rotation(roll_position)
    rotation = rotation_z(roll_position + lead - wheel_rotation)
    shift = rotation_z(-wheel_rotation) @ np.array([0.0, -meshed.pair.centre_distance, 0.0])
    return rotation, shift


def _relative_radius(meshed: MeshedPair, rolls: tuple[FloatArray, FloatArray]) -> float:
    pair = meshed.pair
    radii = []
    for roll, tooth in zip(rolls, (pair.pinion, pair.wheel), strict=True):
        clipped = min(max(float(roll), tooth.form_roll_angle), tooth.tip_roll_angle)
        radii.append(max(clipped * tooth.base_radius, 0.1 * tooth.module))
    return 1.0 / (1.0 / radii[0] + 1.0 / radii[1])


def _element_rows(flank: Flank, tooth: Tooth, roll: float, half: float) -> tuple[int, int]:
    """Element rows [low, high) of a flank within the arc length `half` of a roll angle."""
    roll = min(max(roll, tooth.form_roll_angle), tooth.tip_roll_angle)
    reach = 2.0 * half / tooth.base_radius  # s = r_b u^2 / 2
    lowest, highest = math.sqrt(max(roll**2 - reach, 0.0)), math.sqrt(roll**2 + reach)
    low = int(np.searchsorted(flank.roll_angle, lowest, side="right")) - 1
    high = int(np.searchsorted(flank.roll_angle, highest, side="left"))
    low = min(max(low, 0), flank.element_rows - 1)
    return low, min(max(high, low + 1), flank.element_rows)
