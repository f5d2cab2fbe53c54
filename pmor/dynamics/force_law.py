"""Force laws of a mesh by displacement, over arrays, and the pair at rest under its load.

Displacements beyond which some section is overloaded: line contact has no law there, and a table of it neither.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

import numpy as np

from pmor.core.arrays import BoolArray, FloatArray
from pmor.core.errors import ConvergenceError
from pmor.dynamics.kernels.hub_table import ClosedMeshes
from pmor.dynamics.kernels.laws import ForceTable, VaryingStiffness, mesh_forces
from pmor.gear.condition import Assembly
from pmor_online.mesh_force import overload_of
from pmor_online.model import ReducedPair

#: laws that compiled code evaluates, as integration over time does
CompiledLaw = VaryingStiffness | ForceTable


class SolvedLaw(Protocol):
    """A law without a table, solved anew at each place: expensive, for harmonic balance alone."""

    def forces(self, phase: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return forces and stiffnesses at phases and displacements, (n,) each; NaN outside its range."""


@runtime_checkable
class MachineLaw(Protocol):
    """A law on r coordinates of meshes."""

    @property
    def meshes(self) -> ClosedMeshes:
        """The law as compiled code takes it."""

    @property
    def samples(self) -> int:
        """Phases of a mesh cycle at which it is known best."""

    @property
    def steps(self) -> int:
        """Steps over time to a sample."""

    @property
    def centre(self) -> FloatArray:
        """Coordinates where the displacements of the machine are zero, under its mean load, (r,)."""

    @property
    def load(self) -> FloatArray:
        """Forces there, (r,)."""

    def forces(self, phase: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return forces (r, n) and stiffnesses (r, r, n) at phases (n,) and coordinates (r, n); NaN out of range."""


ForceLaw = CompiledLaw | SolvedLaw | MachineLaw
#: laws of motion over time
OverTime = CompiledLaw | MachineLaw


def compiled_law(law: OverTime) -> CompiledLaw | ClosedMeshes:
    """Return a law as compiled code takes it."""
    return law.meshes if isinstance(law, MachineLaw) else law


def samples_of(law: ForceLaw, samples: int) -> int:
    """Return at how many phases of a mesh cycle a law is looked at: so many, unless it says by itself."""
    return int(getattr(law, "samples", samples))


def centre_of(law: ForceLaw) -> FloatArray | None:
    """Return where the coordinates of a law stand under its load; None where that is to be found."""
    return getattr(law, "centre", None)


def coordinate_forces(law: ForceLaw, phase: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return forces (r, n) and stiffnesses (r, r, n) at phases (n,) and coordinates (r, n)."""
    if centre_of(law) is not None:
        return law.forces(phase, x)  # type: ignore[union-attr]
    force, slope = forces_at(law, phase, x[0])
    return force[None], slope[None, None]


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


# Steps over time to a sample of a law of one coordinate, at least: 1024 a mesh cycle.
STEPS = 16


def steps_of(law: OverTime) -> int:
    """Return the steps over time to each sample of a mesh cycle, at least."""
    return int(getattr(law, "steps", STEPS))


def stiffness_of(law: OverTime) -> FloatArray:
    """Return about the largest stiffness that a law puts beside the springs of its machine, (r, r)."""
    if isinstance(law, MachineLaw):
        return law.meshes.tangent
    if isinstance(law, VaryingStiffness):
        return np.full((1, 1), law.stiffness * (1.0 + abs(law.variation)))
    return np.full((1, 1), float(law.values.max()) / (law.high - law.low))


def cycles_of(law: OverTime) -> int:
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


# Phases of a mesh cycle at which the limit is known; displacements that are tried at a time, twice.
LIMIT_PHASES, TRIED = 64, 33


@dataclass(frozen=True)
class LoadLimit:
    """Range of motion in which no section is overloaded.

    Parameters
    ----------
    displacement : ndarray, shape (cycles LIMIT_PHASES,)
        Largest one along the line of action at equal phases, mm; infinite where all of the table is within.
    backlash : float
        As of `ForceTable`: coast flanks mirror the flanks.
    """

    displacement: FloatArray
    backlash: float

    @property
    def lowest(self) -> float:
        """The least of them at any phase, mm; infinite where nothing is overloaded."""
        return float(self.displacement.min())

    def shifted(self, shift: float) -> LoadLimit:
        """Return the limit for displacements that are larger by `shift` at the same force."""
        return replace(self, displacement=self.displacement + shift, backlash=self.backlash - 2.0 * shift)

    def exceeded(self, phase: FloatArray, x: FloatArray) -> BoolArray:
        """Return whether a section is overloaded at phases (rad) and displacements (mm), (n,) each."""
        back = x <= -0.5 * self.backlash
        phase, x = np.where(back, -phase, phase), np.where(back, -x - self.backlash, x)
        place = np.rint(phase * LIMIT_PHASES / (2.0 * np.pi)).astype(int) % len(self.displacement)
        return np.asarray(x > self.displacement[place])


def load_limit(reduced: ReducedPair, assembly: Assembly, table: ForceTable, alike: Sequence[int] = (0,)) -> LoadLimit:
    """Find where sections are overloaded within the range of a table.

    Parameters
    ----------
    reduced : ReducedPair
        Of line loads.
    alike : sequence of int
        Of each mesh cycle, as in `pmor.dynamics.force_table.tabulate`.
    """
    kinds, overloaded = np.asarray(alike), overload_of(reduced, assembly)
    first = np.unique(kinds, return_index=True)[1]
    limits = np.full((len(first), LIMIT_PHASES), np.inf)
    for kind, cycle in enumerate(first):
        for place in range(LIMIT_PHASES):
            phase, low, high = 2.0 * np.pi * (cycle + place / LIMIT_PHASES), table.low, table.high
            if not overloaded(phase, np.array([high]))[0]:
                continue
            for _ in range(2):
                x = np.linspace(low, high, TRIED)
                beyond = max(int(np.argmax(overloaded(phase, x))), 1)
                low, high = x[beyond - 1], x[beyond]
            limits[kind, place] = low
    return LoadLimit(limits[kinds].ravel(), table.backlash)
