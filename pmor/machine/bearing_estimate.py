"""Stiffness of a rolling bearing across by its type, bore and load, where a file says no more of it.

Balls: deflection of the most loaded ball after Palmgren (1959), as in Harris, Rolling Bearing Analysis (1991), with the
load that Stribeck's formula gives it in a bearing without clearance; balls of 0.3 of the height between bore and outer
diameter, 2.9 (D + d) / (D - d) of them in a row, the usual proportions of deep-groove ball bearings.

Rollers: Schaeffler, Rolling Bearings, catalogue HR 1, "Rigidity": delta = F^0.84 / (K_c d^0.65), in um, N and mm. K_c
is that of cylindrical roller bearings with cage, NJ2, or of needle roller bearings, NA49.

Both hold without clearance, preload and misalignment, and are no better than a factor of two.
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

# Of the height between bore and outer diameter; of Z = 2.9 (D + d) / (D - d).
BALL_SHARE, BALL_COUNT = 0.3, 2.9
# D / d of the light series (02), where the outer diameter is not said.
LIGHT_SERIES = 1.8
# Palmgren, mm and N; Stribeck, of point contacts.
BALL_DEFLECTION, STRIBECK = 4.36e-4, 4.37
# Schaeffler, HR 1: K_c, and exponents of load and bore.
RIGIDITY = {"roller": 11.1, "needle": 23.5}
LOAD_EXPONENT, BORE_EXPONENT = 0.84, 0.65

SOURCES = {
    "ball": "Palmgren (1959)", "roller": "Schaeffler HR 1, K_c = 11.1", "needle": "Schaeffler HR 1, K_c = 23.5",
}  # fmt: skip


class CatalogueBearing(NamedTuple):
    """A bearing as a catalogue number has it.

    Attributes
    ----------
    kind : {"ball", "roller", "needle"}
    bore_mm : float
    outer_mm : float or None
        Outer diameter; that of the light series without.
    rows : int
        Of rolling elements.
    contact_angle_deg : float
        Of balls.
    """

    kind: Literal["ball", "roller", "needle"]
    bore_mm: float
    outer_mm: float | None = None
    rows: int = 1
    contact_angle_deg: float = 0.0

    def radial_N_per_mm(self, load_N: float) -> float:
        """Return load over deflection under a radial load, to three digits."""
        load = load_N / self.rows
        if self.kind == "ball":
            outer = self.outer_mm or LIGHT_SERIES * self.bore_mm
            diameter = BALL_SHARE * (outer - self.bore_mm)
            count, cosine = BALL_COUNT * (outer + self.bore_mm) / (outer - self.bore_mm), self._cosine
            deflection = BALL_DEFLECTION * (STRIBECK * load / (count * cosine)) ** (2.0 / 3.0)
            deflection /= diameter ** (1.0 / 3.0) * cosine
        else:
            deflection = 1e-3 * load**LOAD_EXPONENT / (RIGIDITY[self.kind] * self.bore_mm**BORE_EXPONENT)
        return float(f"{load_N / deflection:.3g}")

    @property
    def _cosine(self) -> float:
        return math.cos(math.radians(self.contact_angle_deg))

    @property
    def source(self) -> str:
        """What the estimate is after, and from."""
        sizes = f"bore {self.bore_mm:g} mm"
        if self.kind == "ball":
            sizes += f", D {self.outer_mm:g} mm" if self.outer_mm else f", D {LIGHT_SERIES:g} of it assumed"
        return f"{SOURCES[self.kind]}, {self.kind} bearing, {sizes}"
