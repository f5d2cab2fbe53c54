"""Misalignment by the shafts and face load factor after ISO 6336-1:2006, 7.6, method C: a shaft as one formula.

    f_sh = F_m / b 0.023 (|B* + K' l s / d_1^2 (d_1 / d_sh)^4 - 0.3| + 0.3) (b / d_1)^2,    F_bx = 1.33 f_sh + f_ma

with B* = 1 of spur and single helical gears, l the span of the bearings and s the distance of the pinion from its
middle, of an overhung pinion from the bearing beside it; K' after figure 13, which DIN 3990-11:1989 has as figure 3.2:
0.48 and 0.8 (a, b), 1.33 of an overhung pinion with and without stiffening (c). Bearings and housing are rigid, and the
mate's shaft is in the factor 1.33.
"""

from __future__ import annotations

import math

import numpy as np

from pmor.core.arrays import FloatArray

# K' of a pinion between two bearings, without and with stiffening by its own body, where d_1 / d_sh reaches this.
PLAIN, STIFFENED, STIFFENING_RATIO = 0.8, 0.48, 1.15
# Of an overhung pinion, to which torque comes past both bearings.
OVERHUNG = 1.33
# s / l below which they hold, between two bearings and of overhung pinions.
LARGEST_OFFSET, LARGEST_OVERHANG = 0.3, 0.5
# c_gamma of steel gears, N/(mm um), for want of a better one (DIN 3990-11:1989, 3.4.3.1).
SLICE_STIFFNESS = 20.0
# Of case-hardened flanks, um.
RUNNING_IN, MOST_RUNNING_IN = 0.15, 6.0


def shaft_misalignment(
    line_load: float, width: float, diameter: float, shaft_diameter: float, span: float, offset: float,
    overhung: bool = False,
) -> float:  # fmt: skip
    """Return f_sh of a pinion on two bearings, um.

    Parameters
    ----------
    line_load : float
        F_m / b: tangential force at the reference circle over the face width, N/mm.
    width, diameter, shaft_diameter, span : float
        b, d_1, d_sh, l, mm.
    offset : float
        s, mm: positive where the pinion stands nearer to the bearing at whose side torque enters, so that torsion and
        bending load the same end of the face (K' > 0); of an overhung pinion from the bearing beside it.
    overhung : bool
        Whether it stands beside the bearings; torque comes past both of them.
    """
    constant = OVERHUNG if overhung else STIFFENED if diameter / shaft_diameter >= STIFFENING_RATIO else PLAIN
    bent = constant * span * offset / diameter**2 * (diameter / shaft_diameter) ** 4
    return 0.023 * line_load * (abs(1.0 + bent - 0.3) + 0.3) * (width / diameter) ** 2


def running_in(misalignment: float) -> float:
    """Return y_beta of case-hardened flanks, um, by F_bx, um."""
    return min(RUNNING_IN * misalignment, MOST_RUNNING_IN)


def face_load_factor(misalignment: float, stiffness: float, line_load: float) -> float:
    """Return K_Hbeta (eq. 41 and 43).

    Parameters
    ----------
    misalignment : float
        F_by after running in, um.
    stiffness : float
        c_gamma,beta, N/(mm um).
    line_load : float
        F_m / b, N/mm.
    """
    size = misalignment * stiffness / line_load
    return 1.0 + 0.5 * size if size <= 2.0 else math.sqrt(2.0 * size)


def sliced_face_load_factor(overlap: FloatArray, line_load: float, stiffness: float = SLICE_STIFFNESS) -> float:
    """Return K_Hbeta of slices that do not feel each other, under any misalignment and flanks.

    Parameters
    ----------
    overlap : ndarray, shape (n,)
        By how much the flanks overlap in the middles of equal slices where they just carry, um, from any level on.
    line_load : float
        Mean over the face, N/mm.
    stiffness : float
        Of a slice, N/(mm um).
    """
    # The k highest slices carry, down to the level at which they take the load.
    high = np.sort(overlap)[::-1]
    level = (np.cumsum(high) - len(high) * line_load / stiffness) / np.arange(1, len(high) + 1)
    carrying = int((high > level).sum())
    return float(stiffness * (high[0] - level[carrying - 1]) / line_load)
