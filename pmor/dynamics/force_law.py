"""Force laws of a mesh by displacement, over arrays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pmor.core.arrays import FloatArray
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
