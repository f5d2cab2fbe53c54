"""Profile shifts of the gears of a file: said, left no choice by the distance of the axes, or split by a rule.

A gear in two meshes, an idler or a planet, has one shift: what one mesh says of it goes on into the other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from pmor.gear.pair import tight_distance, tight_shift, transverse_backlash
from pmor.rexs.joints import RING, stages
from pmor.rexs.model import Component, Gearbox
from pmor.rexs.stage import axes_apart

EQUAL = "equal_addendum_modification_coefficients"
# Rules that a file asks for, by which we split as well.
KNOWN_RULES = ("according_to_DIN_3992", EQUAL)
# By which a shift contradicts a distance, and tips that are not shortened may differ from addendum 1; in modules.
CONTRADICTS, ROUNDED_TIP = 0.03, 0.01


@dataclass(frozen=True)
class Shift:
    """Profile shift coefficient of a gear; `how` it was found, empty where the file says it."""

    coefficient: float
    how: str = ""


@dataclass(frozen=True)
class Rack:
    """What two gears have in common.

    Parameters
    ----------
    teeth : (int, int)
        Of a ring negative.
    module, pressure_angle, helix_angle : float
        Normal ones at the reference cylinder; mm, rad.
    """

    teeth: tuple[int, int]
    module: float
    pressure_angle: float
    helix_angle: float

    @property
    def transverse(self) -> float:
        """Transverse pressure angle, rad."""
        return math.atan(math.tan(self.pressure_angle) / math.cos(self.helix_angle))

    @property
    def bases(self) -> float:
        """Sum of the base radii, mm."""
        return 0.5 * sum(self.teeth) * self.module / math.cos(self.helix_angle) * math.cos(self.transverse)

    def shifts_at(self, distance: float) -> float | None:
        """Return the sum of the shifts without backlash at a distance, mm; None where base circles do not reach."""
        if distance <= abs(self.bases):
            return None
        signed = math.copysign(distance, self.bases)
        return tight_shift(sum(self.teeth), self.bases, signed, self.pressure_angle, self.transverse)

    def distance_of(self, shifts: float) -> float:
        """Return the distance without backlash of a sum of shifts, mm; GeometryError where there is none."""
        return abs(tight_distance(sum(self.teeth), self.bases, shifts, self.pressure_angle, self.transverse))

    def backlash(self, distance: float, tight: float) -> float:
        """Return the transverse backlash on the line of action at a distance, without any at another one, mm."""
        return transverse_backlash(abs(self.bases), *sorted((distance, tight)))

    def split(self, total: float, rule: str) -> tuple[float, float]:
        """Return the shifts of both gears by a rule of the standard: equal ones, or DIN 3992 in all other cases.

        DIN 3992 (1964) by the formula of Roloff/Matek, Maschinenelemente (eq. 21.33), with virtual numbers of teeth
        z / cos^3(beta): x_1 = s + (1/2 - s) lg(u) / lg(z_1 z_2 / 100), s = (x_1 + x_2) / 2. It says nothing of rings:
        their pinion has no shift then.
        """
        if min(self.teeth) < 0:
            return (total, 0.0) if self.teeth[0] < 0 else (0.0, total)
        low, high = (z / math.cos(self.helix_angle) ** 3 for z in sorted(self.teeth))
        half = 0.5 * total
        more = (0.5 - half) * math.log(high / low) / math.log(low * high / 100.0) if low * high > 100.0 else 0.0
        if rule == EQUAL or self.teeth[0] == self.teeth[1]:
            more = 0.0
        return (half + more, half - more) if self.teeth[0] <= self.teeth[1] else (half - more, half + more)


def said_shift(gear: Component, flanks: list[Component]) -> float | None:
    """Return the profile shift coefficient that the first of some flanks says."""
    module = gear.number_of("normal_module")
    for flank in flanks:
        if (coefficient := flank.number_of("addendum_modification_coefficient")) is not None:
            return coefficient
        if module and (length := flank.number_of("addendum_modification")) is not None:
            return length / module
    return None


def profile_shifts(gearbox: Gearbox) -> dict[int, Shift]:
    """Return the profile shifts of all gears in cylindrical stages, by their numbers."""
    pairs = stages(gearbox)
    sums = {number: _sum_of_shifts(gearbox, number, pair) for number, pair in pairs.items()}
    found = dict[int, Shift]()
    for gear in {gear.number: gear for pair in pairs.values() for gear in pair}.values():
        if (said := said_shift(gear, gearbox.beside(gear.number, "cylindrical_gear_flank", "flank"))) is not None:
            found[gear.number] = Shift(said)
    for number, pair in pairs.items():
        found |= _outvoted(gearbox, pair, sums[number], found)

    def first(number: int) -> tuple[bool, bool, bool]:
        """What leaves no choice comes first; a rule for two gears outside before one for a ring."""
        pair = pairs[number]
        return sums[number][0] is None, not any(gear.number in found for gear in pair), RING in [g.kind for g in pair]

    while waiting := [n for n, pair in pairs.items() if any(gear.number not in found for gear in pair)]:
        number = min(waiting, key=first)
        found |= _open_shifts(gearbox, number, pairs[number], sums[number], found)
    return found


def _outvoted(
    gearbox: Gearbox, pair: tuple[Component, Component], said: tuple[float | None, str], found: dict[int, Shift]
) -> dict[int, Shift]:
    """A shift that contradicts both distance and tip circle, which agree on another one; none where none does.

    Programs write 0 for shifts that were never given.
    """
    (total, by), rack = said, rack_of(gearbox, pair)
    if total is None or rack is None or any(gear.number not in found for gear in pair):
        return {}
    shifts = [found[gear.number].coefficient for gear in pair]
    off, theirs = total - sum(shifts), dict[int, Shift]()
    for gear, teeth, shift in zip(pair, rack.teeth, shifts, strict=True):
        if abs(off) > CONTRADICTS and (tip := gear.number_of("tip_diameter")) is not None:
            reference = abs(teeth) * rack.module / math.cos(rack.helix_angle)
            above = math.copysign(0.5, teeth) * (abs(tip) - reference) / rack.module
            if abs(above - shift - off - 1.0) < ROUNDED_TIP:
                by_both = f"{by} and its tip_diameter = {tip:g} mm: {shift:g} fits neither"
                theirs[gear.number] = Shift(shift + off, f"profile shift {shift + off:.6g}, from {by_both}")
    return theirs if len(theirs) == 1 else {}


def _open_shifts(
    gearbox: Gearbox, number: int, pair: tuple[Component, Component], said: tuple[float | None, str],
    found: dict[int, Shift],
) -> dict[int, Shift]:  # fmt: skip
    """Shifts of the gears of a stage that the file does not say, by their sum and what says it."""
    total, by = said
    missing = [gear for gear in pair if gear.number not in found]
    if total is None:
        how = "neither its profile shift nor the distance to its mate's axis is said: profile shift 0 assumed"
        return {gear.number: Shift(0.0, how) for gear in missing}
    if len(missing) == 1:
        (gear,) = missing
        mate = pair[1] if gear is pair[0] else pair[0]
        own, of_mate = total - found[mate.number].coefficient, found[mate.number].coefficient
        return {gear.number: Shift(own, f"profile shift {own:.6g}, from {by} and {of_mate:.6g} of {mate.label}")}
    rule = gearbox.components[number].text_of("flag_designation_addendum_modification")
    rack = rack_of(gearbox, pair)
    shifts = rack.split(total, rule) if rack else (0.5 * total, 0.5 * total)
    name = "none on the pinion of a ring" if RING in [gear.kind for gear in pair] else "DIN 3992"
    name = "x1 = x2" if rule == EQUAL and rack and min(rack.teeth) > 0 else name
    asked = f", where the file asks for {rule}" if rule.startswith("equal_") and rule not in KNOWN_RULES else ""
    how = f"of {total:.6g} in all, from {by}, split by a rule: {name}{asked}"
    return {
        gear.number: Shift(shift, f"profile shift {shift:.6g} {how}") for gear, shift in zip(pair, shifts, strict=True)
    }


def _sum_of_shifts(gearbox: Gearbox, number: int, pair: tuple[Component, Component]) -> tuple[float | None, str]:
    """The sum of the shifts of a stage without backlash, and what says it; None where nothing does."""
    stage, rack = gearbox.components[number], rack_of(gearbox, pair)
    distance = stage.number_of("center_distance")
    if distance is None:
        said = stage.number_of("sum_of_addendum_modification_coefficients")
        if said is not None:
            return said, f"sum_of_addendum_modification_coefficients = {said:g}"
    for value, by in ((distance, "center_distance = {:g} mm"), (axes_apart(gearbox, pair), "axes {:.6g} mm apart")):
        total = rack.shifts_at(value) if rack and value else None
        if total is not None:
            return total, by.format(value)
    return None, ""


def rack_of(gearbox: Gearbox, pair: tuple[Component, Component]) -> Rack | None:
    """Return what the gears of a stage have in common, as the first of them says it; None where none does."""
    flanks = [flank for gear in pair for flank in gearbox.beside(gear.number, "cylindrical_gear_flank", "flank")]
    module, angle, helix = (
        next((value for part in parts if (value := part.number_of(name)) is not None), None)
        for name, parts in (("normal_module", pair), ("normal_pressure_angle", flanks),
                            ("helix_angle_reference_diameter", pair))
    )  # fmt: skip
    teeth = [gear.whole_number_of("number_of_teeth") for gear in pair]
    if not module or not angle or not teeth[0] or not teeth[1]:
        return None
    one, two = (-abs(z or 0) if gear.kind == RING else z or 0 for z, gear in zip(teeth, pair, strict=True))
    return Rack((one, two), module, math.radians(angle), math.radians(helix or 0.0)) if one + two else None
