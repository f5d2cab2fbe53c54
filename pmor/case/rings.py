"""Rules for internal gears: which keys a ring has, and those that only a ring has."""

from __future__ import annotations

import math
from typing import Any

from pmor.case.gears import GearCase, LugsCase, PairCase, ShaperCase
from pmor.case.values import toml_text
from pmor.core.errors import CaseError, GeometryError
from pmor.gear.ring_root import Shaper
from pmor.gear.tooth import Tooth

# Keys of a ring alone.
OF_RINGS = ("root_fillet_mm", "shaper", "rim_thickness_mm")
# Keys that say what a rack cuts, and a shaper has of its own.
OF_RACKS = ("dedendum", "rack_tip_radius")
# Modules by which a dedendum that is written may differ from what the shaper cuts: drawings round it.
SAME_DEDENDUM = 0.02


def check_ring(pair: PairCase, document: dict[str, Any], where: str) -> None:
    """Raise `CaseError` where keys of rings and of external gears are mixed, or a ring lacks one of its own."""
    if pair.pinion.internal:
        raise CaseError(
            f"{where}: [pinion] internal = true: the ring of an internal pair is the wheel: write the external gear in "
            "[pinion], and internal = true in [wheel]"
        )
    for name, gear in (("pinion", pair.pinion), ("wheel", pair.wheel)):
        if not gear.internal:
            _check_external(gear, f"{where}: [{name}]")
    if pair.wheel.internal:
        _check_internal(pair, document.get("wheel", {}), f"{where}: [wheel]")


def _check_external(gear: GearCase, place: str) -> None:
    for key in OF_RINGS:
        if (value := getattr(gear, key)) is not None:
            raise CaseError(f"{place} {key} = {toml_text(value)}: is of a ring: leave it out, or write internal = true")
    if gear.lugs is not None:
        raise CaseError(f"{place} held: lugs are of a ring: leave it out, or write internal = true")
    for key in ("seat_radial_N_per_mm", "seat_tangential_N_per_mm"):
        if (value := getattr(gear, key)) != "rigid":
            raise CaseError(f"{place} {key} = {value}: is of a ring: leave it out, or write internal = true")
    if gear.bore_radius_mm is None:
        raise CaseError(f"{place} bore_radius_mm: is missing: add 'bore_radius_mm = ...' below [{place.split('[')[-1]}")


def _check_internal(pair: PairCase, written: dict[str, Any], place: str) -> None:
    ring = pair.wheel
    if ring.bore_radius_mm is not None:
        raise CaseError(
            f"{place} bore_radius_mm = {ring.bore_radius_mm}: a ring has no bore: write rim_thickness_mm, from its "
            "root circle to its outside"
        )
    if ring.one_piece:
        raise CaseError(f"{place} one_piece = true: a ring has no shaft: leave it out")
    if ring.lugs is not None:
        _check_lugs(ring.lugs, place)
    if ring.seat_tangential_N_per_mm == "free":
        rule = 'nothing would hold the torque: write a number, or "rigid"'
        raise CaseError(f'{place} seat_tangential_N_per_mm = "free": {rule}')
    if ring.blank is not None or ring.body is not None:
        raise CaseError(f"{place[:-1]}.blank]: a ring has no web and no hub: leave it out, write rim_thickness_mm")
    if ring.rim_thickness_mm is None:
        raise CaseError(
            f"{place} rim_thickness_mm: is missing: add 'rim_thickness_mm = ...' below [wheel], from the root circle "
            "of the ring to its outside"
        )
    if ring.shaper is not None:
        if ring.root_fillet_mm is not None:
            raise CaseError(
                f"{place} root_fillet_mm = {ring.root_fillet_mm}: the shaper makes the fillet: leave one of the two out"
            )
        if "rack_tip_radius" in written:
            raise CaseError(
                f"{place} rack_tip_radius = {ring.rack_tip_radius}: the shaper makes the fillet, by its tip_radius_mm: "
                "leave it out"
            )
        _check_dedendum(pair, ring.shaper, written, place)
        if ring.shaper.teeth >= ring.teeth:
            raise CaseError(
                f"{place} shaper teeth = {ring.shaper.teeth}: must be fewer than the {ring.teeth} of the ring: lower it"
            )
    if ring.teeth <= pair.pinion.teeth:
        raise CaseError(
            f"{place} teeth = {ring.teeth}: a ring needs more teeth than its pinion, {pair.pinion.teeth}: raise it"
        )


def _check_lugs(lugs: LugsCase, place: str) -> None:
    if (lugs.lugs is None) == (not lugs.at_deg):
        raise CaseError(f"{place} held: write either lugs, their number, or at_deg, their places")
    narrowest = min(lugs.gaps_deg)
    if narrowest <= lugs.lug_deg:
        reason = f"{lugs.lugs} lugs of it take all of the outside" if lugs.lugs else f"two are {narrowest:g} deg apart"
        raise CaseError(f'{place} held lug_deg = {lugs.lug_deg:g}: {reason}: lower it, or write held = "outside"')


def _check_dedendum(pair: PairCase, cutter: ShaperCase, written: dict[str, Any], place: str) -> None:
    if "dedendum" not in written:
        return
    angles, ring = (math.radians(pair.pressure_angle_deg), math.radians(pair.helix_angle_deg)), pair.wheel
    shaper = Shaper(cutter.teeth, cutter.addendum, cutter.tip_radius_mm, cutter.profile_shift)
    try:
        cut = Tooth(
            -ring.teeth, pair.module_mm, *angles, ring.profile_shift, ring.addendum, shaper=shaper,
            thickness_allowance=0.5 * sum(ring.thickness_allowances_mm),
        ).cut_dedendum  # fmt: skip
    except GeometryError:
        return  # refused with the pair
    if abs(ring.dedendum - cut) > SAME_DEDENDUM:
        raise CaseError(
            f"{place} dedendum = {ring.dedendum}: the shaper cuts {cut:.4g} modules deep: leave it out, or change "
            "shaper addendum"
        )
