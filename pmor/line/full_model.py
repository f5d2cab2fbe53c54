"""Line contact on the compliance of all flank nodes: slow and obvious, the reference for the compiled solver.

The equations are those of `pmor.line.kernels.loads`, with the flexibility D = W C W^T multiplied out from the
compliance C of whole flanks for each position, and Newton's method on forces and advance together.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pmor.body.support import Support
from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.core.errors import ConvergenceError
from pmor.gear.condition import Condition, common_build
from pmor.line.hertz import TOO_WIDE, width_limit
from pmor.line.kernels.law import approach_of
from pmor.line.kernels.places import line_deviations
from pmor.line.kernels.pressure import PATCH_FIELDS, line_patches
from pmor.line.kernels.tip_corner import LineLaw
from pmor.line.layered_pair import LayeredPair, place_sections
from pmor.line.pair import on_supports, row_normals

MAX_STEPS, PATIENCE, TOLERANCE = 100, 20, 1e-12
# Sections whose rigid flanks overlap by more than minus this share of the deepest overlap may carry.
NEARBY = 0.2


class ToothCompliance(Protocol):
    """Compliance of the flanks of both gears, equation (A) of `pmor.body`."""

    @property
    def supports(self) -> tuple[Support | None, Support | None]:
        """The part of low rank of pinion and wheel."""

    def between(self, gear: int, offset: int) -> FloatArray:
        """Return the displacement of tooth `offset` of a gear under unit forces on tooth 0, (n, n), mm/N."""


@dataclass(frozen=True)
class LineState:
    """Sections that carry load at one pinion angle, n of them, and how the flanks deform.

    Attributes
    ----------
    advance : float
        Rotation of the pinion ahead of its kinematic position, rad.
    steps : int
        Of Newton's method.
    pair, section : (n,) int
        Tooth pair and section.
    force : (n,)
        Along the transverse line of action, N; of the image behind a plane of symmetry too.
    line_load : (n,)
        N/mm.
    lever, mate_lever : (n,)
        Derivative of the gap by the pinion's rotation; lever arm of the force on the wheel, mm.
    lever_change : (n,)
        By how much the lever differs from that without load, mm.
    law : (n, LAW_FIELDS)
        `LineLaw` of each section.
    roll : (n, 2)
        Roll angles on pinion and wheel, rad.
    loaded_pairs : (p,) int
        Tooth pairs with a section that may carry.
    nodal_force, displacement : pairs of (p, rows, columns, c)
        Of the flank nodes of these teeth of pinion and wheel in their teeth's frames, N and mm; without any support.
    condition_number : float
        Of the last matrix of the sections that carry.
    """

    advance: float
    steps: int
    pair: IntArray
    section: IntArray
    force: FloatArray
    line_load: FloatArray
    lever: FloatArray
    mate_lever: FloatArray
    lever_change: FloatArray
    law: FloatArray
    roll: FloatArray
    loaded_pairs: IntArray
    nodal_force: tuple[FloatArray, FloatArray]
    displacement: tuple[FloatArray, FloatArray]
    condition_number: float

    @property
    def torque(self) -> FloatArray:
        """Torque on the pinion of each section, shape (n,), N mm."""
        return -self.force * self.lever

    @property
    def wheel_torque(self) -> float:
        """Torque of the contact forces on the wheel, N mm."""
        return float(self.force @ self.mate_lever)

    def patches(self) -> FloatArray:
        """Return half-width (mm), offset towards the pinion's tip (mm) and peak pressure (MPa), shape (n, 3)."""
        found = np.empty((1, len(self.force), PATCH_FIELDS))
        line_patches(self.law, self.line_load[None], found)
        return np.asarray(found[0])


@dataclass(frozen=True)
class SolvedAngle:
    """States at one pinion angle.

    Parameters
    ----------
    states : tuple of LineState or None
        One for each condition; None where Newton's method did not converge.
    failures : tuple of str
        Messages of the failed ones.
    seconds : float
        Wall time.
    """

    states: tuple[LineState | None, ...]
    failures: tuple[str, ...]
    seconds: float


def solve_angle(
    meshed: LayeredPair, compliance: ToothCompliance, phi: float, conditions: Sequence[Condition],
    start: float | None = None,
) -> SolvedAngle:  # fmt: skip
    """Solve one pinion angle (rad) under conditions with the same axes and flanks.

    Parameters
    ----------
    compliance : callable
        ``compliance(gear, offset)`` of whole flanks (`ToothCompliance`).
    phi : float
        rad.
    start : float, optional
        Advance to start from, rad; by default the expected one.
    """
    began = time.perf_counter()
    flanks = _Flanks(meshed, compliance, phi, conditions)
    states: list[LineState | None] = []
    failures: list[str] = []
    for condition in conditions:
        try:
            states.append(flanks.solve(condition, start))
        except ConvergenceError as error:
            states.append(None)
            failures.append(str(error))
    return SolvedAngle(tuple(states), tuple(failures), time.perf_counter() - began)


@dataclass(frozen=True)
class _Solution:
    """Forces of the sections that may carry, at an advance."""

    candidates: IntArray
    carries: BoolArray
    force: FloatArray
    advance: float
    steps: int
    condition_number: float


class _Flanks:
    """The flanks at one pinion angle: gaps between them, and how sections are carried by the nodes."""

    def __init__(
        self, meshed: LayeredPair, compliance: ToothCompliance, phi: float, conditions: Sequence[Condition]
    ) -> None:
        assembly = common_build(conditions)
        self.meshed, self.between, self.phi = meshed, compliance.between, phi
        own = self.between(0, 0)
        self.components = own.shape[0] // (meshed.pinion.nodes.size // 3)
        lines = place_sections(meshed, np.array([phi]), assembly.misalignment, self.components)
        lines, on_support = on_supports(meshed, compliance.supports, lines)
        deviation = np.zeros_like(lines.gap)
        line_deviations(lines, meshed.sections.z, *meshed.deviations(assembly), deviation)
        self.lines, self.free = lines, (lines.gap + deviation)[0]
        self.on_support = on_support[0]
        self.sections = len(meshed.sections.z)
        self.width = np.tile(meshed.width, meshed.tooth_pair_count)
        self.laws = [LineLaw(*row) for row in lines.law[0].tolist()]

    def rigid_gap(self, advance: float) -> FloatArray:
        """Gaps of rigid flanks, (N,), mm."""
        further = np.maximum(advance - self.lines.corner_advance[0], 0.0)
        return np.asarray(self.free + self.lines.lever[0] * advance + 0.5 * self.lines.lever_slope[0] * further**2)

    def lever(self, advance: float) -> FloatArray:
        """Levers, (N,), mm."""
        further = np.maximum(advance - self.lines.corner_advance[0], 0.0)
        return np.asarray(self.lines.lever[0] + self.lines.lever_slope[0] * further)

    def weights(self, gear: int, n: int) -> FloatArray:
        """Gradient of the gap of section `n` by the displacements of its flank, (unknowns of the flank,)."""
        nodes = (self.meshed.pinion, self.meshed.wheel)[gear].nodes
        sections, place = self.meshed.sections, n % self.sections
        weights = np.zeros((*nodes.shape[:2], self.components))
        rows = self.lines.gradient[0, n, gear].reshape(4, self.components)
        for a, gradient in enumerate(rows):
            for b, share in enumerate(sections.share[gear, place]):
                if share != 0.0 and gradient.any():
                    weights[self.lines.row[0, n, gear] + a, sections.column[gear, place] + b] += share * gradient
        return weights.ravel()

    def moved(self, gear: int, loaded: IntArray, forces: FloatArray, pairs: IntArray) -> FloatArray:
        """Displacements of the flanks of tooth pairs (relative numbers) under forces on flanks, (p, unknowns, ...)."""
        # The wheel's teeth are numbered against its own counter-clockwise sense.
        sense = 1 if gear == 0 else -1
        return np.stack([
            sum(self.between(gear, sense * int(a - b)) @ forces[k] for k, b in enumerate(loaded)) for a in pairs
        ])  # fmt: skip

    def flexibility(self, candidates: IntArray) -> FloatArray:
        """Change of the gaps of sections by forces in them, mm/N."""
        total, pair = self.on_support[np.ix_(candidates, candidates)], candidates // self.sections
        pairs = np.unique(pair)
        for gear in range(2):
            weights = np.stack([self.weights(gear, n) for n in candidates])
            for b in pairs:
                of_b = pair == b
                moved = self.moved(gear, np.array([b]), weights[None, of_b].transpose(0, 2, 1), pairs)
                for k, a in enumerate(pairs):
                    total[np.ix_(pair == a, of_b)] += weights[pair == a] @ moved[k]
            if self.meshed.free_ends:
                total += np.where(pair[:, None] == pair, self.coupling(gear, candidates), 0.0)
        return total

    def coupling(self, gear: int, candidates: IntArray) -> FloatArray:
        """What the layer of a gear adds to plane strain between sections, were they all on one tooth, mm/N."""
        normals = row_normals(self.meshed, gear, self.components)
        pressed = np.zeros((len(candidates), len(normals)))
        gradient = self.lines.gradient[0, candidates, gear].reshape(-1, 4, self.components)
        for force, own, first in zip(pressed, gradient, self.lines.row[0, candidates, gear], strict=True):
            normal = normals[first : first + 4]
            force[first : first + 4] = np.einsum("ai,ai->a", own[: len(normal)], normal)
        section = candidates % self.sections
        added = self.meshed.layer_coupling[gear][:, section[:, None], section]
        found = np.einsum("nr,rnm,m->nm", pressed, added, pressed.sum(axis=1))
        return np.asarray(0.5 * (found + found.T))

    def solve(self, condition: Condition, start: float | None = None) -> LineState:
        """Solve one condition; ConvergenceError where that fails."""
        lever, touch = self.lines.lever[0], float(np.min(self.free / -self.lines.lever[0]))
        advance = touch + self.meshed.expected_approach(condition.torque) / -float(lever[0])
        advance = advance if start is None else max(start, advance)
        largest = max(advance, touch)
        for _ in range(MAX_STEPS):
            rigid = self.rigid_gap(largest)
            depth = max(-float(rigid.min()), 0.0)
            candidates = np.flatnonzero(rigid <= NEARBY * depth)
            newton = self._newton(candidates, advance, depth, condition)
            if newton.advance <= largest:
                force = np.zeros_like(self.lines.gap)[None]
                force[..., candidates] = newton.force
                if width_limit(self.meshed, self.lines.law).exceeded(force).any():
                    raise ConvergenceError(f"phi = {self.phi:.6g} rad, {condition.load_text} {TOO_WIDE}", [])
                return self._state(newton)
            largest = newton.advance + NEARBY * (newton.advance - touch)
        raise ConvergenceError(f"line contact: sections without end at phi = {self.phi:.6g} rad", [])

    def _newton(self, candidates: IntArray, advance: float, depth: float, condition: Condition) -> _Solution:
        """Newton's method on the forces of those candidates that carry, and on the advance."""
        flexibility, width = self.flexibility(candidates), self.width[candidates]
        laws, free = [self.laws[n] for n in candidates], self.rigid_gap(advance)[candidates]
        least = np.array([law.least for law in laws]) * width
        carries, torque = free < 0.0, condition.torque
        force = np.where(carries, torque / self.meshed.pair.pinion.base_radius / max(int(carries.sum()), 1), 0.0)
        matrix = np.zeros((0, 0))
        for step in range(1, MAX_STEPS + 1):
            active, rigid = np.flatnonzero(carries), self.rigid_gap(advance)[candidates]
            if not len(active):
                break
            law = np.array([approach_of(force[n] / width[n], laws[n], self.meshed.corners) for n in active])
            matrix = flexibility[np.ix_(active, active)] + np.diag(law[:, 1] / width[active])
            free = rigid[active] + law[:, 0] - law[:, 1] * force[active] / width[active]
            places = candidates[active]
            lever = self.lever(advance)[places]
            turning = np.where(advance > self.lines.corner_advance[0, places], self.lines.lever_slope[0, places], 0.0)
            bordered = np.block([[matrix, lever[:, None]], [lever[None], np.array([[turning @ force[active]]])]])
            solution = np.linalg.solve(bordered, np.append(-free, -torque))
            new, advance = solution[:-1], advance + float(solution[-1])
            pulls = new <= 0.0
            changes = (new - force[active]) ** 2 / (np.maximum(new, least[active]) * new.max())
            change = float(np.max(changes, initial=0.0, where=~pulls))
            settled = change <= TOLERANCE and not pulls.any()
            # The law is steeper the smaller the load: a section that pulls here may still push there.
            carries[active[pulls]] = force[active[pulls]] > least[active[pulls]]
            force[active] = np.where(pulls, np.where(carries[active], 0.5 * least[active], 0.0), new)
            gap = self.rigid_gap(advance)[candidates] + flexibility @ force
            closed = np.flatnonzero(~carries & (gap < -1e-9 * NEARBY * depth))
            if step > PATIENCE:
                closed = closed[: int(change <= TOLERANCE)]  # one at a time
            carries[closed], force[closed] = True, 0.5 * least[closed]
            if settled and not len(closed):
                return _Solution(candidates, carries, force, advance, step, float(np.linalg.cond(matrix, 1)))
        raise ConvergenceError(
            f"no equilibrium at phi = {self.phi:.6g} rad, {condition.load_text} after {MAX_STEPS} Newton steps", []
        )

    def _state(self, newton: _Solution) -> LineState:
        places = newton.candidates[newton.carries]
        force, pair = newton.force[newton.carries], places // self.sections
        pairs, first = np.unique(pair), self.lines.first_pair[0]
        nodal, displacement = [], []
        for gear, flank in enumerate((self.meshed.pinion, self.meshed.wheel)):
            shape = (len(pairs), *flank.nodes.shape[:2], self.components)
            forces = np.zeros((len(pairs), flank.nodes.size // 3 * self.components))
            for n, value in zip(places, force, strict=True):
                forces[np.searchsorted(pairs, n // self.sections)] += value * self.weights(gear, int(n))
            moved = self.moved(gear, pairs, forces, pairs) if len(pairs) else forces
            nodal.append(forces.reshape(shape))
            displacement.append(moved.reshape(shape))
        lever = self.lever(newton.advance)[places]
        return LineState(
            advance=newton.advance, steps=newton.steps, pair=first + pair, section=places % self.sections, force=force,
            line_load=force / self.width[places], lever=lever, mate_lever=self.lines.mate_lever[0, places],
            lever_change=lever - self.lines.lever[0, places], law=self.lines.law[0, places],
            roll=self.lines.roll[0, places], loaded_pairs=first + pairs, nodal_force=(nodal[0], nodal[1]),
            displacement=(displacement[0], displacement[1]), condition_number=newton.condition_number,
        )  # fmt: skip
