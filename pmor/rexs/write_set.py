"""A set and its results as a REXS 2.0 file: a planetary one alone or on the shafts of a gearbox.

Alone its axis is x, its x and y are y and z, and its members stand on shafts of the width of their faces, on bearings
of the stiffness that the set file says. Mesh, sweep of angles and tolerances of the set file are left out.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from pmor.case import Case
from pmor.case.capability import refuse_beyond
from pmor.core.arrays import FloatArray
from pmor.gear.pair import GearPair
from pmor.pair.model import gear_pair
from pmor.rexs.document import Attributes, Document, Value
from pmor.rexs.parts import ALONE, add_shaft, at, springs
from pmor.rexs.set_results import gear_forces, mesh_attributes, stage_results
from pmor.rexs.sets import DIGITS, STAGE
from pmor.rexs.sets_on_shafts import JOINED_AT
from pmor.rexs.shafts import shaft_attributes
from pmor.rexs.write import add_gear, stage_attributes
from pmor.rexs.write_train import train_rexs
from pmor.sets.layout import SECOND_PLANET
from pmor.sets.loader import SetFile
from pmor.sets.settings import Member
from pmor.sets.solution import SetSolution

# Number of the ring among the bodies: the sun is before it, planets are behind.
RING = 1


def set_rexs(file: SetFile, solved: SetSolution | None, date: str) -> bytes:
    """Return the text of the file; `date` is ISO 8601.

    Raises
    ------
    CaseError
        When REXS has no words for it: `pmor.case.capability`.
    """
    refuse_beyond(file, "rexs")
    if file.sections.gears:
        return train_rexs(file, solved, date)
    document, load = Document(), file.sections.load
    assert load is not None
    unit = document.add("gear_unit", file.sections.title, model_name=file.name)
    casing = document.add("gear_casing", "Housing")
    document.relate("assembly", assembly=unit, part=casing)
    parts = SetParts(document, unit, casing, file, file.sections.title)
    parts.add()
    torque = document.add_to(
        parts.shafts[load.on], "external_load", "Torque", u_coordinate_on_shaft=0.0, transmits_torque=True,
        defines_torque=True,
    )  # fmt: skip
    for number, amount in enumerate(file.torques_Nm):
        case: dict[int, Attributes] = {torque: {"torque_around_u_axis": math.copysign(amount, load.torque_Nm)}}
        if solved is not None and solved.converged[number].any():
            case |= parts.results(solved, number)
        document.cases.append(case)
    return document.text(date)


@dataclass
class SetParts:
    """The parts of a planetary set in a file: numbers of its components by bodies and meshes.

    Parameters
    ----------
    casing : int
        Which holds one of its members.
    name : str
        Of the stage.
    turn : ndarray, shape (3, 3)
        Axes of the file by those of the set.
    middle_mm : sequence of float
        Where the middle of the sun's face is.
    given : mapping of str to (int, float, float)
        Members on shafts of a gearbox: the shaft, the place where they join it, and that of `middle_mm` along it, mm.
    """

    document: Document
    unit: int
    casing: int
    file: SetFile
    name: str
    turn: FloatArray = field(default_factory=lambda: ALONE)
    middle_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    given: Mapping[Member, tuple[int, float, float]] = field(default_factory=dict)
    stage: int = 0
    plates: dict[float, int] = field(default_factory=dict)
    shafts: dict[str, int] = field(default_factory=dict)
    gears: list[int] = field(default_factory=list)
    meshes: list[int] = field(default_factory=list)

    @property
    def along(self) -> float:
        """1 where the axis of the set looks along x of the file, else -1."""
        return float(self.turn[0, 2])

    def add(self) -> None:
        """Add the stage with all of its parts."""
        said, plan, relate = self.file.sections, self.file.plan, self.document.relate
        assert said.load is not None
        first: Attributes = {"custom_pmor_first_planet": self.first_deg} if self.first_deg else {}
        self.stage = self.document.add_to(self.unit, STAGE, self.name, **first)
        carrier = self.document.add_to(self.stage, "planet_carrier", "Carrier")
        for side, place in zip(("-z", "+z"), self.cheeks_mm, strict=True):
            self.plates[place] = self.document.add_to(carrier, "side_plate", f"Cheek at {side}", **self.at(place))
        pairs = {name: gear_pair(case) for name, case in self.file.cases.items()}
        self.members(list(self.file.cases.values()), list(pairs.values()))
        relate("assembly", assembly=carrier, part=self.shafts["carrier"])
        relate("planet_carrier_shaft", planetary_stage=self.stage, shaft=self.shafts["carrier"])
        for shaft in ("sun", "ring"):
            relate("central_shaft", planetary_stage=self.stage, shaft=self.shafts[shaft])
        for mesh in plan.meshes:
            name = f"{plan.bodies[mesh.pinion].name} - {plan.bodies[mesh.wheel].name}"
            stage = self.document.add_to(self.stage, "cylindrical_stage", name, **stage_attributes(pairs[mesh.case]))
            relate("stage", stage=stage, gear_1=self.gears[mesh.pinion], gear_2=self.gears[mesh.wheel])
            self.meshes.append(stage)
        held = self.shafts[said.load.held]
        self.document.join(held, self.casing, "coupling", "Held", **self.at(0.0), **springs("free", "free", "free"))

    @property
    def first_deg(self) -> float:
        """Place of the first planet that is there, about x of the file from the y axis of the set."""
        body = self.file.plan.bodies[self.file.plan.planets[0]]
        return self.along * round(math.degrees(math.atan2(-body.x, body.y)), DIGITS) + 0.0

    @property
    def cheeks_mm(self) -> tuple[float, float]:
        """Where the pins end, along the axis."""
        pins, half = self.file.sections.pins, 0.5 * max(self.widths)
        places = [body.z for body in self.file.plan.bodies]
        return (min(places) - half, max(places) + half) if pins is None else pins.ends_mm

    @property
    def widths(self) -> list[float]:
        """Of the faces of sun, planets and ring."""
        return [gear.face_width_mm or case.pair.face_width_mm for case in self.file.cases.values()
                for gear in (case.pair.pinion, case.pair.wheel)]  # fmt: skip

    def at(self, z: float, x: float = 0.0, y: float = 0.0) -> dict[str, Value]:
        """Return a place of the set in the file, and its axes."""
        return at((np.array(self.middle_mm) + self.turn @ [x, y, z]).tolist())

    def members(self, cases: list[Case], pairs: list[GearPair]) -> None:
        """Add sun, ring, planets and the carrier's shaft, in the order of the bodies of the set."""
        load, radial = self.file.sections.load, self.file.sections.supports.sun_radial_N_per_mm
        assert load is not None
        (inner, outer), (inner_pair, outer_pair) = cases, pairs
        bodies, stepped = self.file.plan.bodies, SECOND_PLANET in self.file.sections.members
        bore = 2.0 * (inner.pair.pinion.bore_radius_mm or 1.0)
        speed: Attributes = {"rotational_speed": load.speed_rpm} if load.speed_rpm and not self.given else {}
        for number, body in enumerate(bodies):
            second, of_ring = body.on is not None, number == RING
            planet = number > RING and not second
            case, pair, gear = inner, inner_pair, int(planet)
            if of_ring or second:
                case, pair, gear = outer, outer_pair, int(of_ring)
            face = [body.z + end for end in pair.faces[gear]]
            more: Attributes = {**(speed if body.name == load.on else {}), **self.pin_error(number)}
            if body.on is not None:
                joined, name = self.on_planet(number), bodies[body.on].name
                begin = min(self.along * end for end in face) - min(self.along * end for end in self.planet_ends(pairs))
            else:
                ends = self.planet_ends(pairs) if planet else (face[0], face[1])
                name, (begin, joined) = body.name, self.member(body.name, ends, (body.x, body.y), bore, more)
                if planet:
                    begin = min(self.along * end for end in face) - min(self.along * end for end in ends)
            self.gears.append(add_gear(
                self.document, case, pair, gear, body.name, begin, "positive" if self.along > 0.0 else "negative",
                of_ring or second, (outer.pinion_modification, outer_pair) if planet and not stepped else None,
                **self.at(body.z, body.x, body.y), **joined,
            )[0])  # fmt: skip
            self.document.relate("assembly", assembly=self.shafts[name], part=self.gears[number])
            if planet:
                self.document.relate("planet_shaft", planetary_stage=self.stage, shaft=self.shafts[body.name])
                self.pin(body.name, (body.x, body.y))
        if radial != "free" and "sun" not in self.given:
            self.bearing("Sun", (self.shafts["sun"], self.casing), self.at(0.0), radial, "rigid")
        self.member("carrier", self.cheeks_mm, (0.0, 0.0), bore, speed if load.on == "carrier" else {})
        if "carrier" in self.given:
            shaft, joined_at, middle = self.given["carrier"]
            x, y, z = self.middle_mm
            self.document.join(shaft, self.plates[self.cheeks_mm[0]], "cylindrical_interference_fit", "Carrier",
                               **at([x + joined_at - middle, y, z]))  # fmt: skip

    def member(
        self, name: str, ends: tuple[float, float], place: tuple[float, float], bore: float, more: Attributes
    ) -> tuple[float, Attributes]:
        """Add the shaft of a member, but for one of the gearbox; return where its face begins, and joins that shaft."""
        shaft, joined_at, middle = self.given.get(name, (None, 0.0, 0.0))  # type: ignore[call-overload]
        if shaft is None:
            self.shaft(name, ends, place, (bore, 0.0), more)
            return 0.0, {}
        self.shafts[name] = shaft
        begin = middle + min(self.along * end for end in ends)
        return begin, {} if abs(joined_at - middle) < 10.0**-DIGITS else {JOINED_AT: joined_at}

    def planet_ends(self, pairs: list[GearPair]) -> tuple[float, float]:
        """Where shafts of planets begin and end along the axis."""
        ends = list(pairs[0].faces[1])
        if (second := self.file.plan.bodies[-1]).on is not None:
            ends += [second.z + end for end in pairs[1].faces[0]]
        return min(ends), max(ends)

    def on_planet(self, body: int) -> Attributes:
        """Return what the second gear of a stepped planet has: by how much it is ahead, and what twists before it."""
        said, bodies = self.file.sections, self.file.plan.bodies
        planet = int(bodies[bodies[body].on or 0].name.removeprefix("planet ")) - 1
        timing = said.planets.timing_mrad[planet] if said.planets.timing_mrad else 0.0
        return shaft_attributes(timing, said.supports.planet_torsion_Nmm_per_rad)

    def pin_error(self, body: int) -> Attributes:
        """By how much the pin of a planet is off its place, outwards and about x of the file."""
        planets, plan = self.file.sections.planets, self.file.plan
        if body not in plan.planets or not (planets.radial_um or planets.tangential_um):
            return {}
        place, none = int(plan.bodies[body].name.removeprefix("planet ")) - 1, (0.0,) * planets.count
        radial, around = ((sizes or none)[place] for sizes in (planets.radial_um, planets.tangential_um))
        return {"custom_pmor_pin_error": [radial, self.along * around + 0.0]}

    def shaft(
        self, name: str, ends: tuple[float, float], place: tuple[float, float], diameters: tuple[float, float],
        more: Attributes, material: Attributes | None = None,
    ) -> int:  # fmt: skip
        """Add a shaft from z to z, of an outer and an inner diameter."""
        start = self.at(min(ends, key=lambda end: self.along * end), *place)["support_vector"]
        sections = [(ends[1] - ends[0], *diameters)]
        number = add_shaft(self.document, self.unit, f"Shaft of {name}", start, sections, material, **more)  # type: ignore[arg-type]
        self.shafts[name] = number
        return number

    def bearing(
        self, name: str, sides: tuple[int, int], place: Attributes, radial: float | str, tilt: float | str
    ) -> None:
        """Add a bearing by its stiffness between an inner and an outer part."""
        self.document.join(*sides, "concept_bearing", name, **place, **springs(radial, "free", tilt))

    def pin(self, planet: str, place: tuple[float, float]) -> None:
        """Add the pin of a planet: that of the file, or one that is rigid, with a bearing of the planet's stiffness."""
        pins, ends = self.file.sections.pins, self.cheeks_mm
        name, bearing = f"Seat of {planet}", f"Bearing of {planet}"
        if pins is None:
            radial = self.file.sections.supports.planet_radial_N_per_mm
            if radial != "rigid":
                number = self.pin_shaft(planet, place, (ends[1] - ends[0], 0.0))
                self.bearing(name, (number, self.plates[ends[0]]), self.at(0.0, *place), "rigid", "rigid")
                self.bearing(bearing, (number, self.shafts[planet]), self.at(0.0, *place), radial, "rigid")
            return
        steel = {"elastic_modulus": 1e3 * pins.youngs_modulus_GPa, "poisson_ratio": pins.poisson_ratio}
        number = self.pin_shaft(planet, place, (pins.diameter_mm, pins.inner_mm), steel)
        for z, plate in self.plates.items():
            tilt = "rigid" if pins.ends == "clamped" else "free"
            self.bearing(name, (number, plate), self.at(z, *place), "rigid", tilt)
        for seat in pins.bearings:
            there = self.at(seat.at_mm, *place)
            self.bearing(bearing, (number, self.shafts[planet]), there, seat.radial_N_per_mm, seat.tilt_Nmm_per_rad)

    def pin_shaft(
        self, planet: str, place: tuple[float, float], diameters: tuple[float, float],
        material: Attributes | None = None,
    ) -> int:  # fmt: skip
        """Add the shaft of a pin."""
        number = self.shaft(f"pin of {planet}", self.cheeks_mm, place, diameters, {}, material)
        self.document.relate("planet_pin", planetary_stage=self.stage, shaft=number)
        return number

    def results(self, solved: SetSolution, torque: int) -> dict[int, Attributes]:
        """Return what was solved under a torque, by component."""
        return {
            self.stage: stage_results(solved, torque),
            **{mesh: mesh_attributes(solved, torque, number) for number, mesh in enumerate(self.meshes)},
            **{gear: gear_forces(solved, torque, number, self.turn) for number, gear in enumerate(self.gears)},
        }
