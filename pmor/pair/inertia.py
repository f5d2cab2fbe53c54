"""Mass and moments of inertia of the gears of a case, as drawn: up to the reference circle, down to the bore."""

from __future__ import annotations

from pmor.case import Case, GearCase
from pmor.case.blank import BlankCase
from pmor.gear.inertia import Inertia, about_the_axis, disc
from pmor.gear.pair import GearPair
from pmor.gear.tooth import Tooth
from pmor.pair.model import held_radii


def gear_inertias(case: Case, pair: GearPair) -> tuple[Inertia, Inertia]:
    """Return the inertias of pinion and wheel, rim, web, hub and holes as they are drawn.

    Teeth count as a full ring up to the reference circle. The density is that of `[dynamics] density_kg_m3`.
    """
    density, held = case.dynamics.density_kg_m3, held_radii(case, pair)
    gears = (case.pair.pinion, pair.pinion, held[0]), (case.pair.wheel, pair.wheel, held[1])
    one, two = (_inertia(gear, tooth, radius, case.pair.face_width_mm, density) for gear, tooth, radius in gears)
    return one, two


def _inertia(gear: GearCase, tooth: Tooth, held: float, pair_width: float, density: float) -> Inertia:
    width, blank = gear.face_width_mm or pair_width, gear.light_blank(pair_width)
    inner, outer = sorted((abs(tooth.reference_radius), abs(held)))
    if blank is None:
        return disc(outer, inner, width, density)
    rim = tooth.root_radius - blank.rim_thickness_mm
    return disc(outer, rim, width, density) + _below_the_rim(blank, rim, inner, width, density)


def _below_the_rim(blank: BlankCase, rim: float, bore: float, width: float, density: float) -> Inertia:
    thick, offset = blank.web_thickness_mm, blank.web_offset_mm
    found = disc(blank.hub_radius_mm, bore, blank.hub_width_mm or width, density)
    found += disc(rim, blank.hub_radius_mm, thick, density, offset)
    if (holes := blank.holes) is not None:
        hole = about_the_axis(disc(holes.radius_mm, 0.0, thick, density, offset), holes.on_radius_mm)
        found += hole.times(-holes.count)
    return found
