"""Half the face width: what an aligned spur pair needs, by symmetry about mid width.

Deformation and contact of such a pair mirror themselves at mid width, exactly. The reduced model then holds the flank
nodes on one side of it, those in the plane of symmetry included, and counts each contact point twice.
"""

from __future__ import annotations

import numpy as np

from pmor.case import Case
from pmor.gear.conventions import FloatArray


def mirrors_at_mid_width(case: Case) -> bool:
    """Return whether half the width stands for the whole: spur, parallel axes, and nodes in the plane of symmetry."""
    if any(map(any, (case.offline.in_plane_um, case.offline.out_of_plane_um))):
        return False
    return case.reduction.half_width and case.pair.helix_angle_deg == 0.0 and case.mesh.width_elements % 2 == 0


def symmetric_part(fields: FloatArray, columns: int) -> FloatArray:
    """Return vector fields on a flank rid of what is not symmetric about mid width: round-off of a symmetric solution.

    Parameters
    ----------
    fields : ndarray, shape (..., f)
        Flank unknowns: lines, node columns over the width, xyz.
    columns : int

    Returns
    -------
    ndarray, shape (..., f)
    """
    grid = fields.reshape(*fields.shape[:-1], fields.shape[-1] // (3 * columns), columns, 3)
    mirrored = grid[..., ::-1, :] * np.array([1.0, 1.0, -1.0])
    return np.asarray(0.5 * (grid + mirrored)).reshape(fields.shape)


def lower_half(fields: FloatArray, columns: int) -> FloatArray:
    """Return vector fields on a flank, shape (..., f), at the columns up to mid width."""
    grid = fields.reshape(*fields.shape[:-1], -1, columns, 3)
    half = grid[..., : columns // 2 + 1, :]
    return np.ascontiguousarray(half).reshape(*fields.shape[:-1], -1)
