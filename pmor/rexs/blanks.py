"""Blanks by dimensions in a REXS file: attributes of ours on the gear, which REXS has none for, and the other way."""

from __future__ import annotations

from typing import Any

from pmor.case.blank import BlankCase
from pmor.rexs.document import Value
from pmor.rexs.model import Component

# Keys of a blank and of its holes, by attribute.
OF_BLANK = {
    "custom_pmor_rim_thickness": "rim_thickness_mm", "custom_pmor_web_thickness": "web_thickness_mm",
    "custom_pmor_web_offset": "web_offset_mm", "custom_pmor_hub_radius": "hub_radius_mm",
    "custom_pmor_hub_width": "hub_width_mm", "custom_pmor_held_length": "held_length_mm",
    "custom_pmor_held_offset": "held_offset_mm",
}  # fmt: skip
OF_HOLES = {
    "custom_pmor_hole_radius": "radius_mm", "custom_pmor_holes_on_radius": "on_radius_mm",
    "custom_pmor_hole_length": "length_deg", "custom_pmor_first_hole": "first_deg",
}  # fmt: skip
COUNT = "custom_pmor_number_of_holes"
# Radius and z of both faces, station by station.
PROFILE = "custom_pmor_web_profile"
# Without it or a profile a gear has no blank of ours.
NEEDED = "custom_pmor_web_thickness"


def blank_attributes(blank: BlankCase | None) -> dict[str, Value]:
    """Return the attributes of a gear with a blank; none without."""
    if blank is None:
        return {}
    found: dict[str, Value] = {
        name: value for name, key in OF_BLANK.items() if (value := getattr(blank, key)) is not None
    }
    if blank.web_profile is not None:
        found[PROFILE] = [number for station in blank.web_profile for number in station]
    if blank.holes is None:
        return found
    return found | {COUNT: blank.holes.count} | {name: getattr(blank.holes, key) for name, key in OF_HOLES.items()}


def blank_keys(gear: Component) -> dict[str, Any]:
    """Return the key `blank` of a gear that has such attributes; none of others."""
    profile = gear.numbers_of(PROFILE)
    if gear.number_of(NEEDED) is None and not profile:
        return {}
    blank: dict[str, Any] = _known(gear, OF_BLANK)
    if profile:
        blank["web_profile"] = [profile[place : place + 3] for place in range(0, len(profile), 3)]
    if count := gear.whole_number_of(COUNT):
        blank["holes"] = {"count": count, **_known(gear, OF_HOLES)}
    return {"blank": blank}


def _known(gear: Component, keys: dict[str, str]) -> dict[str, float]:
    return {key: value for name, key in keys.items() if (value := gear.number_of(name)) is not None}
