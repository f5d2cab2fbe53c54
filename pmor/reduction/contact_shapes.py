"""Static contact shapes of a tooth pair over its roll position.

One family of shapes *per tooth pair*: the force field that the flanks exchange at a roll position under a training
torque, on pinion and wheel together, and the displacements it causes on the loaded and the neighbouring teeth. By
cyclic symmetry the family serves every tooth pair; online each pair in mesh takes the active shapes at its own roll
position, so that load sharing comes out of the solution. Force and displacement are interpolated with the same weights
and therefore stay consistent (Blockmans, Tamarozzi, Naets & Desmet, IJNME 102 (2015) 1162).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.penalty.kernels.state import Family, GearLines, PositionShapes

if TYPE_CHECKING:
    from pmor.body.elastic_gear import ElasticGear

# Grid positions that an interpolation combines.
STENCIL = {"linear": 2, "cubic": 4}


@dataclass(frozen=True)
class ContactShapes:
    """Family of contact shapes of one tooth pair: M roll positions, T shapes at each, f flank unknowns per tooth.

    Parameters
    ----------
    roll_position : ndarray, shape (M,)
        Uniform grid, rad; its first and last positions are idle, so that nothing is extrapolated.
    angles_per_pitch : int
        Grid steps per pitch: pairs a whole number of pitches apart have the same interpolation weights.
    loaded : ndarray of bool, shape (M, T)
        Whether the pair carries load there, and has that shape; the others are zero.
    displacement : ndarray, shape (M, T, 2, 2 neighbours + 1, f)
        Displacement of pinion and wheel (second but last axis: tooth, counted counter-clockwise from the loaded one),
        mm per unit coordinate.
    gram : ndarray, shape (neighbours + 1, M, S, S, T, T)
        ``gram[d, k, a, b]`` holds the products of the force fields at grid position k + a - before with the
        displacements that the shapes at k + b - before, acting on the pair d pitches ahead, cause there. S grid
        positions are combined: 2 for linear interpolation (before = 0), 4 for cubic (before = 1).
    """

    roll_position: FloatArray
    angles_per_pitch: int
    loaded: np.ndarray
    displacement: FloatArray
    gram: FloatArray

    @property
    def neighbours(self) -> int:
        """Neighbouring teeth covered on either side."""
        return (self.displacement.shape[3] - 1) // 2

    @property
    def stencil(self) -> int:
        """Grid positions that are combined: S."""
        return int(self.gram.shape[2])

    @cached_property
    def family(self) -> Family:
        """The shapes for the kernels."""
        step = self.roll_position[1] - self.roll_position[0]
        positions = PositionShapes(self.roll_position[0], step, self.loaded, self.displacement, self.gram)
        none = GearLines(np.zeros(1, dtype=np.int64), np.empty((1, 0, 0)), np.empty((1, 0, 0)))
        return Family(False, (none, none), positions)


def contact_shapes(
    pinion: ElasticGear, wheel: ElasticGear, roll_position: FloatArray, angles_per_pitch: int, force: FloatArray,
    interpolation: str = "linear",
) -> ContactShapes:  # fmt: skip
    """Build the family from the raw force fields of the training, one shape for each.

    Parameters
    ----------
    roll_position, angles_per_pitch
        As in `ContactShapes`.
    force : ndarray, shape (M, T, 2, f)
        Nodal forces on the pinion's and the wheel's flank, each in its tooth's frame, N; zero where the pair is idle.
    interpolation : {"linear", "cubic"}
    """
    # Over the whole width: a force on several images of a node is shared by them.
    shared = force.reshape(*force.shape[:3], -1, len(pinion.mesh.z), 3) / np.sqrt(pinion.mesh.images)[:, None]
    norm = np.linalg.norm(shared.reshape(force.shape), axis=(2, 3))
    unit = force / np.where(norm > 0.0, norm, 1.0)[:, :, None, None]
    return shapes_of((pinion, wheel), roll_position, angles_per_pitch, unit, interpolation)


def shapes_of(
    bodies: tuple[ElasticGear, ElasticGear], roll_position: FloatArray, angles_per_pitch: int, force: FloatArray,
    interpolation: str,
) -> ContactShapes:  # fmt: skip
    """Build the family from the force fields of its shapes.

    Parameters
    ----------
    roll_position, angles_per_pitch
        As in `ContactShapes`.
    force : ndarray, shape (M, T, 2, f)
        Of each shape, as it is; zero where there is none.
    interpolation : {"linear", "cubic"}
    """
    positions, shapes, _, size = force.shape
    neighbours = bodies[0].neighbours
    displacement = np.empty((positions, shapes, 2, 2 * neighbours + 1, size))
    for gear, body in enumerate(bodies):
        fields = force[:, :, gear].reshape(-1, size)
        for k in range(-neighbours, neighbours + 1):
            moved = fields @ body.tooth_compliance(k).T
            displacement[:, :, gear, neighbours + k] = moved.reshape(positions, shapes, size)
    gram = energy_products(force, displacement, angles_per_pitch, neighbours, STENCIL[interpolation])
    loaded = np.asarray(force.any(axis=(2, 3)))
    return ContactShapes(roll_position, angles_per_pitch, loaded, displacement, gram)


def energy_products(
    force: FloatArray, displacement: FloatArray, angles_per_pitch: int, neighbours: int, stencil: int
) -> FloatArray:
    """Return ``gram`` of `ContactShapes`.

    Parameters
    ----------
    force : ndarray, shape (M, T, 2, f)
        Of each shape.
    stencil : int
        Grid positions that are combined.
    """
    positions, torques = force.shape[:2]
    gram = np.zeros((neighbours + 1, positions, stencil, stencil, torques, torques))
    before = stencil // 2 - 1
    for d in range(neighbours + 1):
        for a in range(stencil):
            for b in range(stencil):
                here, ahead = a - before, d * angles_per_pitch + b - before
                # Only where both active shapes exist.
                rows = np.arange(max(-here, -ahead, 0), max(positions - max(here, ahead, 0), 0))
                for gear, tooth in ((0, -d), (1, d)):
                    moved = displacement[rows + ahead, :, gear, neighbours + tooth]
                    gram[d, rows, a, b] += np.einsum("ktf,kuf->ktu", force[rows + here, :, gear], moved)
    return gram
