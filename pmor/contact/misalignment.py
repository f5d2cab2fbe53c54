"""Misalignment: the wheel's axis as a rigid body in another place than its nominal one.

Shafts and housings give way and are not machined exactly: the wheel's axis is then off by some hundredths of a
millimetre. The finite-element models of the gears know nothing of it, since each is made in its own frame, so that
misalignment is a parameter like the torque. Deviations in and across the plane of the axes are those of ISO/TR 10064-3.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Misalignment:
    """Offset and tilt of the wheel's axis.

    Parameters
    ----------
    in_plane_um : float
        Deviation from parallel in the plane of the axes, over the face width: at the face with the larger z the axes
        are farther apart by half of it, um.
    out_of_plane_um : float
        Deviation across that plane, over the face width: at the face with the larger z the wheel's axis is off along
        +x by half of it, um.
    centre_distance_um : float
        Increase of the centre distance at mid width, um.
    """

    in_plane_um: float = 0.0
    out_of_plane_um: float = 0.0
    centre_distance_um: float = 0.0

    @property
    def tilted(self) -> bool:
        """Whether the axes are not parallel."""
        return self.in_plane_um != 0.0 or self.out_of_plane_um != 0.0

    @property
    def spread(self) -> float:
        """Most that the gap between aligned flanks can differ over the face width, mm."""
        return 1e-3 * (abs(self.in_plane_um) + abs(self.out_of_plane_um))


ALIGNED = Misalignment()


@dataclass(frozen=True)
class OperatingCondition:
    """What a pair runs under: everything that a state depends on beside the pinion's angle.

    Parameters
    ----------
    torque : float
        On the pinion, N mm.
    misalignment : Misalignment
    """

    torque: float
    misalignment: Misalignment = ALIGNED
