"""What no rolling bearing has: keys of its inner geometry that do not fit together."""

from __future__ import annotations

import math

from pmor.body.bearing_rows import BearingRows
from pmor.body.roller_bearing import RollerBearing, SphericalRollerBearing
from pmor.body.rolling_bearing import BallBearing

InnerGeometry = BallBearing | RollerBearing | SphericalRollerBearing

# Length of the slenderest needles that are made over their diameter, with some reserve (ISO 3096:1996 goes to 10).
SLENDEREST = 12.0
# By which elements of full bearings may overlap: their sizes are rounded.
ROUNDED = 1e-3


def impossible(bearing: InnerGeometry) -> tuple[str, str] | None:
    """Return keys that no bearing has together, with their values, and the rule; None of a possible bearing."""
    found = _elements(bearing) or (_rows(bearing) if isinstance(bearing, BearingRows) else None)
    return found or (_sphere(bearing) if isinstance(bearing, SphericalRollerBearing) else None)


def takes_thrust_one_way(bearing: InnerGeometry) -> bool:
    """Return whether forces across push the inner ring along the axis."""
    return bool(bearing.contact_angle_deg) and sum(bearing.row_signs) != 0.0


def overlap(one: InnerGeometry | None, other: InnerGeometry | None, apart_mm: float) -> bool:
    """Return whether elements of two bearings on one shaft, so far apart along it, are in one place."""
    if one is None or other is None:
        return False
    return apart_mm < (1.0 - ROUNDED) * (_half_width(one) + _half_width(other))


def _half_width(bearing: InnerGeometry) -> float:
    across = abs(bearing.row_places[-1] - bearing.row_places[0])
    return 0.5 * (across + bearing.element_mm[1] * math.cos(math.radians(bearing.contact_angle_deg)))


def _elements(bearing: InnerGeometry) -> tuple[str, str] | None:
    pitch, angle = bearing.pitch_diameter_mm, math.radians(bearing.contact_angle_deg)
    name, (diameter, length) = "roller", bearing.element_mm
    if isinstance(bearing, BallBearing):
        name, length = "ball", 0.0
    room = pitch * math.sin(math.pi / bearing.count)
    if diameter > (1.0 + ROUNDED) * room:
        keys = f"{name}s = {bearing.count}, {name}_diameter_mm = {diameter:g}, pitch_diameter_mm = {pitch:g}"
        return keys, f"the {name}s overlap: so many have room on that circle up to {room:.4g} mm; correct one of them"
    if length > SLENDEREST * diameter:
        rule = f"must be at most {SLENDEREST:g} times roller_diameter_mm = {diameter:g}: correct one of them"
        return f"effective_length_mm = {length:g}", rule
    if length * abs(math.sin(angle)) + diameter * math.cos(angle) >= pitch:
        rule = f"rollers reach the axis inside of pitch_diameter_mm = {pitch:g}: correct one of them"
        return f"effective_length_mm = {length:g}, contact_angle_deg = {bearing.contact_angle_deg:g}", rule
    return None


def _rows(bearing: BallBearing | RollerBearing) -> tuple[str, str] | None:
    if bearing.arrangement != "tandem" and bearing.rows != 2:
        return f'arrangement = "{bearing.arrangement}"', f"is of two rows: write rows = 2, and not {bearing.rows}"
    if bearing.arrangement != "tandem" and not bearing.contact_angle_deg:
        rule = "is of rows that take thrust: write contact_angle_deg, or leave it out"
        return f'arrangement = "{bearing.arrangement}"', rule
    size = bearing.element_mm[1] * math.cos(math.radians(bearing.contact_angle_deg))
    width = bearing.element_mm[0] if isinstance(bearing, BallBearing) else size
    if bearing.rows > 1 and bearing.row_spacing_mm < (1.0 - ROUNDED) * width:
        rule = f"rows overlap: their elements take {width:.4g} mm along the axis; correct it"
        return f"rows = {bearing.rows}, row_spacing_mm = {bearing.row_spacing_mm:g}", rule
    for key in ("axial_preload_mm", "axial_preload_N"):
        if (value := getattr(bearing, key)) and not bearing.contact_angle_deg:
            rule = "a bearing without contact angle has none: write a negative clearance_mm, or contact_angle_deg"
            return f"{key} = {value:g}", rule
    if bearing.axial_preload_mm and bearing.axial_preload_N:
        return "axial_preload_mm, axial_preload_N", "say the same: leave one of them out"
    if bearing.axial_preload_N and abs(bearing.pushed) > bearing.element_mm[0]:
        rule = f"pushes rings {abs(bearing.pushed):.3g} mm along the axis, farther than an element is thick: correct it"
        return f"axial_preload_N = {bearing.axial_preload_N:g}, contact_angle_deg = {bearing.contact_angle_deg:g}", rule
    return None


def _sphere(bearing: SphericalRollerBearing) -> tuple[str, str] | None:
    angle = f"contact_angle_deg = {bearing.contact_angle_deg:g}"
    if bearing.rows == 2:
        spacing = bearing.row_places[1] - bearing.row_places[0]
        length = bearing.effective_length_mm * math.cos(math.radians(bearing.contact_angle_deg))
        if spacing < length:
            rule = f"both rows overlap: their middles are {spacing:.4g} mm apart, and rollers take {length:.4g} mm"
            return angle, f"{rule}; correct it, or write rows = 1"
    barrel = bearing.profile_radius_mm
    if barrel is not None and not 0.5 * bearing.effective_length_mm < barrel <= bearing.sphere_mm:
        rule = (
            f"barrels have at most the radius of the sphere that they run on, {bearing.sphere_mm:.4g} mm, and at least "
            "half of their length: correct it"
        )
        return f"profile_radius_mm = {barrel:g}", rule
    return None
