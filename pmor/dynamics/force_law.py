"""Force laws of a mesh by displacement, over arrays, and the pair at rest under its load."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.errors import ConvergenceError
from pmor.dynamics.kernels.laws import ForceTable, VaryingStiffness, mesh_forces

#: laws that compiled code evaluates, as integration over time does
CompiledLaw = VaryingStiffness | ForceTable


class SolvedLaw(Protocol):
    """A law without a table, solved anew at each place: expensive, for harmonic balance alone."""

    def forces(self, phase: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return forces and stiffnesses at phases and displacements, (n,) each; NaN outside its range."""


ForceLaw = CompiledLaw | SolvedLaw


def forces_at(law: ForceLaw, phase: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return forces and stiffnesses at phases and displacements, (n,) each."""
    if not isinstance(law, CompiledLaw):
        return law.forces(phase, x)
    force, slope = np.empty_like(x), np.empty_like(x)
    mesh_forces(law, phase, x, force, slope)
    return force, slope


@dataclass(frozen=True)
class Shifted:
    """A law that counts displacements from another place."""

    law: SolvedLaw
    shift: float  # New displacement less that of the law

    def forces(self, phase: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return forces and stiffnesses at phases and displacements, (n,) each."""
        return self.law.forces(phase, x - self.shift)


def shifted(table: ForceTable, shift: float) -> ForceTable:
    """Return a table for displacements that are larger by `shift` at the same force."""
    return table._replace(low=table.low + shift, high=table.high + shift, backlash=table.backlash - 2.0 * shift)


def cycles_of(law: CompiledLaw) -> int:
    """Return after how many mesh cycles a law repeats."""
    return len(law.root) if isinstance(law, ForceTable) else 1


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
