"""Peak-to-peak STE of a design on finer and finer angles, until it no longer moves: see `pmor.design.fine`."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pmor.campaigns.kind import ANGLES, PEAKS
from pmor.core.arrays import FloatArray
from pmor.core.errors import ConvergenceError
from pmor.design.fine import MOST, NOISE, SETTLED, first_angles


def settled_peaks(spans: Callable[[int], FloatArray], few: int, nominal: int, pitches: int = 1) -> dict[str, float]:
    """Return `PEAKS` of a design, and the `ANGLES` on which they no longer move.

    Parameters
    ----------
    spans : callable
        From angles per pitch to the peak-to-peak STE under all torques, (D,), um; NaN where not converged.
    few : int
        Angles per pitch that the file of the design asks for.
    nominal : int
        Number of the nominal torque.
    pitches : int
        Over which the angles to begin with are counted.

    Raises
    ------
    ConvergenceError
        Where a position did not converge, or the STE still moves on the finest angles.
    """
    before: FloatArray | None = None
    angles = first_angles(few, pitches)
    while angles <= max(MOST, 4 * few):
        found = spans(angles)
        if not np.isfinite(found).all():
            raise ConvergenceError(f"a position on {angles} angles per pitch did not converge", [])
        if before is not None and (np.abs(found - before) <= SETTLED * found + NOISE).all():
            return {PEAKS[0]: float(found[nominal]), PEAKS[1]: float(found.max()), ANGLES: angles}
        before, angles = found, 2 * angles
    raise ConvergenceError(f"the STE still moves on {angles // 2} angles per pitch", [])
