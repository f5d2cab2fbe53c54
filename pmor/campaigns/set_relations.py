"""Campaigns of sets: from the base set and the keys of a design to its set file, with what follows from relations."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable
from functools import lru_cache
from typing import Any

from pmor.campaigns.keys import by_section, setting
from pmor.campaigns.kind import Design, Number
from pmor.campaigns.settings import SetRelations
from pmor.case.change import document_text, laid_over
from pmor.case.document import flattened
from pmor.case.reader import sections_in
from pmor.case.schema import SECTIONS
from pmor.core.errors import GeometryError
from pmor.gear.pair import tight_distance, tight_shift
from pmor.sets.kinematics import member_speeds
from pmor.sets.loader import PLANETARY, SHARED
from pmor.sets.settings import SetSections

LISTS = ("gears", "meshes", "pins.bearings")
# Sections whose keys designs may change.
KNOWN: dict[str, type] = {
    **{f"{member}{name.removeprefix(role)}": kind
       for member, role in zip(PLANETARY, ("pinion", "pinion", "wheel"), strict=True)
       for name, kind in SECTIONS.items() if name.split(".")[0] == role},
    **{name: SECTIONS[name] for name in SHARED},
    **{name: kind for name, kind in sections_in(SetSections).items() if name not in LISTS},
}  # fmt: skip
# Of a gear, either way.
MOST_SHIFT = 3.0
# Of a profile shift: without the round-off of a shift that is none.
DIGITS = 12


def with_relations(base_text: str, design: Design, relations: SetRelations) -> dict[str, Number]:
    """Return the keys of a design with those that follow from relations; GeometryError when these cannot be met."""
    found = dict(design)

    def said(name: str) -> Any:
        return setting(_document(base_text), found, name, KNOWN)

    sun, ring = said("sun.teeth"), said("ring.teeth")
    _refuse_ratio(relations, sun, ring, said("load.on"), said("load.held"))
    if relations.planet_teeth_fewer is not None:
        found["planet.teeth"] = (ring - sun) // 2 - relations.planet_teeth_fewer
    cosine = math.cos(math.radians(said("pair.helix_angle_deg")))
    if relations.ring_diameter_mm is not None:
        found["pair.module_mm"] = relations.ring_diameter_mm * cosine / ring
    for member in ("sun", "planet") if relations.bore_share is not None else ():
        radius_mm = 0.5 * said(f"{member}.teeth") * said("pair.module_mm") / cosine
        found[f"{member}.bore_radius_mm"] = relations.bore_share * radius_mm
    if relations.solve is not None or relations.centre_distance_mm is not None:
        found |= _profile_shifts(relations, said)
    return found


def text_of_design(base_text: str, design: Design) -> str:
    """Return the TOML text of the set file of a design."""
    document = dict(_document(base_text))
    for section, keys in by_section(design).items():
        document[section] = laid_over(document.get(section, {}), keys)
    return document_text(document)


def why_infeasible(reason: str, base_text: str, design: Design, relations: SetRelations) -> str:
    """Return why a design cannot be made, with what relations have made of it."""
    told = (name for name in relations.solved if name in design and "bore" not in name)
    made = [f"{name} = {design[name]:.4g}" for name in told]
    return f"{reason} ([relations] set {', '.join(made)})" if made else reason


def _refuse_ratio(relations: SetRelations, sun: int, ring: int, on: str, held: str) -> None:
    if relations.ratio is None:
        return
    speeds = member_speeds((sun, ring), on, held, 1.0)
    (driven,) = (speed for member, speed in speeds.items() if member not in (on, held))
    found = abs(1.0 / driven)
    off = 100.0 * abs(found / relations.ratio - 1.0)
    if off > relations.ratio_tolerance_percent:
        raise GeometryError(
            f"[relations] ratio = {relations.ratio:g}: {sun} and {ring} teeth of sun and ring give {found:.4g}, off by "
            f"{off:.2g} %, more than {relations.ratio_tolerance_percent:g} %: take other teeth, or raise "
            "ratio_tolerance_percent"
        )


def _profile_shifts(relations: SetRelations, said: Callable[[str], Any]) -> dict[str, float]:
    """Profile shifts of sun and ring, or of one of them, with which both meshes have no backlash at one distance."""
    sun, planet, ring = (said(f"{member}.teeth") for member in PLANETARY)
    normal, helix = math.radians(said("pair.pressure_angle_deg")), math.radians(said("pair.helix_angle_deg"))
    transverse = math.atan(math.tan(normal) / math.cos(helix))
    radius = 0.5 * said("pair.module_mm") / math.cos(helix) * math.cos(transverse)  # of a base circle, for each tooth
    # Sums of teeth of the meshes of sun and ring: of the ring's they are negative, and so is the centre distance.
    teeth, shift = {"sun": sun + planet, "ring": planet - ring}, said("planet.profile_shift")
    if planet >= ring:
        raise GeometryError(f"[planet] teeth = {planet}: does not fit into a ring of {ring} teeth: take fewer")
    place = f"[relations] solve = {relations.solve}"
    if relations.centre_distance_mm is not None:
        distance = relations.centre_distance_mm
        place = f"[relations] centre_distance_mm = {distance:g}"
    else:
        other = "ring" if relations.solve == "sun" else "sun"
        known, count = shift + said(f"{other}.profile_shift"), teeth[other]
        distance = abs(tight_distance(count, radius * count, known, normal, transverse))
    found = {}
    for member in ("sun", "ring") if relations.solve is None else (relations.solve,):
        count = teeth[member]
        if radius * abs(count) >= distance:
            raise GeometryError(
                f"{place}: {sun}, {planet} and {ring} teeth: the base circles of {member} and planet touch at "
                f"{radius * abs(count):.4g} mm, and {distance:.4g} mm are asked: take other teeth or another module"
            )
        needed = tight_shift(count, radius * count, math.copysign(distance, count), normal, transverse) - shift
        if abs(needed) > MOST_SHIFT:
            raise GeometryError(
                f"{place}: {sun}, {planet} and {ring} teeth at {distance:.4g} mm take a profile shift of the {member} "
                f"of {needed:.3g}, and {MOST_SHIFT:g} is the most: take other teeth or another module"
            )
        found[f"{member}.profile_shift"] = round(needed, DIGITS)
    return found


@lru_cache(maxsize=4)
def _document(base_text: str) -> dict[str, Any]:
    return flattened(tomllib.loads(base_text), PLANETARY)
