"""A design file that was read: flanks of the meshes of a pair, a gearbox or a set that vary."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

from pmor.case import Case
from pmor.case.document import GEARS
from pmor.core.shown import Written
from pmor.design.settings import Design, Variable
from pmor.gear.condition import Assembly
from pmor.machine.loader import GearboxFile
from pmor.pair.conditions import assembly_of
from pmor.sets.loader import SetFile

# Tolerances of a set file that designs draw, by the keys of the errors.
PINS = {"pins_radial_um": "radial_um", "pins_tangential_um": "tangential_um", "timing_mrad": "timing_mrad"}


class Words(NamedTuple):
    """What is designed, in words.

    Attributes
    ----------
    kind, name, title : str
        Of the file that a variant is written as: a case, a gearbox or a set.
    base : str
        Flanks as that file has them.
    torque, angle : str
        What torques and angles are of.
    made : str
        Many of them.
    """

    kind: str
    name: str
    title: str
    base: str
    torque: str
    angle: str
    made: str


@dataclass(frozen=True)
class CarryingFlank:
    """A flank that carries: as its file has it, and as a gear of a case.

    Parameters
    ----------
    member : str
        The gear in the file.
    mesh : str or None
        Of a gearbox the mesh that the gear is of.
    flank : {"drive", "coast"}
    case : str
    gear : {"pinion", "wheel"}
    """

    member: str
    mesh: str | None
    flank: str
    case: str
    gear: str


@dataclass(frozen=True)
class DesignFile(Written):
    """A design file that was read.

    Parameters
    ----------
    name : str
        Stem of the file name.
    text : str
        Of the file and of what it starts from.
    inputs : tuple of Path
        Files that were read.
    source : Case, GearboxFile or SetFile
        What it starts from, as it was read.
    cases : mapping of str to Case
        Whose finite elements are solved: of a set by the members that mesh, else by the names of meshes or of the case.
    set : SetFile or None
        With the torques and the angles of the design.
    """

    name: str
    text: str
    design: Design
    inputs: tuple[Path, ...]
    source: Case | GearboxFile | SetFile
    cases: Mapping[str, Case]
    set: SetFile | None = None

    @property
    def box(self) -> GearboxFile | None:
        """The gearbox whose meshes are designed."""
        return self.source if isinstance(self.source, GearboxFile) else None

    @property
    def meshes(self) -> tuple[str, ...]:
        """Cases of the meshes that are designed, one for each mesh."""
        if self.set is not None:
            return tuple(mesh.case for mesh in self.set.plan.meshes)
        return self.design.mesh or tuple(self.cases)

    @property
    def case(self) -> Case | None:
        """The case of the only mesh that is designed."""
        return self.cases[self.meshes[0]] if self.set is None and len(self.meshes) == 1 else None

    @cached_property
    def flanks(self) -> tuple[CarryingFlank, ...]:
        """Flanks that carry under the loads."""
        carrying = dict[CarryingFlank, None]()
        for number, name in enumerate(self.meshes):
            mesh = name if self.box is not None else None
            members: Sequence[str] = GEARS
            if self.set is not None:
                of_set = self.set.plan.meshes[number]
                members = [self.set.plan.bodies[body].member for body in (of_set.pinion, of_set.wheel)]
            for gear, member in zip(GEARS, members, strict=True):
                carrying[CarryingFlank(member, mesh, self.cases[name].flank, name, gear)] = None
        return tuple(carrying)

    @property
    def sides(self) -> list[tuple[object, object]]:
        """What flanks of pinion and wheel of each mesh are made with: in a set a side of a gear in all its meshes."""
        if self.set is None:
            return [((name, GEARS[0]), (name, GEARS[1])) for name in self.meshes]
        meshes, cases = self.set.plan.meshes, self.set.cases
        return [((m.pinion, cases[m.case].flank), (m.wheel, cases[m.case].flank)) for m in meshes]

    @property
    def base(self) -> dict[str, Assembly]:
        """Flanks as they are filed, by the cases of the meshes."""
        return {name: assembly_of(self.cases[name]) for name in self.meshes}

    @property
    def words(self) -> Words:
        """What is designed, for pages and pictures."""
        if self.set is not None:
            name, title, angle = self.set.name, self.set.sections.title, "Angle of the first gear [pitches]"
            return Words("set", name, title, "as filed", "Torque of the set", angle, "sets")
        ends = "Torque on the pinion", "Pinion angle [pitches]"
        base, made = ("as filed", "gearboxes") if self.case is None else ("base case", "pairs")
        if self.box is not None:
            return Words("gearbox", self.box.name, self.box.sections.title, base, *ends, made)
        assert self.case is not None
        return Words("case", self.case.name, self.case.title, base, *ends, made)

    @property
    def pitches(self) -> int:
        """Mesh cycles that a variant is solved over, added up over the meshes that are solved one by one."""
        if self.set is not None:
            return self.set.pitches
        return sum(self.repeats_after(name) for name in self.meshes)

    def repeats_after(self, name: str) -> int:
        """Return the mesh cycles after which holes, and teeth that differ, stand as before, of a mesh."""
        base = assembly_of(self.cases[name])
        return self.cases[name].pair.repeats_with([(base.pinion, base.wheel)])

    @property
    def pins(self) -> dict[str, float]:
        """Standard deviations of pins, and of gears on them, by which a set file draws sets, by their keys."""
        return pins_of(self.source)

    @property
    def scattered(self) -> tuple[str, ...]:
        """Keys of what scatters."""
        return (*self.design.scatter.modifications, *self.design.scatter.axes, *self.pins)

    @property
    def notes(self) -> tuple[str, ...]:
        """Assumptions about what files do not say, and what was changed of them."""
        if self.set is not None:
            return (*self.set.changed, *self.set.notes)
        return () if self.box is None else self.box.notes

    @property
    def around(self) -> str:
        """Text of what results depend on beside the cases."""
        return "" if isinstance(self.source, Case) else source_text(self.source)


def source_text(source: Case | GearboxFile | SetFile) -> str:
    """Return the text of what a design starts from, files that it names included."""
    return source.text if isinstance(source, Case) else source.whole_text


def pins_of(source: Case | GearboxFile | SetFile) -> dict[str, float]:
    """Return the standard deviations of pins of a set, by their keys; empty of all else."""
    sizes = source.sections.tolerances if isinstance(source, SetFile) and not source.sections.gears else None
    deviations = {key: getattr(sizes, key) for key in PINS} if sizes is not None else {}
    return {key: size for key, size in deviations.items() if size > 0.0}


def on_flanks(variable: Variable, flanks: Sequence[CarryingFlank]) -> list[CarryingFlank]:
    """Return the flanks that a variable changes."""
    return [
        flank for flank in flanks
        if variable.gear in (flank.member, "both") and flank.flank in variable.flanks
        and variable.mesh in (flank.mesh, None)
    ]  # fmt: skip


def of_case(variables: Sequence[Variable], flanks: Sequence[CarryingFlank], case: str) -> dict[int, Variable]:
    """Return the variables of a mesh as those of its case, by their numbers."""
    variables_of: dict[int, Variable] = {}
    for number, variable in enumerate(variables):
        gears = [flank.gear for flank in on_flanks(variable, flanks) if flank.case == case]
        if gears:
            gear = gears[0] if len(gears) == 1 else "both"
            variables_of[number] = replace(variable, gear=gear, mesh=None, flank="both")
    return variables_of


def parameter_names(flanks: Sequence[CarryingFlank]) -> dict[tuple[str, str], str]:
    """Return what parameters of the gears of cases, ``case, gear``, are told by: mesh, member, flank where both carry.

    The mesh stands there where there are several.
    """
    sides = {(f.mesh, f.member): {g.flank for g in flanks if (g.mesh, g.member) == (f.mesh, f.member)} for f in flanks}
    several = len({flank.mesh for flank in flanks}) > 1
    return {
        (f.case, f.gear): ".".join([
            *([str(f.mesh)] if several else []), f.member, *([f.flank] if len(sides[f.mesh, f.member]) > 1 else []),
        ])
        for f in flanks
    }  # fmt: skip
