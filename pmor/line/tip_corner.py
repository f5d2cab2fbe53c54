"""Tip corner: compliance added to line contact by the end of the surface layer (`tests.programs.ended_layer`)."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np

from pmor.core.arrays import FloatArray

# Distance from the corner, in depths of the layer there, beyond which the layer's end is not felt.
INFLUENCE_LENGTH = 1.25
# Angles between flank and tip land, and Poisson's ratios, that were solved; powers of place and spread in the fit.
ANGLES_DEG, RATIOS = (100.0, 110.0, 120.0, 130.0, 140.0, 150.0), (0.0, 0.3, 0.42, 0.49)
POWERS, SPREADS = 5, 3
TABLE = Path(__file__).with_name("tip_corner.txt")


def wedge_softness(angle: float) -> float:
    """Return by how much a wedge is softer than a half-plane near its apex, under loads at right angles to a face.

    Flamant's radial field of a force at the apex (Johnson, Contact Mechanics, 1985, ch. 2.2, for a wedge): the
    displacement grows with -R ln r where that of the half-plane grows with -ln r.

    Parameters
    ----------
    angle : float
        Inside the wedge, rad.
    """
    half, tilt = 0.5 * angle, 0.5 * (math.pi - angle)
    along = math.cos(tilt) ** 2 / (half + 0.5 * math.sin(angle))
    across = math.sin(tilt) ** 2 / (half - 0.5 * math.sin(angle))
    return 0.5 * math.pi * (along + across)


@cache
def _table() -> FloatArray:
    rows = np.loadtxt(TABLE)[:, 2:]
    return rows.reshape(len(ANGLES_DEG), len(RATIOS), 3, POWERS, SPREADS)


def corner_coefficients(angle: float, poisson_ratio: float) -> FloatArray:
    """Return the coefficients of P_k in `tests.programs.ended_layer`, shape (3, `POWERS`, `SPREADS`).

    Parameters
    ----------
    angle : float
        Between flank and tip land, rad; held inside the range of the table.
    """
    within = min(max(math.degrees(angle), ANGLES_DEG[0]), ANGLES_DEG[-1])
    by_angle = np.tensordot(interpolation_weights(ANGLES_DEG, within), _table(), axes=1)
    return np.asarray(np.tensordot(interpolation_weights(RATIOS, min(poisson_ratio, RATIOS[-1])), by_angle, axes=1))


def interpolation_weights(nodes: tuple[float, ...], at: float) -> FloatArray:
    """Return the weights of values at all nodes in the polynomial through them."""
    return np.array([math.prod((at - other) / (node - other) for other in nodes if other != node) for node in nodes])
