"""Force laws of a mesh by displacement, over arrays."""

from __future__ import annotations

import numpy as np

from pmor.arrays import FloatArray
from pmor.dynamics.kernels.laws import ForceTable, VaryingStiffness, mesh_forces

ForceLaw = VaryingStiffness | ForceTable


def forces_at(law: ForceLaw, phase: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return forces and stiffnesses at phases and displacements, (n,) each."""
    force, slope = np.empty_like(x), np.empty_like(x)
    mesh_forces(law, phase, x, force, slope)
    return force, slope
