"""The reduced pair: a basis file made ready to answer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pmor.contact.flank import MeshedPair
from pmor.contact.solve import ElasticityAt
from pmor.gear.conventions import FloatArray
from pmor.model import assemble_pair, gear_pair
from pmor.reduction.contact_shapes import reduced_elasticity
from pmor.storage.basis_file import Basis


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
    def elasticity_at(self) -> ElasticityAt:
        """Reduced elasticity of the windows of a position, interpolated over the roll position."""
        shapes, pitch = self.basis.shapes, self.meshed.pair.pitch
        return lambda position: reduced_elasticity(shapes, position, pitch)

    @property
    def size(self) -> int:
        """Largest number of unknowns at a position: shapes of the pairs in mesh, and the rotation."""
        shapes = self.basis.shapes
        together = int(np.ceil(self.meshed.pair.contact_ratio))
        return together * shapes.loaded.shape[1] + 1


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
    return ReducedPair(basis, assemble_pair(basis.case, pair, basis.flank_nodes, basis.flank_roll_angle))


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
