"""Active patches: which tooth pairs can touch at a pinion angle, and which rows of their flanks.

Everything follows from the kinematics. Near the contact point two conjugate flanks separate by ``s^2 / (2 rho)``, with
s the distance along the flank and rho the relative radius of curvature, so an approach `depth` is confined to
``s <= sqrt(2 rho depth)``. Nothing outside is deformed or evaluated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pmor.arrays import FloatArray, IntArray
from pmor.contact import kernel
from pmor.contact.condition import ALIGNED, Axes
from pmor.contact.flank import MeshedPair


@dataclass(frozen=True)
class Position:
    """The windows of all tooth pairs in reach at one pinion angle.

    Parameters
    ----------
    phi : float
        Pinion angle, rad.
    axes : Axes
        Where the wheel's axis is.
    kinematics : ndarray
        With the axis there, for the kernel (`MeshedPair.kinematics`).
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
    centre : ndarray, shape (p, 2)
        Kinematic contact of each pair on pinion and wheel, in element rows of the flank.
    depth : float
        Approach of the flanks for which the windows are cut, mm.
    """

    phi: float
    axes: Axes
    kinematics: FloatArray
    pair_index: IntArray
    windows: IntArray
    first_row: IntArray
    flank_nodes: tuple[tuple[IntArray, IntArray], ...]
    nodes: FloatArray
    centre: FloatArray
    depth: float

    def window_slice(self, pair: int, gear: int) -> slice:
        """Return the nodes of a window (gear 0: pinion, 1: wheel) in `nodes`."""
        offset = int(self.windows[pair, gear, 0])
        return slice(offset, offset + len(self.flank_nodes[pair][gear]))


def active_patches(meshed: MeshedPair, phi: float, depth: float, axes: Axes = ALIGNED) -> Position:
    """Find the windows that can touch.

    Parameters
    ----------
    meshed : MeshedPair
    phi : float
        Pinion angle, rad.
    depth : float
        Largest approach of the flanks to allow for: deflection, penetration and surface error, mm.
    axes : Axes

    Returns
    -------
    Position
    """
    reachable = pairs_in_reach(meshed)
    indices, windows = np.zeros(reachable, dtype=np.int64), np.zeros((reachable, 2, 6), dtype=np.int64)
    first_row, centre = np.zeros((reachable, 2), dtype=np.int64), np.zeros((reachable, 2))
    kinematics = meshed.kinematics(axes)
    pairs, _ = kernel.place_windows(phi, depth, kinematics, meshed.gears, indices, windows, first_row, centre)
    flank_nodes, coordinates = [], []
    for p in range(pairs):
        numbers = []
        for gear, flank in enumerate((meshed.pinion, meshed.wheel)):
            low = first_row[p, gear] - windows[p, gear, 2]
            rows = np.arange(low, low + windows[p, gear, 1])
            numbers.append((rows[:, None] * flank.columns + np.arange(flank.columns)).ravel())
            coordinates.append(flank.nodes[rows].reshape(-1, 3))
        flank_nodes.append((numbers[0], numbers[1]))
    nodes = np.concatenate(coordinates) if coordinates else np.empty((0, 3))
    return Position(phi, axes, kinematics, indices[:pairs], windows[:pairs], first_row[:pairs], tuple(flank_nodes),
                    nodes, centre[:pairs], depth)  # fmt: skip


def pairs_in_reach(meshed: MeshedPair) -> int:
    """Return the largest number of tooth pairs that can be in reach together."""
    # The overshoot on either side of the path of contact is at most half a pitch (`kernel.overshoot`).
    return math.floor(meshed.pair.contact_ratio + 1.0) + 1


def overshoot(meshed: MeshedPair, depth: float) -> float:
    """Return how far beyond the path of contact an approach `depth` (mm) makes a pair touch, rad of roll position."""
    return float(kernel.overshoot(meshed.kinematics(ALIGNED), meshed.gears, depth))


def relative_motion(
    meshed: MeshedPair, roll_position: float, lead: float, axes: Axes = ALIGNED
) -> tuple[FloatArray, FloatArray]:
    """Return the rigid motion from the pinion tooth's frame into the mating wheel tooth's frame.

    Parameters
    ----------
    meshed : MeshedPair
    roll_position : float
        Kinematic roll position of the pinion tooth, rad.
    lead : float
        Rotation of the pinion ahead of its kinematic position, rad.
    axes : Axes

    Returns
    -------
    rotation : ndarray, shape (3, 3)
    shift : ndarray, shape (3,)
        ``x_wheel = rotation x_pinion + shift``; `shift` is also where the pinion's axis is, mm.
    """
    rotation, shift = np.empty((3, 3)), np.empty(3)
    kernel.relative_motion(meshed.kinematics(axes), meshed.gears, roll_position, lead, rotation, shift)
    return rotation, shift
