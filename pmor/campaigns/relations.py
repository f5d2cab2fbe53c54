"""From the base case and the keys of a design to its case: relations are solved for the keys that follow."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import fields
from functools import lru_cache
from typing import Any

from pmor.campaigns.settings import Number, Relations
from pmor.case import Case, changed_text, parse_case
from pmor.case.document import GEARS, flattened
from pmor.case.reader import keys_of
from pmor.case.schema import SECTIONS
from pmor.case.values import forms_of
from pmor.core.errors import GeometryError
from pmor.gear.involute import involute_function

PINION, WHEEL = GEARS
# Of a case, either way.
MOST_SHIFT = 3.0


def split(name: str) -> tuple[str, str]:
    """Part the name of a key into its section and itself: ``pinion.modification.tip_relief_um`` has a dot in both."""
    section, _, key = name.rpartition(".")
    return section, key


def unit_of(name: str) -> str:
    """Return the unit of a key of the case; empty where it has none."""
    section, key = split(name)
    hint = keys_of(SECTIONS[section])[key]
    return next((allowed.unit for _, allowed in forms_of(hint) if allowed is not None), "")


def with_relations(base_text: str, design: Mapping[str, Number], relations: Relations) -> dict[str, Number]:
    """Return the keys of a design with those that follow from relations; GeometryError when these cannot be met."""
    found = dict(design)
    if relations.ratio is not None:
        found["wheel.teeth"] = _mating_teeth(int(_setting(base_text, found, "pinion.teeth")), relations)
    if relations.centre_distance_mm is not None:
        found |= _profile_shifts(base_text, found, relations)
    return found


def case_of(base_text: str, design: Mapping[str, Number], name: str) -> Case:
    """Return the case of a design, keys as `with_relations` gives them, under a name that stands in messages."""
    return parse_case(text_of_design(base_text, design), name, name)


def text_of_design(base_text: str, design: Mapping[str, Number]) -> str:
    """Return the TOML text of the case of a design; see `case_of`."""
    changes: dict[str, dict[str, Any]] = {}
    for name, value in design.items():
        section, key = split(name)
        changes.setdefault(section, {})[key] = value
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


def _profile_shifts(base_text: str, design: Mapping[str, Number], relations: Relations) -> dict[str, float]:
    """Profile shifts with which a pair has a centre distance without backlash (ISO 21771, 6.2, solved for them)."""
    distance = relations.centre_distance_mm
    assert distance is not None

    def setting(name: str) -> float:
        return float(_setting(base_text, design, name))

    gives = _without_shifts(base_text, design, distance)
    teeth = setting("pinion.teeth") + setting("wheel.teeth")
    normal, helix = math.radians(setting("pair.pressure_angle_deg")), math.radians(setting("pair.helix_angle_deg"))
    transverse = math.atan(math.tan(normal) / math.cos(helix))
    bases = 0.5 * teeth * setting("pair.module_mm") / math.cos(helix) * math.cos(transverse)
    if bases >= distance:
        raise GeometryError(
            f"[relations] centre_distance_mm = {distance:g}: {gives}, and the base circles' radii alone are "
            f"{bases:.4g} mm together: take fewer teeth or a smaller module"
        )
    working = math.acos(bases / distance)
    needed = teeth * (involute_function(working) - involute_function(transverse)) / (2.0 * math.tan(normal))
    if relations.solve == "both":
        found = {f"{gear}.profile_shift": 0.5 * needed for gear in GEARS}
    else:
        # The mate's is set explicitly: a wheel without a section would inherit the pinion's new one.
        mate = f"{WHEEL if relations.solve == PINION else PINION}.profile_shift"
        found = {f"{relations.solve}.profile_shift": needed - setting(mate), mate: setting(mate)}
    largest = max(found.values(), key=abs)
    if abs(largest) > MOST_SHIFT:
        more = ("more teeth", "larger") if largest > 0.0 else ("fewer teeth", "smaller")
        raise GeometryError(
            f"[relations] centre_distance_mm = {distance:g}: {gives}: the difference takes a profile shift of "
            f"{largest:.3g}, and {MOST_SHIFT:g} is the most: take {more[0]} or a {more[1]} module"
        )
    return found


def why_infeasible(reason: str, base_text: str, design: Mapping[str, Number], relations: Relations) -> str:
    """Return why a design cannot be made, with the profile shifts that a centre distance has made it take."""
    shifts = [design.get(f"{gear}.profile_shift") for gear in GEARS]
    if relations.centre_distance_mm is None or None in shifts:
        return reason
    gives = _without_shifts(base_text, design, relations.centre_distance_mm)
    taken = " and ".join(f"x{k} = {shift:.3g}" for k, shift in enumerate(shifts, start=1))
    return f"{reason} ([relations] set {taken}: {gives})"


def _without_shifts(base_text: str, design: Mapping[str, Number], distance: float) -> str:
    """The centre distance of a design without profile shifts, beside the one that is asked for."""
    module, *teeth = (_setting(base_text, design, name) for name in ("pair.module_mm", "pinion.teeth", "wheel.teeth"))
    helix = _setting(base_text, design, "pair.helix_angle_deg")
    reference = 0.5 * sum(teeth) * module / math.cos(math.radians(helix))
    under = f" under {helix:g} deg" if helix else ""
    return f"z1 + z2 = {sum(teeth)} at m {module:g}{under} gives {reference:.4g} mm; {distance:g} asked"


def _setting(base_text: str, design: Mapping[str, Number], name: str) -> Any:
    """Value of a key: of the design, of the base case, or the usual one."""
    section, key = split(name)
    document = _document(base_text)
    if name in design:
        return design[name]
    if section == WHEEL and section not in document:
        return _setting(base_text, design, f"{PINION}.{key}")
    usual = {field.name: field.default for field in fields(SECTIONS[section])}
    return document.get(section, {}).get(key, usual[key])


@lru_cache(maxsize=4)
def _document(base_text: str) -> dict[str, Any]:
    return flattened(tomllib.loads(base_text))
