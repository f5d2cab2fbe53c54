"""A bearing alone under a force: Newton's method on its convex energy."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pmor.body.bearing_rows import DOF
from pmor.body.rolling_bearing import BearingState, RollingBearing
from pmor.core.arrays import FloatArray

MOST_STEPS = 200
# Of the largest force.
SETTLED = 1e-10
# Displacements of an inner ring in units of like size, mm and 1/100 rad.
SIZES = np.array([1.0, 1.0, 1.0, 0.01, 0.01])
# Stiffness that is added to all directions at first, N/mm: rings lie loose in their clearance.
FIRST_ADDED = 1e4


class Loaded(NamedTuple):
    """Displacement of the inner ring, (5,), and state of a bearing."""

    place: FloatArray
    state: BearingState


def loaded_bearing(bearing: RollingBearing, force: FloatArray, near: Loaded | None = None) -> Loaded | None:
    """Return the state of a bearing under a force on its inner ring, (5,), N and N mm; None where none holds it.

    Directions that a bearing leaves free stay where they are.

    Parameters
    ----------
    near : Loaded, optional
        Under a force that is about the same.
    """
    load, added = SIZES * force, 0.0 if near else FIRST_ADDED
    size = float(np.abs(load).max())
    place, state = near or Loaded(np.zeros(DOF), bearing.state(np.zeros(DOF)))
    left = load - SIZES * state.force
    for _ in range(MOST_STEPS):
        if float(np.abs(left).max()) <= SETTLED * size:
            return Loaded(place, state)
        tangent = SIZES[:, None] * state.stiffness * SIZES
        least = 1e-12 * max(float(np.trace(tangent)), 1.0)
        step = np.linalg.solve(tangent + max(added, least) * np.eye(DOF), left)
        tried = bearing.state(place + SIZES * step)
        after = load - SIZES * tried.force
        # Of a convex energy, a step that still goes downhill at its end lowers it.
        if np.linalg.norm(after) < np.linalg.norm(left) or after @ step >= 0.0:
            place, state, left, added = place + SIZES * step, tried, after, 0.1 * added
        else:
            added = max(4.0 * added, 1e-6 * float(np.trace(tangent)))
    return None
