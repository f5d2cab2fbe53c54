"""The reduced pair: a basis file made ready to answer."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from pmor.body.flank_compliance import FlankCompliance
from pmor.case import Case
from pmor.case.width import mirrors_at_mid_width
from pmor.core.arrays import FloatArray
from pmor.core.shown import brief
from pmor.gear.condition import Assembly
from pmor.gear.meshed_pair import MeshedPair
from pmor.line.hubs import Hubs
from pmor.line.layered_pair import LayeredPair, as_layered
from pmor.line.pair import LinePair, line_compliance_between
from pmor.pair.model import assemble_pair, gear_pair
from pmor.penalty.elasticity import ReducedElasticity, shape_elasticity
from pmor.penalty.kernels.state import Family
from pmor.penalty.position import Position
from pmor.reduction.basis import Basis


@brief
@dataclass(frozen=True)
class ReducedPair:
    """A gear pair with its reduced elasticity."""

    basis: Basis
    meshed: MeshedPair

    @property
    def layered(self) -> LayeredPair:
        """The meshed pair, of line contact."""
        return as_layered(self.meshed)

    @property
    def elasticity_at(self) -> Any:
        """Elasticity of the windows of a position, callable; of line loads the compliance of the flanks."""
        if self.basis.shapes is None:
            return self.flank_compliance
        return self.shape_elasticity_at

    @property
    def shape_elasticity_at(self) -> Callable[[Position], ReducedElasticity]:
        """Reduced elasticity of the windows of a position, of a basis with shapes."""
        return partial(shape_elasticity, self.family)

    @property
    def family(self) -> Family:
        """Shapes for the kernels."""
        if self.basis.shapes is None:
            raise TypeError("line loads have no shapes")
        return self.basis.shapes.family

    @property
    def flank_compliance(self) -> FlankCompliance:
        """Compliance between the flanks, of line loads.

        Raises
        ------
        TypeError
            When the basis does not hold it.
        """
        if self.basis.compliance is None:
            raise TypeError("a basis of line loads holds the compliance of the flanks, and this one does not")
        return self.basis.compliance

    @cached_property
    def coarser(self) -> ReducedPair | None:
        """The same pair on half as many elements, where the basis has it."""
        return None if self.basis.coarser is None else reduced_pair(self.basis.coarser)

    @property
    def components(self) -> int:
        """Components of displacement that line loads cause: those along the axis on helical gears alone."""
        return self.flank_compliance.components

    @cached_property
    def section_compliance(self) -> tuple[FloatArray, FloatArray]:
        """Compliance between sections, for the kernels of line loads."""
        return line_compliance_between(self.layered, self.flank_compliance.gears, self.components)

    @cached_property
    def lines(self) -> LinePair:
        """The pair prepared for line loads."""
        flanks = self.flank_compliance
        return LinePair(self.layered, self.section_compliance, self.components, flanks.gears, flanks.supports)

    @property
    def kernel_compliance(self) -> tuple[FloatArray, FloatArray]:
        """Flank compliance for the error estimate; of length 0 where the basis does not hold it."""
        none = np.empty((0, 0, 0))
        return self.basis.compliance.gears if self.basis.compliance else (none, none)


def reduced_pair(basis: Basis) -> ReducedPair:
    """Make a basis ready to answer."""
    pair = gear_pair(basis.case)
    half = mirrors_at_mid_width(basis.case)
    flanks = basis.flank_nodes, basis.flank_roll_angle
    return ReducedPair(basis, assemble_pair(basis.case, pair, *flanks, basis.layers, half))


def on_hubs(reduced: ReducedPair, hubs: Hubs) -> ReducedPair:
    """Return a reduced pair of line loads whose hubs give way; the compliance of its flanks is not found again."""
    meshed = reduced.layered.on_hubs(hubs)
    found = _sharing(reduced, replace(reduced, meshed=meshed), replace(reduced.lines, meshed=meshed))
    if reduced.coarser is not None:
        vars(found).update(coarser=on_hubs(reduced.coarser, hubs))
    return found


def with_flanks(reduced: ReducedPair, assembly: Assembly) -> ReducedPair:
    """Return a reduced pair of line loads whose case has other flanks; what does not depend on them is kept."""
    case = replace(reduced.basis.case, pinion_modification=assembly.pinion, wheel_modification=assembly.wheel)
    return _sharing(reduced, replace(reduced, basis=replace(reduced.basis, case=case)), reduced.lines)


def keeping_sections(reduced: ReducedPair) -> ReducedPair:
    """Return a reduced pair of line loads that keeps sections placed where they were solved; for one thread alone."""
    return _sharing(reduced, replace(reduced), replace(reduced.lines, kept={}))


def _sharing(reduced: ReducedPair, found: ReducedPair, lines: LinePair) -> ReducedPair:
    vars(found).update(section_compliance=reduced.section_compliance, lines=lines)  # of its cached properties
    return found


def online_angles(pitch: float, count: int, pitches: int = 1) -> FloatArray:
    """Return `count` pinion angles to a pitch over so many of them from 0, end point excluded, rad."""
    return np.asarray(pitch * np.arange(pitches * count) / count)


def sweep_angles(case: Case) -> FloatArray:
    """Return the pinion angles of the sweep that a case asks for, rad."""
    pitch = 2.0 * math.pi / case.pair.pinion.teeth
    return online_angles(pitch, case.online.angles_per_pitch, case.pitches)


def unseen_angles(pair_start: float, pitch: float, count: int, trained: int) -> FloatArray:
    """Return `count` pinion angles over one pitch from 0, none of them trained, rad.

    One angle is drawn at random in each of `count` equal parts of the pitch (fixed seed), and again while it is close
    to a training angle: within a twentieth of a training step, or a quarter of its part where that is less.

    Parameters
    ----------
    pair_start : float
        A training angle, rad.
    pitch : float
        rad.
    count, trained : int
        Angles to draw, training angles per pitch.
    """
    rng = np.random.default_rng(20160919)
    angles = np.empty(count)
    clear = min(0.05, 0.25 * trained / count)
    for i in range(count):
        while True:
            angles[i] = (i + rng.random()) / count * pitch
            steps = (angles[i] - pair_start) / pitch * trained
            if abs(steps - round(steps)) > clear:
                break
    return angles
