"""Active patches: which tooth pairs can touch at a pinion angle, and which rows of their flanks.

Everything follows from the kinematics. Near the contact point two conjugate flanks separate by ``s^2 / (2 rho)``, with
s the distance along the flank and rho the relative radius of curvature, so an approach `depth` is confined to
``s <= sqrt(2 rho depth)``. Nothing outside is deformed or evaluated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.gear.condition import ALIGNED, PLAIN, Assembly, Misalignment
from pmor.gear.kernels import motion
from pmor.gear.kernels.types import Motion
from pmor.gear.meshed_pair import MeshedPair
from pmor.penalty.kernels import windows
from pmor.penalty.kernels.types import AT_ROOT, AT_TIP, FIRST, FIRST_ROW, NODE_ROWS, OFFSET, ActivePatches, Pair
from pmor.penalty.pair import PenaltyPair, least_radius


@dataclass(frozen=True)
class Position:
    """The windows of all tooth pairs that can touch at one pinion angle.

    Parameters
    ----------
    assembly : Assembly
        Axes and flanks.
    kernel_pair : Pair
        The gears with the axis there and such flanks, for the kernels.
    patches : ActivePatches
        Tooth pairs and windows, for the kernels.
    flank_nodes : tuple of ndarray of int
        For each pair the flank-grid numbers (row-major) of the pinion window's and the wheel window's nodes.
    nodes : ndarray, shape (n, 3)
        Undeformed nodes of all windows, each in its tooth's frame, mm; of surfaces through nodes they lie where the
        flanks deviate to.
    depth : float
        Approach of the flanks for which the windows are cut, mm.
    """

    assembly: Assembly
    kernel_pair: Pair
    patches: ActivePatches
    flank_nodes: tuple[tuple[IntArray, IntArray], ...]
    nodes: FloatArray
    depth: float

    @property
    def phi(self) -> float:
        """Pinion angle, rad."""
        return self.patches.phi

    @property
    def pair_index(self) -> IntArray:
        """Tooth pairs that can touch, shape (p,)."""
        return self.patches.tooth_pair[: self.patches.pairs]

    @property
    def windows(self) -> IntArray:
        """Pinion's and wheel's window of each pair, shape (p, 2, 7); the columns are named in the kernels' types."""
        return self.patches.windows[: self.patches.pairs]

    @property
    def whole(self) -> bool:
        """Whether all windows hold their whole flanks."""
        return bool(self.windows[:, :, [AT_ROOT, AT_TIP]].all())

    def window_slice(self, pair: int, gear: int) -> slice:
        """Return the nodes of a window (gear 0: pinion, 1: wheel) in `nodes`."""
        offset = int(self.windows[pair, gear, OFFSET])
        return slice(offset, offset + len(self.flank_nodes[pair][gear]))


def active_patches(meshed: PenaltyPair, phi: float, depth: float, assembly: Assembly = PLAIN) -> Position:
    """Find the windows that can touch.

    Parameters
    ----------
    phi : float
        Pinion angle, rad.
    depth : float
        Largest approach of the flanks to allow for: deflection, penetration and surface error, mm.
    """
    clear, pair_count = meshed.clearance(assembly) * depth, meshed.tooth_pair_count
    kernel_pair = meshed.for_kernels(assembly)
    patches, _ = windows.place_windows(
        phi, depth, clear, pair_count, kernel_pair.kinematics, kernel_pair.gears, kernel_pair.limits
    )
    flank_nodes, coordinates = [], []
    for pair in patches.windows[: patches.pairs]:
        numbers = []
        for window, flank in zip(pair, (meshed.pinion, meshed.wheel), strict=True):
            low = window[FIRST_ROW] - window[FIRST]
            rows = np.arange(low, low + window[NODE_ROWS])
            numbers.append((rows[:, None] * flank.columns + np.arange(flank.columns)).ravel())
            coordinates.append(flank.nodes[rows].reshape(-1, 3))
        flank_nodes.append((numbers[0], numbers[1]))
    nodes = np.concatenate(coordinates) if coordinates else np.empty((0, 3))
    if assembly.modified:
        windows.load_windows(patches, kernel_pair.gears, kernel_pair.deviations, nodes)
    return Position(assembly, kernel_pair, patches, tuple(flank_nodes), nodes, depth)


def overshoot(meshed: MeshedPair, depth: float) -> float:
    """Return how far beyond the path of contact an approach `depth` (mm) makes a pair touch, rad of roll position."""
    return float(windows.overshoot(meshed.kinematics(ALIGNED), meshed.gears, least_radius(meshed), depth))


def relative_motion(
    meshed: MeshedPair, roll_position: float, advance: float, misalignment: Misalignment = ALIGNED
) -> tuple[FloatArray, FloatArray]:
    """Return the rigid motion from the pinion tooth's frame into the mating wheel tooth's frame.

    Parameters
    ----------
    roll_position : float
        Kinematic roll position of the pinion tooth, rad.
    advance : float
        Rotation of the pinion ahead of its kinematic position, rad.

    Returns
    -------
    rotation : ndarray, shape (3, 3)
    shift : ndarray, shape (3,)
        ``x_wheel = rotation x_pinion + shift``; `shift` is also where the pinion's axis is, mm.
    """
    forward, back = Motion(np.empty((3, 3)), np.empty(3)), Motion(np.empty((3, 3)), np.empty(3))
    motion.relative_motion(meshed.kinematics(misalignment), meshed.gears, roll_position, advance, forward, back)
    return forward.rotation, forward.shift
