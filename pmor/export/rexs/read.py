"""A stage of a REXS gearbox as a case: geometry, tools, material, blanks, flanks, torques; notes on the rest."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pmor.case import Case, make_case, parse_case
from pmor.core.errors import CaseError, GeometryError, printable
from pmor.export.rexs.blanks import blank_keys
from pmor.export.rexs.flanks import READERS, FileFlank, read_flank
from pmor.export.rexs.joints import RING, axis_of, shafts_of
from pmor.export.rexs.model import Component, Gearbox, read_rexs
from pmor.export.rexs.rings import CUTTER, cleared, ring_keys
from pmor.export.rexs.stage import Stage, face_middle, find_stage, middle_on_shaft
from pmor.gear.pair import GearPair
from pmor.pair.model import gear_pair

# Defaults: bore over reference diameter, and line load in N/mm for the torque.
BORE_SHARE, LINE_LOAD = 0.2, 100.0
# Modules between root circle and bore below which a blank cannot be meshed: the gear is cut into its shaft.
LEAST_RIM = 1.5
# Relative; a distance nearer to that without backlash counts as equal.
SAME_DISTANCE = 1e-10
SIDES = ("left", "right")
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
    notes : tuple of str
        Assumptions, changed values, parts not understood.
    changed : tuple of str
        Those of them that say what was changed, as the gears would not run as the file has them.
    """

    case: Case
    notes: tuple[str, ...]
    changed: tuple[str, ...]


def read_stage(path: Path, stage: int | None = None) -> Imported:
    """Make a case of a stage, with notes: see `pmor.app.export.import_rexs`."""
    gearbox = read_rexs(path)
    where = f"{path}, stage {stage}" if stage is not None else str(path)
    return stage_case(path, gearbox, find_stage(gearbox, stage, str(path)), where)


def stage_case(path: Path, gearbox: Gearbox, found: Stage, where: str) -> Imported:
    """Make a case of a stage that was found."""
    draft = _Draft(gearbox, found, where)
    sections = draft.sections()
    plain = make_case(path.stem, **sections)
    for gear, keys in zip(("pinion", "wheel"), draft.modifications(gear_pair(plain)), strict=True):
        if keys:
            sections[f"{gear}.modification"] = keys
    draft.note_unread()
    if _uneven(sections):
        sections["mesh"] = {"width": "whole"}
    text = make_case(path.stem, **sections).text
    head = [
        f"{path.name}, {found.component.label}, REXS {gearbox.version} of {gearbox.program or 'an unnamed program'}.",
        "Missing values are assumed; mesh and training are the defaults.",
        *draft.notes,
    ]
    comments = "\n".join(f"# {printable(line)}" for line in head)
    case = parse_case(f"{comments}\n\n{text}", path.stem, where)
    gear_pair(case)  # refused here, with its place, and not at the first use
    return Imported(case, tuple(draft.notes), tuple(draft.changed))


class _Draft:
    """Sections of a case as found, and notes on missing data."""

    def __init__(self, gearbox: Gearbox, stage: Stage, where: str) -> None:
        self.gearbox, self.stage, self.where = gearbox, stage, where
        self.gears = stage.pinion, stage.wheel
        self.notes, self.changed = list(stage.notes), list[str]()
        self.datum = [self._datum(gear) for gear in self.gears]
        # Seen from the larger z the pinion's carrying flank is the left one.
        self.along = [a * self.datum[0] * (1 if stage.loaded == "left" else -1) for a in axis_of(stage.pinion)]
        self.flanks = [self._flank(gear) for gear in self.gears]

    def sections(self) -> dict[str, Any]:
        """Return all sections but the modifications."""
        pinion, wheel = self.gears
        flank, module = self.flanks[0], self._needed(pinion, "normal_module")
        helix = pinion.number_of("helix_angle_reference_diameter") or 0.0
        angle, mating = self._needed(flank, "normal_pressure_angle"), -helix
        # Some programs write a ring with the sign of its hand, others with that of a gear outside in its place.
        if wheel.kind == RING and math.isclose(helix, wheel.number_of("helix_angle_reference_diameter") or 0.0):
            mating = helix
        for attribute, one, other in (
            ("normal_module", module, self._needed(wheel, "normal_module")),
            ("normal_pressure_angle", angle, self._needed(self.flanks[1], "normal_pressure_angle")),
            ("helix_angle_reference_diameter", mating, wheel.number_of("helix_angle_reference_diameter") or 0.0),
        ):
            if not math.isclose(one, other, rel_tol=1e-6, abs_tol=1e-6):
                said = f"{other:g} of {wheel.label} where its mate asks for {one:g}"
                raise CaseError(f"{self.where}: {attribute}: {said}: no pair")
        pair: dict[str, Any] = {"module_mm": module, "pressure_angle_deg": _rounded(angle), "helix_angle_deg": helix}
        faces = self._faces()
        pair["face_width_mm"] = _rounded(faces[0][2])
        tooth = [self._tooth(gear, flank, module, helix) for gear, flank in zip(self.gears, self.flanks, strict=True)]
        for keys, gear, (offset, width, common) in zip(tooth, self.gears, faces, strict=True):
            if not math.isclose(width, common):
                keys["face_width_mm"] = _rounded(width)
            if abs(offset) > 1e-9:
                keys["face_offset_mm"] = _rounded(offset)
            keys |= self._material(gear)
        self._clear_tips(wheel, pair, tooth)
        distance = self.stage.component.number_of("center_distance")
        if distance is not None:
            pair["centre_distance_mm"] = self._distance(distance, pair, tooth)
        torques = self.stage.torques_Nm or (self._assumed_torque(module, helix, faces[0][2]),)
        sections: dict[str, Any] = {
            "title": self._title(), "load": {"torque_Nm": torques[-1]}, "pair": _present(pair),
            "pinion": tooth[0], "wheel": tooth[1],
        }  # fmt: skip
        if len(torques) > 1:
            sections["online"] = {"torques_Nm": list(torques)}
        return sections

    def _clear_tips(self, wheel: Component, pair: dict[str, Any], tooth: list[dict[str, Any]]) -> None:
        """Shorten the tips of a ring whose tip circle is not said, until they clear the pinion's fillets."""
        if wheel.kind == RING and "addendum" not in tooth[1]:
            found = cleared(_present(pair), tooth, wheel.label)
            if found is not None:
                tooth[1]["addendum"] = found[0]
                self.notes.append(found[1])
                self.changed.append(found[1])

    def modifications(self, pair: GearPair) -> Iterator[dict[str, Any]]:
        """Return the keys of the modifications of both gears."""
        for number, (gear, flank) in enumerate(zip(self.gears, self.flanks, strict=True)):
            tooth = (pair.pinion, pair.wheel)[number]
            low, high = pair.faces[number]
            along = sum(a * b for a, b in zip(axis_of(gear), self.along, strict=True))
            profile = FileFlank(
                tooth.base_radius, *pair.active_rolls[number], tooth.tip_roll_angle, high - low,
                self.datum[number] * (1 if along >= 0.0 else -1),
            )  # fmt: skip
            found = read_flank([part for part in self._referenced(flank) if part.kind != "material"], profile)
            self.notes += found.notes
            if deviations := flank.numbers_of("custom_pmor_pitch_deviations"):
                found.keys["pitch_deviations_um"] = [_rounded(1e3 * deviation) for deviation in deviations]
            yield found.keys

    def note_unread(self) -> None:
        """Note the attributes of gears, flanks, tools and modifications without a counterpart in a case."""
        parts = [*self.gears, *self.flanks]
        for gear, flank in zip(self.gears, self.flanks, strict=True):
            parts += self._tools(gear, flank)
            parts += [part for part in self._referenced(flank) if part.kind in UNDERSTOOD]
        for part in {part.number: part for part in parts}.values():
            if unread := sorted(set(part.values) - part.used - WITHOUT_MEANING):
                self.notes.append(f"{part.label}: not read: {', '.join(unread)}")

    def _tools(self, gear: Component, flank: Component) -> list[Component]:
        kind = CUTTER if gear.kind == RING else "rack_shaped_tool"
        return self.gearbox.beside(flank.number, kind) or self.gearbox.beside(gear.number, kind)

    def _tooth(self, gear: Component, flank: Component, module: float, helix: float) -> dict[str, Any]:
        shift = flank.number_of("addendum_modification_coefficient")
        if shift is None:
            shift = (flank.number_of("addendum_modification") or 0.0) / module
        teeth = gear.whole_number_of("number_of_teeth") or int(self._needed(gear, "number_of_teeth"))
        radius = 0.5 * teeth * module / math.cos(math.radians(helix))
        keys: dict[str, Any] = {"teeth": teeth}
        if shift:
            keys["profile_shift"] = _rounded(shift)
        if gear.kind == RING:
            sizes = teeth, module, helix, shift
            found, notes = ring_keys(gear, self._tools(gear, flank), sizes, self._shaft_diameter(gear))
            keys |= found
            self.notes += notes
        else:
            keys |= self._addendum(gear, module, shift, radius)
            keys |= self._tool(gear, flank, module, shift, radius)
            root_radius = radius - module * (keys.get("dedendum", 1.25) - shift)
            keys["bore_radius_mm"] = self._bore(gear, root_radius, radius, module)
            keys |= blank_keys(gear)
        if chamfer := flank.number_of("tooth_tip_chamfer"):
            keys["tip_chamfer_mm"] = chamfer
        if rounding := flank.number_of("custom_pmor_tip_rounding"):
            keys["tip_rounding_mm"] = rounding
        if allowances := flank.numbers_of("custom_pmor_tooth_thickness_allowances"):
            keys["tooth_thickness_allowance_um"] = [_rounded(1e3 * allowance) for allowance in allowances]
        return keys

    def _addendum(self, gear: Component, module: float, shift: float, radius: float) -> dict[str, float]:
        tip, height = gear.number_of("tip_diameter"), gear.number_of("tooth_tip_height")
        if tip is not None and tip > 2.0 * (radius - module):
            return {"addendum": _rounded((0.5 * tip - radius) / module - shift)}
        if tip is not None:
            self.notes.append(f"{gear.label}: tip_diameter = {tip:g} mm is below its teeth: addendum 1 assumed")
        elif height is not None:
            return {"addendum": _rounded(height / module - shift)}
        else:
            self.notes.append(f"{gear.label}: no tip_diameter: addendum 1 assumed")
        return {}

    def _tool(self, gear: Component, flank: Component, module: float, shift: float, radius: float) -> dict[str, float]:
        """Dedendum and tip radius of the rack: from its tool, else from the root circle."""
        keys = dict[str, float]()
        if tools := self._tools(gear, flank):
            tool = tools[-1]  # the last step makes the flank
            for key, size, factor in (
                ("dedendum", "addendum", "addendum_coefficient"),
                ("rack_tip_radius", "tip_corner_radius", "tip_corner_radius_factor"),
            ):
                value = tool.number_of(f"{factor}_reference_profile")
                length = tool.number_of(f"{size}_reference_profile")
                if value is None and length is not None:
                    value = length / module
                if value is not None:
                    keys[key] = _rounded(value)
            if tool.number_of("protuberance_amount", "protuberance_amount_factor"):
                self.notes.append(f"{tool.label}: its protuberance is left out: the fillet begins where the rack ends")
        root = gear.number_of("root_diameter")
        if "dedendum" not in keys and root is not None:
            keys["dedendum"] = _rounded((radius - 0.5 * root) / module + shift)
        if missing := [key for key in ("dedendum", "rack_tip_radius") if key not in keys]:
            self.notes.append(f"{gear.label}: no tool says {' and '.join(missing)}: that of ISO 53 A assumed")
        return keys

    def _bore(self, gear: Component, root_radius: float, radius: float, module: float) -> float:
        """Radius at which the body is held: of its bore, or of the shaft that it sits on."""
        if own := gear.number_of("custom_pmor_thin_rim_bore"):
            return _rounded(0.5 * own)
        bore = gear.number_of("inner_diameter") or next(
            (body.number_of("inner_diameter") for body in self.gearbox.beside(gear.number, "gear_body")), None
        )
        bore = bore or self._shaft_diameter(gear)
        if bore and 0.5 * bore < root_radius - LEAST_RIM * module:
            return _rounded(0.5 * bore)
        assumed = float(f"{BORE_SHARE * 2.0 * radius:.3g}")
        why = f"{bore:g} mm leaves no rim" if bore else "nothing says its bore"
        self.notes.append(f"{gear.label}: {why}: bore radius {assumed:g} mm assumed")
        return assumed

    def _shaft_diameter(self, gear: Component) -> float | None:
        for shaft in shafts_of(self.gearbox, gear):
            middle = middle_on_shaft(self.gearbox, gear, shaft)
            for section in self.gearbox.beside(shaft.number, "shaft_section"):
                start, length = section.number_of("u_coordinate_on_shaft"), section.number_of("length")
                ends = [section.number_of(f"outer_diameter_{end}") for end in ("begin", "end")]
                if middle is None or start is None or not length or not start <= middle <= start + length:
                    continue
                low, high = (next((end for end in order if end), None) for order in (ends, ends[::-1]))
                return low and high and low + (high - low) * (middle - start) / length
        return None

    def _material(self, gear: Component) -> dict[str, float]:
        keys = dict[str, float]()
        for material in self.gearbox.beside(gear.number, "material"):
            if modulus := material.number_of("elastic_modulus"):
                keys["youngs_modulus_GPa"] = _rounded(1e-3 * modulus)
            if (ratio := material.number_of("poisson_ratio")) is not None:
                keys["poisson_ratio"] = ratio
        if not keys:
            self.notes.append(f"{gear.label}: refers to no material: steel assumed, 210 GPa and 0.3")
        return keys

    def _faces(self) -> list[tuple[float, float, float]]:
        """Of each gear: offset from the middle of the common face, own face width, common face width; mm."""
        widths = [self._needed(gear, "face_width") for gear in self.gears]
        middles = [face_middle(self.gearbox, gear, self.along) for gear in self.gears]
        if middles[0] is None or middles[1] is None:
            self.notes.append("axial positions of the gears are missing: faces assumed centred on each other")
            middles = [0.0, 0.0]
        ends = [(m - 0.5 * w, m + 0.5 * w) for m, w in zip(middles, widths, strict=True)]  # type: ignore[operator]
        low, high = max(ends[0][0], ends[1][0]), min(ends[0][1], ends[1][1])
        if high <= low:
            raise CaseError(f"{self.where}: the faces of the gears lie beside each other: no contact")
        return [(0.5 * (a + b - low - high), w, high - low) for (a, b), w in zip(ends, widths, strict=True)]

    def _distance(self, distance: float, pair: dict[str, Any], teeth: list[dict[str, Any]]) -> float | None:
        """The centre distance; None where it is the one without backlash, or too small for shifts that are rounded."""

        def made(**distance_mm: float) -> GearPair:
            both = {"pinion": teeth[0], "wheel": teeth[1], "load": {"torque_Nm": 1.0}}
            return gear_pair(make_case("pair", pair=_present(pair) | distance_mm, **both))

        try:
            if math.isclose(abs(made().centre_distance), distance, rel_tol=SAME_DISTANCE):
                return None
            made(centre_distance_mm=distance)
        except (CaseError, GeometryError) as error:
            if "jam" not in str(error):
                raise type(error)(f"{self.where}: {error}") from None
            self.notes.append(f"centre distance {distance:g} mm: too small for the profile shifts: without backlash")
            return None
        return distance

    def _assumed_torque(self, module: float, helix: float, width: float) -> float:
        teeth = self._needed(self.gears[0], "number_of_teeth")
        torque = float(f"{LINE_LOAD * width * 0.5 * teeth * module / math.cos(math.radians(helix)) * 1e-3:.2g}")
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


def _rounded(value: float) -> float:
    """Round off the last digits after a change of units."""
    return float(f"{value:.12g}")


def _present(keys: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in keys.items() if value is not None}


def _uneven(sections: dict[str, Any]) -> bool:
    """Whether flanks differ between the halves of a spur pair, which is meshed in halves by default."""
    keys = [sections.get(f"{gear}.modification", {}) for gear in ("pinion", "wheel")]
    return any(name in one for one in keys for name in ("helix_slope_um", "twist_um", "topography"))
