"""A bearing by its stiffness that is loose in its clearance: it carries from where that is used up.

Across, the force is k (r - s / 2) along the displacement r once it is longer than half the clearance s; along the axis,
beyond half the play either way. Both follow from a convex potential.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pmor.body.bearing_rows import DOF
from pmor.body.rolling_bearing import BearingState
from pmor.core.arrays import FloatArray

NO_ELEMENTS, NO_ROWS = np.zeros((0, 0, 0)), np.zeros((0, DOF))


@dataclass(frozen=True)
class BearingWithPlay:
    """Springs beyond a clearance.

    Parameters
    ----------
    radial_N_per_mm, axial_N_per_mm, tilt_Nmm_per_rad : float
        0 of a direction that is free, or held otherwise.
    clearance_mm, axial_clearance_mm : float
        From one end to the other: twice the way from the middle.
    """

    radial_N_per_mm: float
    axial_N_per_mm: float
    tilt_Nmm_per_rad: float
    clearance_mm: float
    axial_clearance_mm: float

    @property
    def words(self) -> str:
        """What it is."""
        return f"springs beyond clearances of {self.clearance_mm:g} and {self.axial_clearance_mm:g} mm"

    def state(self, displacement: FloatArray) -> BearingState:
        """Return force and stiffness under a displacement, shape (5,), mm and rad."""
        force, stiffness = np.zeros(DOF), np.zeros((DOF, DOF))
        along, half = float(displacement[0]), 0.5 * self.axial_clearance_mm
        if abs(along) > half or half == 0.0:
            force[0] = self.axial_N_per_mm * (along - math.copysign(half, along))
            stiffness[0, 0] = self.axial_N_per_mm
        across, half = displacement[1:3], 0.5 * self.clearance_mm
        length = math.hypot(*across)
        if half == 0.0:
            force[1:3], stiffness[1:3, 1:3] = self.radial_N_per_mm * across, self.radial_N_per_mm * np.eye(2)
        elif length > half:
            normal = across / length
            force[1:3] = self.radial_N_per_mm * (length - half) * normal
            stiffness[1:3, 1:3] = self.radial_N_per_mm * (
                (1.0 - half / length) * np.eye(2) + half / length * np.outer(normal, normal)
            )
        force[3:], stiffness[[3, 4], [3, 4]] = self.tilt_Nmm_per_rad * displacement[3:], self.tilt_Nmm_per_rad
        return BearingState(force, stiffness, NO_ELEMENTS, NO_ROWS, 0.0, math.inf)
