"""Campaigns of sets: from the base set and the keys of a design to its set file, with what follows from relations."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

from pmor.campaigns.keys import by_section, parts_in, setting, split, with_value
from pmor.campaigns.kind import Design, Number
from pmor.campaigns.settings import SetRelations
from pmor.campaigns.trains import GEARS, changed_gears
from pmor.case.change import document_text, laid_over
from pmor.case.document import flattened
from pmor.case.reader import sections_in
from pmor.case.schema import SECTIONS
from pmor.core.errors import GeometryError
from pmor.gear.pair import tight_distance, tight_shift
from pmor.sets.kinematics import speed_ratio
from pmor.sets.layout import PAIR, SECOND_PAIR, SECOND_PLANET, SHARED
from pmor.sets.settings import SetSections

LISTS = ("gears", "meshes", "loads", "pins.bearings")
MEMBERS = {"sun": "pinion", "planet": "pinion", SECOND_PLANET: "pinion", "ring": "wheel"}
# Sections whose keys designs may change.
KNOWN: dict[str, type] = {
    **{f"{member}{name.removeprefix(role)}": kind for member, role in MEMBERS.items()
       for name, kind in SECTIONS.items() if name.split(".")[0] == role},
    **{name: SECTIONS[name] for name in SHARED}, SECOND_PAIR: SECTIONS[PAIR],
    **{name: kind for name, kind in sections_in(SetSections).items() if name not in LISTS},
}  # fmt: skip
# Of a gear, either way.
MOST_SHIFT = 3.0
# Of a profile shift: without the round-off of a shift that is none.
DIGITS = 12


def with_relations(base_text: str, design: Design, relations: SetRelations) -> dict[str, Number]:
    """Return the keys of a design with those that follow from relations; GeometryError when these cannot be met."""
    found, document = dict(design), _document(base_text)
    if GEARS in document:
        return found

    def said(name: str) -> Any:
        section, key = split(name)
        if section == SECOND_PAIR and name not in found and key not in document.get(section, {}):
            return said(f"{PAIR}.{key}")
        return setting(document, found, name, KNOWN)

    sun, ring = said("sun.teeth"), said("ring.teeth")
    if relations.planet_teeth_fewer is not None:
        found["planet.teeth"] = (ring - sun) // 2 - relations.planet_teeth_fewer
        if found["planet.teeth"] < 1:
            raise GeometryError(
                f"[relations] planet_teeth_fewer = {relations.planet_teeth_fewer}: sun and ring of {sun} and {ring} "
                "teeth leave a planet none: take more teeth on the ring"
            )
    stepped = SECOND_PLANET in document
    first, second = said("planet.teeth"), said(f"{SECOND_PLANET if stepped else 'planet'}.teeth")
    _refuse_ratio(relations, (sun, first, second, ring), said("load.on"), said("load.held"))
    cosine = math.cos(math.radians(said("pair.helix_angle_deg")))
    if relations.ring_diameter_mm is not None:
        found["pair.module_mm"] = relations.ring_diameter_mm * cosine / ring
    for member in ("sun", "planet") if relations.bore_share is not None else ():
        radius_mm = 0.5 * said(f"{member}.teeth") * said("pair.module_mm") / cosine
        found[f"{member}.bore_radius_mm"] = relations.bore_share * radius_mm
    if relations.solve is not None or relations.centre_distance_mm is not None:
        found |= _profile_shifts(relations, said, stepped)
    return found


def with_kept_sums(base_text: str, design: Design) -> dict[str, float]:
    """Return the profile shifts of sun and ring beside other ones of the planets, so that axes and backlash stay."""
    document = _document(base_text)
    found = {}
    for member, planet in (("sun", "planet"), ("ring", SECOND_PLANET if SECOND_PLANET in document else "planet")):
        of_planet, own = f"{planet}.profile_shift", f"{member}.profile_shift"
        before, after = (setting(document, keys, of_planet, KNOWN) for keys in ({}, design))
        found[own] = round(setting(document, {}, own, KNOWN) + before - after, DIGITS)
    return found


def known_in(said: SetSections) -> dict[str, type]:
    """Return the sections whose keys designs of a planetary set may change, those in its lists among them."""
    return KNOWN | (parts_in(said.pins, "pins") if said.pins is not None else {})


def text_of_design(base_text: str, design: Design) -> str:
    """Return the TOML text of the set file of a design."""
    document, design = dict(_document(base_text)), dict(design)
    if GEARS not in document:
        for name in [name for name in design if split(name)[0] not in KNOWN]:  # in lists, by places
            document = with_value(document, name.split("."), design.pop(name))
    changes = by_section(design)
    if GEARS in document:
        document[GEARS] = changed_gears(document[GEARS], changes)
    for section, keys in changes.items():
        if section.split(".")[0] == GEARS:
            continue
        document[section] = laid_over(document.get(section, {}), keys)
    return document_text(document)


def why_infeasible(reason: str, base_text: str, design: Design, relations: SetRelations) -> str:
    """Return why a design cannot be made, with what relations have made of it."""
    told = (name for name in relations.solved if name in design and "bore" not in name)
    made = [f"{name} = {design[name]:.4g}" for name in told]
    return f"{reason} ([relations] set {', '.join(made)})" if made else reason


def _refuse_ratio(relations: SetRelations, teeth: tuple[int, int, int, int], on: str, held: str) -> None:
    """Refuse teeth of sun, planet towards sun and ring, and ring that are off the ratio."""
    if relations.ratio is None:
        return
    sun, first, second, ring = teeth
    found = abs(speed_ratio((sun, ring * first / second), on, held))
    off = 100.0 * abs(found / relations.ratio - 1.0)
    if off > relations.ratio_tolerance_percent:
        stepped = f", {first} and {second} of the planets" if first != second else ""
        raise GeometryError(
            f"[relations] ratio = {relations.ratio:g}: {sun} and {ring} teeth of sun and ring{stepped} give "
            f"{found:.4g}, off by {off:.2g} %, more than {relations.ratio_tolerance_percent:g} %: take other teeth, or "
            "raise ratio_tolerance_percent"
        )


class _Flanks(NamedTuple):
    """What the shift of sun or ring is found from: sums of a mesh, those of the ring's negative; the planet's shift."""

    teeth: int
    bases: float
    normal: float
    transverse: float
    shift: float


def _profile_shifts(relations: SetRelations, said: Callable[[str], Any], stepped: bool) -> dict[str, float]:
    """Profile shifts of sun and ring, or of one of them, with which both meshes have no backlash at one distance."""
    planets = {"sun": "planet", "ring": SECOND_PLANET if stepped else "planet"}
    if said(f"{planets['ring']}.teeth") >= said("ring.teeth"):
        counts = f"{said(planets['ring'] + '.teeth')} teeth of the planet, {said('ring.teeth')} of the ring"
        raise GeometryError(f"[relations] {counts}: the planet does not fit into the ring: take fewer teeth on it")
    meshes = {member: _flanks(said, member, planet) for member, planet in planets.items()}
    if relations.solve is not None:
        other, place = "ring" if relations.solve == "sun" else "sun", f'solve = "{relations.solve}"'
        teeth, bases, normal, transverse, shift = meshes[other]
        shift += said(f"{other}.profile_shift")
        distance = abs(tight_distance(teeth, bases, shift, normal, transverse))
    else:
        assert relations.centre_distance_mm is not None
        distance, place = relations.centre_distance_mm, f"centre_distance_mm = {relations.centre_distance_mm:g}"
    found = {}
    for member in (relations.solve,) if relations.solve is not None else ("sun", "ring"):
        teeth, bases, normal, transverse, shift = meshes[member]
        counts = f"{said(f'{planets[member]}.teeth')} teeth of the planet and {said(f'{member}.teeth')} of the {member}"
        what = f"[relations] {place}: {counts}"
        if abs(bases) >= distance:
            raise GeometryError(
                f"{what}: their base circles touch at {abs(bases):.4g} mm, and {distance:.4g} mm are asked: take other "
                "teeth or another module"
            )
        needed = tight_shift(teeth, bases, math.copysign(distance, teeth), normal, transverse) - shift
        if abs(needed) > MOST_SHIFT:
            raise GeometryError(
                f"{what}: at {distance:.4g} mm they take a profile shift of {needed:.3g}, and {MOST_SHIFT:g} is the "
                "most: take other teeth or another module"
            )
        found[f"{member}.profile_shift"] = round(needed, DIGITS)
    return found


def _flanks(said: Callable[[str], Any], member: str, planet: str) -> _Flanks:
    pair = SECOND_PAIR if planet == SECOND_PLANET else PAIR
    teeth = said(f"{planet}.teeth") + (said("sun.teeth") if member == "sun" else -said("ring.teeth"))
    normal, helix = (math.radians(said(f"{pair}.{angle}_angle_deg")) for angle in ("pressure", "helix"))
    transverse = math.atan(math.tan(normal) / math.cos(helix))
    bases = 0.5 * teeth * said(f"{pair}.module_mm") / math.cos(helix) * math.cos(transverse)
    return _Flanks(teeth, bases, normal, transverse, said(f"{planet}.profile_shift"))


@lru_cache(maxsize=4)
def _document(base_text: str) -> dict[str, Any]:
    document = tomllib.loads(base_text)
    return flattened(document, (*MEMBERS, *(gear["name"] for gear in document.get(GEARS, []))))
