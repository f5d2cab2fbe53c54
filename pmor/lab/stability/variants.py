"""One line of the matrix: a change of the case, and how the answer is judged."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from pmor.case import Case
from pmor.gear.pair import GearPair
from pmor.lab.core.variants import Sections, merged

Against = Literal["start", "base", "finer", "mirror", "neighbours", "full", "nothing"]

#: how a reference solution is found, for the report
REFERENCES = {
    "start": "the same positions, reached from another load",
    "base": "the base case at the same positions, by the scale that mechanics asks for",
    "finer": "the same gears on half again as many elements over the profile, less the change of the base case",
    "mirror": "the same pair with the gears exchanged, at the mirrored positions",
    "neighbours": "the mean of the two positions a ten-thousandth of a pitch away",
    "full": "full FE on the same mesh",
    "nothing": "nothing: the variant is expected to be refused",
}
# Two ways to one state agree to the tolerance of the solver, with a margin for flat directions.
SAME_STATE = 1e-6


@dataclass(frozen=True)
class Variant:
    """One line of the matrix."""

    name: str  # Unique
    # Heading of the report, and subject of the group
    group: str
    about: str
    changes: Sections = field(default_factory=dict)  # New values by section and key of the case
    against: Against = "start"  # Key of `REFERENCES`
    factor: float = 1.0  # The STE of the reference is multiplied by it
    tolerance: float = SAME_STATE  # On the largest difference to the reference over its mean STE
    # {"usual", "borders", "ends", "hunting"}: Positions over the pitch: `pmor.lab.stability.places`
    places: str = "usual"
    # Offset of the first guess, mm along the line of action; None: the solver's own start
    start_mm: float | None = None
    # Loads over the nominal one that are solved before it, one after the other, as a sweep does
    rising: tuple[float, ...] = ()
    basis: str | None = None  # Training of the reduced basis (`pmor.lab.stability.reduced`); None: full FE
    limit: str = ""  # Part of the warning that the program gives beforehand where this variant is known not to hold


def rows(
    group: str, about: str, table: Mapping[str, Sections | tuple[Sections, Mapping[str, Any]]], **judged: Any
) -> list[Variant]:
    """Return the variants of a group.

    `table` gives by name the changes, alone or with fields of `Variant` that differ from `judged`, which holds for the
    whole group; its ``common`` changes are shared by all.
    """
    common = judged.pop("common", {})
    found = []
    for name, entry in table.items():
        changes, own = entry if isinstance(entry, tuple) else (entry, {})
        found.append(Variant(name, group, about, merged(common, changes), **(judged | dict(own))))
    return found


def load(torque_Nm: float) -> Sections:
    """Changes that set the nominal torque and that of every stage."""
    stages = {name: {"torques_Nm": [torque_Nm]} for name in ("offline", "online", "compare")}
    return {"load": {"torque_Nm": torque_Nm}, **stages}


def wheel(case: Case, **keys: Any) -> Sections:
    """Changes of the wheel, with all its keys: a case may leave it to be like the pinion."""
    return {"wheel": {**vars(case.pair.wheel), **keys}}


def both_gears(case: Case, **keys: Any) -> Sections:
    """Changes of both gears."""
    return {"pinion": keys, **wheel(case, **keys)}


def modified(pinion: Mapping[str, Any], wheel: Mapping[str, Any] | None = None) -> Sections:
    """Changes of the flank modifications; of the pinion alone, or of both gears."""
    return {"pinion.modification": dict(pinion), "wheel.modification": dict(wheel or {})}


def both_flanks(**keys: Any) -> Sections:
    """The same modification on both gears."""
    return modified(keys, keys)


def roll_deg(pair: GearPair, gear: int, share: float) -> float:
    """Roll angle at a share of the way from the start of a gear's active profile to its tip, deg."""
    start, tip = pair.active_rolls[gear][0], (pair.pinion, pair.wheel)[gear].tip_roll_angle
    return math.degrees(start + share * (tip - start))


def short(power: float) -> str:
    """Write a power of ten the short way, such as 1e6."""
    return f"{power:.0e}".replace("e+0", "e").replace("e+", "e")
