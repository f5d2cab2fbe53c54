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
from pmor.contact.condition import ALIGNED, PLAIN, Axes, Built
from pmor.contact.flank import MeshedPair
from pmor.contact.kernels import motion, windows
from pmor.contact.kernels.line_places import Lines, place_lines
from pmor.contact.kernels.types import AT_ROOT, AT_TIP, FIRST, FIRST_ROW, NODE_ROWS, OFFSET, Motion, Pair, Reach


@dataclass(frozen=True)
class Position:
    """The windows of all tooth pairs in reach at one pinion angle.

    Parameters
    ----------
    built : Built
        Where the wheel's axis is, and what the flanks are like.
    kernel_pair : Pair
        The gears with the axis there and such flanks, for the kernels.
    reach : Reach
        Tooth pairs and windows, for the kernels.
    flank_nodes : tuple of ndarray of int
        For each pair the flank-grid numbers (row-major) of the pinion window's and the wheel window's nodes.
    nodes : ndarray, shape (n, 3)
        Undeformed nodes of all windows, each in its tooth's frame, mm; of surfaces through nodes they lie where the
        flanks deviate to.
    depth : float
        Approach of the flanks for which the windows are cut, mm.
    """

    built: Built
    kernel_pair: Pair
    reach: Reach
    flank_nodes: tuple[tuple[IntArray, IntArray], ...]
    nodes: FloatArray
    depth: float

    @property
    def phi(self) -> float:
        """Pinion angle, rad."""
        return self.reach.phi

    @property
    def pair_index(self) -> IntArray:
        """Tooth pairs in reach, shape (p,)."""
        return self.reach.tooth_pair[: self.reach.pairs]

    @property
    def windows(self) -> IntArray:
        """Pinion's and wheel's window of each pair, shape (p, 2, 7); the columns are named in the kernels' types."""
        return self.reach.windows[: self.reach.pairs]

    @property
    def whole(self) -> bool:
        """Whether all windows hold their whole flanks."""
        return bool(self.windows[:, :, [AT_ROOT, AT_TIP]].all())

    def window_slice(self, pair: int, gear: int) -> slice:
        """Return the nodes of a window (gear 0: pinion, 1: wheel) in `nodes`."""
        offset = int(self.windows[pair, gear, OFFSET])
        return slice(offset, offset + len(self.flank_nodes[pair][gear]))


def active_patches(meshed: MeshedPair, phi: float, depth: float, built: Built = PLAIN) -> Position:
    """Find the windows that can touch.

    Parameters
    ----------
    meshed : MeshedPair
    phi : float
        Pinion angle, rad.
    depth : float
        Largest approach of the flanks to allow for: deflection, penetration and surface error, mm.
    built : Built

    Returns
    -------
    Position
    """
    clear, reachable = meshed.clearance(built) * depth, pairs_in_reach(meshed)
    kernel_pair = meshed.for_kernels(built)
    reach, _ = windows.place_windows(phi, depth, clear, reachable, kernel_pair.kinematics, kernel_pair.gears)
    flank_nodes, coordinates = [], []
    for pair in reach.windows[: reach.pairs]:
        numbers = []
        for window, flank in zip(pair, (meshed.pinion, meshed.wheel), strict=True):
            low = window[FIRST_ROW] - window[FIRST]
            rows = np.arange(low, low + window[NODE_ROWS])
            numbers.append((rows[:, None] * flank.columns + np.arange(flank.columns)).ravel())
            coordinates.append(flank.nodes[rows].reshape(-1, 3))
        flank_nodes.append((numbers[0], numbers[1]))
    nodes = np.concatenate(coordinates) if coordinates else np.empty((0, 3))
    if built.modified and not meshed.scheme.exact:
        windows.load_windows(reach, kernel_pair.gears, kernel_pair.deviations, nodes)
    return Position(built, kernel_pair, reach, tuple(flank_nodes), nodes, depth)


def pairs_in_reach(meshed: MeshedPair) -> int:
    """Return the largest number of tooth pairs that can be in reach together."""
    # The overshoot on either side of the path of contact is at most half a pitch (`windows.overshoot`).
    return math.floor(meshed.pair.total_contact_ratio + 1.0) + 1


def place_sections(meshed: MeshedPair, phi: FloatArray, axes: Axes = ALIGNED, components: int = 2) -> Lines:
    """Place the sections of all tooth pairs that can be in reach, for line loads.

    Parameters
    ----------
    meshed : MeshedPair
        With surface layers.
    phi : ndarray, shape (n,)
        Pinion angles, rad.
    axes : Axes
    components : int
        Of displacement: 2 without, 3 with those along the axis.

    Returns
    -------
    Lines
    """
    reach, z = pairs_in_reach(meshed), meshed.sections.z
    lines: Lines = place_lines(phi, meshed.kinematics(axes), meshed.gears, z, reach, components)
    return lines


def overshoot(meshed: MeshedPair, depth: float) -> float:
    """Return how far beyond the path of contact an approach `depth` (mm) makes a pair touch, rad of roll position."""
    return float(windows.overshoot(meshed.kinematics(ALIGNED), meshed.gears, depth))


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
    forward, back = Motion(np.empty((3, 3)), np.empty(3)), Motion(np.empty((3, 3)), np.empty(3))
    motion.relative_motion(meshed.kinematics(axes), meshed.gears, roll_position, lead, forward, back)
    return forward.rotation, forward.shift
