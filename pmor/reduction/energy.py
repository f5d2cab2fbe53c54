"""The energy inner product of force fields: <f, g> = f^T C g, the work of one on the displacements of the other.

In it a basis is orthonormal when unit amplitudes store unit energy (twice over), each by itself.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pmor.core.arrays import FloatArray

if TYPE_CHECKING:
    from pmor.body.elastic_gear import ElasticGear

# Directions of a Gram matrix below this fraction of the largest are dependent to working precision.
DEPENDENCE_TOLERANCE = 1e-10


def own_displacement(bodies: tuple[ElasticGear, ElasticGear], force: FloatArray) -> FloatArray:
    """Return the displacement of the loaded teeth under forces on pinion and wheel, shape (..., 2, f), mm."""
    return np.stack([force[..., g, :] @ body.tooth_compliance(0).T for g, body in enumerate(bodies)], axis=-2)


def principal_energies(gram: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the energies of the independent principal directions of a Gram matrix, falling, and these as columns."""
    values, vectors = np.linalg.eigh(gram)
    kept = np.flatnonzero(values > DEPENDENCE_TOLERANCE * values.max(initial=0.0))[::-1]
    return values[kept], vectors[:, kept]
