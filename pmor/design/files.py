"""Design files that were read: of a pair, of a mesh of a gearbox, of a set."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from pmor.case import Case
from pmor.design.set_flanks import CarryingFlank, carrying_flanks
from pmor.design.settings import Design
from pmor.gear.condition import Assembly
from pmor.machine.loader import GearboxFile
from pmor.pair.conditions import assembly_of
from pmor.sets.loader import SetFile

# Tolerances of a set file that designs draw, by the keys of the errors.
PINS = {"pins_radial_um": "radial_um", "pins_tangential_um": "tangential_um", "timing_mrad": "timing_mrad"}


@dataclass(frozen=True)
class Words:
    """What is designed, in words.

    Parameters
    ----------
    kind, name, title : str
        Of the file that a design starts from: a case or a set.
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
class DesignFile(ABC):
    """A design file that was read.

    Parameters
    ----------
    name : str
        Stem of the file name.
    text : str
        Of the file and of what it starts from.
    inputs : tuple of Path
        Files that were read.
    """

    name: str
    text: str
    design: Design
    inputs: tuple[Path, ...]

    @property
    @abstractmethod
    def words(self) -> Words:
        """What is designed, for pages and pictures."""

    @property
    @abstractmethod
    def cases(self) -> Mapping[str, Case]:
        """Cases whose finite elements are solved."""

    @property
    @abstractmethod
    def searched(self) -> Mapping[str, Case]:
        """Cases that results of variants depend on."""

    @property
    @abstractmethod
    def pitches(self) -> int:
        """Mesh cycles that a variant is solved over."""

    @property
    @abstractmethod
    def scattered(self) -> tuple[str, ...]:
        """Keys of what scatters."""

    @property
    def notes(self) -> tuple[str, ...]:
        """Assumptions about what files do not say."""
        return ()


@dataclass(frozen=True)
class PairDesign(DesignFile):
    """A design of a pair.

    Parameters
    ----------
    case : Case
        Ready to be trained for it.
    box : GearboxFile or None
        That the design names in place of a case.
    """

    case: Case
    box: GearboxFile | None = None

    @property
    def mesh(self) -> str:
        """Name of the mesh of the gearbox."""
        return str(self.design.mesh)

    @property
    def base(self) -> Assembly:
        """The pair as the case builds it."""
        return assembly_of(self.case)

    @property
    def words(self) -> Words:
        """The case."""
        name, title = self.case.name, self.case.title
        return Words("case", name, title, "base case", "Torque on the pinion", "Pinion angle [pitches]", "pairs")

    @property
    def cases(self) -> Mapping[str, Case]:
        """The case, or those of all meshes of the gearbox."""
        return {self.case.name: self.case} if self.box is None else {**self.box.cases, self.mesh: self.case}

    @property
    def searched(self) -> Mapping[str, Case]:
        """The case."""
        return {"case": self.case}

    @property
    def pitches(self) -> int:
        """Mesh cycles after which holes, and teeth that differ, stand as before."""
        return self.case.pair.repeats_with([(self.base.pinion, self.base.wheel)])

    @property
    def scattered(self) -> tuple[str, ...]:
        """Keys of flanks and axes."""
        return (*self.design.scatter.modifications, *self.design.scatter.axes)

    @property
    def notes(self) -> tuple[str, ...]:
        """Assumptions about what the gearbox does not say."""
        return () if self.box is None else self.box.notes


def pins_of(file: SetFile) -> dict[str, float]:
    """Return the standard deviations of pins, and of gears on them, by which a set file draws sets, by their keys."""
    sizes = file.sections.tolerances
    found = {key: getattr(sizes, key) for key in PINS} if sizes is not None else {}
    return {key: size for key, size in found.items() if size > 0.0}


@dataclass(frozen=True)
class SetDesign(DesignFile):
    """A design of a set.

    Parameters
    ----------
    set : SetFile
        With the torques and the angles of the design.
    filed : SetFile
        As it was read.
    """

    set: SetFile
    filed: SetFile

    @cached_property
    def flanks(self) -> tuple[CarryingFlank, ...]:
        """Flanks that carry."""
        return carrying_flanks(self.set)

    @property
    def base(self) -> dict[str, Assembly]:
        """Flanks of all meshes as the set file has them, by their cases."""
        return {name: assembly_of(case) for name, case in self.set.cases.items()}

    @property
    def words(self) -> Words:
        """The set."""
        name, title, angle = self.set.name, self.set.sections.title, "Angle of the first gear [pitches]"
        return Words("set", name, title, "as filed", "Torque of the set", angle, "sets")

    @property
    def cases(self) -> Mapping[str, Case]:
        """Cases of all meshes that differ."""
        return self.set.cases

    searched = cases

    @property
    def pitches(self) -> int:
        """Mesh cycles after which the set stands as before."""
        return self.set.pitches

    @property
    def pins(self) -> dict[str, float]:
        """Standard deviations of pins, by the keys of the set file that gives them."""
        return pins_of(self.filed)

    @property
    def scattered(self) -> tuple[str, ...]:
        """Keys of flanks and pins."""
        return (*self.design.scatter.modifications, *self.pins)

    @property
    def notes(self) -> tuple[str, ...]:
        """Assumptions about what the set file does not say, and what was changed of it."""
        return (*self.set.changed, *self.set.notes)
