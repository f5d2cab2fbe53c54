"""A planetary stage of a REXS file as a set file: members, planets, load, what they stand on; a note on all the rest.

The set is seen with the torque turning its sun counter-clockwise. What sun, planets and carrier stand on is read in
`pmor.rexs.set_supports`; the shaft of the ring is rigid.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from pmor.case.capability import ONE_WAY
from pmor.case.change import document_text
from pmor.case.document import COAST, MODIFICATION
from pmor.case.reader import sections_in
from pmor.core.errors import printable
from pmor.gear.modification import UNEVEN
from pmor.rexs.drive import drives, shaft_speeds
from pmor.rexs.joints import COUPLINGS, RING, axis_of, shafts_of, stages, turning_together
from pmor.rexs.model import Component, Gearbox
from pmor.rexs.read import Imported, stage_case
from pmor.rexs.set_supports import RexsSupports, on_casing
from pmor.rexs.shafts import on_shaft
from pmor.rexs.stage import find_stage
from pmor.sets.kinematics import torque_ratios
from pmor.sets.layout import PAIR, SECOND_PAIR, SECOND_PLANET
from pmor.sets.reader import SetReader
from pmor.sets.settings import Member, SetSections

STAGE = "planetary_stage"
SHARED = ("module_mm", "pressure_angle_deg", "face_width_mm")
# Of the back flank of a planet whose front is modified: without keys it would be like that.
PLAIN = {"profile_crowning_um": 0.0}
# Of the angles of planets that are equally spaced, deg.
EVENLY = 1e-6
# Of places of planets that a file rounds: from angles where teeth fit, deg; of sizes that follow from them, relative.
ROUNDED_DEG, ROUNDED = 1e-3, 1e-4
DIGITS = 9


@dataclass(frozen=True)
class ReadSet:
    """A planetary stage as a REXS file has it.

    Parameters
    ----------
    sections : SetSections
    text : str
        Of a set file that says the same.
    notes : tuple of str
        Assumptions, and what is not read.
    changed : tuple of str
        What was changed, as the gears would not run as filed.
    """

    sections: SetSections
    text: str
    notes: tuple[str, ...]
    changed: tuple[str, ...]


class PlanetaryStage:
    """A planetary stage of a REXS file: its sun, ring and planets, and notes on missing data.

    Raises
    ------
    CaseError
        When its gears are none of a planetary set.
    """

    def __init__(self, gearbox: Gearbox, path: Path, stage: Component) -> None:
        self.gearbox, self.path, self.stage = gearbox, path, stage
        self.notes, self.changed = list[str](), list[str]()
        meshes = {part.number for part in gearbox.beside(self.stage.number, "cylindrical_stage", "assembly")}
        listed = {number: gears for number, gears in stages(gearbox).items() if number in meshes}
        rings = {n: sorted(gears, key=lambda gear: gear.kind == RING) for n, gears in listed.items()
                 if RING in (gears[0].kind, gears[1].kind)}  # fmt: skip
        # By gears of planets those that mesh with the ring: of stepped ones others than those that do with the sun.
        mates = {gear: planet for planet, _ in rings.values() for gear in self.on_shaft_of(planet)}
        self.inner = {
            gear.number: number for number, gears in listed.items() if number not in rings for gear in gears
            if gear.number in mates
        }  # fmt: skip
        others = {gear.number: gear for n in self.inner.values() for gear in listed[n] if gear.number not in mates}
        self.rings = {ring.number: ring for _, ring in rings.values()}
        to_ring = {planet.number: number for number, (planet, _) in rings.items()}
        alike = sorted(mates[number].number for number in self.inner) == sorted(to_ring)
        if (len(others), len(self.rings)) != (1, 1) or not alike:
            raise self.stage.refusal("is solved where each planet meshes with one sun and one ring, the same ones")
        (self.sun,), (self.ring,) = others.values(), self.rings.values()
        first = {mates[number].number: number for number in self.inner}
        self.outer = {first[number]: mesh for number, mesh in to_ring.items()}
        self.mates = {number: mates[number] for number in self.inner}
        self.planets = [gearbox.components[number] for number in self.outer]
        self.steps = {number: dict(on_shaft(mate)) for number, mate in self.mates.items() if number != mate.number}

    def on_shaft_of(self, planet: Component) -> list[int]:
        """Numbers of the gears of a planet."""
        beside = [gear.number for shaft in shafts_of(self.gearbox, planet)
                  for gear in self.gearbox.beside(shaft.number, planet.kind, "assembly")]  # fmt: skip
        return list(dict.fromkeys([planet.number, *beside]))

    def read(self, on_sun_Nm: float | None = None) -> ReadSet:
        """Return the stage as a set file.

        Parameters
        ----------
        on_sun_Nm : float, optional
            Torque on the sun about its axis, of a part of a gearbox: its shafts are solved there.
        """
        alone = on_sun_Nm is None
        load, sense, sweep = self.load() if on_sun_Nm is None else self.part_load(on_sun_Nm)
        angles = {planet.number: self.angle(planet, sense) for planet in self.planets}
        self.planets.sort(key=lambda planet: angles[planet.number])
        first = self.planets[0]
        inner = self.mesh(self.inner[first.number], sense, self.sun)
        outer = self.mesh(self.outer[first.number], -sense, self.mates[first.number])
        self.refuse_unequal(inner, outer, sense)
        said = nested(inner.sections), nested(outer.sections)
        helical, force = bool(said[0]["pair"].get("helix_angle_deg")), self.mesh_force(load, *said)
        supports = RexsSupports(self.gearbox, self.path, self.notes, sense, helical, alone, force)
        document: dict[str, Any] = {
            "title": printable(self.stage.name or self.path.stem), "load": load, **self.gears(*said),
            "planets": self.places([angles[planet.number] for planet in self.planets], sense) | self.pin_errors(sense),
            **supports.sections(self.sun, first, self.member_shafts()["carrier"]),
        }  # fmt: skip
        if self.steps:
            self.add_steps(document, sense)
        document |= {"sweep": sweep} if sweep else {}
        for found in (inner, outer):
            self.changed += found.changed
            self.notes += [note for note in found.notes if note not in found.changed]
        if alone:
            self.notes.append("ring's shaft: rigid; tilt and twist of the sun's shaft are left out")
        reader = SetReader(f"{self.path}: {self.stage.label}", sections_in(SetSections), self.path.parent)
        sections = reader.section(nested(document), SetSections)
        return ReadSet(sections, document_text(document), tuple(dict.fromkeys(self.notes)), tuple(self.changed))

    def add_steps(self, document: dict[str, Any], sense: int) -> None:
        """Add to the sections where second gears are, by how much they are ahead, and what twists before them."""
        first, steps = self.planets[0], [self.steps[planet.number] for planet in self.planets]
        places = [np.array(gear.numbers_of("support_vector")) for gear in (first, self.mates[first.number])]
        along = sense * float(np.dot(places[1] - places[0], axis_of(self.sun)))
        document["planets"]["second_z_mm"] = round(along, DIGITS) + 0.0
        if any("timing_mrad" in step for step in steps):
            document["planets"]["timing_mrad"] = [step.get("timing_mrad", 0.0) for step in steps]
        if torsion := steps[0].get("torsion_Nmm_per_rad"):
            document.setdefault("supports", {})["planet_torsion_Nmm_per_rad"] = torsion

    def mesh_force(self, load: dict[str, Any], inner: dict[str, Any], outer: dict[str, Any]) -> float:
        """Return the force of a mesh at the reference circle of the sun, N, where planets share the load."""
        through = outer["wheel"]["teeth"] * inner["wheel"]["teeth"] / outer["pinion"]["teeth"]
        ratios = torque_ratios((inner["pinion"]["teeth"], through))
        on_sun = 1e3 * abs(load["torque_Nm"] * ratios["sun"] / ratios[load["on"]])
        helix = math.radians(inner["pair"].get("helix_angle_deg", 0.0))
        radius = 0.5 * inner["pair"]["module_mm"] * inner["pinion"]["teeth"] / math.cos(helix)
        return on_sun / (radius * len(self.planets))

    def mesh(self, number: int, sense: int, pinion: Component) -> Imported:
        """Return the case of a mesh, whose pinion is loaded in a sense about its axis."""
        found = find_stage(self.gearbox, number, str(self.path))
        if found.pinion.number != pinion.number:
            found = replace(found, pinion=found.wheel, wheel=found.pinion)
        datum = 1 if pinion.text_of("datum_face_orientation") == "positive" else -1
        loaded = "left" if sense * datum > 0 else "right"
        found = replace(found, torques_Nm=(1.0,), loaded=loaded, loaded_known=True, notes=())
        return stage_case(self.path, self.gearbox, found, f"{self.path}, stage {number}", both_flanks=False)

    def refuse_unequal(self, inner: Imported, outer: Imported, sense: int) -> None:
        """Refuse planets that differ: one is solved for all of them."""
        for planet in self.planets[1:]:
            sun, ring = self.inner[planet.number], self.outer[planet.number]
            others = self.mesh(sun, sense, self.sun), self.mesh(ring, -sense, self.mates[planet.number])
            for one, other in zip((inner, outer), others, strict=True):
                alike = [stage.sections | {"title": ""} for stage in (one, other)]
                if not _alike(*alike):
                    raise planet.refusal(f"differs from {self.planets[0].label}: only equal planets are solved")

    def gears(self, inner: dict[str, Any], outer: dict[str, Any]) -> dict[str, Any]:
        """Return the sections of the pair and of the members."""
        pair = inner["pair"]
        for key in SHARED:
            if pair[key] != outer["pair"][key] and not self.steps:
                raise self.stage.refusal(f"{key} is {pair[key]:g} and {outer['pair'][key]:g} of its meshes: no set"
                )
        for side in ("pinion", "wheel"):
            for keys in (inner[side], outer[side]):
                odd = [key for key in ONE_WAY if key in keys or key in keys.get(MODIFICATION, {})]
                if odd:
                    rule = f"{odd[0]}: gears that differ from end to end are not read: write a set file"
                    raise self.stage.refusal(rule)
        distance = pair.get("centre_distance_mm", outer["pair"].get("centre_distance_mm"))
        planet, ring = inner["wheel"], outer["wheel"]
        if self.steps:
            shared = pair | ({} if distance is None else {"centre_distance_mm": distance})
            second = {key: value for key, value in outer["pair"].items() if key != "centre_distance_mm"}
            flanks = {
                f"sun.{MODIFICATION}": inner["pinion"].pop(MODIFICATION, {}),
                f"planet.{MODIFICATION}": planet.pop(MODIFICATION, {}),
                f"{SECOND_PLANET}.{MODIFICATION}": _from_the_other_end(outer["pinion"].pop(MODIFICATION, {})),
                f"ring.{COAST}": _from_the_other_end(ring.pop(MODIFICATION, {})),
            }
            sections = {PAIR: shared, SECOND_PAIR: second, "sun": inner["pinion"], "planet": planet,
                        SECOND_PLANET: outer["pinion"], "ring": ring}  # fmt: skip
            return sections | {name: keys for name, keys in flanks.items() if keys}
        # Tips of a planet that the file leaves open clear both of its mates.
        if addenda := [keys["addendum"] for keys in (planet, outer["pinion"]) if "addendum" in keys]:
            planet["addendum"] = min(addenda)
        # The ring meshes with the other flanks of the planet, its own coast flanks as they are drawn.
        flanks = {
            f"sun.{MODIFICATION}": inner["pinion"].pop(MODIFICATION, {}),
            f"planet.{MODIFICATION}": planet.pop(MODIFICATION, {}),
            f"planet.{COAST}": PLAIN | _from_the_other_end(outer["pinion"].pop(MODIFICATION, {})),
            f"ring.{COAST}": _from_the_other_end(ring.pop(MODIFICATION, {})),
        }
        if flanks[f"planet.{MODIFICATION}"] == {} and flanks[f"planet.{COAST}"] == PLAIN:
            del flanks[f"planet.{COAST}"]
        sections = {"pair": pair | ({} if distance is None else {"centre_distance_mm": distance}),
                    "sun": inner["pinion"], "planet": planet, "ring": ring}  # fmt: skip
        return sections | {name: keys for name, keys in flanks.items() if keys}

    @property
    def meshes(self) -> set[int]:
        """Numbers of its cylindrical stages."""
        return {*self.inner.values(), *self.outer.values()}

    def part_load(self, on_sun_Nm: float) -> tuple[dict[str, Any], int, dict[str, Any]]:
        """Return what `load` does, of a torque on the sun that the rest of the gearbox makes."""
        section = {"torque_Nm": abs(on_sun_Nm), "on": "sun", "held": self.held()}
        return section, -1 if on_sun_Nm < 0.0 else 1, {}

    def held(self, driven: Member | None = None) -> Member:
        """Return the member that the casing holds, another one than that which has the torque."""
        shafts = self.member_shafts()
        held = [name for name in shafts if name != driven and self.is_held(shafts[name])]
        if len(held) != 1:
            raise self.stage.refusal(f"{' and '.join(held) or 'no member'} held by the casing: it must be one")
        return held[0]

    def load(self) -> tuple[dict[str, Any], int, dict[str, Any]]:
        """Return the sections of the load and the sweep, and the sense in which the sun is loaded about its axis."""
        shafts = self.member_shafts()
        cases, train = self.gearbox.load_cases or ({},), turning_together(self.gearbox)
        turning = {member: {train[shaft.number] for shaft in own} for member, own in shafts.items()}
        found: dict[Member, list[float]] = {}
        for number, case in enumerate(cases):
            for one in drives(self.gearbox, case):
                on = next((member for member, own in turning.items() if train[one.shaft.number] in own), None)
                if on is not None and one.torque_Nm:
                    found.setdefault(on, [0.0] * len(cases))[number] += one.torque_Nm
                    self.notes += [one.note] if one.note else []
        if len(found) != 1:
            names = " and ".join(found) or "no member"
            raise self.stage.refusal(f"a torque enters at {names}: one of sun, ring and carrier must have it")
        ((member, torques),) = found.items()
        if min(torques) * max(torques) < 0.0:
            raise self.stage.refusal(f"load cases turn the {member} both ways: keep those of one sense")
        sense = (-1 if member == "carrier" else 1) * (1 if sum(torques) > 0.0 else -1)
        most = max(map(abs, torques))
        section: dict[str, Any] = {"torque_Nm": -most if member == "carrier" else most, "on": member}
        section["held"] = self.held(member)
        speeds = shaft_speeds(self.gearbox, cases[0])
        speed = next((abs(speeds[shaft.number]) for shaft in shafts[member] if speeds.get(shaft.number)), None)
        if speed is None:
            self.notes.append(f"no rotational_speed of the {member}: no frequencies")
        others = sorted({abs(torque) for torque in torques if torque} - {most})
        return (
            section | ({} if speed is None else {"speed_rpm": speed}),
            sense,
            {"torques_Nm": others} if others else {},
        )

    def member_shafts(self) -> dict[Member, list[Component]]:
        """Shafts of sun, ring and carrier."""
        carrier = [self.gearbox.components[number] for relation in self.gearbox.relations
                   if relation.kind == "planet_carrier_shaft" and relation.role(STAGE) == self.stage.number
                   and (number := relation.role("shaft") or 0) in self.gearbox.components]  # fmt: skip
        sun, ring = shafts_of(self.gearbox, self.sun), shafts_of(self.gearbox, self.ring)
        for component, found in ((self.sun, sun), (self.ring, ring)):
            if not found:
                raise component.refusal("is on no shaft")
        return {"sun": sun, "ring": ring, "carrier": carrier}

    def is_held(self, shafts: Sequence[Component]) -> bool:
        """Whether a coupling fixes a member to the casing."""
        return any(joint.kind in COUPLINGS for shaft in shafts for joint in on_casing(self.gearbox, shaft))

    def angle(self, planet: Component, sense: int) -> float:
        """Angle of a planet from the first one of the file, in the sense in which the sun is loaded, deg."""
        places = [np.array(gear.numbers_of("support_vector")) for gear in (self.sun, planet)]
        if any(len(place) != 3 for place in places):
            raise planet.refusal("support_vector is missing: the file must say where the planets are")
        axis, offset = np.array(axis_of(self.sun)), places[1] - places[0]
        first = self.planets[0].numbers_of("support_vector") - places[0]
        first -= axis * (first @ axis)
        angle = math.degrees(sense * math.atan2(offset @ np.cross(axis, first), offset @ first))
        gears = self.sun, self.ring, planet, self.mates[planet.number]
        sun, ring, own, mate = (int(gear.number_of("number_of_teeth") or 0) for gear in gears)
        step = 360.0 * math.gcd(own, mate) / (sun * mate + ring * own)
        fits = step * round(angle / step)
        return round((fits if abs(angle - fits) < ROUNDED_DEG else angle) % 360.0, DIGITS) % 360.0

    def pin_errors(self, sense: int) -> dict[str, Any]:
        """Return by how much pins are off their places, where the file says so by the name of ours."""
        shafts = [shafts_of(self.gearbox, planet)[:1] for planet in self.planets]
        said = [shaft[0].numbers_of("custom_pmor_pin_error") if shaft else [] for shaft in shafts]
        if any(len(error) != 2 for error in said):
            return {}
        radial, around = np.round(1e3 * np.array(said), DIGITS).T
        return {"radial_um": radial.tolist(), "tangential_um": (sense * around + 0.0).tolist()}

    def places(self, angles: Sequence[float], sense: int) -> dict[str, Any]:
        """Return the section of the planets; the first one of the file is drawn at the top but for a name of ours."""
        steps, first = np.diff([*angles, angles[0] + 360.0]), self.stage.number_of("custom_pmor_first_planet") or 0.0
        if not first and np.abs(steps - 360.0 / len(angles)).max() < EVENLY:
            return {"count": len(angles)}
        turned = [round((angle + sense * first) % 360.0, DIGITS) for angle in angles]
        return {"count": len(angles), "positions_deg": turned}


def nested(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return sections by their dotted names as TOML gives them, one inside the other."""
    nested: dict[str, Any] = {}
    for name, content in document.items():
        outer, _, inner = name.partition(".")
        if inner:
            nested[outer][inner] = dict(content)
        else:
            nested[outer] = dict(content) if isinstance(content, Mapping) else content
    return nested


def _from_the_other_end(modification: dict[str, Any]) -> dict[str, Any]:
    """Return the keys of a flank that is seen from the other end of its gear, as the two meshes of a planet see it."""
    return {key: -value if key in UNEVEN else value for key, value in modification.items()}


def _alike(one: Any, other: Any) -> bool:
    """Whether sections of two cases are the same but for what rounded places leave."""
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(_alike(one[key], other[key]) for key in one)
    if isinstance(one, float) and isinstance(other, float):
        return math.isclose(one, other, rel_tol=ROUNDED, abs_tol=ROUNDED)
    return bool(one == other)
