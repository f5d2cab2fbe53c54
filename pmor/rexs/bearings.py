"""Bearings of a REXS file of which it says no more than a catalogue number: what they are by type and sizes."""

from __future__ import annotations

from collections.abc import Callable

from pmor.body.bearing_estimate import CatalogueBearing
from pmor.core.errors import CaseError
from pmor.rexs.model import Component, Gearbox

# Types of bearings whose inner geometry is solved, and whether they have balls; others are taken by their stiffness.
KINDS = {
    "angular_contact_ball_bearing": True, "radial_grooved_ball_bearing": True, "radial_needle_roller_bearing": False,
    "radial_roller_bearing": False, "radial_tapered_roller_bearing": False,
}  # fmt: skip


def catalogue_bearing(
    gearbox: Gearbox, bearing: Component, shaft: Component, place: float, note: Callable[[str], None]
) -> CatalogueBearing:
    """Return what a bearing is by its type, and its bore, which is its shaft's diameter where none is said.

    Raises
    ------
    CaseError
        When the file says neither type nor bore.
    """
    kind = bearing.text_of("bearing_type")
    if not kind:
        rule = "neither stiffness, inner geometry nor bearing_type: write radial_stiffness, or its type"
        raise _refuse(bearing, rule)
    bore = bearing.number_of("inner_diameter") or _diameter(gearbox, shaft, place)
    if not bore:
        raise _refuse(bearing, "inner_diameter is missing: write it, or radial_stiffness")
    outer, rows = bearing.number_of("outer_diameter"), bearing.whole_number_of("number_of_bearing_rows") or 1
    rolling = "ball" if "ball" in kind else "needle" if "needle" in kind else "roller"
    if kind not in KINDS:
        note(f"{bearing.label}: {kind}: taken by the stiffness of a {rolling} bearing")
    angles = [row.number_of("pressure_angle") for row in gearbox.beside(bearing.number, "rolling_bearing_row")]
    angle = next((abs(one) for one in angles if one), 0.0) if rolling == "ball" else 0.0
    outer, width = outer if outer and outer > bore else None, bearing.number_of("width")
    return CatalogueBearing(rolling, bore, outer, rows, angle, width or None)  # type: ignore[arg-type]


def _diameter(gearbox: Gearbox, shaft: Component, place: float) -> float | None:
    """Diameter of the section of a shaft at a place, mm."""
    for part in gearbox.beside(shaft.number, "shaft_section", "assembly"):
        start, length = part.number_of("u_coordinate_on_shaft"), part.number_of("length")
        if start is not None and length and start <= place <= start + length:
            return part.number_of("outer_diameter_begin", "outer_diameter_end")
    return None


def _refuse(bearing: Component, rule: str) -> CaseError:
    return CaseError(f"{bearing.file}: {bearing.label}: {rule}")
