"""A gearbox from a REXS file: shafts, bearings, stages and load cases, with a note on each thing that is not said.

The axes of the machine are those of the file where its first shaft lies along x; else the file is turned.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from pmor.case import Case
from pmor.core.arrays import FloatArray
from pmor.core.errors import CaseError, printable
from pmor.machine.settings import (
    HOUSING,
    Bearing,
    GearboxSections,
    GearPlace,
    MemberPlace,
    Mesh,
    PlanetarySet,
    Shaft,
    ShaftSection,
)
from pmor.rexs.bearings import RexsBearings
from pmor.rexs.housing import read_housing_matrix
from pmor.rexs.joints import COUPLINGS, FITS, RING, axis_of, shafts_of, stages
from pmor.rexs.loads import RexsLoads, read_gravity
from pmor.rexs.lubricant import read_lubricant
from pmor.rexs.model import BEARINGS, Component, Gearbox, read_rexs
from pmor.rexs.read import stage_case
from pmor.rexs.sets_on_shafts import StageOnShafts, stage_names, stages_on_shafts
from pmor.rexs.shafts import PARALLEL, along_x, density_of, elastic_constants, sections_of
from pmor.rexs.stage import face_middle, find_stage
from pmor.rexs.units import rounded

UNSOLVED = ("bevel_stage", "worm_stage")


@dataclass(frozen=True)
class ReadGearbox:
    """A gearbox as a REXS file has it.

    Parameters
    ----------
    sections : GearboxSections
    cases : dict of str to Case
        Of the meshes.
    face_offsets : dict of str to (float, float)
        By how much the faces of pinion and wheel lie beyond their common middle along x, mm; where any does.
    stages : tuple of StageOnShafts
        Planetary ones.
    notes : tuple of str
        Assumptions, and parts that are left out.
    housing : ndarray, optional
        As of `pmor.machine.model.GearboxModel`.
    results : tuple of (load case, shaft, N m)
        Torques that the file has as results.
    """

    sections: GearboxSections
    cases: dict[str, Case]
    face_offsets: dict[str, tuple[float, float]]
    stages: tuple[StageOnShafts, ...]
    notes: tuple[str, ...]
    housing: FloatArray | None
    results: tuple[tuple[str, str, float], ...]


def read_gearbox(path: Path) -> ReadGearbox:
    """Read all of a gearbox that pmor solves.

    Raises
    ------
    FileFormatError
        When it is no REXS file.
    CaseError
        When the file does not say enough, with what is missing.
    """
    return _Draft(read_rexs(path), path).read()


class _Draft:
    """Parts of a gearbox as found, and notes on missing data."""

    def __init__(self, gearbox: Gearbox, path: Path) -> None:
        self.path, self.notes = path, list[str]()
        self.gearbox = gearbox = along_x(gearbox, self.notes.append)
        kinds = ("shaft", *BEARINGS, *COUPLINGS, *FITS)
        self.names = Counter(one.name for one in gearbox.components.values() if one.kind in kinds)
        self.face_offsets: dict[str, tuple[float, float]] = {}
        self.gravity = read_gravity(gearbox, self.notes.append)
        self.stages = stages_on_shafts(gearbox, path, self.notes.append)
        self.own = {number for stage in self.stages for number in stage.own}
        self.shafts = {shaft.number: shaft for shaft in gearbox.of_kind("shaft") if shaft.number not in self.own}

    def read(self) -> ReadGearbox:
        meshes, cases = self.meshes()
        bearings = RexsBearings(self.gearbox, self.shafts, self.own, self.name, self.notes.append)
        loads = RexsLoads(self.gearbox, str(self.path), self.shafts, self.name, self.notes.append)
        title = next((unit.name for unit in self.gearbox.of_kind("gear_unit") if unit.name), "")
        sections = GearboxSections(
            title=printable(title or self.path.stem), shafts=tuple(map(self.shaft, self.shafts.values())),
            bearings=(*bearings.read(), *self.carriers()), meshes=meshes, sets=tuple(map(self.planetary, self.stages)),
            loads=loads.read(), gravity=self.gravity, lubricant=read_lubricant(self.gearbox, self.notes.append),
        )  # fmt: skip
        housing = read_housing_matrix(self.gearbox, bearings.seats, self.notes.append)
        notes = tuple(dict.fromkeys(self.notes))
        return ReadGearbox(
            sections, cases, self.face_offsets, tuple(self.stages), notes, housing, tuple(loads.results)
        )

    def carriers(self) -> Iterator[Bearing]:
        """Yield rigid joints of carriers that stand on two shafts."""
        for stage in self.stages:
            for shaft, place, other in stage.bridges:
                yield Bearing(
                    name=f"{stage.name}, carrier", shaft=self.name(shaft), to=self.name(other), at_mm=place,
                    radial_N_per_mm="rigid", axial_N_per_mm="rigid", tilt_Nmm_per_rad="rigid",
                    torsion_Nmm_per_rad="rigid",
                )  # fmt: skip

    def planetary(self, stage: StageOnShafts) -> PlanetarySet:
        places = {
            member: MemberPlace(shaft=self.name(shaft), at_mm=place) for member, (shaft, place) in stage.seats.items()
        }
        return PlanetarySet(name=stage.name, set=self.path, **{"carrier": HOUSING, "sun": HOUSING, **places})  # type: ignore[arg-type]

    def name(self, component: Component) -> str:
        """Unique, and printable."""
        if not component.name:
            return f"{component.number}"
        alike = self.names[component.name] > 1 or component.name == HOUSING
        return printable(f"{component.name} [{component.number}]" if alike else component.name)

    def origin(self, shaft: Component) -> list[float]:
        """Where a shaft begins, mm."""
        place = shaft.numbers_of("support_vector")
        if len(place) != 3:
            raise shaft.refusal("support_vector is missing: the file must say where the shafts are")
        if math.dist(axis_of(shaft), [1.0, 0.0, 0.0]) > PARALLEL:
            others = [one.label for kind in UNSOLVED for one in self.gearbox.of_kind(kind)]
            why = f": {', '.join(others)}: bevel, hypoid and worm gears are not solved" if others else ""
            rule = f"its axis is not parallel to that of the first shaft, or looks the other way{why}; "
            raise shaft.refusal(f"{rule}pmor export --to case takes a cylindrical stage alone")
        return place

    def shaft(self, shaft: Component) -> Shaft:
        """Return a shaft with its sections."""
        x, y, z = self.origin(shaft)
        sections = [
            ShaftSection(length_mm=part.length, outer_mm=part.outer, inner_mm=part.inner)
            for part in sections_of(self.gearbox, shaft, self.notes.append)
        ]
        modulus, ratio = elastic_constants(self.gearbox, shaft, self.notes.append)
        density = density_of(self.gearbox, shaft)
        if density is None and any(self.gravity.vector):
            self.notes.append(f"{shaft.label}: no density of its material: {Shaft.density_kg_m3:g} kg/m3 assumed")
        return Shaft(
            name=self.name(shaft), at_mm=(y, z), start_mm=x, sections=tuple(sections),
            youngs_modulus_GPa=1e-3 * modulus, poisson_ratio=ratio,
            density_kg_m3=rounded(density) if density else Shaft.density_kg_m3,
        )  # fmt: skip

    def meshes(self) -> tuple[tuple[Mesh, ...], dict[str, Case]]:
        found, cases = list[Mesh](), dict[str, Case]()
        inside = {number for one in self.stages for number in one.stage.meshes}
        names = stage_names(self.gearbox)
        for number, gears in sorted(stages(self.gearbox).items()):
            if number in inside:
                continue
            if ring := next((gear for gear in gears if gear.kind == RING), None):
                rule = "internal pairs are solved with shafts in planetary stages alone: leave it out of the file"
                raise ring.refusal(rule)
            stage = find_stage(self.gearbox, number, str(self.path))
            read = stage_case(self.path, self.gearbox, stage, f"{self.path}, stage {number}")
            name = names[number]
            self.notes += [f"{name}: {note}" for note in read.notes]
            faces = [self.face(gear, stage.component) for gear in (stage.pinion, stage.wheel)]
            low, high = max(face[0] for face in faces), min(face[1] for face in faces)
            middle = 0.5 * (low + high)
            pinion, wheel = (self.gear_place(gear, middle) for gear in (stage.pinion, stage.wheel))
            if any(sum(face) != 2.0 * middle for face in faces):
                self.face_offsets[name] = (0.5 * sum(faces[0]) - middle, 0.5 * sum(faces[1]) - middle)
            found.append(Mesh(name=name, case=self.path, pinion=pinion, wheel=wheel, changes={}))
            cases[name] = read.case
        if not found and not self.stages:
            raise CaseError(f"{self.path}: has no stage of two external cylindrical gears, and no planetary one")
        return tuple(found), cases

    def face(self, gear: Component, stage: Component) -> tuple[float, float]:
        """Where the face of a gear begins and ends along x, mm."""
        middle = face_middle(self.gearbox, gear, [1.0, 0.0, 0.0])
        width = gear.number_of("face_width") or stage.number_of("common_face_width")
        if middle is None or not width:
            raise gear.refusal("u_coordinate_on_shaft or face_width is missing: where is its face?")
        return middle - 0.5 * width, middle + 0.5 * width

    def gear_place(self, gear: Component, x: float) -> GearPlace:
        for shaft in shafts_of(self.gearbox, gear):
            return GearPlace(shaft=self.name(shaft), at_mm=x - self.origin(shaft)[0])
        raise gear.refusal("is on no shaft")
