"""Allowed ranges of numbers with units: they stand beside the type of each field that a case file fills.

The ranges are wide enough for extreme gears; they exist to catch slips, above all wrong units.
"""

import math
from dataclasses import dataclass
from typing import Annotated, Literal


@dataclass(frozen=True)
class WrongUnit:
    """A unit that is easily written by mistake.

    Parameters
    ----------
    name, symbol : str
        The mistaken unit, spelt out and as a symbol.
    factor : float
        Multiply the value by this to get the unit that the key asks for.
    """

    name: str
    symbol: str
    factor: float


@dataclass(frozen=True)
class Range:
    """Allowed range of a number, or of each number of a list; the ends belong to it unless said otherwise.

    A list is sorted, and has no number twice, unless its numbers stand `in_order`. A number other than 0 but smaller
    than `least` is allowed, and likely one in a unit of `mistaken_for` (`pmor.case.slips`).
    """

    low: float
    high: float
    unit: str = ""
    low_excluded: bool = False
    high_excluded: bool = False
    mistaken_for: tuple[WrongUnit, ...] = ()
    in_order: bool = False
    least: float = 0.0

    def contains(self, value: float) -> bool:
        """Whether `value` lies in the range; never true for nan."""
        above = value > self.low if self.low_excluded else value >= self.low
        below = value < self.high if self.high_excluded else value <= self.high
        return above and below


METRES = WrongUnit("metres", "m", 1e3)
MILLIMETRES = WrongUnit("millimetres", "mm", 1e3)
RADIANS = WrongUnit("radians", "rad", math.degrees(1.0))
SHARE = WrongUnit("a share", "of 1", 100.0)
TAKEN_OFF = WrongUnit("what is taken off", "um", -1.0)
PASCALS = (WrongUnit("MPa", "MPa", 1e-3), WrongUnit("Pa", "Pa", 1e-9))
GRAMS_PER_CM3 = WrongUnit("g/cm3", "g/cm3", 1e3)

# Deviations below this, um, are less than any machine tool makes or measures.
LEAST_DEVIATION = 0.05


def micrometres(low: float, high: float, *, in_order: bool = False) -> Range:
    """Return the range of a deviation of flanks, axes or pins, um."""
    return Range(low, high, "um", mistaken_for=(MILLIMETRES,), in_order=in_order, least=LEAST_DEVIATION)


Length = Annotated[float, Range(1e-3, 1e5, "mm", mistaken_for=(METRES,))]
Torque = Annotated[float, Range(0.0, 1e12, "N m", low_excluded=True)]
Torques = Annotated[tuple[float, ...], Range(0.0, 1e12, "N m", low_excluded=True)]
Stiffness = Annotated[float, Range(1e-3, 1e15, "N/mm")] | Literal["rigid", "free"]
TiltStiffness = Annotated[float, Range(1e-3, 1e18, "N mm/rad")] | Literal["rigid", "free"]
SignedTorque = Annotated[float, Range(-1e12, 1e12, "N m")]
Diameter = Annotated[float, Range(0.0, 1e5, "mm", mistaken_for=(METRES,))]
Place = Annotated[float, Range(-1e6, 1e6, "mm")]
Places = Annotated[tuple[float, ...], Range(-1e6, 1e6, "mm", in_order=True)]
YoungsModulus = Annotated[float, Range(1e-3, 1e4, "GPa", mistaken_for=PASCALS)]
PoissonRatio = Annotated[float, Range(0.0, 0.5, high_excluded=True)]
Density = Annotated[float, Range(100.0, 3e4, "kg/m3", mistaken_for=(GRAMS_PER_CM3,))]
