"""Stiffness of a rolling bearing across by its type, sizes and load, where a file says no more of it.

The deflection is that of the most loaded element, Q = 4.37 F / (Z cos alpha) of balls and 4.08 F / Z of rollers in a
bearing without clearance (Stribeck; NSK, Technical Report CAT. E728g, section 5.1, eq. 4 and 5):

    balls, mm and N (Palmgren 1959, as in Harris, Rolling Bearing Analysis, 1991):
        4.36e-4 Q^(2/3) / (D_w^(1/3) cos alpha)
    rollers (ISO/TS 16281:2008, eq. 19): (Q / (35,948 L^(8/9)))^(9/10)

Number and size of the elements are those of usual proportions: balls have 0.3 of the height between bore and outer
diameter, rollers 0.27, needles half of it; rollers are 0.74 of the width long, and they fill 0.8 of their circle,
needles 0.65 (tapered bearings 33012, 33014, 33016 and needle cage K50x58x25 as a public REXS file has them).

It holds without clearance, preload and misalignment, and is no better than a factor of two.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Literal

from pmor.core.ranges import Length, Range

# ISO/TS 16281, 5.3: stiffness of a roller of steel, N/mm^(10/9) for lengths in mm.
LINE, LINE_STIFFNESS, LINE_LENGTH_EXPONENT = 10.0 / 9.0, 35948.0, 8.0 / 9.0
BALL_DEFLECTION = 4.36e-4
# Of the most loaded element over the mean one of all.
STRIBECK = {"ball": 4.37, "roller": 4.08, "needle": 4.08}
# Of the height between bore and outer diameter, of the circle of the elements' centres, and of the width.
SHARE = {"ball": 0.3, "roller": 0.27, "needle": 0.5}
FILLED = {"ball": 0.55, "roller": 0.8, "needle": 0.65}
LENGTH = 0.74
# Of the outer diameter over the bore, where it is not said: the light series 02, and needle bearings 49.
OUTER = {"ball": 1.8, "roller": 1.8, "needle": 1.4}
# Of the width over the height between bore and outer diameter, where it is not said.
WIDTH = {"ball": 0.5, "roller": 0.5, "needle": 1.1}

SOURCES = {"ball": "Palmgren (1959)", "roller": "ISO/TS 16281", "needle": "ISO/TS 16281"}


@dataclass(frozen=True)
class CatalogueBearing:
    """A bearing as a catalogue number has it.

    Parameters
    ----------
    kind : {"ball", "roller", "needle"}
        Kind of its rolling elements.
    bore_mm : float
        Diameter of the bore.
    outer_mm : float or None
        Outer diameter; that of a light series without.
    rows : int
        Number of rows of rolling elements.
    contact_angle_deg : float
        Contact angle of balls.
    width_mm : float or None
        Width of the whole bearing; that of a light series without.
    """

    kind: Literal["ball", "roller", "needle"]
    bore_mm: Length
    outer_mm: Length | None = None
    rows: Annotated[int, Range(1, 8)] = 1
    contact_angle_deg: Annotated[float, Range(0.0, 90.0, "deg", high_excluded=True)] = 0.0
    width_mm: Length | None = None

    @property
    def fault(self) -> tuple[str, str] | None:
        """Keys that no bearing has together, and the rule; None of a possible bearing."""
        if self.outer_mm is not None and self.outer_mm <= self.bore_mm:
            return f"outer_mm = {self.outer_mm:g}", f"must be above bore_mm = {self.bore_mm:g}: correct one of them"
        return None

    def radial_N_per_mm(self, load_N: float) -> float:
        """Return load over deflection under a radial load, to three digits."""
        outer = self.outer_mm or OUTER[self.kind] * self.bore_mm
        height, pitch = outer - self.bore_mm, 0.5 * (outer + self.bore_mm)
        diameter, cosine = SHARE[self.kind] * height, math.cos(math.radians(self.contact_angle_deg))
        count = FILLED[self.kind] * math.pi * pitch / diameter
        most = STRIBECK[self.kind] * load_N / (self.rows * count * cosine)
        if self.kind == "ball":
            deflection = BALL_DEFLECTION * most ** (2.0 / 3.0) / (diameter ** (1.0 / 3.0) * cosine)
        else:
            length = LENGTH * (self.width_mm or self.rows * WIDTH[self.kind] * height) / self.rows
            deflection = (most / (LINE_STIFFNESS * length**LINE_LENGTH_EXPONENT)) ** (1.0 / LINE)
        return float(f"{load_N / deflection:.3g}")

    @property
    def source(self) -> str:
        """What the estimate is after, and from."""
        outer = f"D {self.outer_mm:g} mm" if self.outer_mm else f"D {OUTER[self.kind]:g} of it assumed"
        width = "" if self.kind == "ball" else f", width {self.width_mm:g} mm" if self.width_mm else ", usual width"
        sizes = f"bore {self.bore_mm:g} mm, {outer}{width}"
        return f"{SOURCES[self.kind]} and usual proportions, {self.kind} bearing, {sizes}"
