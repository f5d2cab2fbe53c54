"""Bearings, couplings and fits of a REXS file: by inner geometry, by stiffness, or by sizes of a catalogue.

What a shaft stands on in a gearbox, and what it is as a seat of a beam in a planetary stage that is read alone.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from pmor.body.bearing_estimate import CatalogueBearing
from pmor.body.bearing_faults import impossible
from pmor.body.roller_bearing import LAMINAE, RollerBearing
from pmor.body.rolling_bearing import BallBearing
from pmor.case.reader import checked
from pmor.machine.settings import HOUSING, Bearing
from pmor.rexs.joints import COUPLINGS, FITS, shaft_joints
from pmor.rexs.model import BEARINGS, CONCEPT, RIGID, RIGID_TILT, Component, Gearbox
from pmor.rexs.shafts import sections_of

# Types of bearings whose inner geometry is solved, and whether they have balls; others are taken by their stiffness.
KINDS = {
    "angular_contact_ball_bearing": True, "radial_grooved_ball_bearing": True, "radial_needle_roller_bearing": False,
    "radial_roller_bearing": False, "radial_tapered_roller_bearing": False,
}  # fmt: skip
# Those that have a contact angle.
ANGLED = ("angular_contact_ball_bearing", "radial_tapered_roller_bearing")
CLEARANCES = ("operating_radial_bearing_clearance", "mounted_radial_bearing_clearance", "radial_bearing_clearance")
# Of a bearing: what moves it off its place, which is not read.
OFF_PLACE = (
    "preload_distance", "preload_force", "misalignment_in_v_direction", "misalignment_in_w_direction",
    "angular_misalignment_around_v_axis", "angular_misalignment_around_w_axis",
)  # fmt: skip
DIGITS = 9


@dataclass
class RexsBearings:
    """What shafts of a gearbox stand on, and what joins them.

    Parameters
    ----------
    shafts : mapping of int to Component
        By number.
    own : set of int
        Shafts that are parts of planetary stages.
    name : callable
        Of a component.
    seats : list of Component
        Bearings to the housing, as they are found.
    """

    gearbox: Gearbox
    shafts: Mapping[int, Component]
    own: set[int]
    name: Callable[[Component], str]
    note: Callable[[str], None]
    seats: list[Component] = field(default_factory=list)
    located: set[int] = field(default_factory=set)

    def read(self) -> tuple[Bearing, ...]:
        """Return bearings, and couplings and fits between shafts."""
        found = list[Bearing]()
        for kind in BEARINGS:
            for bearing in self.gearbox.of_kind(kind):
                inner, outer = self.sides(bearing)
                if {inner, outer} <= {*self.own, None}:
                    continue
                if outer in self.own:
                    rule = "stands in a part of the carrier that is no shaft of its own: write a file with [[sets]]"
                    raise bearing.refusal(rule)
                if inner is None or inner not in self.shafts:
                    self.note(f"{bearing.label}: stands on no shaft: left out")
                    continue
                found.append(self.bearing(bearing, self.shafts[inner], self.shafts.get(outer or -1)))
                if found[-1].to == HOUSING:
                    self.seats.append(bearing)
        for joint, one, other in shaft_joints(self.gearbox):
            if one.number in self.shafts and other.number in self.shafts:
                found.append(self.coupling(joint, one, other))
        return tuple(found)

    def sides(self, bearing: Component) -> tuple[int | None, int | None]:
        """Numbers of its inner and its outer part."""
        roles = [one for one in self.gearbox.relations if one.role("assembly") == bearing.number]
        inner, outer = (next((one.role(f"{side}_part") for one in roles if one.role(f"{side}_part")), None)
                        for side in ("inner", "outer"))  # fmt: skip
        return inner, outer

    def bearing(self, bearing: Component, shaft: Component, outer: Component | None) -> Bearing:
        """Return a bearing of a shaft."""
        place = _place(bearing, shaft)
        if place is None:
            raise bearing.refusal("u_coordinate_on_shaft_inner_side is missing: where does it stand?")
        at: dict[str, Any] = {
            "name": self.name(bearing), "shaft": self.name(shaft), "to": self.name(outer) if outer else HOUSING,
            "at_mm": round(place, DIGITS),
        }  # fmt: skip
        if lost := [f"{name} = {value:g}" for name in OFF_PLACE if (value := bearing.number_of(name))]:
            self.note(f"{bearing.label}: {', '.join(lost)}: left out: it stands on its place, without preload")
        radial, holds = bearing.number_of("radial_stiffness"), bearing.text_of("radial_force_absorption") != "false"
        inner = inner_geometry(self.gearbox, bearing, self.note)
        if inner is not None:
            # A stiffness is force by deflection at one load. It does not know that thrust and moments follow from
            # forces across in tapered bearings, and in ball bearings under thrust.
            if radial:
                self.note(f"{bearing.label}: radial_stiffness is not taken: inner geometry goes before it")
            at["ball" if isinstance(inner, BallBearing) else "roller"] = inner
            return Bearing(**at)
        if radial or not holds:
            at["radial_N_per_mm"] = stiffness(radial, RIGID, "free")
        elif bearing.kind == CONCEPT:
            self.note(f"{bearing.label}: neither stiffness nor inner geometry: radially rigid, as a concept")
        else:
            at["catalogue"] = catalogue_bearing(self.gearbox, bearing, shaft, place, self.note)
        return Bearing(
            **at, axial_N_per_mm=self.axial(bearing, shaft.number),
            tilt_Nmm_per_rad=stiffness(bearing.number_of("bending_stiffness"), RIGID_TILT, "free"),
        )  # fmt: skip

    def axial(self, bearing: Component, shaft: int) -> Any:
        """Stiffness along the axis; of bearings that take thrust without one, the first of a shaft holds it."""
        takes = bearing.text_of("axial_force_absorption")
        if takes not in ("both_directions", "positive", "negative"):
            return "free"
        found = stiffness(bearing.number_of("axial_stiffness"), RIGID, "free" if shaft in self.located else "rigid")
        if takes != "both_directions":
            how = "held by another bearing" if found == "free" else "held by it in both directions"
            self.note(f"{bearing.label}: takes thrust in one direction: the shaft is {how}")
        self.located.add(shaft)
        return found

    def coupling(self, joint: Component, shaft: Component, other: Component) -> Bearing:
        """Return a joint between two shafts, which carries torque: fits are rigid, as is what is not said."""
        place = _place(joint, shaft)
        if place is None:
            place = sum(part.length for part in sections_of(self.gearbox, shaft, self.note))
            self.note(f"{joint.label}: its place is not said: at the end of {shaft.label}")
        names = "radial_stiffness", "axial_stiffness", "bending_stiffness", "rotational_stiffness"
        said = [None if joint.kind in FITS else joint.number_of(name) for name in names]
        if joint.kind in COUPLINGS and None in said:
            lacking = ", ".join(name for name, value in zip(names, said, strict=True) if value is None)
            self.note(f"{joint.label}: {lacking} missing: rigid")
        radial, axial, tilt, torsion = (
            stiffness(rigid if value is None else value, rigid, "free")
            for value, rigid in zip(said, (RIGID, RIGID, RIGID_TILT, RIGID_TILT), strict=True)
        )
        if axial != "free":
            self.located |= {shaft.number}
        return Bearing(
            name=self.name(joint), shaft=self.name(shaft), to=self.name(other), at_mm=round(place, DIGITS),
            radial_N_per_mm=radial, axial_N_per_mm=axial, tilt_Nmm_per_rad=tilt, torsion_Nmm_per_rad=torsion,
        )  # fmt: skip


def stiffness(value: float | None, rigid: float, without: str) -> Any:
    """Stiffness in a direction as a key has it; `without` where the file has none, or 0."""
    return without if not value else "rigid" if value >= rigid else value


def _place(joint: Component, shaft: Component) -> float | None:
    """Where a joint stands on its inner shaft, mm: as it is said, or by the places of both; None without."""
    said = joint.number_of("u_coordinate_on_shaft_inner_side", "u_coordinate_on_shaft")
    foot, there = (one.numbers_of("support_vector") for one in (shaft, joint))
    return there[0] - foot[0] if said is None and len(there) == len(foot) == 3 else said


def inner_geometry(
    gearbox: Gearbox, bearing: Component, note: Callable[[str], None]
) -> BallBearing | RollerBearing | None:
    """Return the inner geometry of a bearing; None where the file has none, or not all of it, with a note.

    Raises
    ------
    CaseError
        When a number is out of range.
    """
    rows = gearbox.beside(bearing.number, "rolling_bearing_row")
    elements = [one for row in rows for one in gearbox.beside(row.number, "rolling_element")]
    if len(rows) != 1 or not elements:
        if elements:
            note(f"{bearing.label}: {len(rows)} rows of rolling elements, and one is solved: by its stiffness")
        return None
    (row,), element, kind = rows, elements[0], bearing.text_of("bearing_type")
    if kind not in KINDS:
        said = f"bearing_type {kind}" if kind else "without bearing_type"
        note(f"{bearing.label}: {said}: its inner geometry is not solved: by its stiffness")
        return None
    ball = KINDS[kind]
    length = row.number_of("significant_contact_length_inner_ring") or element.number_of("length_of_rolling_element")
    needed = {
        "number_of_rolling_elements": row.whole_number_of("number_of_rolling_elements"),
        "reference_diameter_rolling_bearing": row.number_of("reference_diameter_rolling_bearing", "reference_diameter"),
        "diameter_of_rolling_element": element.number_of("diameter_of_rolling_element"),
        **({} if ball else {"length_of_rolling_element": length}),
        **({"pressure_angle": row.number_of("pressure_angle")} if kind in ANGLED else {}),
    }
    if missing := [name for name, value in needed.items() if not value]:
        note(f"{bearing.label}: {', '.join(missing)} missing: by its stiffness")
        return None
    count, pitch, diameter = (value or 0.0 for value in list(needed.values())[:3])
    clearance = bearing.number_of(*CLEARANCES)
    if clearance is None:
        note(f"{bearing.label}: no radial clearance is said: 0")
    said = row.text_of("axial_force_absorption_of_row") or bearing.text_of("axial_force_absorption")
    angle = (row.number_of("pressure_angle") or 0.0) * (-1.0 if said == "negative" else 1.0)
    first = element.number_of("angular_position_around_u") or 0.0
    rated = bearing.number_of("radial_dynamic_load_rating") or None
    where = f"{bearing.file}: {bearing.label}"
    if not ball:
        laminae, profile = row.whole_number_of("custom_pmor_laminae"), row.text_of("custom_pmor_logarithmic_profile")
        roller = RollerBearing(
            rollers=int(count), roller_diameter_mm=diameter, effective_length_mm=length or 0.0,
            pitch_diameter_mm=pitch, clearance_mm=clearance or 0.0, contact_angle_deg=angle, first_roller_deg=first,
            laminae=laminae or LAMINAE, logarithmic_profile=profile != "false", dynamic_rating_N=rated,
        )  # fmt: skip
        return _possible(checked(roller, RollerBearing, where, "roller"), bearing, note)
    grooves = [row.number_of(f"raceway_radius_of_{ring}_ring") for ring in ("inner", "outer")]
    usual = 0.52, 0.53
    if None in grooves:
        note(f"{bearing.label}: no raceway radii are said: {usual[0]:g} and {usual[1]:g} of the balls' diameter")
    osculation = [groove / diameter if groove else value for groove, value in zip(grooves, usual, strict=True)]
    steel: dict[str, Any] = {}
    for material in gearbox.beside(element.number, "material"):
        modulus, ratio = material.number_of("elastic_modulus"), material.number_of("poisson_ratio")
        if modulus and ratio is not None:
            steel = {"youngs_modulus_GPa": 1e-3 * modulus, "poisson_ratio": ratio}
    found = BallBearing(
        balls=int(count), ball_diameter_mm=diameter, pitch_diameter_mm=pitch, clearance_mm=clearance or 0.0,
        contact_angle_deg=angle, first_ball_deg=first, inner_osculation=osculation[0], outer_osculation=osculation[1],
        dynamic_rating_N=rated, **steel,
    )  # fmt: skip
    return _possible(checked(found, BallBearing, where, "ball"), bearing, note)


def _possible(
    found: BallBearing | RollerBearing, bearing: Component, note: Callable[[str], None]
) -> BallBearing | RollerBearing | None:
    """None of a bearing that cannot be made, with a note."""
    if (fault := impossible(found)) is None:
        return found
    note(f"{bearing.label}: {fault[0]} cannot be: {fault[1]}; by its stiffness")
    return None


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
        raise bearing.refusal(rule)
    bore = bearing.number_of("inner_diameter") or _diameter(gearbox, shaft, place)
    if not bore:
        raise bearing.refusal("inner_diameter is missing: write it, or radial_stiffness")
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
