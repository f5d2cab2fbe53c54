"""The mesh force of a reduced pair by displacement, as its dynamics ask for it: solved anew at each place."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from pmor.core.arrays import BoolArray, FloatArray
from pmor.gear.condition import PLAIN, Assembly
from pmor.line.kernels.types import LineResults
from pmor.line.pair import LinePair, PlacedSections
from pmor_online.model import ReducedPair

#: forces at a phase (rad) and at displacements along the line of action: (displacements,) to (displacements,)
Forces = Callable[[float, FloatArray], FloatArray]

# Phases whose sections are placed at a time, and memory of placed sections beyond which none are kept for later.
PHASES_AT_ONCE, MOST_BYTES = 1024, 1 << 29


def mesh_force_of(reduced: ReducedPair, assembly: Assembly = PLAIN) -> Forces:
    """Return the force along the transverse line of action (N) over phase (rad) and displacement (mm).

    Phase 0 is the pinion's angle 0, a tooth on the line of centres; 2 pi is a pitch on. The displacement is the advance
    times the base radius: under a torque that is held, the static transmission error.

    Parameters
    ----------
    reduced : ReducedPair
        Of line loads.
    assembly : Assembly
        Axes and flanks; deviations of pitch do not repeat over one mesh cycle.
    """
    return _MeshForce(reduced.lines, assembly)


def overload_of(reduced: ReducedPair, assembly: Assembly = PLAIN) -> Callable[[float, FloatArray], BoolArray]:
    """Return the function that tells at which displacements some section is overloaded (`WidthLimit`).

    Parameters as in `mesh_force_of`; phases and displacements too.
    """
    return _MeshForce(reduced.lines, assembly).overloaded


@dataclass(frozen=True)
class _MeshForce:
    """A force law that can be pickled: processes share out its phases."""

    pair: LinePair
    assembly: Assembly

    def __call__(self, phase: float, displacement: FloatArray) -> FloatArray:
        _, found = self._solved(phase, displacement)
        force = found.torque[:, 0].sum(axis=1) / self.pair.base_radius
        return np.where(found.converged[:, 0], force, np.nan)

    def overloaded(self, phase: float, displacement: FloatArray) -> BoolArray:
        """Whether contact of some section is too wide for the law, (displacements,)."""
        placed, found = self._solved(phase, displacement)
        return np.asarray(placed.width_limit.exceeded(found.force)[:, 0])

    def _solved(self, phase: float, displacement: FloatArray) -> tuple[PlacedSections, LineResults]:
        placed = place_phases(self.pair, np.array([phase]), self.assembly)
        return placed, placed.solve(displacement / self.pair.base_radius, True, placed.deviation(self.assembly))


@dataclass(frozen=True)
class LineLoadLaw:
    """The force law of a reduced pair without a table: line loads solved at each phase and displacement.

    Phases and displacements are those of `mesh_force_of`. At phases that are asked for again and again, as harmonic
    balance does, sections stay placed, and loads start from those found there before.

    Parameters
    ----------
    reduced : ReducedPair
        Of line loads.
    low, high : float
        Range of displacements, mm: below it nothing touches, above it there is no force that motion could take.
    backlash : float
        Displacement to where the coast flanks touch, mirror images of the flanks, mm; infinite for none.
    """

    reduced: ReducedPair
    assembly: Assembly
    low: float
    high: float
    backlash: float = np.inf
    _known: dict[bytes, _Known] = field(default_factory=dict, repr=False, compare=False)

    def forces(self, phase: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return forces, N, and stiffnesses, N/mm, at phases and displacements, (n,) each; NaN where there are none."""
        force, slope = self._of_flanks(phase, x)
        back = x <= -0.5 * self.backlash
        if back.any():
            mirrored, steep = self._of_flanks(-phase, np.where(back, -x - self.backlash, self.low))
            force, slope = np.where(back, -mirrored, force), np.where(back, steep, slope)
        return force, slope

    def _of_flanks(self, phase: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        radius, touches = self.reduced.lines.base_radius, (x > self.low) & (x <= self.high)
        force = np.where(x > self.high, np.nan, 0.0)
        slope = force.copy()
        for start in range(0, len(phase), PHASES_AT_ONCE):
            part = slice(start, start + PHASES_AT_ONCE)
            near, known = touches[part], self._at(np.ascontiguousarray(phase[part]))
            advance = np.where(near, x[part], self.low) / radius
            found = known.placed.solve(advance[None], True, known.deviation, force=known.force)
            known.force[:] = found.force
            torque = np.where(found.converged[0], found.torque[0].sum(axis=1), np.nan)
            stiffness = np.where(found.converged[0], found.stiffness[0, :, 0, 0], np.nan)
            force[part] = np.where(near, torque / radius, force[part])
            slope[part] = np.where(near, stiffness / radius**2, slope[part])
        return force, slope

    def _at(self, phase: FloatArray) -> _Known:
        key = phase.tobytes()
        if key not in self._known:
            if sum(known.placed.nbytes for known in self._known.values()) > MOST_BYTES:
                self._known.clear()
            placed = place_phases(self.reduced.lines, phase, self.assembly)
            force = np.zeros((1, *placed.lines.gap.shape))
            self._known[key] = _Known(placed, placed.deviation(self.assembly), force)
        return self._known[key]


@dataclass(frozen=True)
class _Known:
    """Sections at some phases, their flanks' deviations, and the last forces there; owned by one law."""

    placed: PlacedSections
    deviation: FloatArray
    force: FloatArray


def place_phases(pair: LinePair, phase: FloatArray, assembly: Assembly) -> PlacedSections:
    """Place the sections of line loads at phases (A,) of the mesh cycle, rad."""
    return pair.place(phase / (2.0 * np.pi) * pair.meshed.pair.pitch, assembly.misalignment)
