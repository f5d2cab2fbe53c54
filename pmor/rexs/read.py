"""A stage of a REXS gearbox as a case: geometry, tools, material, blanks, flanks, torques; notes on the rest."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, TypeVar

from pmor.case import Case, make_case
from pmor.case.document import COAST, MODIFICATION
from pmor.case.dynamics import DynamicsCase
from pmor.core.errors import CaseError, GeometryError, printable
from pmor.gear.condition import Misalignment
from pmor.gear.modification import AMOUNTS, UNEVEN
from pmor.gear.pair import ROUNDING, GearPair
from pmor.pair.model import gear_pair
from pmor.rexs.drive import shaft_speeds
from pmor.rexs.flanks import READERS, FileFlank, Found, read_flank
from pmor.rexs.gears import GearInFile, tools_of
from pmor.rexs.joints import RING, axis_of, shafts_of
from pmor.rexs.model import Component, Gearbox, read_rexs
from pmor.rexs.shafts import density_of
from pmor.rexs.shifts import Rack
from pmor.rexs.stage import OFF_PLACE, Stage, axes_apart, face_middle, find_stage
from pmor.rexs.tips import clear_tips
from pmor.rexs.units import rounded

# Line load for a torque that is not said, N/mm.
LINE_LOAD = 100.0
# A distance nearer to that without backlash counts as equal: relative where it is said, mm where it is that of axes.
SAME_DISTANCE, SAME_PLACE = 1e-10, 2e-3
# Modules of backlash from which on a note says it.
NOTED_BACKLASH = 0.02
SIDES, GEARS = ("left", "right"), ("pinion", "wheel")
PITCHES = "pitch_deviations_um"
MISALIGNED = [item.name for item in fields(Misalignment)]
T = TypeVar("T")
UNDERSTOOD = (*READERS, "end_relief_datum_face", "end_relief_non_datum_face")
# Attributes of a part: drawing data and name.
WITHOUT_MEANING = {
    "display_color", "modification_date", "part_number", "reference_component_for_position", "referenced_component_id",
    "revision_number", "sequence_number", "support_vector", "u_axis_vector", "u_coordinate_on_shaft", "version",
    "w_axis_vector",
}  # fmt: skip


@dataclass(frozen=True)
class Imported:
    """A stage as a case.

    Parameters
    ----------
    case : Case
        Its text begins with the notes, as comments.
    sections : dict
        Its settings, by the dotted names of sections.
    notes : tuple of str
        Assumptions, changed values, parts not understood.
    changed : tuple of str
        Those of them that say what was changed, as the gears would not run as the file has them.
    """

    case: Case
    sections: dict[str, Any]
    notes: tuple[str, ...]
    changed: tuple[str, ...]


def read_stage(path: Path, stage: int | None = None) -> Imported:
    """Make a case of a stage, with notes: see `pmor.app.export.import_rexs`."""
    gearbox = read_rexs(path)
    where = f"{path}, stage {stage}" if stage is not None else str(path)
    return stage_case(path, gearbox, find_stage(gearbox, stage, str(path)), where)


def stage_case(path: Path, gearbox: Gearbox, found: Stage, where: str, both_flanks: bool = True) -> Imported:
    """Make a case of a stage that was found; `both_flanks` takes the flanks that do not carry as well."""
    draft = _Draft(gearbox, found, where)
    sections = draft.sections()
    pair = draft.checked(lambda: gear_pair(make_case(path.stem, **sections)))
    carrying, others = list(draft.modifications(pair)), list(draft.others(pair) if both_flanks else (None, None))
    for gear, own, other in zip(GEARS, carrying, others, strict=True):
        keys, coast = (other or {}, own) if found.coast else (own, other)
        if keys:
            sections[f"{gear}.{MODIFICATION}"] = keys
        if coast is not None and coast != {key: value for key, value in keys.items() if key != PITCHES}:
            sections[f"{gear}.{COAST}"] = {**dict.fromkeys((key for key in keys if key in AMOUNTS), 0.0), **coast}
    draft.note_unread()
    if _uneven(sections):
        sections["mesh"] = {"width": "whole"}
    case = draft.checked(lambda: make_case(path.stem, **sections))
    draft.checked(lambda: gear_pair(case))  # refused here, with its place, and not at the first use
    head = [
        f"{path.name}, {found.component.label}, REXS {gearbox.version} of {gearbox.program or 'an unnamed program'}.",
        "Missing values are assumed; mesh and training are the defaults.",
        *draft.notes,
    ]
    comments = "\n".join(f"# {printable(line)}" for line in head)
    case = replace(case, text=f"{comments}\n\n{case.text}")
    return Imported(case, sections, tuple(draft.notes), tuple(draft.changed))


class _Draft:
    """Sections of a case as found, and notes on missing data."""

    def __init__(self, gearbox: Gearbox, stage: Stage, where: str) -> None:
        self.gearbox, self.stage, self.where = gearbox, stage, where
        self.gears = stage.pinion, stage.wheel
        self.notes, self.changed, self.contradiction = list(stage.notes), list[str](), ""
        self.datum = [self._datum(gear) for gear in self.gears]
        # Seen from the larger z the pinion's carrying flank is the left one; of coast flanks the other one is.
        drives_left = stage.coast or stage.loaded == "left"
        self.along = [a * self.datum[0] * (1 if drives_left else -1) for a in axis_of(stage.pinion)]
        self.flanks = [self._flank(gear) for gear in self.gears]

    def checked(self, make: Callable[[], T]) -> T:
        """Return what is made of the stage; what is wrong with it is said with its place in the file."""
        try:
            return make()
        except (CaseError, GeometryError) as error:
            said = f"{self.contradiction}, and so " if self.contradiction else ""
            raise type(error)(f"{self.where}: {said}{error}") from None

    def sections(self) -> dict[str, Any]:
        """Return all sections but the modifications."""
        rack = self._rack()
        faces = self._faces()
        pair: dict[str, Any] = {
            "module_mm": rack.module, "pressure_angle_deg": rounded(math.degrees(rack.pressure_angle)),
            "helix_angle_deg": rounded(math.degrees(rack.helix_angle)), "face_width_mm": rounded(faces[0][2]),
        }  # fmt: skip
        gears = [
            GearInFile(self.gearbox, gear, flank, rack, self.where, self.notes)
            for gear, flank in zip(self.gears, self.flanks, strict=True)
        ]
        tooth = [gear.keys for gear in gears]
        for keys, (offset, width, common) in zip(tooth, faces, strict=True):
            if not math.isclose(width, common):
                keys["face_width_mm"] = rounded(width)
            if abs(offset) > 1e-9:
                keys["face_offset_mm"] = rounded(offset)
        pair["centre_distance_mm"] = self._distance(rack, tooth)
        said = clear_tips(_present(pair), tooth, [one.gear.label if one.tip_is_open else None for one in gears])
        self.notes += said
        self.changed += said
        torques = self.stage.torques_Nm or (self._assumed_torque(rack, faces[0][2]),)
        signed = [-torque for torque in torques] if self.stage.coast else list(torques)
        sections: dict[str, Any] = {
            "title": self._title(), "load": {"torque_Nm": signed[-1], **self._speed()}, "pair": _present(pair),
            "pinion": tooth[0], "wheel": tooth[1],
        }  # fmt: skip
        if off := {key: value for key in MISALIGNED if (value := self.stage.component.number_of(f"{OFF_PLACE}{key}"))}:
            sections["misalignment"] = {key: rounded(1e3 * value) for key, value in off.items()}
        if (density := self._density()) is not None:
            sections["dynamics"] = {"density_kg_m3": density}
        if len(torques) > 1:
            sections["online"] = {"torques_Nm": signed}
        return sections

    def _rack(self) -> Rack:
        """What the gears have in common; what one of them does not say is that of its mate."""
        teeth = [gear.whole_number_of("number_of_teeth") or int(self._needed(gear, "number_of_teeth"))
                 for gear in self.gears]  # fmt: skip
        ring = self.gears[1].kind == RING
        found = list[float]()
        for attribute, parts, sign in (
            ("normal_module", self.gears, 1.0), ("normal_pressure_angle", self.flanks, 1.0),
            ("helix_angle_reference_diameter", self.gears, -1.0),
        ):  # fmt: skip
            said = [part.number_of(attribute) for part in parts]
            if None in said:
                said = self._completed(attribute, said, sign)
            one, other = (value or 0.0 for value in said)
            # Some programs write a ring with the sign of its hand, others with that of a gear outside in its place.
            if not math.isclose(one, sign * other, rel_tol=1e-6, abs_tol=1e-6) and not (
                ring and math.isclose(one, other, rel_tol=1e-6)
            ):
                shown = f"{other:g} of {self.gears[1].label} where its mate asks for {sign * one:g}"
                raise CaseError(f"{self.where}: {attribute}: {shown}: no pair")
            found.append(one)
        module, angle, helix = found
        return Rack((teeth[0], -teeth[1] if ring else teeth[1]), module, math.radians(angle), math.radians(helix))

    def _completed(self, attribute: str, said: list[float | None], sign: float) -> list[float | None]:
        """An attribute of both gears where the file does not say it of both: a mate has the same one."""
        missing = [gear.label for gear, value in zip(self.gears, said, strict=True) if value is None]
        if len(missing) == 1:
            (value,) = (value for value in said if value is not None)
            self.notes.append(f"{missing[0]}: no {attribute}: that of its mate")
            return [sign * value if one is None else one for one in said]
        if sign > 0.0:
            self._needed(self.gears[0] if attribute == "normal_module" else self.flanks[0], attribute)
        self.notes.append(f"no {attribute} of either gear: spur gears assumed")
        return [0.0, 0.0]

    def _speed(self) -> dict[str, float]:
        """Speed of the pinion, where all load cases have the same one."""
        shaft, cases = next(iter(shafts_of(self.gearbox, self.gears[0])), None), self.gearbox.load_cases or ({},)
        speeds = {shaft_speeds(self.gearbox, case).get(shaft.number) for case in cases} if shaft else set()
        (speed,) = speeds if len(speeds) == 1 else (None,)
        return {"speed_rpm": rounded(abs(speed))} if speed else {}

    def _density(self) -> float | None:
        """Density of both gears, kg/m^3; None where neither material says it, or it is that of a case."""
        said = [density for gear in self.gears if (density := density_of(self.gearbox, gear)) is not None]
        if len(set(said)) > 1:
            self.notes.append(f"densities {said[0]:g} and {said[1]:g} kg/m3: a case has one, their mean taken")
        mean = rounded(sum(said) / len(said)) if said else DynamicsCase.density_kg_m3
        return None if mean == DynamicsCase.density_kg_m3 else mean

    def modifications(self, pair: GearPair) -> Iterator[dict[str, Any]]:
        """Return the keys of the modifications of both gears."""
        for number, flank in enumerate(self.flanks):
            found = self._modification(number, flank, pair)
            self.notes += found.notes
            yield found.keys

    def others(self, pair: GearPair) -> Iterator[dict[str, Any] | None]:
        """Return the keys of the flanks that do not carry; None of a gear that has none in the file."""
        for number, (gear, flank) in enumerate(zip(self.gears, self.flanks, strict=True)):
            roles = [one for one in self.gearbox.relations if one.kind == "flank" and one.role("gear") == gear.number]
            both = [self.gearbox.components.get(one.role(side) or -1) for one in roles for side in SIDES]
            other = next((one for one in both if one is not None and one is not flank), None)
            yield None if other is None else self._modification(number, other, pair).keys

    def _modification(self, number: int, flank: Component, pair: GearPair) -> Found:
        """What a flank of a gear is modified by."""
        tooth, (low, high) = (pair.pinion, pair.wheel)[number], pair.faces[number]
        along = sum(a * b for a, b in zip(axis_of(self.gears[number]), self.along, strict=True))
        profile = FileFlank(
            tooth.base_radius, *pair.active_rolls[number], tooth.tip_roll_angle, high - low,
            self.datum[number] * (1 if along >= 0.0 else -1),
        )  # fmt: skip
        found = read_flank([part for part in self._referenced(flank) if part.kind != "material"], profile)
        if deviations := flank.numbers_of("custom_pmor_pitch_deviations"):
            found.keys[PITCHES] = [rounded(1e3 * deviation) for deviation in deviations]
        return found

    def note_unread(self) -> None:
        """Note the attributes of gears, flanks, tools and modifications without a counterpart in a case."""
        parts = [*self.gears, *self.flanks]
        for gear, flank in zip(self.gears, self.flanks, strict=True):
            parts += tools_of(self.gearbox, gear, flank)
            parts += self.gearbox.beside(flank.number, "cylindrical_gear_manufacturing_settings", "manufacturing_step")
            parts += [part for part in self._referenced(flank) if part.kind in UNDERSTOOD]
        for part in {part.number: part for part in parts}.values():
            if unread := sorted(set(part.values) - part.used - WITHOUT_MEANING):
                self.notes.append(f"{part.label}: not read: {', '.join(unread)}")

    def _faces(self) -> list[tuple[float, float, float]]:
        """Faces of both gears: offset from the middle of the common face, own face width, common face width; mm."""
        widths = [self._face_width(gear) for gear in self.gears]
        middles = [face_middle(self.gearbox, gear, self.along) for gear in self.gears]
        if middles[0] is None or middles[1] is None:
            self.notes.append("axial positions of the gears are missing: faces assumed centred on each other")
            middles = [0.0, 0.0]
        ends = [(m - 0.5 * w, m + 0.5 * w) for m, w in zip(middles, widths, strict=True)]  # type: ignore[operator]
        low, high = max(ends[0][0], ends[1][0]), min(ends[0][1], ends[1][1])
        if high <= low:
            raise CaseError(f"{self.where}: the faces of the gears lie beside each other: no contact")
        return [(0.5 * (a + b - low - high), w, high - low) for (a, b), w in zip(ends, widths, strict=True)]

    def _face_width(self, gear: Component) -> float:
        """Face width of a gear, or that which the stage says of both."""
        common = self.stage.component.number_of("common_face_width")
        if gear.number_of("face_width") is None and common:
            self.notes.append(f"{gear.label}: no face_width: common_face_width = {common:g} mm of its stage")
            return common
        return self._needed(gear, "face_width")

    def _distance(self, rack: Rack, teeth: list[dict[str, Any]]) -> float | None:
        """The centre distance; None where it is the one without backlash, or too small for the shifts."""
        said, between = self.stage.component.number_of("center_distance"), axes_apart(self.gearbox, self.gears)
        distance, by_axes = (between, True) if said is None else (said, False)
        if distance is None:
            return None
        named, axes = f"center_distance = {distance:g} mm", f"axes {between or 0.0:.6g} mm apart"
        shifts = [keys.get("profile_shift", 0.0) for keys in teeth]
        tight = self.checked(lambda: rack.distance_of(sum(shifts)))
        least = self.checked(lambda: rack.distance_of(sum(shifts) + sum(_thinned(keys, rack) for keys in teeth)))
        size, both = "small" if rack.bases > 0.0 else "large", f"{shifts[0]:.6g} and {shifts[1]:.6g}"

        def jams(distance: float) -> bool:
            return math.copysign(1.0, rack.bases) * (distance - least) < -ROUNDING * rack.module

        if not by_axes and between and jams(distance) and not jams(between):
            note = f"{named}: too {size} for the profile shifts {both}: that of the axes taken, {between:.6g} mm"
            self.notes.append(note)
            self.changed.append(note)
            distance, by_axes = between, True
        elif not by_axes and between and abs(distance - between) > SAME_PLACE:
            self.notes.append(f"{named}, but the axes of the gears are {between:.6g} mm apart: the former taken")
        named = axes if by_axes else named
        if abs(distance - tight) <= (SAME_PLACE if by_axes else SAME_DISTANCE * distance):
            return None
        if jams(distance):
            note = f"{named}: too {size} for the profile shifts {both}, without backlash at {tight:.6g} mm: that taken"
            self.notes.append(note)
            self.changed.append(note)
            return None
        backlash = rack.backlash(distance, tight)
        if backlash > NOTED_BACKLASH * rack.module:
            self.contradiction = (
                f"{named} leaves the profile shifts {both}, without backlash at {tight:.6g} mm, {backlash:.3g} mm of it"
            )
            self.notes.append(f"{self.contradiction}: taken as they are said")
        return distance

    def _assumed_torque(self, rack: Rack, width: float) -> float:
        radius = 0.5 * rack.teeth[0] * rack.module / math.cos(rack.helix_angle)
        torque = float(f"{LINE_LOAD * width * radius * 1e-3:.2g}")
        self.notes.append(
            f"no torque of the stage is said: {torque:g} N m assumed, {LINE_LOAD:g} N/mm: write its own into [load] "
            "torque_Nm"
        )
        return torque

    def _flank(self, gear: Component) -> Component:
        """The flank that carries: the said one of the pinion, and of the wheel the one on the same side."""
        index = self.gears.index(gear)
        turned = self.datum[index] * sum(a * b for a, b in zip(axis_of(gear), axis_of(self.gears[0]), strict=True))
        same = turned * self.datum[0] > 0.0
        side = self.stage.loaded if same else SIDES[SIDES.index(self.stage.loaded) - 1]
        for relation in self.gearbox.relations:
            if relation.kind == "flank" and relation.role("gear") == gear.number:
                found = {name: self.gearbox.components.get(relation.role(name) or 0) for name in SIDES}
                flank = found[side] or found["left"] or found["right"]
                if flank is not None:
                    self._say_if_sides_differ(gear, found, side)
                    return flank
        raise CaseError(f"{self.where}: {gear.label}: has no flanks, which say pressure angle and profile shift")

    def _say_if_sides_differ(self, gear: Component, flanks: dict[str, Component | None], side: str) -> None:
        left, right = (
            {
                (part.kind, *sorted((k, str(v)) for k, v in part.values.items()))
                for part in (*self.gearbox.beside(flank.number, flank.kind), *self._referenced(flank))
            }
            for flank in (flanks["left"] or flanks["right"], flanks["right"] or flanks["left"])
            if flank is not None
        )
        if left != right and not self.stage.loaded_known:
            self.notes.append(f"{gear.label}: which flank carries is not said, and they differ: the {side} one taken")

    def _referenced(self, flank: Component) -> list[Component]:
        return [
            self.gearbox.components[n]
            for relation in self.gearbox.relations
            if relation.kind == "reference" and relation.role("origin") == flank.number
            for _, n in relation.parts
            if n != flank.number and n in self.gearbox.components
        ]

    def _datum(self, gear: Component) -> int:
        """1 where the datum face looks along the gear's axis; it is the face at the gear's place unless said."""
        return 1 if gear.text_of("datum_face_orientation") == "positive" else -1

    def _needed(self, component: Component, attribute: str) -> float:
        value = component.number_of(attribute)
        if value is None:
            raise CaseError(f"{self.where}: {component.label}: {attribute} is missing: a case needs it")
        return value

    def _title(self) -> str:
        names = [gear.name or f"gear {gear.number}" for gear in self.gears]
        title = f"{self.stage.component.name or f'Stage {self.stage.component.number}'}: {names[0]} / {names[1]}"
        return "".join(c if c.isprintable() else " " for c in title)


def _thinned(keys: dict[str, Any], rack: Rack) -> float:
    """Profile shift that cuts the mean allowance of a gear's tooth thickness (DIN 3967), in modules."""
    allowances = keys.get("tooth_thickness_allowance_um", [0.0])
    mean_mm = 0.5e-3 * (allowances[0] + allowances[-1])
    return 0.5 * mean_mm / (rack.module * math.tan(rack.pressure_angle))


def _present(keys: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in keys.items() if value is not None}


def _uneven(sections: dict[str, Any]) -> bool:
    """Whether flanks differ between the halves of a spur pair, which is meshed in halves by default."""
    keys = [sections.get(f"{gear}.{name}", {}) for gear in GEARS for name in (MODIFICATION, COAST)]
    return any(name in one for one in keys for name in (*UNEVEN, "topography"))
