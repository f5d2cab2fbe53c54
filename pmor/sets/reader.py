"""What no single key of a set file can know: checks across sections, and the cases of the meshes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from pmor.case import Case
from pmor.case.capability import refuse_beyond
from pmor.case.change import case_of_settings
from pmor.case.document import BLANK, COAST, MODIFICATION
from pmor.case.duty import check_duty
from pmor.case.motion import check_bodies, check_motion
from pmor.case.reader import Reader
from pmor.case.seats import read_seats
from pmor.case.width import meshed_width, whole_width
from pmor.core.arrays import FloatArray
from pmor.core.errors import GeometryError, PmorError
from pmor.core.wording import did_you_mean
from pmor.gear.pair import GearPair
from pmor.pair.conditions import assembly_of
from pmor.pair.model import gear_pair, refuse_loads_unmeshed
from pmor.sets.bounds import refuse_draws, refuse_errors
from pmor.sets.draws import drawn
from pmor.sets.layout import PAIR, SECOND_PAIR, SECOND_PLANET, SHARED, Layout, Share, planetary_layout, train_layout
from pmor.sets.plan import SetPlan, planetary_errors, with_errors
from pmor.sets.settings import Eccentricity, SetSections
from pmor.sets.support_checks import check_supports
from pmor.sets.train_checks import check_stepped, check_tolerances, check_train

# Torque of cases before that of their meshes is known, N m.
ANY = 1.0
# Positions of a sweep.
MOST_ANGLES = 200_000
# Angles of a cycle of all meshes, all of which are placed.
MOST_PLACED = 20_000
# Key of flanks that planets may have each of their own.
PITCH = "pitch_deviations_um"
# Of a module: centre distances of two meshes that are one.
SAME_DISTANCE = 1e-4


class SetReader(Reader):
    """Checks what no single key can know, and makes the cases of the meshes."""

    def layout(self, said: SetSections, whole_width: bool) -> Layout:
        """Return which members mesh."""
        if said.gears or said.meshes:
            check_train(said, self.refuse)
            if said.masses:
                self.refuse("[[masses]]", "is of planetary sets: give a train with masses as a gearbox")
            layout = train_layout(said)
        else:
            self.check_planets(said)
            layout = planetary_layout(said, whole_width)
        check_duty(said.loads, self.refuse)
        check_motion(said.dynamics, self.refuse)
        check_bodies(((f'[[masses]] on = "{one.on}"', one.inertia) for one in said.masses), self.refuse)
        members = list(dict.fromkeys(member for share in layout.shares for member in share.members))
        sections = dict.fromkeys((PAIR, *(share.section for share in layout.shares)))
        for name in said.members:
            if name not in (*members, *SHARED, *sections):
                if name == SECOND_PAIR and not said.gears:
                    self.refuse(f"[{name}]", f"is of stepped planets: add [{SECOND_PLANET}], or leave it out")
                known = [*members, *SHARED, *(sections if said.gears else (SECOND_PLANET, SECOND_PAIR))]
                self.refuse(f"[{name}]", f"unknown section: {did_you_mean(name, known)}")
        for name in (*members, *sections):
            if name not in said.members:
                self.refuse(f"[{name}]", "is missing: add the section with its keys")
        return layout

    def check_planets(self, said: SetSections) -> None:
        """Refuse what says nothing about a planetary set, or too much."""
        if said.load is None:
            self.refuse("[load]", "is missing: add torque_Nm, and the member that it is on")
        if said.load.torque_Nm == 0.0:
            self.refuse("[load] torque_Nm = 0", "carries nothing: write the torque of the set")
        if said.load.on == said.load.held:
            rule = "stands still and has the torque: a set at rest carries none through; name another member in one"
            self.refuse(f'[load] on = "{said.load.on}", held = "{said.load.held}"', f"the {said.load.on} {rule}")
        planets, off = said.planets, said.eccentricity
        listed = {f"[planets] {key}": getattr(planets, key) for key in ("positions_deg", "radial_um", "tangential_um")}
        listed |= {"[eccentricity] planets_um": off.planets_um, "[eccentricity] planets_deg": off.planets_deg}
        listed |= {"[planets] timing_mrad": planets.timing_mrad}
        for key, given in listed.items():
            if given and len(given) != planets.count:
                rule = f"must be one number for each of the {planets.count} planets"
                self.refuse(f"{key} with {len(given)} numbers", rule)
        check_tolerances(said, self.refuse)
        if any(number > planets.count for number in planets.missing):
            self.refuse(f"[planets] missing = {list(planets.missing)}", f"there are planets 1 to {planets.count}")
        if len(planets.missing) >= planets.count:
            self.refuse(f"[planets] missing = {list(planets.missing)}", "leaves no planet: take one out of the list")
        if planets.count - len(planets.missing) == 1:
            for member in ("sun", "ring"):
                key = f"{member}_radial_N_per_mm"
                if getattr(said.supports, key) == "free":
                    rule = f"one planet alone pushes the {member} aside: give it a stiffness, or add planets"
                    self.refuse(f'[supports] {key} = "free"', rule)
        check_supports(said, self.refuse)
        check_stepped(said, self.refuse)

    def check_errors(
        self, said: SetSections, plan: SetPlan, cases: Mapping[str, Case], pairs: Mapping[str, GearPair]
    ) -> None:
        """Refuse errors, also those that tolerances draw, with which gears cannot mesh."""
        place = "[[gears]] eccentricity_um" if said.gears else "[planets], [eccentricity]"
        try:
            refuse_errors(plan, cases, pairs)
            if said.tolerances is not None:
                place = "[tolerances]"
                refuse_draws(plan, (with_errors(plan, sample) for sample in drawn(said)), pairs)
        except GeometryError as error:
            raise GeometryError(f"{self.where}: {place}: {error}") from None

    def carrier_stiffness(self, said: SetSections) -> FloatArray | None:
        """Return the stiffness of the carrier at the seats of its pins; None where the file names none."""
        if said.carrier.stiffness is None:
            return None
        assert said.pins is not None
        seats = said.planets.count * (2 if said.pins.cheeks == "both" else 1)
        return read_seats(self, "carrier", said.carrier.stiffness, seats, "seat of a pin in a cheek")

    def pairs(self, said: SetSections, layout: Layout) -> dict[str, GearPair]:
        """Return the geometry of all meshes that differ."""
        found = {}
        for share in layout.shares:
            with self.named(share):
                found[share.name] = gear_pair(self.case(said, share, ANY))
        return found

    def cases(self, said: SetSections, layout: Layout, torques_Nm: Mapping[str, float]) -> dict[str, Case]:
        """Return the cases of all meshes that differ, in the frames in which their pinions drive."""
        found = {}
        for share in layout.shares:
            with self.named(share):
                case = self.case(said, share, torques_Nm[share.name])
                refuse_loads_unmeshed(case)
            found[share.name] = case
        for share in layout.shares:
            pair = found[share.name].pair
            for member, gear in zip(share.members, (pair.pinion, pair.wheel), strict=True):
                if gear.blank is not None and gear.blank.stress:
                    self.refuse(f"[{member}.blank] stress = true", "a set has no stress of webs: leave it out")
        # Members are solved once for all of their meshes.
        if len({meshed_width(case) for case in found.values()}) > 1:
            found = {name: whole_width(case) for name, case in found.items()}
        return found

    def own_teeth(self, said: SetSections, layout: Layout, plan: SetPlan, torques_Nm: Mapping[str, float]) -> SetPlan:
        """Return the plan with the pitch deviations of each planet in its meshes, where a member lists them so."""
        shares, meshes = {share.name: share for share in layout.shares}, []
        listed = {member for share in layout.shares for member in share.members if _by_planet(said.members[member])}
        there = [number for number in range(said.planets.count) if number + 1 not in said.planets.missing]
        for mesh in plan.meshes:
            own = [body for body in (mesh.pinion, mesh.wheel) if plan.bodies[body].member in listed]
            for number in own:
                on = plan.bodies[number].on
                planet = there[plan.planets.index(number if on is None else on)]
                with self.named(shares[mesh.case]):
                    case = self.case(said, shares[mesh.case], torques_Nm[mesh.case], planet)
                mesh = replace(mesh, assembly=assembly_of(case))
            meshes.append(mesh)
        return replace(plan, meshes=tuple(meshes))

    def idle_teeth(self, layout: Layout, cases: Mapping[str, Case]) -> Iterator[str]:
        """Yield a sentence for each flank whose teeth differ and that carries nothing, with the one that does."""
        carrying, idle = set[str](), dict[str, tuple[str, str]]()
        for share in layout.shares:
            case = cases[share.name]
            sections = (COAST, MODIFICATION) if case.flank == "coast" else (MODIFICATION, COAST)
            for member, other in zip(share.members, case.other_flanks, strict=True):
                carrying.add(f"{member}.{sections[0]}")
                idle[f"{member}.{sections[1]}"] = " and ".join(other.tooth_keys), f"{member}.{sections[0]}"
        for name, (keys, instead) in idle.items():
            if keys and name not in carrying:
                yield f"[{name}] {keys}: of flanks that carry nothing under this torque: those of [{instead}] carry"

    def case(self, said: SetSections, share: Share, torque_Nm: float, planet: int | None = None) -> Case:
        """Return the case of a mesh; a torque that turns its pinion clockwise makes the case of the image.

        `planet` is the one whose pitch deviations count where they differ: else any that has some.
        """
        document: dict[str, Any] = {"load": {"torque_Nm": share.sense * torque_Nm}}
        pair = dict(said.members[PAIR]) | dict(said.members[share.section])
        if share.distance_mm is not None:
            if "centre_distance_mm" in pair:
                self.refuse("[pair] centre_distance_mm", "follows from at_mm of the gears: leave it out")
            pair["centre_distance_mm"] = share.distance_mm
        if "helix_angle_deg" in pair and share.hand < 0:
            pair["helix_angle_deg"] = -pair["helix_angle_deg"]
        document["pair"] = pair
        for role, member in zip(("pinion", "wheel"), share.members, strict=True):
            keys = dict(said.members[member])
            for inner in (MODIFICATION, COAST, BLANK):
                if inner in keys:
                    document[f"{role}.{inner}"] = self.of_planet(said, f"{member}.{inner}", keys.pop(inner), planet)
            document[role] = keys
        graded = said.tolerances is not None and said.tolerances.flank_tolerance_class is not None
        whole = {"width": "whole"} if share.whole_width or graded else {}
        document["mesh"] = {"error_bar": False, **said.members.get("mesh", {}), **whole}
        document["contact"] = dict(said.members.get("contact", {}))
        results = dict(said.members.get("results", {}))
        if unknown := next((key for key in results if key != "root_stress"), None):
            self.refuse(f"[results] {unknown}", "of a set root_stress alone can be chosen: leave it out")
        document["results"] = {"maps": False, **results}
        case = case_of_settings(document, share.name, self.folder)
        refuse_beyond(case, "set", f"{self.where}: mesh {share.name}")
        return case

    def of_planet(self, said: SetSections, place: str, keys: Mapping[str, Any], planet: int | None) -> dict[str, Any]:
        """Return the keys of flanks with the pitch deviations of a planet by its number, from 0 on."""
        given: Any = keys.get(PITCH)
        if not _is_nested(given):
            return dict(keys)
        if place.split(".")[0] not in ("planet", SECOND_PLANET) or said.gears:
            rule = "is a list of lists, which planets alone have: write one number for each tooth"
            self.refuse(f"[{place}] {PITCH}", rule)
        if len(given) != said.planets.count or not all(isinstance(one, list) for one in given):
            rule = f"must be one list for each of the {said.planets.count} planets, or one list for all of them"
            self.refuse(f"[{place}] {PITCH} with {len(given)} lists and numbers", rule)
        uneven = next((number for number, one in enumerate(given) if any(one)), 0)
        return {**keys, PITCH: given[uneven if planet is None else planet]}

    @contextmanager
    def named(self, share: Share) -> Iterator[None]:
        """Raise errors of the case of a mesh with the names of the set file."""
        try:
            yield
        except PmorError as error:
            if str(error).startswith(f"{self.where}: "):
                raise
            text = str(error).removeprefix(f"{share.name}: ")
            for role, member in zip(("pinion", "wheel"), share.members, strict=True):
                text = text.replace(f"[{role}", f"[{member}").replace(f"the {role}", f"the {member}")
            raise type(error)(f"{self.where}: mesh {share.name}: {text}") from None

    def pitches(self, said: SetSections, plan: SetPlan, cases: Mapping[str, Case], housed: bool = False) -> int:
        """Return the mesh cycles to solve: as the file says, or until lugs, holes and errors of gears stand as before.

        Parameters
        ----------
        housed : bool
            Whether the housing has to stand as before too, against the carrier.
        """
        spans = {plan.cycle}
        for mesh, rate in zip(plan.meshes, plan.rates, strict=True):
            case = cases[mesh.case]
            flanks = case.pinion_modification, case.wheel_modification
            for body, gear, flank in zip(
                (mesh.pinion, mesh.wheel), (case.pair.pinion, case.pair.wheel), flanks, strict=True
            ):
                teeth = gear.unlike_teeth(case.pair.face_width_mm)
                held = housed and said.load is not None and plan.bodies[body].member == said.load.held
                turned = held or plan.eccentricity[body].any()
                teeth = gear.teeth if turned else math.lcm(teeth, flank.repeats_after(gear.teeth))
                # Until whole pitches of the gear, a multiple of its unlike teeth, have passed.
                spans.add(rate.denominator * teeth // math.gcd(rate.numerator, teeth))
        pitches = said.sweep.pitches or math.lcm(*spans)
        placed = plan.placed_pitches(pitches) * said.sweep.angles_per_pitch
        if placed > MOST_PLACED:
            self.refuse(
                f"[sweep] pitches = {pitches}", f"makes {placed} different angles, and {MOST_PLACED} are allowed: "
                f"the set repeats after {plan.cycle} pitches of the first gear; lower "
                "angles_per_pitch or pitches, or take tooth numbers of gears on one shaft with common divisors"
            )  # fmt: skip
        return self._few_enough(said, pitches)

    def _few_enough(self, said: SetSections, pitches: int) -> int:
        if pitches * said.sweep.angles_per_pitch > MOST_ANGLES:
            self.refuse(
                f"[sweep] pitches = {pitches}", f"makes {pitches * said.sweep.angles_per_pitch} angles with "
                f"angles_per_pitch = {said.sweep.angles_per_pitch}, and {MOST_ANGLES} are enough: lower one of the two"
            )  # fmt: skip
        return pitches

    def sample_pitches(self, said: SetSections, plan: SetPlan, cases: Mapping[str, Case]) -> int:
        """Return the mesh cycles to solve of each set within tolerances."""
        if said.tolerances is None:
            return 1
        sizes, off = said.tolerances, said.eccentricity
        if sizes.flank_tolerance_class is not None:
            # A turn of the gear that takes longest: until all teeth met as before it would be their common multiple.
            span, turn = self.pitches(said, plan, cases), max(
                gear.teeth / rate
                for mesh, rate in zip(plan.meshes, plan.rates, strict=True)
                for gear in (cases[mesh.case].pair.pinion, cases[mesh.case].pair.wheel)
            )
            return said.sweep.pitches or self._few_enough(said, span * math.ceil(turn / span))
        if said.gears:
            off_axis = plan.eccentricity + sizes.gears_eccentricity_um
            return self.pitches(said, replace(plan, eccentricity=off_axis), cases)
        widest = Eccentricity(
            sun_um=off.sun_um + sizes.sun_eccentricity_um, ring_um=off.ring_um + sizes.ring_eccentricity_um,
            planets_um=tuple(sizes.planets_eccentricity_um + amount
                             for amount in off.planets_um or (0.0,) * said.planets.count),
        )  # fmt: skip
        errors = planetary_errors(replace(said, eccentricity=widest), plan.bodies, plan.clockwise)
        return self.pitches(said, replace(plan, eccentricity=errors[1]), cases)

    def check_distances(self, said: SetSections, layout: Layout, pairs: Mapping[str, GearPair]) -> None:
        """Refuse a planet whose two centre distances contradict each other."""
        if said.gears:
            return
        apart = [abs(pairs[share.name].centre_distance) for share in layout.shares]
        if max(apart) - min(apart) > SAME_DISTANCE * pairs[layout.shares[0].name].pinion.module:
            raise GeometryError(
                f"{self.where}: without backlash sun and planet are {apart[0]:.6g} mm apart, planet and ring "
                f"{apart[1]:.6g} mm: give [pair] centre_distance_mm, or correct tooth numbers and profile shifts"
            )


def _is_nested(given: Any) -> bool:
    return isinstance(given, list) and any(isinstance(one, list) for one in given)


def _by_planet(keys: Mapping[str, Any]) -> bool:
    """Whether a member lists pitch deviations planet by planet."""
    return any(_is_nested(keys.get(inner, {}).get(PITCH)) for inner in (MODIFICATION, COAST))
