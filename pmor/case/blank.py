"""Blank of a gear below its teeth, by dimensions: rim, web, hub and equal holes."""

import math
from dataclasses import dataclass
from typing import Annotated

from pmor.core.errors import CaseError
from pmor.core.ranges import Length, Range

# Of parts of a blank, in modules: thinner ones cannot be meshed sensibly.
THINNEST = 0.05
# Round-off that dimensions may overlap by, over the face width.
ROUND_OFF = 1e-9
# Distance from the sharp corners of a web, where stress has no bound, at which it is read, over the web's thickness.
CLEAR = 0.5


@dataclass(frozen=True, kw_only=True)
class HolesCase:
    """Equal holes in a web, evenly around the axis (sections `[pinion.blank.holes]` and `[wheel.blank.holes]`).

    Round ones, or kidney-shaped slots.

    Parameters
    ----------
    count : int
        Number of holes.
    radius_mm : float
        Radius of each in mm; of a kidney-shaped slot that of its ends, half its width.
    on_radius_mm : float
        Radius in mm of the circle that their centres lie on.
    length_deg : float
        Angle in degrees about the gear's axis between the centres of the round ends of a kidney-shaped slot, which is
        where a round hole goes along that circle; 0 is a round hole.
    first_deg : float
        Place of the middle of the first one at pinion angle 0, in degrees: from the line from this gear's centre to its
        mate's, counter-clockwise seen from +z.
    """

    count: Annotated[int, Range(1, 1000)]
    radius_mm: Length
    on_radius_mm: Length
    length_deg: Annotated[float, Range(0.0, 360.0, "deg")] = 0.0
    first_deg: Annotated[float, Range(-360.0, 360.0, "deg")] = 0.0


@dataclass(frozen=True, kw_only=True)
class BlankCase:
    """Rim, web and hub of one gear; without this section it is solid down to its bore.

    Parameters
    ----------
    rim_thickness_mm : float
        Thickness of the rim in mm, below the root circle, over the whole face width.
    web_thickness_mm : float
        Thickness of the web in mm; as wide as the face it leaves the gear solid.
    web_offset_mm : float
        Of the middle of the web from the middle of the face along z, in mm.
    hub_radius_mm : float
        Outer radius of the hub in mm; its inner one is the bore.
    hub_width_mm : float or None
        Width of the hub in mm, in the middle of the face; None is that of the face.
    holes : HolesCase or None
        Holes through the web, `holes = {count = 8, radius_mm = 6.0, on_radius_mm = 50.0}`; None is none.
    held_length_mm : float or None
        Length of the bore in mm that is held, as by a shrink fit; None is all of it, as wide as the hub.
    held_offset_mm : float
        Of the middle of the held length from the middle of the face along z, in mm.
    stress : bool
        Stress on the faces of the web and at the edges of its holes, as `pmor run` tells it; under line contact. The
        basis then holds it.
    """

    rim_thickness_mm: Length
    web_thickness_mm: Length
    web_offset_mm: Annotated[float, Range(-1e5, 1e5, "mm")] = 0.0
    hub_radius_mm: Length
    hub_width_mm: Length | None = None
    holes: HolesCase | None = None
    held_length_mm: Length | None = None
    held_offset_mm: Annotated[float, Range(-1e5, 1e5, "mm")] = 0.0
    stress: bool = False

    def fills(self, face_width_mm: float) -> bool:
        """Return whether rim, web and hub leave nothing out of a solid gear of a face width, held all over its bore."""
        hub_mm = self.hub_width_mm or face_width_mm
        full = min(self.web_thickness_mm, hub_mm) >= face_width_mm * (1.0 - ROUND_OFF)
        full = full and hub_mm <= face_width_mm * (1.0 + ROUND_OFF) and self.holes is None
        return full and not self.held_in_part(face_width_mm)

    def held_in_part(self, face_width_mm: float) -> bool:
        """Return whether some of the bore is free, of a gear of a face width."""
        hub_mm = self.hub_width_mm or face_width_mm
        return self.held_length_mm is not None and self.held_length_mm < hub_mm * (1.0 - ROUND_OFF)


def check_blank(
    blank: BlankCase, root_mm: float, bore_mm: float, face_width_mm: float, module_mm: float, place: str
) -> None:
    """Raise `CaseError` where the parts of a blank do not fit into each other.

    Parameters
    ----------
    root_mm, bore_mm : float
        Radii of the root circle and of the bore, mm.
    place : str
        Section of the blank, for messages.
    """
    thin_mm, slack_mm = THINNEST * module_mm, ROUND_OFF * face_width_mm
    inner_mm, hub_mm = root_mm - blank.rim_thickness_mm, blank.hub_radius_mm

    def refuse(key: str, value: float, rule: str) -> None:
        raise CaseError(f"{place} {key} = {value:g}: {rule}")

    for key in ("rim_thickness_mm", "web_thickness_mm"):
        if getattr(blank, key) < thin_mm:
            refuse(key, getattr(blank, key), f"must be at least {thin_mm:g} mm, 0.05 modules: raise it")
    if hub_mm < bore_mm + thin_mm:
        refuse("hub_radius_mm", hub_mm, f"must be above the bore's radius, {bore_mm:g} mm, by 0.05 modules: raise it")
    if inner_mm < hub_mm + thin_mm:
        refuse(
            "rim_thickness_mm", blank.rim_thickness_mm,
            f"the rim's inner radius, {inner_mm:.6g} mm, must be above hub_radius_mm = {hub_mm:g} by 0.05 modules: "
            "lower it, or the hub's radius",
        )  # fmt: skip
    for name, width_mm in (("face", face_width_mm), ("hub", blank.hub_width_mm or face_width_mm)):
        if blank.web_thickness_mm > width_mm + slack_mm:
            refuse("web_thickness_mm", blank.web_thickness_mm, f"is wider than the {name}, {width_mm:g} mm: lower it")
        room_mm = 0.5 * (width_mm - blank.web_thickness_mm)
        if abs(blank.web_offset_mm) > room_mm + slack_mm:
            refuse(
                "web_offset_mm", blank.web_offset_mm,
                f"the web, {blank.web_thickness_mm:g} mm thick, ends beyond the {name}, {width_mm:g} mm wide: stay "
                f"within {room_mm:g} mm to either side",
            )  # fmt: skip
    _check_held(blank, blank.hub_width_mm or face_width_mm, thin_mm, slack_mm, place)
    if blank.stress:
        _check_stress(blank, inner_mm - hub_mm, face_width_mm, f"{place} stress = true")
    if blank.holes is not None:
        _check_holes(blank.holes, hub_mm, inner_mm, thin_mm, f"{place} holes")


def _check_held(blank: BlankCase, hub_mm: float, thin_mm: float, slack_mm: float, place: str) -> None:
    held_mm = hub_mm if blank.held_length_mm is None else blank.held_length_mm
    if held_mm < thin_mm:
        raise CaseError(
            f"{place} held_length_mm = {held_mm:g}: must be at least {thin_mm:g} mm, 0.05 modules: raise it"
        )
    if held_mm > hub_mm + slack_mm:
        raise CaseError(f"{place} held_length_mm = {held_mm:g}: is longer than the hub, {hub_mm:g} mm wide: lower it")
    room_mm = 0.5 * (hub_mm - held_mm)
    if abs(blank.held_offset_mm) > room_mm + slack_mm:
        raise CaseError(
            f"{place} held_offset_mm = {blank.held_offset_mm:g}: {held_mm:g} mm that are held end beyond the hub, "
            f"{hub_mm:g} mm wide: stay within {room_mm:g} mm to either side, or give held_length_mm"
        )


def _check_stress(blank: BlankCase, long_mm: float, face_width_mm: float, place: str) -> None:
    if blank.fills(face_width_mm):
        raise CaseError(f"{place}: the gear is solid, it has no web: leave it out, or lower web_thickness_mm")
    if blank.holes is None and long_mm <= 2.0 * CLEAR * blank.web_thickness_mm:
        raise CaseError(
            f"{place}: the web is {long_mm:.6g} mm long and {blank.web_thickness_mm:g} mm thick, and stress is read "
            f"{CLEAR:g} thicknesses from hub and rim, whose corners are sharp: leave it out, or lower web_thickness_mm"
        )


def _check_holes(holes: HolesCase, hub_mm: float, rim_mm: float, thin_mm: float, place: str) -> None:
    radius_mm, on_mm = holes.radius_mm, holes.on_radius_mm
    if on_mm - radius_mm < hub_mm + thin_mm or on_mm + radius_mm > rim_mm - thin_mm:
        raise CaseError(
            f"{place}: from radius {on_mm - radius_mm:.6g} to {on_mm + radius_mm:.6g} mm they leave the web, which is "
            f"between hub, {hub_mm:.6g} mm, and rim, {rim_mm:.6g} mm, by 0.05 modules on either side: lower radius_mm, "
            "or change on_radius_mm"
        )
    long_mm = math.radians(holes.length_deg) * on_mm
    if 0.0 < long_mm < thin_mm:
        raise CaseError(
            f"{place} length_deg = {holes.length_deg:g}: {long_mm:.3g} mm at on_radius_mm, less than {thin_mm:g} mm, "
            "0.05 modules: raise it, or leave it out for round holes"
        )
    # Half the angle between the ends of neighbours; beyond a right angle what is between them is longer than the hub.
    apart = min(math.pi / holes.count - 0.5 * math.radians(holes.length_deg), 0.5 * math.pi)
    bridge_mm = 2.0 * (on_mm * math.sin(apart) - radius_mm)
    if bridge_mm < thin_mm:
        long = (f", length_deg = {holes.length_deg:g}", ", or shorter ones") if holes.length_deg else ("", "")
        raise CaseError(
            f"{place} count = {holes.count}{long[0]}: {bridge_mm:.3g} mm stay between neighbours, less than "
            f"{thin_mm:g} mm, 0.05 modules: take fewer or smaller ones{long[1]}"
        )
