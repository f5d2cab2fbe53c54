"""Mass and gyroscopic moments of gears as rigid discs; t, mm, s."""

from __future__ import annotations

import numpy as np

from pmor.body.beam import NODE
from pmor.core.arrays import FloatArray
from pmor.gear.inertia import Inertia

# Tonnes of a kilogram, t mm^2 of a kg m^2.
KG, KG_M2 = 1e-3, 1e3


def disc_matrices(inertia: Inertia, along: float, axis: int = 0) -> tuple[FloatArray, FloatArray]:
    """Return mass and gyroscopic matrices of a rigid disc, its middle `along` the axis from its node, mm, (6, 6).

    Parameters
    ----------
    axis : int
        Along which it has its own: 0 of the machine, 2 of a set.
    """
    moved = np.eye(NODE)
    moved[1, 5], moved[2, 4] = along, -along
    mass, tilting = KG * inertia.mass_kg, KG_M2 * inertia.tilting_kg_m2
    polar = KG_M2 * inertia.polar_kg_m2
    spin = np.zeros((NODE, NODE))
    spin[4, 5], spin[5, 4] = polar, -polar
    whole = moved.T @ np.diag([mass, mass, mass, polar, tilting, tilting]) @ moved
    order = np.concatenate([np.roll(np.arange(3), axis), 3 + np.roll(np.arange(3), axis)])
    return whole[np.ix_(order, order)], spin[np.ix_(order, order)]
