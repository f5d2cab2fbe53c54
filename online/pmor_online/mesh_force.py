"""The mesh force of a reduced pair by displacement, as its dynamics ask for it: solved anew at each place."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pmor.arrays import FloatArray, IntArray
from pmor.contact.condition import PLAIN, Built
from pmor.contact.kernels.line_loads import solve_leads
from pmor.contact.kernels.line_places import Lines, line_deviations
from pmor.contact.position import place_sections
from pmor.dynamics.force_table import Forces
from pmor_online.line_sweep import line_force_law
from pmor_online.model import ReducedPair

# Relative, of a displacement: where no equilibrium was found, one beside it is taken.
NUDGES = np.array([1e-9, -1e-9, 1e-8, -1e-8])
# Phases whose sections are kept placed for the next time.
MOST_KEPT = 2048


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

    def solved(phase: float, displacement: FloatArray) -> FloatArray:
        angle = np.array([phase / (2.0 * np.pi) * pitch])
        law = line_force_law(reduced, angle, list(np.asarray(displacement) / radius), built)
        return np.asarray(1e3 / radius * law.torque_Nm[:, 0])

    def forces(phase: float, displacement: FloatArray) -> FloatArray:
        found = solved(phase, displacement)
        for k in np.flatnonzero(np.isnan(found)):
            beside = solved(phase, displacement[k] * (1.0 + NUDGES))
            found[k] = next(iter(beside[np.isfinite(beside)]), np.nan)
        return found

    return forces


@dataclass(frozen=True)
class LineLoadLaw:
    """The force law of a reduced pair without a table: line loads solved at each phase and displacement.

    Phases and displacements are those of `mesh_force_of`. At phases that are asked for again and again, as harmonic
    balance does, sections stay placed, and loads start from those found there before.

    Parameters
    ----------
    reduced : ReducedPair
        Of line loads.
    built : Built
    low, high : float
        Range of displacements, mm: below it nothing touches, above it there is no force that motion could take.
    """

    reduced: ReducedPair
    built: Built
    low: float
    high: float
    _placed: dict[bytes, _Placed] = field(default_factory=dict, repr=False, compare=False)

    def forces(self, phase: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return forces, N, and stiffnesses, N/mm, at phases and displacements, (n,) each; NaN where there are none."""
        radius = self.reduced.meshed.pair.pinion.base_radius
        force, slope = np.zeros_like(x), np.zeros_like(x)
        known = (x > self.low) & (x <= self.high)
        force[x > self.high] = slope[x > self.high] = np.nan
        for start in range(0, len(phase), MOST_KEPT):
            part = slice(start, start + MOST_KEPT)
            placed = self._at(np.ascontiguousarray(phase[part]))
            torque, stiffness = placed.solve(np.where(known[part], x[part], self.low) / radius)
            force[part] = np.where(known[part], torque / radius, force[part])
            slope[part] = np.where(known[part], stiffness / radius**2, slope[part])
        return force, slope

    def _at(self, phase: FloatArray) -> _Placed:
        key = phase.tobytes()
        if key not in self._placed:
            if len(self._placed) > 1:
                self._placed.clear()
            self._placed[key] = _place(self.reduced, self.built, phase)
        return self._placed[key]


@dataclass(frozen=True)
class _Placed:
    """Sections at some phases, and the forces found there last."""

    reduced: ReducedPair
    lines: Lines
    deviation: FloatArray
    force: FloatArray

    def solve(self, lead: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return torques, N mm, and their derivatives by the leads, N mm / rad."""
        meshed = self.reduced.meshed
        width = meshed.sections.width * (2.0 if meshed.mirrored else 1.0)
        torque, stiffness = np.empty_like(lead), np.empty_like(lead)
        solve_leads(
            self.lines, self.deviation, lead, meshed.expected_approach(1.0), width, self.reduced.section_compliance,
            (meshed.gears[0].corner, meshed.gears[1].corner), self.force, torque, stiffness,
        )  # fmt: skip
        return torque, stiffness


def _place(reduced: ReducedPair, built: Built, phase: FloatArray) -> _Placed:
    meshed = reduced.meshed
    lines = place_sections(meshed, phase / (2.0 * np.pi) * meshed.pair.pitch, built.axes, reduced.components)
    deviation = np.empty((0, 0))
    if built.modified:
        deviation = np.empty_like(lines.gap)
        line_deviations(lines, meshed.sections.z, *meshed.deviations(built), deviation)
    return _Placed(reduced, lines, deviation, np.zeros_like(lines.gap))
