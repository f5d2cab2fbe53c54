"""Bearings, couplings and fits of a REXS gearbox: by inner geometry, by stiffness, or by type, bore and load."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from pmor.body.rolling_bearing import BallBearing
from pmor.core.errors import CaseError
from pmor.machine.settings import HOUSING, Bearing
from pmor.rexs.bearings import catalogue_bearing
from pmor.rexs.inner_geometry import inner_geometry
from pmor.rexs.joints import COUPLINGS, FITS, shaft_joints
from pmor.rexs.model import BEARINGS, CONCEPT, RIGID, RIGID_TILT, Component, Gearbox
from pmor.rexs.sets_on_shafts import refuse_bearing
from pmor.rexs.shafts import sections_of

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
                    raise refuse_bearing(bearing)
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
            raise _refuse(bearing, "u_coordinate_on_shaft_inner_side is missing: where does it stand?")
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


def _refuse(component: Component, rule: str) -> CaseError:
    return CaseError(f"{component.file}: {component.label}: {rule}")
