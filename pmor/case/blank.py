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
# Distance from hub and rim below which a station of a web is at them, over the length of the web.
AT_END = 1e-6


# Radius of a station of a web, and z of both faces there, mm.
Station = Annotated[tuple[float, ...], Range(-1e5, 1e5, "mm", in_order=True)]


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
        Angle in degrees between the centres of the round ends of a kidney-shaped slot; 0 is a round hole.
    first_deg : float
        Place of the middle of the first one at pinion angle 0, in degrees, counter-clockwise seen from +z: from the
        line to the mate's centre; of a set from the y axis, on its planets from where the pin lies outwards.
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
    web_thickness_mm : float or None
        Thickness of the web in mm; as wide as the face it leaves the gear solid. Needed without `web_profile`.
    web_offset_mm : float
        Distance of the middle of the web from the middle of the face along z, in mm.
    web_profile : tuple of (float, float, float) or None
        Stepped web, cone or dish, in place of `web_thickness_mm`: `[[radius_mm, from_mm, to_mm], ...]`, z of both faces
        from the middle of the face, at radii that rise from hub to rim; straight between, a step where two are at one
        radius.
    hub_radius_mm : float
        Outer radius of the hub in mm; its inner one is the bore.
    hub_width_mm : float or None
        Width of the hub in mm, in the middle of the face; None is that of the face.
    holes : HolesCase or None
        Holes through the web, `holes = {count = 8, radius_mm = 6.0, on_radius_mm = 50.0}`; None is none.
    held_length_mm : float or None
        Length of the bore in mm that is held, as by a shrink fit; None is all of it, as wide as the hub.
    held_offset_mm : float
        Distance of the middle of the held length from the middle of the face along z, in mm.
    stress : bool
        Stress on the faces of the web and at the edges of its holes; under line contact.
    """

    rim_thickness_mm: Length
    web_thickness_mm: Length | None = None
    web_offset_mm: Annotated[float, Range(-1e5, 1e5, "mm")] = 0.0
    web_profile: tuple[Station, ...] | None = None
    hub_radius_mm: Length
    hub_width_mm: Length | None = None
    holes: HolesCase | None = None
    held_length_mm: Length | None = None
    held_offset_mm: Annotated[float, Range(-1e5, 1e5, "mm")] = 0.0
    stress: bool = False

    def fills(self, face_width_mm: float) -> bool:
        """Return whether rim, web and hub leave nothing out of a solid gear of a face width, held all over its bore."""
        if self.web_thickness_mm is None:
            return False
        hub_mm = self.hub_width_mm or face_width_mm
        full = min(self.web_thickness_mm, hub_mm) >= face_width_mm * (1.0 - ROUND_OFF)
        full = full and hub_mm <= face_width_mm * (1.0 + ROUND_OFF) and self.holes is None
        return full and not self.held_in_part(face_width_mm)

    def held_in_part(self, face_width_mm: float) -> bool:
        """Return whether some of the bore is free, of a gear of a face width."""
        hub_mm = self.hub_width_mm or face_width_mm
        return self.held_length_mm is not None and self.held_length_mm < hub_mm * (1.0 - ROUND_OFF)

    @property
    def web_even(self) -> bool:
        """Whether the web is its own image about the middle of the face."""
        return self.web_offset_mm == 0.0 and all(low == -high for _, low, high in self.web_profile or ())

    @property
    def thinnest_web_mm(self) -> float:
        """Thickness of the web where it is thinnest."""
        if self.web_profile is None:
            return self.web_thickness_mm or 0.0  # given
        return min(high - low for _, low, high in self.web_profile)

    def web_stations(self, inner_mm: float, middle_mm: float = 0.0) -> tuple[tuple[float, float, float], ...]:
        """Return radius and z of both faces of the web, mm, from the hub to the rim's inner radius; two at a step.

        Z counts from where the middle of the face is at `middle_mm`.
        """
        ends_mm = self.hub_radius_mm, inner_mm
        if self.web_profile is None:
            half_mm = 0.5 * (self.web_thickness_mm or 0.0)
            low, high = (middle_mm + self.web_offset_mm + side * half_mm for side in (-1.0, 1.0))
            return tuple((radius, low, high) for radius in ends_mm)
        rows = [(radius, middle_mm + low, middle_mm + high) for radius, low, high in self.web_profile]
        (_, *first), (_, *last) = rows[0], rows[-1]
        between = [row for row in rows if min(abs(row[0] - end) for end in ends_mm) > AT_END * (inner_mm - ends_mm[0])]
        return (ends_mm[0], first[0], first[1]), *between, (ends_mm[1], last[0], last[1])


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
        if (getattr(blank, key) or thin_mm) < thin_mm:
            refuse(key, getattr(blank, key), f"must be at least {thin_mm:g} mm, 0.05 modules: raise it")
    if hub_mm < bore_mm + thin_mm:
        refuse("hub_radius_mm", hub_mm, f"must be above the bore's radius, {bore_mm:g} mm, by 0.05 modules: raise it")
    if inner_mm < hub_mm + thin_mm:
        refuse(
            "rim_thickness_mm", blank.rim_thickness_mm,
            f"the rim's inner radius, {inner_mm:.6g} mm, must be above hub_radius_mm = {hub_mm:g} by 0.05 modules: "
            "lower it, or the hub's radius",
        )  # fmt: skip
    if blank.web_thickness_mm is None:
        _check_profile(blank, inner_mm, face_width_mm, thin_mm, slack_mm, place)
    else:
        _check_plain_web(blank, blank.web_thickness_mm, face_width_mm, slack_mm, place)
    _check_held(blank, blank.hub_width_mm or face_width_mm, thin_mm, slack_mm, place)
    if blank.stress:
        _check_stress(blank, inner_mm - hub_mm, face_width_mm, f"{place} stress = true")
    if blank.holes is not None:
        _check_holes(blank.holes, hub_mm, inner_mm, thin_mm, f"{place} holes")


def _check_plain_web(blank: BlankCase, web_mm: float, face_mm: float, slack_mm: float, place: str) -> None:
    if blank.web_profile is not None:
        raise CaseError(f"{place} web_profile: has the thickness of the web: leave web_thickness_mm out")
    for name, width_mm in (("face", face_mm), ("hub", blank.hub_width_mm or face_mm)):
        if web_mm > width_mm + slack_mm:
            raise CaseError(
                f"{place} web_thickness_mm = {web_mm:g}: is wider than the {name}, {width_mm:g} mm: lower it"
            )
        room_mm = 0.5 * (width_mm - web_mm)
        if abs(blank.web_offset_mm) > room_mm + slack_mm:
            raise CaseError(
                f"{place} web_offset_mm = {blank.web_offset_mm:g}: the web, {web_mm:g} mm thick, ends beyond the "
                f"{name}, {width_mm:g} mm wide: stay within {room_mm:g} mm to either side"
            )


def _check_profile(
    blank: BlankCase, inner_mm: float, face_mm: float, thin_mm: float, slack_mm: float, place: str
) -> None:
    """Raise `CaseError` where the stations are not those of a web between hub and rim, within the face."""
    stations, ends_mm, hub_mm = blank.web_profile, (blank.hub_radius_mm, inner_mm), blank.hub_width_mm or face_mm
    if stations is None:
        raise CaseError(f"{place} web_thickness_mm: is missing: add 'web_thickness_mm = ...', or web_profile")
    place = f"{place} web_profile"
    if len(stations) < 2 or any(len(station) != 3 for station in stations):
        raise CaseError(f"{place}: must be two stations or more: write [[radius_mm, from_mm, to_mm], ...]")
    if blank.web_offset_mm:
        raise CaseError(f"{place}: says where the web is along z: leave web_offset_mm out")
    for key, present in (("holes", blank.holes is not None), ("stress", blank.stress)):
        if present:
            raise CaseError(f"{place}: {key} is for webs of one thickness: leave {key} out, or give web_thickness_mm")
    for station in stations:
        _check_station(station, ends_mm, face_mm + 2.0 * slack_mm, thin_mm, f"{place}: at radius {station[0]:g} mm")
    for before, station in zip(stations[:-1], stations[1:], strict=True):
        at = f"{place}: at radius {station[0]:g} mm"
        if before[0] == station[0]:
            _check_step(before, station, ends_mm, thin_mm, at)
        elif station[0] < before[0] + thin_mm:
            raise CaseError(
                f"{at} is the station after the one at {before[0]:g} mm: radii must rise by {thin_mm:g} mm, 0.05 "
                "modules, or be equal at a step: sort or merge the stations"
            )
    for before, further in zip(stations[:-2], stations[2:], strict=True):
        if before[0] == further[0]:
            raise CaseError(f"{place}: at radius {before[0]:g} mm are three stations: leave two, for a step")
    _, low_mm, high_mm = stations[0]
    if max(-low_mm, high_mm) > 0.5 * hub_mm + slack_mm:
        raise CaseError(
            f"{place}: begins from {low_mm:g} to {high_mm:g} mm, beyond the hub, {hub_mm:g} mm wide: stay within "
            f"{0.5 * hub_mm:g} mm to either side, or raise hub_width_mm"
        )


def _check_station(
    station: tuple[float, ...], ends_mm: tuple[float, float], face_mm: float, thin_mm: float, at: str
) -> None:
    (radius_mm, low_mm, high_mm), reach_mm = station, AT_END * (ends_mm[1] - ends_mm[0])
    if not ends_mm[0] - reach_mm <= radius_mm <= ends_mm[1] + reach_mm:
        raise CaseError(
            f"{at} is no web, which is between hub, {ends_mm[0]:g} mm, and rim, {ends_mm[1]:.6g} mm: move the station"
        )
    if high_mm - low_mm < thin_mm:
        raise CaseError(
            f"{at} it is from {low_mm:g} to {high_mm:g} mm: must be at least {thin_mm:g} mm thick, 0.05 modules: raise "
            "the third number"
        )
    if max(-low_mm, high_mm) > 0.5 * face_mm:
        raise CaseError(
            f"{at} it is from {low_mm:g} to {high_mm:g} mm, beyond the face, {face_mm:g} mm wide: stay within "
            f"{0.5 * face_mm:g} mm to either side"
        )


def _check_step(
    before: tuple[float, ...], station: tuple[float, ...], ends_mm: tuple[float, float], thin_mm: float, at: str
) -> None:
    (radius_mm, *faces), (_, *further) = before, station
    if not ends_mm[0] + thin_mm <= radius_mm <= ends_mm[1] - thin_mm:
        raise CaseError(f"{at} a step is within 0.05 modules, {thin_mm:g} mm, of hub or rim: give one station there")
    if min(faces[1], further[1]) - max(faces[0], further[0]) < thin_mm:
        raise CaseError(
            f"{at} both sides of the step share less than {thin_mm:g} mm, 0.05 modules: let their faces overlap"
        )


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
    if blank.holes is None and long_mm <= 2.0 * CLEAR * blank.thinnest_web_mm:
        raise CaseError(
            f"{place}: the web is {long_mm:.6g} mm long and {blank.thinnest_web_mm:g} mm thick, and stress is read "
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
