"""A gearbox from a REXS file: shafts, bearings, stages and load cases, with a note on each thing that is not said.

The axes of the machine are those of the file: u of the shafts along x. Bearings are taken by their stiffness; catalogue
bearings have none in most files, and makers' inner geometry is in none: they are then rigid, and a note says so.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pmor.case import Case
from pmor.core.arrays import FloatArray
from pmor.core.errors import CaseError, printable
from pmor.export.rexs.joints import RING, axis_of, stages
from pmor.export.rexs.model import BEARINGS, RIGID, RIGID_TILT, Component, Gearbox, read_rexs
from pmor.export.rexs.read import read_stage
from pmor.export.rexs.stage import find_stage
from pmor.machine.checks import ROUNDED_SHARE
from pmor.machine.rexs_parts import inner_geometry, read_housing_matrix
from pmor.machine.rexs_sets import StageOnShafts, refuse_bearing, stages_on_shafts
from pmor.machine.rolling_bearing import BallBearing
from pmor.machine.settings import (
    HOUSING,
    Bearing,
    GearboxSections,
    GearPlace,
    LoadCase,
    MemberPlace,
    Mesh,
    PlanetarySet,
    Shaft,
    ShaftForce,
    ShaftMoment,
    ShaftSection,
    ShaftTorque,
)

PARALLEL = 1e-9


@dataclass(frozen=True)
class ReadGearbox:
    """A gearbox as a REXS file has it.

    Parameters
    ----------
    sections : GearboxSections
    cases : dict of str to Case
        Of the meshes.
    face_offsets : dict of str to (float, float)
        By how much the faces of pinion and wheel lie beyond their common middle along x, mm; where any does.
    stages : tuple of StageOnShafts
        Planetary ones.
    notes : tuple of str
        Assumptions, and parts that are left out.
    housing : ndarray, optional
        As of `pmor.machine.model.GearboxModel`.
    """

    sections: GearboxSections
    cases: dict[str, Case]
    face_offsets: dict[str, tuple[float, float]]
    stages: tuple[StageOnShafts, ...]
    notes: tuple[str, ...]
    housing: FloatArray | None


def read_gearbox(path: Path) -> ReadGearbox:
    """Read all of a gearbox that pmor solves.

    Raises
    ------
    FileFormatError
        When it is no REXS file.
    CaseError
        When the file does not say enough, with what is missing.
    """
    return _Draft(read_rexs(path), path).read()


class _Draft:
    """Parts of a gearbox as found, and notes on missing data."""

    def __init__(self, gearbox: Gearbox, path: Path) -> None:
        self.gearbox, self.path = gearbox, path
        self.notes: list[str] = []
        self.face_offsets: dict[str, tuple[float, float]] = {}
        self.stages = stages_on_shafts(gearbox, path, self.notes.append)
        self.own = {number for stage in self.stages for number in stage.own}
        self.shafts = {shaft.number: shaft for shaft in gearbox.of_kind("shaft") if shaft.number not in self.own}
        self.seats = list[Component]()

    def read(self) -> ReadGearbox:
        meshes, cases = self.meshes()
        sections = GearboxSections(
            title=printable(self.path.stem), shafts=tuple(map(self.shaft, self.shafts.values())),
            bearings=self.bearings(), meshes=meshes, sets=tuple(map(self.planetary, self.stages)), loads=self.loads(),
        )  # fmt: skip
        housing = read_housing_matrix(self.gearbox, self.seats, self.notes.append)
        notes = tuple(dict.fromkeys(self.notes))
        return ReadGearbox(sections, cases, self.face_offsets, tuple(self.stages), notes, housing)

    def planetary(self, stage: StageOnShafts) -> PlanetarySet:
        places = {
            member: MemberPlace(shaft=self.name(shaft), at_mm=place) for member, (shaft, place) in stage.seats.items()
        }
        return PlanetarySet(name=stage.name, set=self.path, **{"carrier": HOUSING, "sun": HOUSING, **places})  # type: ignore[arg-type]

    def name(self, component: Component) -> str:
        """Unique, and printable."""
        return printable(f"{component.name} [{component.number}]" if component.name else f"{component.number}")

    def refuse(self, component: Component, rule: str) -> CaseError:
        return CaseError(f"{self.path}: {component.label}: {rule}")

    def origin(self, shaft: Component) -> list[float]:
        place = shaft.numbers_of("support_vector")
        if len(place) != 3:
            raise self.refuse(shaft, "support_vector is missing: the file must say where the shafts are")
        if math.dist(axis_of(shaft), [1.0, 0.0, 0.0]) > PARALLEL:
            raise self.refuse(shaft, "its axis is not along x: only parallel axes along x are solved")
        return place

    def shaft(self, shaft: Component) -> Shaft:
        x, y, z = self.origin(shaft)
        parts = sorted(
            self.gearbox.beside(shaft.number, "shaft_section", "assembly"),
            key=lambda part: part.number_of("u_coordinate_on_shaft") or 0.0,
        )
        if not parts:
            raise self.refuse(shaft, "has no sections: the file must say its diameters")
        sections = []
        for part in parts:
            ends = [[part.number_of(f"{side}_diameter_{end}") or 0.0 for end in ("begin", "end")]
                    for side in ("outer", "inner")]  # fmt: skip
            if any(one != other for one, other in ends):
                self.notes.append(f"{part.label}: conical: a cylinder of its mean diameters")
            outer, inner = (0.5 * sum(end) for end in ends)
            sections.append(ShaftSection(length_mm=part.number_of("length") or 0.0, outer_mm=outer, inner_mm=inner))
        modulus, ratio = self.material(shaft)
        return Shaft(
            name=self.name(shaft), at_mm=(y, z), start_mm=x, sections=tuple(sections), youngs_modulus_GPa=modulus,
            poisson_ratio=ratio,
        )  # fmt: skip

    def material(self, shaft: Component) -> tuple[float, float]:
        for material in self.gearbox.beside(shaft.number, "material"):
            modulus, ratio = material.number_of("elastic_modulus"), material.number_of("poisson_ratio")
            if modulus and ratio is not None:
                return 1e-3 * modulus, ratio
        self.notes.append(f"{shaft.label}: refers to no elastic constants: steel assumed, 210 GPa and 0.3")
        return 210.0, 0.3

    def bearings(self) -> tuple[Bearing, ...]:
        found, located = list[Bearing](), set[str]()
        for kind in BEARINGS:
            for bearing in self.gearbox.of_kind(kind):
                sides = [relation for relation in self.gearbox.relations if relation.role("assembly") == bearing.number]
                inner = next((one.role("inner_part") for one in sides if one.role("inner_part")), None)
                outer = next((one.role("outer_part") for one in sides if one.role("outer_part")), None)
                if {inner, outer} <= {*self.own, None}:
                    continue
                if outer in self.own:
                    raise refuse_bearing(self.path, bearing)
                if inner not in self.shafts:
                    self.notes.append(f"{bearing.label}: stands on no shaft: left out")
                    continue
                found.append(self.bearing(bearing, self.shafts[inner], self.shafts.get(outer or -1), located))
                if found[-1].to == HOUSING:
                    self.seats.append(bearing)
        return tuple(found)

    def bearing(self, bearing: Component, shaft: Component, outer: Component | None, located: set[str]) -> Bearing:
        place = bearing.number_of("u_coordinate_on_shaft_inner_side", "u_coordinate_on_shaft")
        if place is None:
            raise self.refuse(bearing, "u_coordinate_on_shaft_inner_side is missing: where does it stand?")
        to = self.name(outer) if outer else HOUSING
        at = {"name": self.name(bearing), "shaft": self.name(shaft), "to": to, "at_mm": place}
        inner = inner_geometry(self.gearbox, bearing, self.notes.append)
        if inner is not None:
            return Bearing(**at, **{"ball" if isinstance(inner, BallBearing) else "roller": inner})  # type: ignore[arg-type]
        radial, tilt = bearing.number_of("radial_stiffness"), bearing.number_of("bending_stiffness")
        holds = bearing.text_of("radial_force_absorption") != "false"
        if radial is None and holds:
            self.notes.append(f"{bearing.label}: neither stiffness nor inner geometry: radially rigid")
        return Bearing(
            **at,  # type: ignore[arg-type]
            radial_N_per_mm=_stiffness(radial, RIGID, "rigid" if holds else "free"),  # type: ignore[arg-type]
            axial_N_per_mm=self.axial(bearing, self.name(shaft), located),  # type: ignore[arg-type]
            tilt_Nmm_per_rad=_stiffness(tilt, RIGID_TILT, "free"),  # type: ignore[arg-type]
        )

    def axial(self, bearing: Component, shaft: str, located: set[str]) -> float | str:
        """Stiffness along the axis; of bearings that take thrust without one, the first of a shaft holds it."""
        takes, stiffness = bearing.text_of("axial_force_absorption"), bearing.number_of("axial_stiffness")
        if takes not in ("both_directions", "positive", "negative"):
            return "free"
        found = _stiffness(stiffness, RIGID, "free" if shaft in located else "rigid")
        if takes != "both_directions":
            how = "held by another bearing" if found == "free" else "held by it in both directions"
            self.notes.append(f"{bearing.label}: takes thrust in one direction: the shaft is {how}")
        located.add(shaft)
        return found

    def meshes(self) -> tuple[tuple[Mesh, ...], dict[str, Case]]:
        found, cases = list[Mesh](), dict[str, Case]()
        inside = {number for one in self.stages for number in one.stage.meshes}
        for number, gears in sorted(stages(self.gearbox).items()):
            if number in inside:
                continue
            if ring := next((gear for gear in gears if gear.kind == RING), None):
                rule = "internal pairs are solved with shafts in planetary stages alone: leave it out of the file"
                raise self.refuse(ring, rule)
            stage, read = find_stage(self.gearbox, number, str(self.path)), read_stage(self.path, number)
            name = f"stage_{number}"
            self.notes += [f"{name}: {note}" for note in read.notes]
            faces = [self.face(gear) for gear in (stage.pinion, stage.wheel)]
            low, high = max(face[0] for face in faces), min(face[1] for face in faces)
            middle = 0.5 * (low + high)
            pinion, wheel = (self.gear_place(gear, middle) for gear in (stage.pinion, stage.wheel))
            if any(sum(face) != 2.0 * middle for face in faces):
                self.face_offsets[name] = (0.5 * sum(faces[0]) - middle, 0.5 * sum(faces[1]) - middle)
            found.append(Mesh(name=name, case=self.path, pinion=pinion, wheel=wheel, changes={}))
            cases[name] = read.case
        if not found and not self.stages:
            raise CaseError(f"{self.path}: has no stage of two external cylindrical gears, and no planetary one")
        return tuple(found), cases

    def face(self, gear: Component) -> tuple[float, float]:
        """Where the face of a gear begins and ends along x, mm."""
        place, width = gear.numbers_of("support_vector"), gear.number_of("face_width")
        if len(place) != 3 or not width:
            raise self.refuse(gear, "support_vector or face_width is missing: where is its face?")
        return place[0] - 0.5 * width, place[0] + 0.5 * width

    def gear_place(self, gear: Component, x: float) -> GearPlace:
        for shaft in self.gearbox.beside(gear.number, "shaft", "assembly"):
            return GearPlace(shaft=self.name(shaft), at_mm=x - self.origin(shaft)[0])
        raise self.refuse(gear, "is on no shaft")

    def loads(self) -> tuple[LoadCase, ...]:
        cases = self.gearbox.load_cases or ({},)
        found = [self.load(f"load case {n}", case) for n, case in enumerate(cases, start=1)]
        times = self.times(cases)
        return tuple(replace(load, fraction=f, hours=h) for load, (f, h) in zip(found, times, strict=True))

    def times(self, cases: Sequence[dict[int, Component]]) -> list[tuple[float | None, float | None]]:
        """Shares of the load cases in the operating time, or their hours where the file has it."""
        unit = next(iter(self.gearbox.of_kind("gear_unit")), None)
        said = [case.get(unit.number, unit).number_of("operating_time_fraction") if unit else None for case in cases]
        parts = [part for part in said if part]
        if unit is None or len(parts) < len(cases):
            if parts:
                self.notes.append("operating_time_fraction is not said of all load cases: no duty cycle")
            return [(None, None)] * len(cases)
        if abs(sum(parts) - 100.0) > 100.0 * ROUNDED_SHARE:
            self.notes.append(f"operating_time_fraction adds up to {sum(parts):g} %, not 100 %: no duty cycle")
            return [(None, None)] * len(cases)
        if (hours := unit.number_of("operating_time")) is not None:
            return [(None, hours * part / sum(parts)) for part in parts]
        return [(part / sum(parts), None) for part in parts]

    def load(self, name: str, case: dict[int, Component]) -> LoadCase:
        torques, forces, moments = list[ShaftTorque](), list[ShaftForce](), list[ShaftMoment]()
        for load in self.gearbox.of_kind("external_load"):
            said = case.get(load.number, load)
            for shaft in self.gearbox.beside(load.number, "shaft", "assembly"):
                if shaft.number in self.own:
                    self.notes.append(f"{load.label}: on {shaft.label}, a part of a planetary stage: left out")
                    continue
                at = {"shaft": self.name(shaft), "at_mm": load.number_of("u_coordinate_on_shaft") or 0.0}
                own = said.number_of("torque_around_u_axis")
                torque = load.number_of("torque_around_u_axis") if own is None else own
                if load.text_of("transmits_torque") == "true":
                    defined = load.text_of("defines_torque")
                    given = defined != "false" and (bool(torque) or (torque == 0.0 and defined == "true"))
                    torques.append(ShaftTorque(**at, torque_Nm=torque if given else "balance"))  # type: ignore[arg-type]
                force = _turned(shaft, [said.number_of(f"force_{way}_direction") or 0.0 for way in "uvw"])
                if any(force):
                    forces.append(ShaftForce(**at, x_N=force[0], y_N=force[1], z_N=force[2]))  # type: ignore[arg-type]
                bending = [said.number_of(f"torque_around_{way}_axis") or 0.0 for way in "vw"]
                moment = _turned(shaft, [0.0, *bending])
                if any(moment):
                    moments.append(ShaftMoment(**at, y_Nm=moment[1], z_Nm=moment[2]))  # type: ignore[arg-type]
        torques.sort(key=lambda one: one.torque_Nm == "balance")
        if not torques or torques[0].torque_Nm == "balance":
            raise CaseError(f"{self.path}: {name}: no torque enters: no external_load has torque_around_u_axis")
        first = next(shaft for shaft in self.shafts.values() if self.name(shaft) == torques[0].shaft)
        speed = case.get(first.number, first).number_of("rotational_speed") or first.number_of("rotational_speed")
        if speed is None:
            self.notes.append(f"{name}: no speed of {first.label}: no losses")
        acting = {"torques": tuple(torques), "forces": tuple(forces), "moments": tuple(moments)}
        return LoadCase(name=name, speed_rpm=speed, **acting)  # type: ignore[arg-type]


def _stiffness(value: float | None, rigid: float, without: str) -> float | str:
    """Stiffness in a direction; `without` where the file has none, or 0."""
    return without if not value else "rigid" if value >= rigid else value


def _turned(shaft: Component, values: Sequence[float]) -> list[float]:
    """Return a vector along u, v, w of a shaft in axes of the machine."""
    u, w = axis_of(shaft), shaft.direction_of("w_axis_vector") or [0.0, 0.0, 1.0]
    return [float(x) for x in np.array(values) @ np.array([u, np.cross(w, u), w])]
