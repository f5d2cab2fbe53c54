"""The pair at rest under its load, from its force law: the reference of a frequency response."""

from __future__ import annotations

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.errors import ConvergenceError
from pmor.dynamics.force_law import CompiledLaw, cycles_of, forces_at

# Phases of the mesh cycle that the stiffness is averaged over.
PHASES = 512
# How often the interval of a static displacement is halved.
BISECTIONS = 50


def static_displacement(law: CompiledLaw, load: float, phase: FloatArray, interval: tuple[float, float]) -> FloatArray:
    """Return the displacement along the line of action under a load at rest, within an interval, at phases (n,).

    That is the static transmission error. ConvergenceError where it does not lie in the interval.
    """
    low, high = (np.full_like(phase, end) for end in interval)
    borne = (forces_at(law, phase, low)[0] < load) & (forces_at(law, phase, high)[0] > load)
    if not borne.all():
        raise ConvergenceError(f"a load of {load:.6g} is not borne between {interval[0]:.6g} and {interval[1]:.6g}")
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        beyond = forces_at(law, phase, middle)[0] > load
        low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
    return np.asarray(0.5 * (low + high))


def mean_stiffness(law: CompiledLaw, load: float, interval: tuple[float, float]) -> float:
    """Return the tangent stiffness of the mesh at rest under a load, its mean over its period."""
    phase = np.asarray(2.0 * np.pi / PHASES * np.arange(PHASES * cycles_of(law)), dtype=float)
    return float(forces_at(law, phase, static_displacement(law, load, phase, interval))[1].mean())
