"""The mesh force of a reduced pair by displacement, as its dynamics ask for it."""

from __future__ import annotations

import numpy as np

from pmor.arrays import FloatArray
from pmor.contact.condition import PLAIN, Built
from pmor.dynamics.force_table import Forces
from pmor_online.line_sweep import line_force_law
from pmor_online.model import ReducedPair


def mesh_force_of(reduced: ReducedPair, built: Built = PLAIN) -> Forces:
    """Return the force along the transverse line of action (N) over phase (rad) and displacement (mm).

    Phase 0 is the pinion's angle 0, a tooth on the line of centres; 2 pi is a pitch on. The displacement is the lead
    times the base radius: under a torque that is held, the static transmission error.

    Parameters
    ----------
    reduced : ReducedPair
        Of line loads.
    built : Built
        Where the axes are, what the flanks are like; deviations of pitch do not repeat over one mesh cycle.
    """
    radius, pitch = reduced.meshed.pair.pinion.base_radius, reduced.meshed.pair.pitch

    def forces(phase: float, displacement: FloatArray) -> FloatArray:
        angle = np.array([phase / (2.0 * np.pi) * pitch])
        law = line_force_law(reduced, angle, list(np.asarray(displacement) / radius), built)
        return np.asarray(1e3 / radius * law.torque_Nm[:, 0])

    return forces
