"""The reduced pair: a basis file made ready to answer."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from pmor.body.flank_compliance import FlankCompliance
from pmor.body.section_compliance import section_compliance
from pmor.body.support import support_rows
from pmor.case import Case
from pmor.case.width import mirrors_at_mid_width
from pmor.core.arrays import FloatArray
from pmor.gear.meshed_pair import MeshedPair
from pmor.line.kernels.places import Lines
from pmor.line.layered_pair import LayeredPair, as_layered
from pmor.line.pair import LinePair
from pmor.pair.model import assemble_pair, gear_pair
from pmor.penalty.elasticity import ReducedElasticity
from pmor.penalty.kernels.state import Family, GearLines, PositionShapes
from pmor.penalty.position import Position
from pmor.reduction.basis import Basis
from pmor.reduction.contact_shapes import ContactShapes, reduced_elasticity
from pmor.reduction.flank_lines import FlankLineShapes, line_elasticity


@dataclass(frozen=True)
class ReducedPair:
    """A gear pair with its reduced elasticity.

    Parameters
    ----------
    basis : Basis
    meshed : MeshedPair
    """

    basis: Basis
    meshed: MeshedPair

    @property
    def layered(self) -> LayeredPair:
        """The meshed pair, of line contact."""
        return as_layered(self.meshed)

    @property
    def elasticity_at(self) -> Callable[..., Any]:
        """Elasticity of the windows of a position; of line loads the compliance of teeth."""
        if self.basis.shapes is None:
            return self.flank_compliance.between
        return self.shape_elasticity_at

    @property
    def shape_elasticity_at(self) -> Callable[[Position], ReducedElasticity]:
        """Reduced elasticity of the windows of a position, of a basis with shapes."""
        shapes, pitch = self._shapes, self.meshed.pair.pitch
        if isinstance(shapes, ContactShapes):
            return lambda position: reduced_elasticity(shapes, position, pitch)
        return lambda position: line_elasticity(shapes, position)

    @property
    def _shapes(self) -> FlankLineShapes | ContactShapes:
        if self.basis.shapes is None:
            raise TypeError("line loads have no shapes")
        return self.basis.shapes

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
        rows = len(self.meshed.pinion.roll_angle), len(self.meshed.wheel.roll_angle)
        sections = self.layered.sections.column, self.layered.sections.share
        return section_compliance(self.flank_compliance.gears, self.components, sections, rows)

    @cached_property
    def lines(self) -> LinePair:
        """The pair prepared for line loads, on what the gears stand on."""
        support = self.flank_compliance.support
        if support is None:
            return LinePair(self.layered, self.section_compliance, self.components)
        rows = len(self.meshed.pinion.roll_angle), len(self.meshed.wheel.roll_angle)
        sections = self.layered.sections.column, self.layered.sections.share

        def flexibility(lines: Lines) -> FloatArray:
            placed = support_rows(support, sections, rows, lines.first_pair, lines.row, lines.gradient)
            return support.flexibility(placed)

        return LinePair(self.layered, self.section_compliance, self.components, flexibility)

    @cached_property
    def family(self) -> Family:
        """Shapes for the kernels."""
        shapes = self._shapes
        if isinstance(shapes, ContactShapes):
            step = shapes.roll_position[1] - shapes.roll_position[0]
            positions = PositionShapes(shapes.roll_position[0], step, shapes.loaded, shapes.displacement, shapes.gram)
            none = GearLines(np.zeros(1, dtype=np.int64), np.empty((1, 0, 0)), np.empty((1, 0, 0)))
            return Family(False, (none, none), positions)
        pinion, wheel = (GearLines(gear.start, gear.displacement, gear.gram) for gear in shapes.gears)
        nowhere = PositionShapes(
            0.0, 1.0, np.zeros((0, 0), dtype=bool), np.empty((0, 0, 2, 1, 0)), np.empty((0, 0, 2, 2, 0, 0)),
        )  # fmt: skip
        return Family(True, (pinion, wheel), nowhere)

    @property
    def kernel_compliance(self) -> tuple[FloatArray, FloatArray]:
        """What the error estimate needs, for the kernel; of length 0 where the basis does not hold it."""
        none = np.empty((0, 0, 0))
        return self.basis.compliance.gears if self.basis.compliance else (none, none)


def reduced_pair(basis: Basis) -> ReducedPair:
    """Make a basis ready to answer."""
    pair = gear_pair(basis.case)
    half = mirrors_at_mid_width(basis.case)
    flanks = basis.flank_nodes, basis.flank_roll_angle
    return ReducedPair(basis, assemble_pair(basis.case, pair, *flanks, basis.layers, half))


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
