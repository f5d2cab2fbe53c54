"""A train of gears on fixed axes of a REXS file as a set file: gears, shafts, meshes, torques.

Such a file says by a name of ours that its shafts stand rigidly below each gear. Another file of shafts is a gearbox.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from pmor.case.change import document_text
from pmor.case.document import COAST, GEARS, MODIFICATION
from pmor.case.reader import sections_in
from pmor.core.errors import printable
from pmor.rexs.drive import Drive, drives
from pmor.rexs.joints import shafts_of, stages
from pmor.rexs.model import Component, Gearbox
from pmor.rexs.read import stage_case
from pmor.rexs.sets import ReadSet, nested
from pmor.rexs.shafts import on_shaft
from pmor.rexs.stage import find_stage
from pmor.rexs.units import rounded
from pmor.sets.layout import PAIR
from pmor.sets.reader import SetReader
from pmor.sets.settings import SetSections

# Of the gear unit: a name of ours.
FIXED_AXES = "custom_pmor_fixed_axes"
# Of torques of load cases that differ by a factor.
SAME = 1e-9


def on_fixed_axes(gearbox: Gearbox) -> bool:
    """Return whether the axes of a gearbox are fixed."""
    return any(unit.text_of(FIXED_AXES) == "true" for unit in gearbox.of_kind("gear_unit"))


def read_train(gearbox: Gearbox, path: Path) -> ReadSet:
    """Read a train of gears on fixed axes.

    Raises
    ------
    FileFormatError, CaseError, GeometryError
        When the file does not say enough of it, with what is missing.
    """
    train = _Train(gearbox, path)
    document = train.document()
    reader = SetReader(str(path), sections_in(SetSections), path.parent)
    sections = reader.section(nested(document), SetSections)
    return ReadSet(sections, document_text(document), tuple(dict.fromkeys(train.notes)), tuple(train.changed))


class _Train:
    """Gears and meshes as they are found, and notes on missing data."""

    def __init__(self, gearbox: Gearbox, path: Path) -> None:
        self.gearbox, self.path = gearbox, path
        self.notes, self.changed = list[str](), list[str]()
        self.meshes = sorted(stages(gearbox).items())
        self.gears = {gear.number: gear for gear in sorted(
            {gear.number: gear for _, pair in self.meshes for gear in pair}.values(), key=lambda gear: gear.number
        )}  # fmt: skip
        self.on_shaft = {gear.number: dict(on_shaft(gear)) for gear in self.gears.values()}
        self.names = {number: printable(gear.name or f"gear_{number}") for number, gear in self.gears.items()}

    def document(self) -> dict[str, Any]:
        """Return the sections of a set file by their dotted names."""
        members, meshes, z = dict[str, Any](), list[dict[str, Any]](), dict[int, float]()
        first = dict[str, float]()
        sections: dict[str, dict[str, Any]] = {}
        for number, _ in self.meshes:
            stage = find_stage(self.gearbox, number, str(self.path))
            # All meshes are seen from one end; what one carries follows from the torques on all of them.
            stage = replace(stage, torques_Nm=(1.0,), notes=(), coast=stage.loaded == "right")
            read = stage_case(self.path, self.gearbox, stage, f"{self.path}, stage {number}")
            self.notes += [note for note in read.notes if note not in read.changed]
            self.changed += read.changed
            both = stage.pinion, stage.wheel
            pair = {key: value for key, value in read.sections["pair"].items() if key != "centre_distance_mm"}
            # The helix angle of a pair is that of the gear that drives first by its section.
            sense = -1.0 if stage.coast else 1.0
            name = self.section(pair, sense, sections, first)
            meshes.append({"gears": [self.names[gear.number] for gear in both], "pair": name})
            faces = [self.face(gear) for gear in both]
            # Of a mesh both gears have the z of the face that drives first.
            middle = next((z[gear.number] for gear in both if gear.number in z), rounded(0.5 * sum(faces[0])))
            for role, gear, (low, high) in zip(GEARS, both, faces, strict=True):
                if gear.number in z:
                    continue
                z[gear.number] = middle
                face = high - low, 0.5 * (low + high) - middle
                members |= self.member(read.sections, role, self.names[gear.number], *face)
        title = next((unit.name for unit in self.gearbox.of_kind("gear_unit") if unit.name), self.path.stem)
        document: dict[str, Any] = {"title": printable(title), "gears": list(self.listed(z)), "meshes": meshes}
        others = self.amounts()
        return document | sections | members | ({"sweep": {"torques_Nm": others}} if others else {})

    def section(
        self, pair: dict[str, Any], sense: float, sections: dict[str, dict[str, Any]], first: dict[str, float]
    ) -> str:
        """Return the section of a pair, another one where none has the same keys."""
        for name, keys in sections.items():
            turned = {**pair, "helix_angle_deg": sense * first[name] * pair["helix_angle_deg"] + 0.0}
            if turned == keys:
                return name
        name = PAIR if not sections else f"{PAIR}_{len(sections) + 1}"
        sections[name], first[name] = pair, sense
        return name

    def member(self, sections: dict[str, Any], role: str, name: str, width: float, offset: float) -> dict[str, Any]:
        """Return the sections of a gear, which has the same ones in each of its meshes."""
        keys = {key: value for key, value in sections[role].items() if not key.startswith("face_")}
        keys |= {"face_width_mm": rounded(width)} | ({"face_offset_mm": rounded(offset)} if abs(offset) > 1e-9 else {})
        inner = {
            f"{name}.{part}": sections[f"{role}.{part}"] for part in (MODIFICATION, COAST)
            if f"{role}.{part}" in sections
        }  # fmt: skip
        return {name: keys, **inner}

    def face(self, gear: Component) -> tuple[float, float]:
        """Ends of the face of a gear along the axes."""
        place, width = gear.numbers_of("support_vector"), gear.number_of("face_width")
        if len(place) != 3 or width is None:
            raise gear.refusal("support_vector or face_width is missing: where is its face?")
        return place[0] - 0.5 * width, place[0] + 0.5 * width

    def listed(self, z: dict[int, float]) -> Iterator[dict[str, Any]]:
        """Yield the gears."""
        torques = dict(self.torques())
        for number, gear in self.gears.items():
            _, x, y = gear.numbers_of("support_vector")
            keys: dict[str, Any] = {"name": self.names[number], "at_mm": [x, y, z[number]]}
            for shaft in shafts_of(self.gearbox, gear):
                if printable(shaft.name) != self.names[number]:
                    keys["shaft"] = printable(shaft.name or str(shaft.number))
            if number in torques:
                keys["torque_Nm"] = "balance" if torques[number] is None else torques[number]
            yield keys | self.on_shaft[number]

    @property
    def cases(self) -> list[list[Drive]]:
        """Places at which torque enters or leaves in each load case, the strongest one last."""
        found = [drives(self.gearbox, case) for case in self.gearbox.load_cases or ({},)]
        return sorted(found, key=_amount)

    def torques(self) -> Iterator[tuple[int, float | None]]:
        """Yield the torques of the strongest load case by the gears that they are on; None holds against the others."""
        for drive in self.cases[-1]:
            place = (drive.load.number_of("u_coordinate_on_shaft") or 0.0) + self.start(drive.shaft)
            own = [gear for gear in self.gears.values() if drive.shaft in shafts_of(self.gearbox, gear)]
            if not own:
                raise drive.load.refusal(f"{drive.shaft.label} has no gear: put the torque on the shaft of a gear")
            yield min(own, key=lambda gear: abs(sum(self.face(gear)) - 2.0 * place)).number, drive.torque_Nm

    def amounts(self) -> list[float]:
        """Return amounts of the torque on the first gear in load cases below the strongest one, rising."""
        most = self.cases[-1]
        driver = find_stage(self.gearbox, self.meshes[0][0], str(self.path)).pinion
        on_first = abs(dict(self.torques()).get(driver.number) or 0.0)
        for case in self.cases:
            share = _amount(case) / _amount(most)
            for one, strongest in zip(case, most, strict=True):
                if abs((one.torque_Nm or 0.0) - share * (strongest.torque_Nm or 0.0)) > SAME * _amount(most):
                    rule = "load cases differ by more than a factor: keep those of one kind in the file"
                    raise one.load.refusal(rule)
        return [rounded(on_first * _amount(case) / _amount(most)) for case in self.cases[:-1]]

    def start(self, shaft: Component) -> float:
        """Where a shaft begins along the axes."""
        return (shaft.numbers_of("support_vector") or [0.0])[0]


def _amount(case: list[Drive]) -> float:
    return sum(abs(drive.torque_Nm or 0.0) for drive in case)
