"""Campaigns of pairs: from base case and keys of a design to its case; relations are solved for what follows."""

from __future__ import annotations

import math
import tomllib
from functools import lru_cache
from typing import Any

from pmor.campaigns.keys import by_section, setting, split
from pmor.campaigns.kind import Design, Number
from pmor.campaigns.settings import Relations
from pmor.case import Case, changed_text, parse_case
from pmor.case.document import GEARS, flattened
from pmor.case.schema import SECTIONS
from pmor.core.errors import GeometryError
from pmor.gear.pair import tight_shift

PINION, WHEEL = GEARS
# Of a case, either way.
MOST_SHIFT = 3.0


def with_relations(base_text: str, design: Design, relations: Relations) -> dict[str, Number]:
    """Return the keys of a design with those that follow from relations; GeometryError when these cannot be met."""
    found = dict(design)
    if relations.ratio is not None:
        found["wheel.teeth"] = _mating_teeth(int(_setting(base_text, found, "pinion.teeth")), relations)
    if relations.centre_distance_mm is not None:
        found |= _profile_shifts(base_text, found, relations)
    return found


def case_of(base_text: str, design: Design, name: str) -> Case:
    """Return the case of a design, keys as `with_relations` gives them, under a name that stands in messages."""
    return parse_case(text_of_design(base_text, design), name, name)


def text_of_design(base_text: str, design: Design) -> str:
    """Return the TOML text of the case of a design; see `case_of`."""
    changes = by_section(design)
    document = _document(base_text)
    if WHEEL in changes and WHEEL not in document:
        # A wheel without a section is like the pinion, also in the keys that a design leaves alone.
        changes[WHEEL] = document[PINION] | changes.get(PINION, {}) | changes[WHEEL]
    return changed_text(base_text, changes)


def _mating_teeth(teeth: int, relations: Relations) -> int:
    assert relations.ratio is not None
    mating = max(round(relations.ratio * teeth), 1)
    off = 100.0 * abs(mating / teeth / relations.ratio - 1.0)
    if off > relations.ratio_tolerance_percent:
        raise GeometryError(
            f"[relations] ratio = {relations.ratio:g}: {teeth} and {mating} teeth are off by {off:.2g} %, more than "
            f"{relations.ratio_tolerance_percent:g} %: take other teeth, or raise ratio_tolerance_percent"
        )
    return mating


def _profile_shifts(base_text: str, design: Design, relations: Relations) -> dict[str, float]:
    """Profile shifts with which a pair has a centre distance without backlash (ISO 21771, 6.2, solved for them)."""
    distance = relations.centre_distance_mm
    assert distance is not None

    def number(name: str) -> float:
        return float(_setting(base_text, design, name))

    gives = _without_shifts(base_text, design, distance)
    ring = bool(_setting(base_text, design, "wheel.internal"))
    teeth = int(number("pinion.teeth") + (-1 if ring else 1) * number("wheel.teeth"))
    normal, helix = math.radians(number("pair.pressure_angle_deg")), math.radians(number("pair.helix_angle_deg"))
    transverse = math.atan(math.tan(normal) / math.cos(helix))
    bases = 0.5 * teeth * number("pair.module_mm") / math.cos(helix) * math.cos(transverse)
    if abs(bases) >= distance:
        raise GeometryError(
            f"[relations] centre_distance_mm = {distance:g}: {gives}, and the base circles' radii alone are "
            f"{abs(bases):.4g} mm {'apart' if ring else 'together'}: take fewer teeth or a smaller module"
        )
    needed = tight_shift(teeth, bases, math.copysign(distance, teeth), normal, transverse)
    if relations.solve == "both":
        found = {f"{gear}.profile_shift": 0.5 * needed for gear in GEARS}
    else:
        # The mate's is set explicitly: a wheel without a section would inherit the pinion's new one.
        mate = f"{WHEEL if relations.solve == PINION else PINION}.profile_shift"
        found = {f"{relations.solve}.profile_shift": needed - number(mate), mate: number(mate)}
    largest = max(found.values(), key=abs)
    if abs(largest) > MOST_SHIFT:
        more = ("more teeth", "larger") if largest > 0.0 else ("fewer teeth", "smaller")
        raise GeometryError(
            f"[relations] centre_distance_mm = {distance:g}: {gives}: the difference takes a profile shift of "
            f"{largest:.3g}, and {MOST_SHIFT:g} is the most: take {more[0]} or a {more[1]} module"
        )
    return found


def why_infeasible(reason: str, base_text: str, design: Design, relations: Relations) -> str:
    """Return why a design cannot be made, with the profile shifts that a centre distance has made it take."""
    shifts = [design.get(f"{gear}.profile_shift") for gear in GEARS]
    if relations.centre_distance_mm is None or None in shifts:
        return reason
    gives = _without_shifts(base_text, design, relations.centre_distance_mm)
    taken = " and ".join(f"x{k} = {shift:.3g}" for k, shift in enumerate(shifts, start=1))
    return f"{reason} ([relations] set {taken}: {gives})"


def _without_shifts(base_text: str, design: Design, distance: float) -> str:
    """The centre distance of a design without profile shifts, beside the one that is asked for."""
    module, first, second = (
        _setting(base_text, design, name) for name in ("pair.module_mm", "pinion.teeth", "wheel.teeth")
    )
    helix, ring = (_setting(base_text, design, name) for name in ("pair.helix_angle_deg", "wheel.internal"))
    teeth, words = (second - first, "z2 - z1") if ring else (first + second, "z1 + z2")
    reference = 0.5 * teeth * module / math.cos(math.radians(helix))
    under = f" under {helix:g} deg" if helix else ""
    return f"{words} = {teeth} at m {module:g}{under} gives {reference:.4g} mm; {distance:g} asked"


def _setting(base_text: str, design: Design, name: str) -> Any:
    """Value of a key: of the design, of the base case, or the usual one."""
    section, key = split(name)
    document = _document(base_text)
    if section == WHEEL and section not in document and name not in design:
        return _setting(base_text, design, f"{PINION}.{key}")
    return setting(document, design, name, SECTIONS)


@lru_cache(maxsize=4)
def _document(base_text: str) -> dict[str, Any]:
    return flattened(tomllib.loads(base_text))
