"""Dynamic factor K_v after ISO 6336-1, method B: the dynamic mesh force over the nominal one, by formulas.

Source: ISO 6336-1:2006, clause 6, equations (9) to (22) and the table of C_v1 to C_v7; tolerances: ISO 1328-1:2013.
Running-in, which depends on the material, is left out: deviations count in full, and K_v is larger for it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pmor.core.arrays import FloatArray

#: ranges of the resonance ratio, by rising speed
RANGES = ("subcritical", "main resonance", "intermediate", "supercritical")
# Resonance ratios at which the main resonance and the intermediate range end.
MAIN_END, INTERMEDIATE_END = 1.15, 1.5
# Of this grade and coarser ones B_k is 1, whatever the tip relief (note to equation (17)).
COARSE_GRADE = 6
# Grade to which the tolerances of ISO 1328-1 are given; each next one is larger by the root of 2.
BASIC_GRADE = 5
# Line load, N/mm, below which the main resonance begins earlier.
LIGHT_LOAD = 100.0


@dataclass(frozen=True)
class DynamicFactor:
    """K_v of a pair under a load, over the speed.

    Parameters
    ----------
    line_load : float
        F_t K_A / b, N/mm.
    stiffness : float
        c' of one tooth pair per face width, N/(mm um).
    contact_ratio : float
        Total, eps_gamma.
    pitch_um, form_um : float
        Deviations of the base pitch and of the profile's form, um.
    relief_um : float or None
        Design tip relief C_a, um; None takes B_k = 1.
    """

    line_load: float
    stiffness: float
    contact_ratio: float
    pitch_um: float
    form_um: float
    relief_um: float | None

    @property
    def main_begin(self) -> float:
        """Resonance ratio N_S at which the main resonance begins, equations (11) and (12)."""
        return 0.5 + 0.35 * math.sqrt(min(self.line_load / LIGHT_LOAD, 1.0))

    @property
    def limits(self) -> tuple[float, float, float]:
        """Resonance ratios that part the `RANGES`."""
        return self.main_begin, MAIN_END, INTERMEDIATE_END

    def at(self, ratio: FloatArray) -> FloatArray:
        """Return K_v at resonance ratios N, mesh frequency over the natural one: equations (13) to (22)."""
        pitch, form = (self.stiffness * f / self.line_load for f in (self.pitch_um, self.form_um))
        relief = 1.0 if self.relief_um is None else abs(1.0 - self.stiffness * self.relief_um / self.line_load)
        c = _weights(self.contact_ratio)
        n = np.asarray(ratio, dtype=float)
        below = 1.0 + n * (c[0] * pitch + c[1] * form + c[2] * relief)
        amid = 1.0 + c[0] * pitch + c[1] * form + c[3] * relief
        above = c[4] * pitch + c[5] * form + c[6]
        between = above + (amid - above) * (INTERMEDIATE_END - n) / (INTERMEDIATE_END - MAIN_END)
        begin, end, far = self.limits
        return np.select([n <= begin, n <= end, n < far], [below, np.full_like(n, amid), between], above)


def tolerances_um(module: float, diameter: float, grade: int) -> tuple[float, float]:
    """Return the tolerances of single pitch and profile form, um, of ISO 1328-1:2013, equations of clause 5.

    Parameters
    ----------
    module, diameter : float
        Normal module and reference diameter, mm.
    grade : int
        Flank tolerance class, 1 to 11.
    """
    step = math.sqrt(2.0) ** (grade - BASIC_GRADE)
    return (0.001 * diameter + 0.4 * module + 5.0) * step, (0.55 * module + 5.0) * step


def single_from_mesh_stiffness(mesh_stiffness: float, transverse_contact_ratio: float) -> float:
    """Return c' whose mean mesh stiffness c_gamma,alpha = c' (0.75 eps_alpha + 0.25) is known, equation (91)."""
    return mesh_stiffness / (0.75 * transverse_contact_ratio + 0.25)


def _weights(contact_ratio: float) -> tuple[float, ...]:
    """C_v1 to C_v7: shares of pitch deviation, form, stiffness cycle; the last is the remainder beyond resonance."""
    e = contact_ratio
    rest = 0.75 if e <= 1.5 else 0.125 * math.sin(math.pi * (e - 2.0)) + 0.875 if e <= 2.5 else 1.0
    if e <= 2.0:
        return 0.32, 0.34, 0.23, 0.90, 0.47, 0.47, rest
    return 0.32, 0.57 / (e - 0.3), 0.096 / (e - 1.56), (0.57 - 0.05 * e) / (e - 1.44), 0.47, 0.12 / (e - 1.74), rest
