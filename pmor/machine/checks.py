"""What no single key of a gearbox file can know: whether its parts fit together."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import combinations

import numpy as np

from pmor.body.bearing import check_bearing
from pmor.body.bearing_faults import overlap
from pmor.case import Case
from pmor.case.duty import check_duty
from pmor.case.motion import check_bodies, check_motion
from pmor.case.reader import Reader
from pmor.case.values import did_you_mean
from pmor.core.errors import PmorError
from pmor.gear.pair import GearPair
from pmor.machine.groups import ROUNDED_MM, alike_from_both_ends, same_gear
from pmor.machine.load_settings import LoadCase
from pmor.machine.model import GearboxModel, pinion_senses, set_torques
from pmor.machine.set_frame import MEMBERS
from pmor.machine.settings import HOUSING, Bearing, GearboxSections, Mesh, PlanetarySet, Shaft, ShaftSection
from pmor.sets.loader import SetFile

# Of the largest torque through a set over all loads: none.
NO_TORQUE = 1e-9
# Clearances, and the stiffness beyond them.
PLAYS = {"clearance_mm": "radial_N_per_mm", "axial_clearance_mm": "axial_N_per_mm"}
LONGEST_NAME, NO_FILE_NAME = 60, '/\\:*?"<>|'
STIFFNESSES = "radial_N_per_mm", "axial_N_per_mm", "tilt_Nmm_per_rad", "torsion_Nmm_per_rad"


class GearboxReader(Reader):
    """Reads a gearbox file, and refuses parts that do not fit together."""

    def check(self, said: GearboxSections) -> None:
        """Refuse a gearbox whose parts do not fit together."""
        for what in ("shafts", "bearings", "meshes", "sets", "masses", "loads"):
            for name, count in Counter(one.name for one in getattr(said, what)).items():
                if count > 1:
                    self.refuse(f'[[{what}]] name = "{name}"', "is there twice: give one of them another name")
        shafts = {shaft.name: shaft for shaft in said.shafts}
        for shaft in said.shafts:
            self.check_shaft(shaft)
        for where, name, place in _places(said):
            self.check_place(where, name, place, shafts)
        for bearing in said.bearings:
            self.check_bearing(bearing, shafts)
        for bearing, beside in combinations(said.bearings, 2):
            apart = abs(bearing.at_mm - beside.at_mm)
            if bearing.shaft == beside.shaft and overlap(bearing.inner, beside.inner, apart):
                places = f"at_mm = {bearing.at_mm:g} and {beside.at_mm:g}"
                where = f'[[bearings]] "{bearing.name}" and "{beside.name}": {places}'
                self.refuse(where, "their elements overlap along the shaft: move one, or correct their sizes")
        for one, two in combinations(said.shafts, 2):
            self.check_apart(one, two)
        for mesh in said.meshes:
            self.check_name("meshes", mesh.name)
            self.check_facing(mesh, shafts)
        if not said.meshes and not said.sets:
            self.refuse("[[meshes]]", "is missing: add a mesh, or a planetary set in [[sets]]")
        for planetary in said.sets:
            self.check_name("sets", planetary.name)
            self.check_members(planetary, shafts)
        for load in said.loads:
            self.check_balance(load, said)
            self.check_unbalance(load, said)
        check_duty(said.loads, self.refuse)
        check_motion(said.dynamics, self.refuse)
        check_bodies(((f'[[masses]] "{one.name}"', one.inertia) for one in said.masses), self.refuse)

    def check_shaft(self, shaft: Shaft) -> None:
        """Refuse an axis without two coordinates, and sections without material."""
        if len(shaft.at_mm) != 2:
            self.refuse(f'[[shafts]] "{shaft.name}": at_mm', "must be y and z of the axis: write two numbers")
        for number, section in enumerate(shaft.sections, start=1):
            if section.inner_mm >= section.outer_mm:
                place = f'[[shafts]] "{shaft.name}", section {number}: inner_mm = {section.inner_mm:g}'
                self.refuse(place, f"must be below outer_mm = {section.outer_mm:g}: correct one of them")
        if shaft.name == HOUSING:
            self.refuse(f'[[shafts]] name = "{HOUSING}"', "means what bearings stand on: give the shaft another name")

    def check_place(self, where: str, name: str, place: float, shafts: dict[str, Shaft]) -> None:
        """Refuse a place that is on no shaft."""
        if name not in shafts:
            self.refuse(f'{where}: shaft = "{name}"', f"there is no such shaft: {did_you_mean(name, list(shafts))}")
        if not -ROUNDED_MM <= place <= shafts[name].length + ROUNDED_MM:
            rule = f'shaft "{name}" goes from 0 to {shafts[name].length:g} mm: correct it, or lengthen the shaft'
            self.refuse(f"{where}: at_mm = {place:g}", rule)

    def check_bearing(self, bearing: Bearing, shafts: dict[str, Shaft]) -> None:
        """Refuse a bearing that is none, or one to a shaft that is not there."""
        where = f'[[bearings]] "{bearing.name}"'
        check_bearing(bearing, where, STIFFNESSES, self.refuse)
        for key, stiffness in PLAYS.items():
            if not (play := getattr(bearing, key)):
                continue
            if bearing.inner is not None or bearing.catalogue is not None:
                rule = "is of a bearing by its stiffness: write clearance_mm of its inner geometry, or leave it out"
                self.refuse(f"{where}: {key} = {play:g}", rule)
            if isinstance(getattr(bearing, stiffness), str):
                rule = f"needs the stiffness beyond it: give {stiffness} in N/mm, or leave it out"
                self.refuse(f"{where}: {key} = {play:g}", rule)
        if bearing.to == HOUSING and bearing.couples:
            rule = f'couples two shafts: name the other one in to, or write torque_Nm = "balance" for the {HOUSING}'
            self.refuse(f"{where}: torsion_Nmm_per_rad", rule)
        if bearing.to == HOUSING:
            return
        if bearing.to == bearing.shaft:
            rule = f'is the shaft that it carries: write "{HOUSING}" or the shaft in which it stands'
            self.refuse(f'{where}: to = "{bearing.to}"', rule)
        if bearing.to not in shafts:
            valid = did_you_mean(bearing.to, [HOUSING, *shafts])
            self.refuse(f'{where}: to = "{bearing.to}"', f'must be a shaft or "{HOUSING}": {valid}')
        one, other = shafts[bearing.shaft], shafts[bearing.to]
        if math.dist(one.at_mm, other.at_mm) > ROUNDED_MM:
            self.refuse(
                f'{where}: to = "{bearing.to}"', f'has another axis than "{bearing.shaft}": correct at_mm of one'
            )
        place = bearing.at_mm + one.start_mm - other.start_mm
        if not bearing.couples and not -ROUNDED_MM <= place <= other.length + ROUNDED_MM:
            rule = f'is {place:g} mm from the beginning of "{bearing.to}", which has {other.length:g} mm: correct it'
            self.refuse(f"{where}: at_mm = {bearing.at_mm:g}", rule)

    def check_apart(self, one: Shaft, two: Shaft) -> None:
        """Refuse shafts that overlap, unless one is inside the other's bore."""
        distance = math.dist(one.at_mm, two.at_mm)
        for first, last, a in _spans(one):
            for low, high, b in _spans(two):
                common = min(last, high) - max(first, low)
                apart = distance >= 0.5 * (a.outer_mm + b.outer_mm)
                inside = min(a.outer_mm - b.inner_mm, b.outer_mm - a.inner_mm) + 2.0 * distance <= 0.0
                if common > ROUNDED_MM and not (apart or inside):
                    place = f"x = {max(first, low):g} to {min(last, high):g} mm"
                    self.refuse(
                        f'[[shafts]] "{one.name}" and "{two.name}"',
                        f"overlap at {place}: correct at_mm, start_mm or the diameters",
                    )

    def check_name(self, what: str, name: str) -> None:
        """Refuse a name that is none for the files of a mesh or a set."""
        if not names_a_file(name):
            rule = f"names a file: at most {LONGEST_NAME} characters, without {NO_FILE_NAME} and no point in front"
            self.refuse(f'[[{what}]] name = "{name:.60}"', rule)

    def check_facing(self, mesh: Mesh, shafts: dict[str, Shaft]) -> None:
        """Refuse gears that do not face each other."""
        x = [shafts[gear.shaft].start_mm + gear.at_mm for gear in (mesh.pinion, mesh.wheel)]
        if abs(x[0] - x[1]) > ROUNDED_MM:
            rule = "gears do not face each other: both places are the middle of the pair's face width; correct at_mm"
            self.refuse(f'[[meshes]] "{mesh.name}": pinion at x = {x[0]:g} mm, wheel at {x[1]:g} mm', rule)
        if mesh.pinion.shaft == mesh.wheel.shaft:
            self.refuse(f'[[meshes]] "{mesh.name}"', "pinion and wheel are on one shaft: name two")

    def check_members(self, one: PlanetarySet, shafts: dict[str, Shaft]) -> None:
        """Refuse members of a set that are not on shafts of one axis."""
        where, names = f'[[sets]] "{one.name}"', [place.shaft for place in one.members.values()]
        housed = [name for name in MEMBERS if name not in one.members]
        if len(housed) != 1:
            rule = "one of sun, carrier and ring must be, the others on shafts"
            self.refuse(f"{where}: {' and '.join(housed) or 'no member'} in the housing", rule)
        if names[0] == names[1]:
            self.refuse(f'{where}: {" and ".join(one.members)} on shaft "{names[0]}"', "they turn together: name two")
        first, second = (shafts[name] for name in names)
        if math.dist(first.at_mm, second.at_mm) > ROUNDED_MM:
            rule = "have different axes: sun, carrier and ring have one; correct at_mm of one"
            self.refuse(f'{where}: shafts "{names[0]}" and "{names[1]}"', rule)

    @contextmanager
    def named(self, one: PlanetarySet) -> Iterator[None]:
        """Raise errors of the file of a set with its place here."""
        try:
            yield
        except PmorError as error:
            raise type(error)(f'{self.where}: [[sets]] "{one.name}": {error}') from None

    def check_set(self, one: PlanetarySet, file: SetFile) -> None:
        """Refuse a set file that is none of a planetary set with the same member in the housing."""
        where = f'[[sets]] "{one.name}"'
        if file.sections.gears:
            rule = "is of gears on fixed axes: write each of them as [[meshes]]"
            self.refuse(f'{where}: set = "{one.set}"', rule)
        if file.held in one.members:
            (housed,) = (name for name in MEMBERS if name not in one.members)
            rule = f'its [load] has held = "{file.held}", and the {housed} is in the housing here: correct one of them'
            self.refuse(f'{where}: set = "{one.set}"', rule)

    def check_balance(self, load: LoadCase, said: GearboxSections) -> None:
        """Refuse torques that do not hold each other."""
        for train in _trains(said):
            torques = [torque for torque in load.torques if torque.shaft in train]
            held = [torque for torque in torques if torque.torque_Nm == "balance"]
            if not torques and len(train) == 1:
                rule = f'nothing holds the rotation of shaft "{train[0]}": add a torque with torque_Nm = "balance"'
                self.refuse(f'[[loads]] "{load.name}"', rule)
            if len(held) != 1:
                names = ", ".join(f'"{name}"' for name in train)
                found = "no torque" if not held else f"{len(held)} torques"
                self.refuse(
                    f'[[loads]] "{load.name}"',
                    f'{found} of the train of shafts {names} hold against the others: write torque_Nm = "balance" at '
                    "one place",
                )
            if len(train) == 1 and len(torques) == 1:
                continue  # an axle, under forces alone
            if len(torques) < 2 or all(torque.torque_Nm in ("balance", 0.0) for torque in torques):
                rule = f'has no torque to carry in the train of shaft "{train[0]}": add one'
                self.refuse(f'[[loads]] "{load.name}"', rule)

    def check_unbalance(self, load: LoadCase, said: GearboxSections) -> None:
        """Refuse unbalances without a speed, where a carrier turns and its set feels them."""
        for mass in said.masses if any("carrier" in one.members for one in said.sets) else ():
            if mass.unbalance_kg_mm and load.speed_rpm is None:
                rule = f'presses with the square of the speed: add speed_rpm to [[loads]] "{load.name}"'
                self.refuse(f'[[masses]] "{mass.name}": unbalance_kg_mm = {mass.unbalance_kg_mm:g}', rule)

    def check_gears(self, model: GearboxModel, cases: dict[str, Case]) -> None:
        """Refuse gears that overlap, gears in several meshes that are not the same in them, and ways that close."""
        ends = [
            (mesh.name, gear, place) for mesh in model.sections.meshes
            for place, gear in enumerate((mesh.pinion, mesh.wheel))
        ]  # fmt: skip
        for (name, one, place), (other_name, other, other_place) in combinations(ends, 2):
            where = f'[[meshes]] "{name}" and "{other_name}": shaft "{one.shaft}"'
            apart, widths = abs(one.at_mm - other.at_mm), [model.pairs[n].common_width for n in (name, other_name)]
            if same_gear(one, other):
                kinds = [_gear_of(cases[n], model.pairs[n], p) for n, p in ((name, place), (other_name, other_place))]
                unlike = [key for key in kinds[0] if kinds[0][key] != kinds[1][key]]
                if unlike:
                    rule = f"differ in {', '.join(unlike)}: correct one of them, or at_mm of two beside each other"
                    self.refuse(where, f"gears at {one.at_mm:g} mm are one gear, and {rule}")
            elif one.shaft == other.shaft and apart < 0.5 * sum(widths) - ROUNDED_MM:
                rule = "correct at_mm; of one gear with several meshes it is the same in all of them"
                self.refuse(where, f"gears at {one.at_mm:g} and {other.at_mm:g} mm overlap: {rule}")
        for group in model.groups:
            names = ", ".join(f'"{mesh.name}"' for mesh in group.meshes)
            if group.closed:
                rule = "how they share the load follows from the angles between gears on a shaft, which are not given"
                self.refuse(
                    f"[[meshes]] {names}", f"close a way around over gears and shafts: {rule}; solve them as a set"
                )
            for mesh in group.meshes:
                if cases[mesh.name].flank == "coast":
                    rule = "write its [load] torque_Nm positive, and the flanks that carry as modification"
                    self.refuse(f'[[meshes]] "{mesh.name}"', f"shares a gear with {names}, as coast flanks: {rule}")
            for load in model.sections.loads:
                senses = pinion_senses(model, load)
                for mesh in group.meshes:
                    turned = senses[mesh.name] != senses[group.meshes[0].name]
                    if turned and not alike_from_both_ends(cases[mesh.name]):
                        self.refuse(
                            f'[[meshes]] "{mesh.name}"',
                            f"shares a gear with {names}, and is not the same seen from both ends: leave out what "
                            "differs along the face, or solve them as a set with [[gears]]",
                        )

    def check_turned(self, model: GearboxModel) -> None:
        """Refuse loads of both senses on a set that differs from end to end: it is seen from the end of the torque."""
        turned = [set_torques(model, load) for load in model.sections.loads]
        for name, file in model.sets.items():
            torques = [torques[name] for torques in turned]
            largest = max(map(abs, torques), default=0.0)
            for load, torque in zip(model.sections.loads, torques, strict=True):
                if abs(torque) <= NO_TORQUE * largest or not torque:
                    rule = "no torque goes through it: write a load case that carries one"
                    self.refuse(f'[[loads]] "{load.name}", set "{name}"', rule)
            if min(torques, default=0.0) * max(torques, default=0.0) < 0.0 and not _set_alike(file):
                self.refuse(
                    f'[[loads]]: they turn the set "{name}" both ways, and it is not the same seen from both ends',
                    "write a gearbox file for each sense",
                )


def names_a_file(name: str) -> bool:
    """Return whether the files of a mesh or a set may have a name."""
    return 0 < len(name) <= LONGEST_NAME and not name.startswith(".") and not set(name) & set(NO_FILE_NAME)


def _gear_of(case: Case, pair: GearPair, place: int) -> dict[str, object]:
    """What two ends of meshes have in common where they are one gear."""
    gear, width = (case.pair.pinion, case.pair.wheel)[place], case.pair.face_width_mm
    return {
        "teeth and tool": (pair.pinion, pair.wheel)[place], "face": gear.face(width), "keys of the gear": gear,
        "[mesh]": case.mesh, "[contact]": case.contact, "root_stress": case.root_stress,
    }  # fmt: skip


def _set_alike(file: SetFile) -> bool:
    """Whether a set is the same seen from its other end: equal planets of one gear, equally spaced, and all pairs."""
    said, plan = file.sections.planets, file.plan
    even = not said.positions_deg and not said.missing and not plan.displacement.any() and not plan.eccentricity.any()
    stepped = any(body.on is not None for body in plan.bodies)
    return even and not stepped and all(alike_from_both_ends(case) for case in file.cases.values())


def _places(said: GearboxSections) -> Iterator[tuple[str, str, float]]:
    """All places along shafts: where they are written, the shaft, mm."""
    for bearing in said.bearings:
        yield f'[[bearings]] "{bearing.name}"', bearing.shaft, bearing.at_mm
    for mesh in said.meshes:
        for name, gear in (("pinion", mesh.pinion), ("wheel", mesh.wheel)):
            yield f'[[meshes]] "{mesh.name}": {name}', gear.shaft, gear.at_mm
    for one in said.sets:
        for name, member in one.members.items():
            yield f'[[sets]] "{one.name}": {name}', member.shaft, member.at_mm
    for mass in said.masses:
        yield f'[[masses]] "{mass.name}"', mass.shaft, mass.at_mm
    for load in said.loads:
        for shaft, place in load.places:
            yield f'[[loads]] "{load.name}"', shaft, place


def _spans(shaft: Shaft) -> Iterator[tuple[float, float, ShaftSection]]:
    ends = shaft.start_mm + np.cumsum([0.0, *(section.length_mm for section in shaft.sections)])
    yield from zip(ends[:-1].tolist(), ends[1:].tolist(), shaft.sections, strict=True)


def _trains(said: GearboxSections) -> list[tuple[str, ...]]:
    """Shafts that meshes, sets and couplings join, in the order of the file."""
    train = {shaft.name: {shaft.name} for shaft in said.shafts}
    for bearing in said.bearings:
        if bearing.couples:
            joined = train[bearing.shaft] | train[bearing.to]
            train |= dict.fromkeys(joined, joined)
    for mesh in said.meshes:
        joined = train[mesh.pinion.shaft] | train[mesh.wheel.shaft]
        train |= dict.fromkeys(joined, joined)
    for one in said.sets:
        joined = set().union(*(train[member.shaft] for member in one.members.values()))
        train |= dict.fromkeys(joined, joined)
    return list(dict.fromkeys(tuple(name for name in train if name in names) for names in train.values()))
