"""A planetary stage of a REXS file as a set file: members, planets, load, what they stand on; a note on all the rest.

The set is seen with the torque turning its sun counter-clockwise. Sun and planets stand on their shafts and pins as
Timoshenko beams (`pmor.body.beam`) on bearings by their stiffness; the carrier and the shaft of the ring are rigid.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from pmor.body.beam import NODE, Beam, CircularSection, ShaftMaterial, stations_of
from pmor.case.change import document_text
from pmor.case.document import COAST, MODIFICATION
from pmor.core.arrays import FloatArray
from pmor.core.errors import CaseError, printable
from pmor.export.rexs.model import BEARINGS, RIGID, RIGID_TILT, Component, Gearbox, read_rexs
from pmor.export.rexs.read import Imported, stage_case
from pmor.export.rexs.stage import RING, axis_of, find_stage, stages

STAGE = "planetary_stage"
COUPLINGS = ("coupling", "switchable_coupling")
SHARED = ("module_mm", "pressure_angle_deg", "face_width_mm")
# Of the back flank of a planet whose front is modified: without keys it would be like that.
PLAIN = {"profile_crowning_um": 0.0}
# Keys of flanks and gears that differ from end to end: the two meshes of a planet are seen from opposite ends.
ONE_WAY = ("face_offset_mm", "helix_slope_um", "twist_um", "topography", "end_relief_um")
# Of the angles of planets that are equally spaced, deg; in a plane, deflection and slope of a beam's node.
EVENLY, PLANE = 1e-6, (1, 5)
DIGITS = 9


@dataclass(frozen=True)
class ReadSet:
    """A planetary stage as a REXS file has it.

    Parameters
    ----------
    text : str
        Of a set file.
    notes : tuple of str
        Assumptions, and what is not read.
    changed : tuple of str
        What was changed, as the gears would not run as filed.
    """

    text: str
    notes: tuple[str, ...]
    changed: tuple[str, ...]


class Seat(NamedTuple):
    """What holds a shaft: its place along it, mm, and stiffness across and against tilting, N/mm and N mm/rad."""

    place: float
    radial: float
    tilt: float


def has_planets(path: Path) -> bool:
    """Return whether a REXS file has a planetary stage."""
    return bool(read_rexs(path).of_kind(STAGE))


def read_set(path: Path) -> ReadSet:
    """Read the planetary stage of a REXS file.

    Raises
    ------
    FileFormatError
        When it is no REXS file.
    CaseError, GeometryError
        When it has no such stage, or does not say enough of it, with what is missing.
    """
    return _Draft(read_rexs(path), path).read()


def flexibility(beam: Beam, seats: Sequence[Seat], places: Sequence[float]) -> FloatArray | None:
    """Return the deflections of a shaft under unit forces across it, mm/N; None where nothing holds it.

    Parameters
    ----------
    places : sequence of float, length n
        Along the shaft, mm: where forces act, and deflections are read; the result is (n, n).
    """
    rows = (NODE * np.arange(len(beam.stations))[:, None] + PLANE).ravel()
    stiffness, held = beam.stiffness()[np.ix_(rows, rows)], list[int]()
    if sum((seat.radial > 0.0) + (seat.tilt > 0.0) for seat in seats) < 2:
        return None
    for seat in seats:
        for way, (value, rigid) in enumerate(((seat.radial, RIGID), (seat.tilt, RIGID_TILT))):
            row = 2 * beam.node_at(seat.place) + way
            if value >= rigid:
                held.append(row)
            else:
                stiffness[row, row] += value
    moves, found = np.setdiff1d(np.arange(len(rows)), held), np.zeros(stiffness.shape)
    found[np.ix_(moves, moves)] = np.linalg.inv(stiffness[np.ix_(moves, moves)])
    nodes = [2 * beam.node_at(place) for place in places]
    return found[np.ix_(nodes, nodes)]


class _Draft:
    """Sections of a set file as found, and notes on missing data."""

    def __init__(self, gearbox: Gearbox, path: Path) -> None:
        self.gearbox, self.path = gearbox, path
        self.notes, self.changed = list[str](), list[str]()
        found = gearbox.of_kind(STAGE)
        if len(found) != 1:
            count = f"has {len(found)} planetary stages" if found else "has no planetary stage"
            raise CaseError(f"{path}: {count}: pmor set takes a file with one; pmor gearbox those without")
        self.stage = found[0]
        meshes = {part.number for part in gearbox.beside(self.stage.number, "cylindrical_stage", "assembly")}
        listed = {number: gears for number, gears in stages(gearbox).items() if number in meshes}
        rings = {n: sorted(gears, key=lambda gear: gear.kind == RING) for n, gears in listed.items()
                 if RING in (gears[0].kind, gears[1].kind)}  # fmt: skip
        self.outer = {planet.number: number for number, (planet, _) in rings.items()}
        self.inner = {
            gear.number: number for number, gears in listed.items() if number not in rings for gear in gears
            if gear.number in self.outer
        }  # fmt: skip
        others = {gear.number: gear for n in self.inner.values() for gear in listed[n] if gear.number not in self.outer}
        self.rings = {ring.number: ring for _, ring in rings.values()}
        if (len(others), len(self.rings)) != (1, 1) or sorted(self.inner) != sorted(self.outer):
            raise self.refuse(self.stage, "is solved where each planet meshes with one sun and one ring, the same ones")
        (self.sun,), (self.ring,) = others.values(), self.rings.values()
        self.planets = [gearbox.components[number] for number in self.outer]

    def refuse(self, component: Component, rule: str) -> CaseError:
        return CaseError(f"{self.path}: {component.label}: {rule}")

    def read(self) -> ReadSet:
        load, sense, sweep = self.load()
        angles = {planet.number: self.angle(planet, sense) for planet in self.planets}
        self.planets.sort(key=lambda planet: angles[planet.number])
        first = self.planets[0]
        inner = self.mesh(self.inner[first.number], sense, self.sun)
        outer = self.mesh(self.outer[first.number], -sense, first)
        self.refuse_unequal(inner, outer, sense)
        said = tomllib.loads(inner.case.text), tomllib.loads(outer.case.text)
        document: dict[str, Any] = {
            "title": printable(self.stage.name or self.path.stem), "load": load, **self.gears(*said),
            "planets": self.places([angles[planet.number] for planet in self.planets]), "supports": self.supports(),
        }  # fmt: skip
        document |= {"sweep": sweep} if sweep else {}
        for found in (inner, outer):
            self.changed += found.changed
            self.notes += [note for note in found.notes if note not in found.changed]
        self.notes.append("carrier and ring's shaft: rigid; tilt and twist of shafts and pins are left out")
        return ReadSet(document_text(document), tuple(dict.fromkeys(self.notes)), tuple(self.changed))

    def mesh(self, number: int, sense: int, pinion: Component) -> Imported:
        """Return the case of a mesh, whose pinion is loaded in a sense about its axis."""
        found = find_stage(self.gearbox, number, str(self.path))
        if found.pinion.number != pinion.number:
            found = replace(found, pinion=found.wheel, wheel=found.pinion)
        datum = 1 if pinion.text_of("datum_face_orientation") == "positive" else -1
        loaded = "left" if sense * datum > 0 else "right"
        found = replace(found, torques_Nm=(1.0,), loaded=loaded, loaded_known=True, notes=())
        return stage_case(self.path, self.gearbox, found, f"{self.path}, stage {number}")

    def refuse_unequal(self, inner: Imported, outer: Imported, sense: int) -> None:
        """Refuse planets that differ: one is solved for all of them."""
        for planet in self.planets[1:]:
            sun, ring = self.inner[planet.number], self.outer[planet.number]
            others = self.mesh(sun, sense, self.sun), self.mesh(ring, -sense, planet)
            for one, other in zip((inner, outer), others, strict=True):
                alike = [tomllib.loads(found.case.text) | {"title": ""} for found in (one, other)]
                if alike[0] != alike[1]:
                    raise self.refuse(planet, f"differs from {self.planets[0].label}: only equal planets are solved")

    def gears(self, inner: dict[str, Any], outer: dict[str, Any]) -> dict[str, Any]:
        """Return the sections of the pair and of the members."""
        pair = inner["pair"]
        for key in SHARED:
            if pair[key] != outer["pair"][key]:
                raise self.refuse(
                    self.stage, f"{key} is {pair[key]:g} and {outer['pair'][key]:g} of its meshes: no set"
                )
        for side in ("pinion", "wheel"):
            for keys in (inner[side], outer[side]):
                odd = [key for key in ONE_WAY if key in keys or key in keys.get(MODIFICATION, {})]
                if odd:
                    raise self.refuse(
                        self.stage, f"{odd[0]}: gears that differ from end to end are not read: write a set file"
                    )
        distance = pair.get("centre_distance_mm", outer["pair"].get("centre_distance_mm"))
        planet, ring = inner["wheel"], outer["wheel"]
        # The ring meshes with the other flanks of the planet, its own coast flanks as they are drawn.
        flanks = {
            f"sun.{MODIFICATION}": inner["pinion"].pop(MODIFICATION, {}),
            f"planet.{MODIFICATION}": planet.pop(MODIFICATION, {}),
            f"planet.{COAST}": PLAIN | outer["pinion"].pop(MODIFICATION, {}),
            f"ring.{COAST}": ring.pop(MODIFICATION, {}),
        }
        if flanks[f"planet.{MODIFICATION}"] == {} and flanks[f"planet.{COAST}"] == PLAIN:
            del flanks[f"planet.{COAST}"]
        sections = {"pair": pair | ({} if distance is None else {"centre_distance_mm": distance}),
                    "sun": inner["pinion"], "planet": planet, "ring": ring}  # fmt: skip
        return sections | {name: keys for name, keys in flanks.items() if keys}

    def load(self) -> tuple[dict[str, Any], int, dict[str, Any]]:
        """Return the sections of the load and the sweep, and the sense in which the sun is loaded about its axis."""
        shafts = self.member_shafts()
        cases = self.gearbox.load_cases or ({},)
        found: dict[str, list[float]] = {}
        for load in self.gearbox.of_kind("external_load"):
            on = {shaft.number for shaft in self.gearbox.beside(load.number, "shaft", "assembly")}
            for member, own in shafts.items():
                if on & {shaft.number for shaft in own} and load.text_of("defines_torque") != "false":
                    said = [one.get(load.number, load).number_of("torque_around_u_axis") for one in cases]
                    torques = [torque or load.number_of("torque_around_u_axis") or 0.0 for torque in said]
                    found |= {member: torques} if any(torques) else {}
        if len(found) != 1:
            names = " and ".join(found) or "no member"
            raise self.refuse(self.stage, f"a torque enters at {names}: one of sun, ring and carrier must have it")
        ((member, torques),) = found.items()
        if min(torques) * max(torques) < 0.0:
            raise self.refuse(self.stage, f"load cases turn the {member} both ways: keep those of one sense")
        held = [name for name in shafts if name != member and self.is_held(shafts[name])]
        if len(held) != 1:
            raise self.refuse(self.stage, f"{' and '.join(held) or 'no member'} held by the casing: it must be one")
        sense = (-1 if member == "carrier" else 1) * (1 if sum(torques) > 0.0 else -1)
        most = max(map(abs, torques))
        section: dict[str, Any] = {"torque_Nm": -most if member == "carrier" else most, "on": member, "held": held[0]}
        speed = next((abs(rpm) for shaft in shafts[member] if (rpm := shaft.number_of("rotational_speed"))), None)
        if speed is None:
            self.notes.append(f"no rotational_speed of the {member}: no frequencies")
        others = sorted({abs(torque) for torque in torques if torque} - {most})
        return (
            section | ({} if speed is None else {"speed_rpm": speed}),
            sense,
            {"torques_Nm": others} if others else {},
        )

    def member_shafts(self) -> dict[str, list[Component]]:
        """Shafts of sun, ring and carrier."""
        carrier = [self.gearbox.components[number] for relation in self.gearbox.relations
                   if relation.kind == "planet_carrier_shaft" and relation.role(STAGE) == self.stage.number
                   and (number := relation.role("shaft") or 0) in self.gearbox.components]  # fmt: skip
        found = {"sun": self.shafts(self.sun), "ring": self.shafts(self.ring), "carrier": carrier}
        for component, name in ((self.sun, "sun"), (self.ring, "ring")):
            if not found[name]:
                raise self.refuse(component, "is on no shaft")
        return found

    def shafts(self, gear: Component) -> list[Component]:
        return self.gearbox.beside(gear.number, "shaft", "assembly")

    def is_held(self, shafts: Sequence[Component]) -> bool:
        """Whether a coupling fixes a member to the casing."""
        casings = {casing.number for casing in self.gearbox.of_kind("gear_casing")}
        return any(joint.kind in COUPLINGS and other in casings
                   for shaft in shafts for joint, other in self.joints(shaft))  # fmt: skip

    def joints(self, shaft: Component) -> list[tuple[Component, int]]:
        """Bearings and engaged couplings of a shaft, and what is on their other side."""
        found = []
        for relation in self.gearbox.relations:
            sides = [relation.role("inner_part"), relation.role("outer_part")]
            joint = self.gearbox.components.get(relation.role("assembly") or 0)
            if relation.kind == "side" and shaft.number in sides and joint and joint.kind in (*BEARINGS, *COUPLINGS):
                engaged, _ = joint.values.get("is_engaged", ("", ""))
                if "false" not in engaged:  # type: ignore[operator]
                    sides.remove(shaft.number)
                    found.append((joint, sides[0] or 0))
        return found

    def angle(self, planet: Component, sense: int) -> float:
        """Angle of a planet from the first one of the file, in the sense in which the sun is loaded, deg."""
        places = [np.array(gear.numbers_of("support_vector")) for gear in (self.sun, planet)]
        if any(len(place) != 3 for place in places):
            raise self.refuse(planet, "support_vector is missing: the file must say where the planets are")
        axis, offset = np.array(axis_of(self.sun)), places[1] - places[0]
        first = self.planets[0].numbers_of("support_vector") - places[0]
        first -= axis * (first @ axis)
        angle = sense * math.atan2(offset @ np.cross(axis, first), offset @ first)
        return round(math.degrees(angle) % 360.0, DIGITS) % 360.0

    def places(self, angles: Sequence[float]) -> dict[str, Any]:
        """Return the section of the planets; the first one of the file is drawn at the top."""
        steps = np.diff([*angles, angles[0] + 360.0])
        if np.abs(steps - 360.0 / len(angles)).max() < EVENLY:
            return {"count": len(angles)}
        return {"count": len(angles), "positions_deg": [round(angle, DIGITS) for angle in angles]}

    def supports(self) -> dict[str, Any]:
        """Return what sun and planets stand on, by stiffness across the axis."""
        sun = self.on_shaft(self.sun, self.shafts(self.sun)[0])
        return {"sun_radial_N_per_mm": sun, "planet_radial_N_per_mm": self.on_pin(self.planets[0])}

    def on_shaft(self, gear: Component, shaft: Component) -> float | str:
        """Stiffness of a gear's place on its shaft."""
        place, seats = self.along(gear, shaft), self.seats(shaft, [joint for joint, _ in self.joints(shaft)])
        beam = self.beam(shaft, [place, *(seat.place for seat in seats)])
        found = flexibility(beam, seats, [place])
        if found is None:
            self.notes.append(f"{shaft.label}: fewer than two bearings: the sun floats")
            return "free"
        self.notes.append(f"{gear.label}: on {shaft.label} and its bearings: {1.0 / found[0, 0]:.4g} N/mm across")
        return _stiffness(found[0, 0])

    def on_pin(self, planet: Component) -> float | str:
        """Stiffness of a planet on its bearings and its pin, which the carrier clamps or supports."""
        shaft = next(iter(self.shafts(planet)), None)
        pins = {one.role("shaft") for one in self.gearbox.relations if one.kind == "planet_pin"}
        joints = [(joint, other) for joint, other in (self.joints(shaft) if shaft else []) if other in pins]
        if not joints:
            self.notes.append(f"{planet.label}: bearings on no pin: rigid on its place in the carrier")
            return "rigid"
        bearings = [joint for joint, _ in joints]
        pin = self.gearbox.components[joints[0][1]]
        ends = [joint for joint, _ in self.joints(pin) if joint not in bearings]
        seats, on = self.seats(pin, ends), self.seats(pin, bearings)
        beam = self.beam(pin, [seat.place for seat in (*seats, *on)])
        found = flexibility(beam, seats, [seat.place for seat in on])
        if found is None:
            self.notes.append(f"{pin.label}: nothing holds it: the pin is rigid in the carrier")
            found = np.zeros((len(on), len(on)))
        springs = found + np.diag([1.0 / seat.radial if 0.0 < seat.radial < RIGID else 0.0 for seat in on])
        if springs.max() < 1.0 / RIGID:
            return "rigid"
        arms = np.array([seat.place for seat in on]) - self.along(planet, pin)
        rigid = np.stack([np.ones(len(on)), arms], axis=1)[:, : min(2, len(on))]
        yields = float(np.linalg.inv(rigid.T @ np.linalg.inv(springs) @ rigid)[0, 0])
        self.notes.append(f"{planet.label}: on {pin.label} and its bearings: {1.0 / yields:.4g} N/mm across")
        return _stiffness(yields)

    def seats(self, shaft: Component, joints: Sequence[Component]) -> list[Seat]:
        found = []
        for joint in joints:
            radial, tilt = joint.number_of("radial_stiffness"), joint.number_of("bending_stiffness")
            if radial is None and joint.text_of("radial_force_absorption") != "false":
                self.notes.append(f"{joint.label}: no radial_stiffness: radially rigid")
                radial = RIGID
            found.append(Seat(self.along(joint, shaft), radial or 0.0, tilt or 0.0))
        return found

    def along(self, part: Component, shaft: Component) -> float:
        """Place of a part on a shaft, mm."""
        foot, place = shaft.numbers_of("support_vector"), part.numbers_of("support_vector")
        if len(foot) != 3 or len(place) != 3:
            raise self.refuse(part, f"support_vector of it or of {shaft.label} is missing: where does it stand?")
        return round(float(np.dot(np.subtract(place, foot), axis_of(shaft))), DIGITS)

    def beam(self, shaft: Component, places: Sequence[float]) -> Beam:
        """Return a shaft as a beam with stations at places along it; its diameters are means over its sections."""
        borders, sections = [0.0], list[CircularSection]()
        parts = self.gearbox.beside(shaft.number, "shaft_section", "assembly")
        for part in sorted(parts, key=lambda part: part.number_of("u_coordinate_on_shaft") or 0.0):
            ends = [[part.number_of(f"{side}_diameter_{end}") or 0.0 for end in ("begin", "end")]
                    for side in ("outer", "inner")]  # fmt: skip
            borders.append(borders[-1] + (part.number_of("length") or 0.0))
            sections.append(CircularSection(*(0.5 * sum(end) for end in ends)))
        if not sections or min(section.outer - section.inner for section in sections) <= 0.0:
            raise self.refuse(shaft, "has no sections with diameters: the file must say them")
        if min(places) < borders[0] or max(places) > borders[-1]:
            raise self.refuse(shaft, f"is {borders[-1]:g} mm long, and parts stand beyond its ends")
        stations = stations_of(np.array(borders), places)
        at = np.searchsorted(borders, 0.5 * (stations[1:] + stations[:-1])) - 1
        return Beam(stations, [sections[number] for number in at], self.material(shaft))

    def material(self, shaft: Component) -> ShaftMaterial:
        for material in self.gearbox.beside(shaft.number, "material"):
            modulus, ratio = material.number_of("elastic_modulus"), material.number_of("poisson_ratio")
            if modulus and ratio is not None:
                return ShaftMaterial(modulus, ratio)
        self.notes.append(f"{shaft.label}: refers to no elastic constants: steel assumed, 210 GPa and 0.3")
        return ShaftMaterial(210e3, 0.3)


def _stiffness(flexibility_mm_N: float) -> float | str:
    return "rigid" if flexibility_mm_N < 1.0 / RIGID else float(f"{1.0 / flexibility_mm_N:.9g}")
