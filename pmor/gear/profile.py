"""Places along the flank of a gear, in each measure that drawings and programs use.

The roll angle u of an involute and the place of its contact on the line of action are one thing: r_b u is its roll
length, r_b sqrt(1 + u^2) its radius. Source: ISO 21771:2007 (roll angle, roll length, lengths of reliefs).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from pmor.gear.modification import RELIEF_PLACES, Modification
from pmor.gear.pair import GearPair


@dataclass(frozen=True)
class ProfilePoint:
    """A point of a flank.

    Parameters
    ----------
    roll_deg : float
        Roll angle of the gear, degrees: 0 at the base circle.
    roll_length_mm : float
        On the line of action, from where it touches the base circle, mm.
    diameter_mm : float
        mm.
    to_tip_mm, from_start_mm : float
        On the line of action, to the tip circle and from the start of the active profile, mm.
    percent : float
        Of the path of contact, from the start of the active profile (0) to its end (100).
    """

    roll_deg: float
    roll_length_mm: float
    diameter_mm: float
    to_tip_mm: float
    from_start_mm: float
    percent: float


@dataclass(frozen=True)
class Profile:
    """The flank of a gear in its pair, along the profile.

    Parameters
    ----------
    base_radius : float
        Negative of an internal gear, mm.
    start, end, tip : float
        Roll angles at the start and the end of the active profile, and at the tip circle, rad.
    """

    base_radius: float
    start: float
    end: float
    tip: float

    def point(self, roll: float) -> ProfilePoint:
        """Return the point at a roll angle (rad) in all measures."""
        length = self.base_radius * roll
        return ProfilePoint(
            roll_deg=math.degrees(roll), roll_length_mm=abs(length),
            diameter_mm=2.0 * abs(self.base_radius) * math.hypot(1.0, roll),
            to_tip_mm=self.base_radius * self.tip - length, from_start_mm=length - self.base_radius * self.start,
            percent=100.0 * (roll - self.start) / (self.end - self.start),
        )  # fmt: skip

    def roll_at(self, measure: str, value: float) -> float:
        """Return the roll angle of a point, rad; the inverse of `point`.

        Parameters
        ----------
        measure : str
            A field of `ProfilePoint`.
        value : float
            In its unit; a diameter below the base circle counts as the base circle.
        """
        if measure == "roll_deg":
            return math.radians(value)
        if measure == "roll_length_mm":
            return value / abs(self.base_radius)
        if measure == "diameter_mm":
            ratio = 0.5 * value / self.base_radius
            return math.sqrt(max((ratio - 1.0) * (ratio + 1.0), 0.0))
        if measure == "to_tip_mm":
            return self.tip - value / self.base_radius
        if measure == "from_start_mm":
            return self.start + value / self.base_radius
        if measure == "percent":
            return self.start + 1e-2 * value * (self.end - self.start)
        raise ValueError(f"measure = {measure!r}: is no field of ProfilePoint")

    def roll_rate(self, measure: str, value: float) -> float:
        """Return the derivative of `roll_at`, rad per unit."""
        if measure == "diameter_mm":
            return value / (4.0 * self.base_radius**2 * self.roll_at(measure, value))
        return self.roll_at(measure, value + 1.0) - self.roll_at(measure, value)  # all others are linear

    def relief_roll(self, modification: Modification, amount: str) -> float | None:
        """Return the roll angle at which a relief, by the key of its amount, starts or ends, rad; None without."""
        key = modification.place_of(amount)
        return None if key is None else self.roll_at(RELIEF_PLACES[amount][key], getattr(modification, key))

    def in_roll_angles(self, modification: Modification) -> Modification:
        """Return a modification of this flank whose reliefs start and end at roll angles."""
        for amount, places in RELIEF_PLACES.items():
            key, by_roll = modification.place_of(amount), next(iter(places))
            if key not in (None, by_roll):
                roll = self.relief_roll(modification, amount)
                modification = modification.changed({by_roll: math.degrees(roll or 0.0)})
        return modification


def profiles(pair: GearPair) -> tuple[Profile, Profile]:
    """Return the flanks of pinion and wheel, along the profile."""
    (pinion, wheel), teeth = pair.active_rolls, (pair.pinion, pair.wheel)
    return (
        Profile(teeth[0].base_radius, *pinion, teeth[0].tip_roll_angle),
        Profile(teeth[1].base_radius, *wheel, teeth[1].tip_roll_angle),
    )
