"""A planetary set and what was found of it as a REXS 2.0 file: the axis of the set along x, its x and y along y and z.

Members stand on shafts of the width of their faces, on bearings of the stiffness that the set file says. Mesh, sweep of
angles and tolerances of the set file are left out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path

from pmor.core.errors import CaseError
from pmor.gear.pair import GearPair
from pmor.pair.model import gear_pair
from pmor.rexs.document import Attributes, Document, Value
from pmor.rexs.set_results import mesh_attributes, shaft_force, stage_results
from pmor.rexs.sets import DIGITS, STAGE
from pmor.rexs.springs import springs
from pmor.rexs.write import ACROSS, ALONG, add_gear, stage_attributes
from pmor.sets.left_out import why_no_rexs
from pmor.sets.loader import SetFile
from pmor.sets.solution import SetSolution
from pmor.storage.atomic import atomic_path

# Number of the ring among the bodies: the sun is before it, planets are behind.
RING = 1


def write_set_rexs(file: SetFile, solved: SetSolution | None, path: Path, overwrite: bool) -> None:
    """Write a planetary set, with what was found of it; OutputError where it cannot be.

    Raises
    ------
    CaseError
        When REXS has no words for it: `why_no_rexs`.
    """
    if reason := why_no_rexs(file):
        raise CaseError(f"{file.name}: {reason}")
    text = set_rexs(file, solved, datetime.now().astimezone().isoformat(timespec="seconds"))
    with atomic_path(path, overwrite) as temporary:
        temporary.write_bytes(text)


def set_rexs(file: SetFile, solved: SetSolution | None, date: str) -> bytes:
    """Return the text of the file; `date` is ISO 8601."""
    return _Draft(file).text(solved, date)


@dataclass
class _Draft:
    """A file in the making: numbers of its components by bodies and meshes."""

    file: SetFile
    document: Document = field(default_factory=Document)
    unit: int = 0
    stage: int = 0
    casing: int = 0
    plates: dict[float, int] = field(default_factory=dict)
    shafts: dict[str, int] = field(default_factory=dict)
    gears: list[int] = field(default_factory=list)
    meshes: list[int] = field(default_factory=list)

    def text(self, solved: SetSolution | None, date: str) -> bytes:
        said, plan = self.file.sections, self.file.plan
        assert said.load is not None
        add, relate = self.document.add, self.document.relate
        self.unit = add("gear_unit", said.title, model_name=self.file.name)
        self.casing = add("gear_casing", "Housing")
        first: Attributes = {"custom_pmor_first_planet": self.first_deg} if self.first_deg else {}
        self.stage = add(STAGE, said.title, **first)
        carrier = add("planet_carrier", "Carrier")
        for part in (self.casing, self.stage):
            relate("assembly", assembly=self.unit, part=part)
        relate("assembly", assembly=self.stage, part=carrier)
        for side, place in zip(("-z", "+z"), self.cheeks_mm, strict=True):
            self.plates[place] = add("side_plate", f"Cheek at {side}", **_at(place, 0.0, 0.0))
            relate("assembly", assembly=carrier, part=self.plates[place])
        cases = list(self.file.cases.values())
        pairs = [gear_pair(case) for case in cases]
        self.members(pairs)
        relate("assembly", assembly=carrier, part=self.shafts["carrier"])
        relate("planet_carrier_shaft", planetary_stage=self.stage, shaft=self.shafts["carrier"])
        for shaft in ("sun", "ring"):
            relate("central_shaft", planetary_stage=self.stage, shaft=self.shafts[shaft])
        for number, mesh in enumerate(plan.meshes):
            pair = pairs[list(self.file.cases).index(mesh.case)]
            name = f"{plan.bodies[mesh.pinion].name} - {plan.bodies[mesh.wheel].name}"
            self.meshes.append(add("cylindrical_stage", name, **stage_attributes(pair)))
            relate("assembly", assembly=self.stage, part=self.meshes[number])
            relate("stage", stage=self.meshes[number], gear_1=self.gears[mesh.pinion], gear_2=self.gears[mesh.wheel])
        joint = add("coupling", "Held", **_at(0.0, 0.0, 0.0), **springs("free", "free", "free"))
        relate("side", assembly=joint, inner_part=self.shafts[said.load.held], outer_part=self.casing)
        self.loads(solved)
        return self.document.text(date)

    @property
    def first_deg(self) -> float:
        """Place of the first planet that is there, counter-clockwise from the y axis."""
        body = self.file.plan.bodies[self.file.plan.planets[0]]
        return round(math.degrees(math.atan2(-body.x, body.y)), DIGITS) + 0.0

    @property
    def cheeks_mm(self) -> tuple[float, float]:
        """Where the pins end, along the axis."""
        pins, width = self.file.sections.pins, max(self.widths)
        return (-0.5 * width, 0.5 * width) if pins is None else pins.ends_mm

    @property
    def widths(self) -> list[float]:
        """Face widths of sun, planets and ring."""
        return [gear.face_width_mm or case.pair.face_width_mm for case in self.file.cases.values()
                for gear in (case.pair.pinion, case.pair.wheel)]  # fmt: skip

    def members(self, pairs: list[GearPair]) -> None:
        """Add sun, ring, planets and the carrier's shaft, in the order of the bodies of the set."""
        (inner, outer), plan = self.file.cases.values(), self.file.plan
        assert self.file.sections.load is not None
        load = self.file.sections.load
        radial = self.file.sections.supports.sun_radial_N_per_mm
        bore = 2.0 * (inner.pair.pinion.bore_radius_mm or 1.0)
        speed: Attributes = {"rotational_speed": load.speed_rpm} if load.speed_rpm else {}
        for number, body in enumerate(plan.bodies):
            case, pair, gear = (outer, pairs[1], 1) if number == RING else (inner, pairs[0], int(number > RING))
            more = {**(speed if body.name == load.on else {}), **self.pin_error(number)}
            self.shaft(body.name, *pair.faces[gear], (body.x, body.y), (bore, 0.0), more)
            back = (outer.pinion_modification, pairs[1]) if number > RING else None
            made, _ = add_gear(
                self.document, case, pair, gear, body.name, 0.0, image=number == RING,
                back=back, support_vector=[0.0, body.x, body.y], u_axis_vector=ALONG,
                w_axis_vector=ACROSS,
            )  # fmt: skip
            self.gears.append(made)
            self.document.relate("assembly", assembly=self.shafts[body.name], part=made)
            if number > RING:
                self.document.relate("planet_shaft", planetary_stage=self.stage, shaft=self.shafts[body.name])
                self.pin(body.name, (body.x, body.y))
        if radial != "free":
            joint = self.bearing("Sun", _at(0.0, 0.0, 0.0), radial, "rigid")
            self.document.relate("side", assembly=joint, inner_part=self.shafts["sun"], outer_part=self.casing)
        self.shaft("carrier", *self.cheeks_mm, (0.0, 0.0), (bore, 0.0), speed if load.on == "carrier" else {})

    def pin_error(self, body: int) -> Attributes:
        """By how much the pin of a planet is off its place, outwards and counter-clockwise."""
        planets, number = self.file.sections.planets, self.file.plan.bodies[body].name.removeprefix("planet ")
        if body <= RING or not (planets.radial_um or planets.tangential_um):
            return {}
        place, none = int(number) - 1, (0.0,) * planets.count
        return {"custom_pmor_pin_error": [(one or none)[place] for one in (planets.radial_um, planets.tangential_um)]}

    def shaft(
        self, name: str, low: float, high: float, at: tuple[float, float], diameters: tuple[float, float],
        more: Attributes | None = None,
    ) -> int:  # fmt: skip
        """Add a shaft from z to z, of an outer and an inner diameter."""
        start, (outer, inner) = {**_at(low, *at), **(more or {})}, diameters
        number = self.shafts[name] = self.document.add("shaft", f"Shaft of {name}", **start)
        self.document.relate("assembly", assembly=self.unit, part=number)
        section = self.document.add(
            "shaft_section", "", u_coordinate_on_shaft=0.0, length=high - low, outer_diameter_begin=outer,
            outer_diameter_end=outer, inner_diameter_begin=inner, inner_diameter_end=inner,
        )  # fmt: skip
        self.document.relate("assembly", assembly=number, part=section)
        return number

    def bearing(self, name: str, place: Attributes, radial: float | str, tilt: float | str) -> int:
        """Add a bearing by its stiffness."""
        return self.document.add("concept_bearing", name, **place, **springs(radial, "free", tilt))

    def pin(self, planet: str, at: tuple[float, float]) -> None:
        """Add the pin of a planet: that of the file, or one that is rigid, with a bearing of the planet's stiffness."""
        pins, (low, high), middle = self.file.sections.pins, self.cheeks_mm, _at(0.0, *at)
        if pins is None:
            radial = self.file.sections.supports.planet_radial_N_per_mm
            if radial != "rigid":
                number = self.pin_shaft(planet, low, high, at, (high - low, 0.0))
                seat = self.bearing(f"Seat of {planet}", middle, "rigid", "rigid")
                self.document.relate("side", assembly=seat, inner_part=number, outer_part=self.plates[low])
                self.on_pin(planet, number, middle, radial, "rigid")
            return
        number = self.pin_shaft(planet, low, high, at, (pins.diameter_mm, pins.inner_mm))
        material = self.document.add(
            "material", "", elastic_modulus=1e3 * pins.youngs_modulus_GPa, poisson_ratio=pins.poisson_ratio
        )
        self.document.relate("reference", origin=number, referenced=material)
        for place, plate in self.plates.items():
            tilt = "rigid" if pins.ends == "clamped" else "free"
            seat = self.bearing(f"Seat of {planet}", _at(place, *at), "rigid", tilt)
            self.document.relate("side", assembly=seat, inner_part=number, outer_part=plate)
        for bearing in pins.bearings:
            self.on_pin(planet, number, _at(bearing.at_mm, *at), bearing.radial_N_per_mm, bearing.tilt_Nmm_per_rad)

    def on_pin(self, planet: str, pin: int, place: Attributes, radial: float | str, tilt: float | str) -> None:
        """Add a bearing of a planet on its pin."""
        joint = self.bearing(f"Bearing of {planet}", place, radial, tilt)
        self.document.relate("side", assembly=joint, inner_part=pin, outer_part=self.shafts[planet])

    def pin_shaft(
        self, planet: str, low: float, high: float, at: tuple[float, float], diameters: tuple[float, float]
    ) -> int:
        """Add the shaft of a pin."""
        number = self.shaft(f"pin of {planet}", low, high, at, diameters)
        self.document.relate("planet_pin", planetary_stage=self.stage, shaft=number)
        return number

    def loads(self, solved: SetSolution | None) -> None:
        """Add the torque, and a load case for each one that is solved."""
        load = self.file.sections.load
        assert load is not None
        number = self.document.add(
            "external_load", "Torque", u_coordinate_on_shaft=0.0, transmits_torque=True, defines_torque=True
        )
        self.document.relate("assembly", assembly=self.shafts[load.on], part=number)
        sign = -1.0 if load.torque_Nm < 0.0 else 1.0
        for place, torque in enumerate(self.file.torques_Nm):
            case: dict[int, Attributes] = {number: {"torque_around_u_axis": sign * torque}}
            if solved is not None and solved.converged[place].any():
                case[self.stage] = stage_results(solved, place)
                case |= {mesh: mesh_attributes(solved, place, n) for n, mesh in enumerate(self.meshes)}
                case |= {gear: shaft_force(solved, place, n) for n, gear in enumerate(self.gears)}
            self.document.cases.append(case)


def _at(z: float, x: float, y: float) -> dict[str, Value]:
    """Return a place of the set in the file, and its axes."""
    return {"support_vector": [z, x, y], "u_axis_vector": ALONG, "w_axis_vector": ACROSS}
