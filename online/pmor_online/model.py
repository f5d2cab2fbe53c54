"""The reduced pair: a basis file made ready to answer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pmor.arrays import FloatArray, IntArray
from pmor.case.width import mirrors_at_mid_width
from pmor.contact.elasticity import ReducedElasticity
from pmor.contact.flank import MeshedPair
from pmor.contact.position import Position, active_patches
from pmor.contact.solve import window_depth
from pmor.pair.conditions import nominal_condition
from pmor.pair.model import assemble_pair, gear_pair
from pmor.reduction.basis import Basis
from pmor.reduction.contact_shapes import ContactShapes, reduced_elasticity
from pmor.reduction.flank_lines import line_elasticity

LineArrays = tuple[IntArray, FloatArray, FloatArray]
PositionArrays = tuple[float, float, np.ndarray, FloatArray, FloatArray, FloatArray, FloatArray]
KernelFamily = tuple[bool, tuple[LineArrays, LineArrays], PositionArrays, int]


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
    def elasticity_at(self) -> Callable[[Position], ReducedElasticity]:
        """Reduced elasticity of the windows of a position."""
        shapes, pitch = self.basis.shapes, self.meshed.pair.pitch
        if isinstance(shapes, ContactShapes):
            return lambda position: reduced_elasticity(shapes, position, pitch)
        return lambda position: line_elasticity(shapes, position)

    @cached_property
    def family(self) -> KernelFamily:
        """Shapes for the kernel (`pmor.contact.kernel`, the reduced pair)."""
        shapes = self.basis.shapes
        if isinstance(shapes, ContactShapes):
            step = shapes.roll_position[1] - shapes.roll_position[0]
            path = shapes.geodesics
            positions = (
                shapes.roll_position[0], step, shapes.loaded, shapes.displacement, shapes.gram, path.turn, path.angle,
            )  # fmt: skip
            none = (np.zeros(1, dtype=np.int64), np.empty((1, 0, 0)), np.empty((1, 0, 0)))
            return False, (none, none), positions, 0
        lines = tuple((gear.start, gear.displacement, gear.gram) for gear in shapes.gears)
        nowhere = (
            0.0, 1.0, np.zeros((0, 0), dtype=bool), np.empty((0, 0, 2, 1, 0)), np.empty((0, 0, 2, 2, 0, 0)),
            np.empty((0, 0, 0)), np.empty((0, 0)),
        )  # fmt: skip
        return True, (lines[0], lines[1]), nowhere, int(shapes.beside)

    @property
    def kernel_compliance(self) -> tuple[FloatArray, FloatArray]:
        """What the error estimate needs, for the kernel; of length 0 where the basis does not hold it."""
        none = np.empty((0, 0, 0))
        return self.basis.compliance.gears if self.basis.compliance else (none, none)

    @cached_property
    def size(self) -> int:
        """Largest number of unknowns over a pitch under the nominal torque: amplitudes of shapes, and the rotation."""
        meshed, elasticity_at = self.meshed, self.elasticity_at
        condition = nominal_condition(self.basis.case)
        depth = window_depth(meshed, condition)
        sizes = (
            len(elasticity_at(active_patches(meshed, float(phi), depth, condition.axes)).zero())
            for phi in online_angles(meshed.pair.pitch, 50)
        )
        return max(sizes) + 1


def reduced_pair(basis: Basis) -> ReducedPair:
    """Make a basis ready to answer.

    Parameters
    ----------
    basis : Basis

    Returns
    -------
    ReducedPair
    """
    pair = gear_pair(basis.case)
    half = mirrors_at_mid_width(basis.case)
    flanks = basis.flank_nodes, basis.flank_roll_angle
    return ReducedPair(basis, assemble_pair(basis.case, pair, *flanks, basis.layers, half))


def online_angles(pitch: float, count: int) -> FloatArray:
    """Return `count` pinion angles over one pitch from 0, end point excluded, rad."""
    return np.asarray(pitch * np.arange(count) / count)


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
