"""The mesh force of a reduced pair by displacement, as its dynamics ask for it: solved anew at each place."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pmor.arrays import FloatArray
from pmor.contact.condition import PLAIN, Built
from pmor.contact.kernels.line_loads import solve_leads
from pmor.contact.kernels.line_places import Lines, line_deviations
from pmor.contact.position import place_sections
from pmor.dynamics.force_table import Forces
from pmor_online.line_sweep import line_force_law
from pmor_online.model import ReducedPair

# Relative, of a displacement: where no equilibrium was found, one beside it is taken.
NUDGES = np.array([1e-9, -1e-9, 1e-8, -1e-8])
# Phases whose sections are placed at a time, and flexibilities of sections beyond which none stay placed for later.
PHASES_AT_ONCE, MOST_BYTES = 1024, 1 << 29


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
    backlash : float
        Displacement to where the backs of teeth touch, mirror images of the flanks, mm; infinite for none.
    """

    reduced: ReducedPair
    built: Built
    low: float
    high: float
    backlash: float = np.inf
    _placed: dict[bytes, _Placed] = field(default_factory=dict, repr=False, compare=False)

    def forces(self, phase: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return forces, N, and stiffnesses, N/mm, at phases and displacements, (n,) each; NaN where there are none."""
        force, slope = self._of_flanks(phase, x)
        back = x <= -0.5 * self.backlash
        if back.any():
            mirrored, steep = self._of_flanks(-phase, np.where(back, -x - self.backlash, self.low))
            force, slope = np.where(back, -mirrored, force), np.where(back, steep, slope)
        return force, slope

    def _of_flanks(self, phase: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        radius, touches = self.reduced.meshed.pair.pinion.base_radius, (x > self.low) & (x <= self.high)
        force = np.where(x > self.high, np.nan, 0.0)
        slope = force.copy()
        for start in range(0, len(phase), PHASES_AT_ONCE):
            part = slice(start, start + PHASES_AT_ONCE)
            near = touches[part]
            placed = self._at(np.ascontiguousarray(phase[part]))
            torque, stiffness = placed.solve(np.where(near, x[part], self.low) / radius)
            force[part] = np.where(near, torque / radius, force[part])
            slope[part] = np.where(near, stiffness / radius**2, slope[part])
        return force, slope

    def _at(self, phase: FloatArray) -> _Placed:
        key = phase.tobytes()
        if key not in self._placed:
            held = sum(placed.lines.flexibility.nbytes for placed in self._placed.values())
            if held > MOST_BYTES:
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
