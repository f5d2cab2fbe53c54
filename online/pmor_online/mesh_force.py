"""The mesh force of a reduced pair by displacement, as its dynamics ask for it: solved anew at each place."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.gear.condition import PLAIN, Assembly
from pmor.gear.kernels.deviation import Deviation
from pmor.gear.kernels.types import Gear, Kinematics
from pmor.line.kernels.loads import solve_advances, solve_lines
from pmor.line.kernels.places import Lines, line_deviations, place_lines
from pmor.line.kernels.tip_corner import Corner
from pmor.line.kernels.types import Layer
from pmor_online.line_sweep import levers_of, no_results
from pmor_online.model import ReducedPair

#: forces at a phase (rad) and at displacements along the line of action: (displacements,) to (displacements,)
Forces = Callable[[float, FloatArray], FloatArray]

# Relative, of a displacement: where no equilibrium was found, one beside it is taken.
NUDGES = np.array([1e-9, -1e-9, 1e-8, -1e-8])
# Phases whose sections are placed at a time, and flexibilities of sections beyond which none stay placed for later.
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
        Where the axes are, what the flanks are like; deviations of pitch do not repeat over one mesh cycle.
    """
    return _MeshForce(_mesh(reduced, assembly))


@dataclass(frozen=True)
class _MeshForce:
    """A force law that can be pickled: processes share out its phases."""

    mesh: _Mesh

    def __call__(self, phase: float, displacement: FloatArray) -> FloatArray:
        found = self._solved(phase, displacement)
        for k in np.flatnonzero(np.isnan(found)):
            beside = self._solved(phase, displacement[k] * (1.0 + NUDGES))
            found[k] = next(iter(beside[np.isfinite(beside)]), np.nan)
        return found

    def _solved(self, phase: float, displacement: FloatArray) -> FloatArray:
        mesh = self.mesh
        lines, deviation = mesh.placed(np.array([phase]))
        advance = np.asarray(displacement) / mesh.radius
        found = no_results(len(advance), 1, lines.gap.shape[1], False)
        solve_lines(lines, deviation, advance, True, mesh.rate, mesh.width, mesh.compliance, mesh.corners, found)
        torque = -(levers_of(lines, found) * found.force)[:, 0].sum(axis=1)
        return np.where(found.converged[:, 0], torque / mesh.radius, np.nan)


@dataclass(frozen=True)
class LineLoadLaw:
    """The force law of a reduced pair without a table: line loads solved at each phase and displacement.

    Phases and displacements are those of `mesh_force_of`. At phases that are asked for again and again, as harmonic
    balance does, sections stay placed, and loads start from those found there before.

    Parameters
    ----------
    reduced : ReducedPair
        Of line loads.
    assembly : Assembly
    low, high : float
        Range of displacements, mm: below it nothing touches, above it there is no force that motion could take.
    backlash : float
        Displacement to where the backs of teeth touch, mirror images of the flanks, mm; infinite for none.
    """

    reduced: ReducedPair
    assembly: Assembly
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
        mesh, touches = self._mesh, (x > self.low) & (x <= self.high)
        force = np.where(x > self.high, np.nan, 0.0)
        slope = force.copy()
        for start in range(0, len(phase), PHASES_AT_ONCE):
            part = slice(start, start + PHASES_AT_ONCE)
            near, placed = touches[part], self._at(np.ascontiguousarray(phase[part]))
            torque, stiffness = np.empty(len(near)), np.empty(len(near))
            solve_advances(
                placed.lines, placed.deviation, np.where(near, x[part], self.low) / mesh.radius, mesh.rate, mesh.width,
                mesh.compliance, mesh.corners, placed.force, torque, stiffness,
            )  # fmt: skip
            force[part] = np.where(near, torque / mesh.radius, force[part])
            slope[part] = np.where(near, stiffness / mesh.radius**2, slope[part])
        return force, slope

    @cached_property
    def _mesh(self) -> _Mesh:
        return _mesh(self.reduced, self.assembly)

    def _at(self, phase: FloatArray) -> _Placed:
        key = phase.tobytes()
        if key not in self._placed:
            if sum(placed.lines.flexibility.nbytes for placed in self._placed.values()) > MOST_BYTES:
                self._placed.clear()
            lines, deviation = self._mesh.placed(phase)
            self._placed[key] = _Placed(lines, deviation, np.zeros_like(lines.gap))
        return self._placed[key]


@dataclass(frozen=True)
class _Placed:
    """Sections at some phases, what their flanks deviate by, and the forces found there last."""

    lines: Lines
    deviation: FloatArray
    force: FloatArray


@dataclass(frozen=True)
class _Mesh:
    """What the kernels need to know of a pair, made once for all phases; see `place_lines` and `solve_lines`."""

    radius: float
    pitch: float
    kinematics: Kinematics
    gears: tuple[Gear, Gear]
    layers: tuple[Layer, Layer]
    deviations: tuple[Deviation, Deviation] | None
    z: FloatArray
    pair_count: int
    components: int
    rate: float
    width: FloatArray
    compliance: tuple[FloatArray, FloatArray]
    corners: tuple[Corner, Corner]

    def placed(self, phase: FloatArray) -> tuple[Lines, FloatArray]:
        """Return the sections at phases, and what their flanks deviate by."""
        angle = phase / (2.0 * np.pi) * self.pitch
        lines: Lines = place_lines(
            angle, self.kinematics, self.gears, self.layers, self.z, self.pair_count, self.components
        )
        if self.deviations is None:
            return lines, np.empty((0, 0))
        deviation = np.empty_like(lines.gap)
        line_deviations(lines, self.z, *self.deviations, deviation)
        return lines, deviation


def _mesh(reduced: ReducedPair, assembly: Assembly) -> _Mesh:
    meshed, gears = reduced.layered, reduced.layered.gears
    return _Mesh(
        meshed.pair.pinion.base_radius, meshed.pair.pitch, meshed.kinematics(assembly.misalignment), gears, meshed.kernel_layers,
        meshed.deviations(assembly) if assembly.modified else None, meshed.sections.z, meshed.tooth_pair_count,
        reduced.components, meshed.expected_approach(1.0), meshed.width,
        reduced.section_compliance, meshed.corners,
    )  # fmt: skip
