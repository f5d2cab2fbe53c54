"""Read a gearbox file: TOML -> `GearboxSections`, checked as a whole, with the cases of its meshes."""

from __future__ import annotations

import csv
import io
import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

import numpy as np

from pmor.case import Case, change_case, load_case, without_models
from pmor.case.capability import refuse_beyond
from pmor.case.reader import Reader, parse_toml, read_text, sections_in
from pmor.case.values import did_you_mean
from pmor.core.arrays import FloatArray
from pmor.core.errors import GeometryError, printable
from pmor.machine.beam import NODE
from pmor.machine.model import GearboxModel, pinion_senses
from pmor.machine.rexs import ENDINGS, read_gearbox
from pmor.machine.settings import HOUSING, Bearing, GearboxSections, LoadCase, Mesh, Shaft, ShaftSection
from pmor.pair.conditions import assembly_of
from pmor.pair.model import gear_pair

# Places along the axes that belong together may differ by so much: drawings are rounded, mm.
ROUNDED_MM = 1e-3
OFFSET_DIGITS = 9
# Of a stiffness matrix of the housing: difference of its halves, and least eigenvalue, over the largest.
SYMMETRIC, HELD = 1e-6, 1e-12
LONGEST_NAME, NO_FILE_NAME = 60, '/\\:*?"<>|'
STIFFNESSES = {"radial_N_per_mm": "rigid", "axial_N_per_mm": "free", "tilt_Nmm_per_rad": "free"}


@dataclass(frozen=True)
class GearboxFile:
    """A gearbox file that was read.

    Parameters
    ----------
    name : str
        Stem of the file name.
    text : str
        Of the file and of the cases that it names.
    cases : dict of str to Case
        Of the meshes, ready to be trained.
    inputs : tuple of Path
        Files that were read.
    notes : tuple of str
        Assumptions about what a REXS file does not say.
    """

    name: str
    text: str
    model: GearboxModel
    cases: dict[str, Case]
    inputs: tuple[Path, ...]
    notes: tuple[str, ...] = ()


def load(path: Path | str) -> GearboxFile:
    """Read and check a gearbox file, TOML or REXS, and the cases of its meshes.

    Raises
    ------
    CaseError, GeometryError
        One line with file, place, rule and remedy.
    """
    path = Path(path)
    where, name = str(path), printable(path.stem)
    reader = _Reader(where, sections_in(GearboxSections), path.parent)
    if path.suffix.lower() in ENDINGS:
        return _of_rexs(path, reader)
    text = read_text(path, "gearbox file")
    said = reader.section(parse_toml(text, where), GearboxSections, filled={"title": name})
    reader.check(said)
    cases = {mesh.name: reader.case(mesh, said) for mesh in said.meshes}
    inputs = path, *(path.parent / mesh.case for mesh in said.meshes)
    texts = "\n".join([text, *(case.text for case in cases.values())])
    model = replace(_model(said, cases), housing=reader.housing(said))
    reader.check_turned(model, cases)
    if said.housing.stiffness is not None:
        inputs = *inputs, path.parent / said.housing.stiffness
        texts += (path.parent / said.housing.stiffness).read_text(encoding="utf-8-sig")
    return GearboxFile(name, texts, model, cases, tuple(dict.fromkeys(inputs)))


def _of_rexs(path: Path, reader: _Reader) -> GearboxFile:
    """Take a REXS file: faces that are not centred lie in the frame of their mesh, which the first load turns."""
    found = read_gearbox(path)
    said = found.sections
    reader.check(said)
    cases = {mesh.name: reader.placed(found.cases[mesh.name], mesh, said) for mesh in said.meshes}
    senses = pinion_senses(_model(said, cases), said.loads[0])
    for name, offsets in found.face_offsets.items():
        pinion, wheel = (round(senses[name] * offset, OFFSET_DIGITS) for offset in offsets)
        cases[name] = change_case(cases[name], pinion={"face_offset_mm": pinion}, wheel={"face_offset_mm": wheel})
    model, texts = _model(said, cases), (repr(said), *(case.text for case in cases.values()))
    reader.check_turned(model, cases)
    return GearboxFile(printable(path.stem), "\n".join(texts), model, cases, (path,), found.notes)


def _model(said: GearboxSections, cases: dict[str, Case]) -> GearboxModel:
    return GearboxModel(said, {name: gear_pair(case) for name, case in cases.items()})


def _alike_from_both_ends(case: Case) -> bool:
    """Whether a pair is the same seen from its other end."""
    assembly, pair = assembly_of(case), case.pair
    flanks = assembly.pinion.mirrored and assembly.wheel.mirrored
    return (
        flanks and not assembly.misalignment.tilted and pair.pinion.face_offset_mm == pair.wheel.face_offset_mm == 0.0
    )


class _Reader(Reader):
    """Checks what no single key can know."""

    def check(self, said: GearboxSections) -> None:
        """Refuse a gearbox whose parts do not fit together."""
        for what in ("shafts", "bearings", "meshes", "loads"):
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
        for one, two in combinations(said.shafts, 2):
            self.check_apart(one, two)
        for mesh in said.meshes:
            self.check_name(mesh)
            self.check_facing(mesh, shafts)
        for load in said.loads:
            self.check_balance(load, said)

    def check_shaft(self, shaft: Shaft) -> None:
        """Refuse an axis without two coordinates, and sections without material."""
        if len(shaft.at_mm) != 2:
            self.refuse(f'[[shafts]] "{shaft.name}": at_mm', "must be y and z of the axis: write two numbers")
        if not shaft.sections:
            self.refuse(f'[[shafts]] "{shaft.name}": sections = []', "must have at least one section: add it")
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
        """Refuse a bearing of two kinds, or one to a shaft that is not there."""
        where = f'[[bearings]] "{bearing.name}"'
        inner = [kind for kind in ("ball", "roller") if getattr(bearing, kind) is not None]
        given = [key for key, usual in STIFFNESSES.items() if getattr(bearing, key) != usual]
        if len(inner) > 1 or (inner and given):
            self.refuse(f"{where}: {', '.join(inner + given)}", "a bearing has one kind: leave out all but one")
        if bearing.to == HOUSING:
            return
        if bearing.to not in shafts:
            valid = did_you_mean(bearing.to, [HOUSING, *shafts])
            self.refuse(f'{where}: to = "{bearing.to}"', f'must be a shaft or "{HOUSING}": {valid}')
        one, other = shafts[bearing.shaft], shafts[bearing.to]
        if math.dist(one.at_mm, other.at_mm) > ROUNDED_MM:
            self.refuse(
                f'{where}: to = "{bearing.to}"', f'has another axis than "{bearing.shaft}": correct at_mm of one'
            )
        place = bearing.at_mm + one.start_mm - other.start_mm
        if not -ROUNDED_MM <= place <= other.length + ROUNDED_MM:
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

    def check_name(self, mesh: Mesh) -> None:
        """Refuse a name that is none for the file of its basis."""
        if len(mesh.name) > LONGEST_NAME or mesh.name.startswith(".") or set(mesh.name) & set(NO_FILE_NAME):
            rule = f"names a file: at most {LONGEST_NAME} characters, without {NO_FILE_NAME} and no point in front"
            self.refuse(f'[[meshes]] name = "{mesh.name:.60}"', rule)

    def check_facing(self, mesh: Mesh, shafts: dict[str, Shaft]) -> None:
        """Refuse gears that do not face each other."""
        x = [shafts[gear.shaft].start_mm + gear.at_mm for gear in (mesh.pinion, mesh.wheel)]
        if abs(x[0] - x[1]) > ROUNDED_MM:
            rule = "gears do not face each other: both places are the middle of the pair's face width; correct at_mm"
            self.refuse(f'[[meshes]] "{mesh.name}": pinion at x = {x[0]:g} mm, wheel at {x[1]:g} mm', rule)
        if mesh.pinion.shaft == mesh.wheel.shaft:
            self.refuse(f'[[meshes]] "{mesh.name}"', "pinion and wheel are on one shaft: name two")

    def check_balance(self, load: LoadCase, said: GearboxSections) -> None:
        """Refuse torques that do not hold each other."""
        for train in _trains(said):
            torques = [torque for torque in load.torques if torque.shaft in train]
            held = [torque for torque in torques if torque.torque_Nm == "balance"]
            if len(held) != 1:
                names = ", ".join(f'"{name}"' for name in train)
                found = "no torque" if not held else f"{len(held)} torques"
                self.refuse(
                    f'[[loads]] "{load.name}"',
                    f'{found} of the train of shafts {names} hold against the others: write torque_Nm = "balance" at '
                    "one place",
                )
            if len(torques) < 2 or all(torque.torque_Nm in ("balance", 0.0) for torque in torques):
                rule = f'has no torque to carry in the train of shaft "{train[0]}": add one'
                self.refuse(f'[[loads]] "{load.name}"', rule)

    def housing(self, said: GearboxSections) -> FloatArray | None:
        """Return the stiffness of the bearings' seats; None where the housing is rigid."""
        name = said.housing.stiffness
        if name is None:
            return None
        assert self.folder is not None
        where = f'[housing] stiffness = "{name}"'
        text = read_text(self.folder / name, "CSV file beside the gearbox file", f"{self.where}: {where}")
        try:
            matrix = np.array([[float(cell) for cell in row] for row in csv.reader(io.StringIO(text)) if row])
        except ValueError as error:
            self.refuse(where, f"must hold numbers, as many in each line ({error}): correct it")
        size = NODE * sum(bearing.to == HOUSING for bearing in said.bearings)
        if matrix.shape != (size, size):
            shape = " x ".join(map(str, matrix.shape))
            self.refuse(where, f"is {shape}, and must be {size} x {size}: six rows for each bearing to the housing")
        largest = np.abs(matrix).max(initial=0.0)
        if not np.isfinite(largest) or np.abs(matrix - matrix.T).max() > SYMMETRIC * largest:
            self.refuse(where, "must be symmetric and finite: a stiffness matrix is")
        scale = 1.0 / np.sqrt(np.maximum(np.diagonal(matrix), np.finfo(float).tiny))
        if np.diagonal(matrix).min() <= 0.0 or np.linalg.eigvalsh(scale[:, None] * matrix * scale).min() < HELD:
            self.refuse(where, "must be positive definite: hold the housing at its feet")
        return 0.5 * (matrix + matrix.T)

    def check_turned(self, model: GearboxModel, cases: dict[str, Case]) -> None:
        """Refuse loads of both senses on a pair that differs from end to end: z of its case turns with the torque."""
        senses = [pinion_senses(model, load) for load in model.sections.loads]
        for name, case in cases.items():
            if len({sense[name] for sense in senses}) > 1 and not _alike_from_both_ends(case):
                self.refuse(
                    f'[[loads]]: they turn the mesh "{name}" both ways, and it is not the same seen from both ends',
                    "write a gearbox file for each sense",
                )

    def case(self, mesh: Mesh, said: GearboxSections) -> Case:
        """Return the case of a mesh that the file names."""
        assert self.folder is not None
        case = load_case(self.folder / mesh.case)
        return self.placed(change_case(case, **mesh.changes) if mesh.changes else case, mesh, said)

    def placed(self, case: Case, mesh: Mesh, said: GearboxSections) -> Case:
        """Return a case on the axes of the gearbox."""
        where = f'{self.where}: [[meshes]] "{mesh.name}"'
        refuse_beyond(case, "gearbox", where)
        shafts = {shaft.name: shaft for shaft in said.shafts}
        distance = math.dist(shafts[mesh.pinion.shaft].at_mm, shafts[mesh.wheel.shaft].at_mm)
        given = case.pair.centre_distance_mm
        if given is not None and abs(given - distance) > ROUNDED_MM:
            raise GeometryError(
                f"{where}: axes are {distance:.6g} mm apart, and centre_distance_mm = {given:g} in {mesh.case}: "
                "correct at_mm of a shaft, or leave centre_distance_mm out there"
            )
        stress = {"root_stress": case.root_stress}
        bare = change_case(without_models(case), mesh={"error_bar": False, "width": "whole"}, results=stress)
        return change_case(bare, pair={"centre_distance_mm": given or distance})


def _places(said: GearboxSections) -> Iterator[tuple[str, str, float]]:
    """All places along shafts: where they are written, the shaft, mm."""
    for bearing in said.bearings:
        yield f'[[bearings]] "{bearing.name}"', bearing.shaft, bearing.at_mm
    for mesh in said.meshes:
        for name, gear in (("pinion", mesh.pinion), ("wheel", mesh.wheel)):
            yield f'[[meshes]] "{mesh.name}": {name}', gear.shaft, gear.at_mm
    for load in said.loads:
        for shaft, place in load.places:
            yield f'[[loads]] "{load.name}"', shaft, place


def _spans(shaft: Shaft) -> Iterator[tuple[float, float, ShaftSection]]:
    ends = shaft.start_mm + np.cumsum([0.0, *(section.length_mm for section in shaft.sections)])
    yield from zip(ends[:-1].tolist(), ends[1:].tolist(), shaft.sections, strict=True)


def _trains(said: GearboxSections) -> list[tuple[str, ...]]:
    """Shafts that meshes join, in the order of the file."""
    train = {shaft.name: {shaft.name} for shaft in said.shafts}
    for mesh in said.meshes:
        joined = train[mesh.pinion.shaft] | train[mesh.wheel.shaft]
        train |= dict.fromkeys(joined, joined)
    return list(dict.fromkeys(tuple(name for name in train if name in names) for names in train.values()))
