"""Units of REXS attributes: those of the standard, and others that programs write."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

#: units of the standard, of attributes that are read or written; the others have none
UNITS = {
    attribute: unit
    for unit, attributes in tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")).items()
    for attribute in attributes.split()
}
#: units that are converted, by the one used here; spaces, dots and stars between factors do not count
FACTORS = {
    "mm": {"mm": 1.0, "mum": 1e-3, "um": 1e-3, "\u00b5m": 1e-3, "\u03bcm": 1e-3, "nm": 1e-6, "cm": 10.0, "dm": 100.0,
           "m": 1e3, "in": 25.4, "inch": 25.4},
    "deg": {"deg": 1.0, "\u00b0": 1.0, "degree": 1.0, "rad": 180.0 / math.pi, "mrad": 0.18 / math.pi},
    "MPa": {"MPa": 1.0, "N/mm^2": 1.0, "N/mm\u00b2": 1.0, "Pa": 1e-6, "N/m^2": 1e-6, "kPa": 1e-3, "GPa": 1e3,
            "kN/mm^2": 1e3},
    "N m": {"Nm": 1.0, "Nmm": 1e-3, "Ncm": 1e-2, "kNm": 1e3, "kNmm": 1.0, "MNm": 1e6},
    "N / mm": {"N/mm": 1.0, "N/m": 1e-3, "kN/mm": 1e3},
    "N": {"N": 1.0, "kN": 1e3},
    "N mm / rad": {"Nmm/rad": 1.0, "Nm/rad": 1e3},
    "C": {"C": 1.0, "\u00b0C": 1.0, "degC": 1.0},
    "kg / dm^3": {"kg/dm^3": 1.0, "g/cm^3": 1.0, "kg/m^3": 1e-3},
    "m / s^2": {"m/s^2": 1.0, "mm/s^2": 1e-3},
    "mm^2 / s": {"mm^2/s": 1.0, "cSt": 1.0, "m^2/s": 1e6},
    "mPa s": {"mPas": 1.0, "Pas": 1e3},
    "kW": {"kW": 1.0, "W": 1e-3, "MW": 1e3},
    "N / rad": {"N/rad": 1.0, "kN/rad": 1e3},
    "1 / min": {"1/min": 1.0, "rpm": 1.0, "1/s": 60.0, "Hz": 60.0},
    "%": {"%": 1.0},
    "h": {"h": 1.0, "min": 1.0 / 60.0, "s": 1.0 / 3600.0},
    "W": {"W": 1.0, "kW": 1e3, "MW": 1e6},
    "none": {"none": 1.0, "-": 1.0, "1": 1.0},
}  # fmt: skip


def factor_of(attribute: str, unit: str) -> float:
    """Return the factor from a unit to the one used here for an attribute; an empty unit is that of the standard.

    Raises
    ------
    ValueError
        When the unit is unknown, or of another quantity.
    """
    standard = UNITS.get(attribute, "none")
    known = FACTORS.get(standard) or next(factors for factors in FACTORS.values() if _plain(standard) in factors)
    factor = known.get(_plain(unit or standard))
    if factor is None:
        raise ValueError(f"unit = {unit!r}: must be one of {', '.join(known)}")
    return factor


def rounded(value: float) -> float:
    """Round off the last digits, which a change of units leaves and nobody means."""
    return float(f"{value:.12g}")


def _plain(unit: str) -> str:
    return "".join(c for c in unit if not c.isspace() and c not in "*\u00b7\u22c5")
