"""Read a gearbox file: TOML -> `GearboxSections`, checked as a whole, with the cases of its meshes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from pmor.case import Case, change_case, changed_text, load_case, parse_case, without_models
from pmor.case.capability import refuse_beyond
from pmor.case.document import joined_files
from pmor.case.reader import parse_toml, read_text, sections_in
from pmor.case.seats import read_seats
from pmor.case.slips import case_slips
from pmor.core.errors import GeometryError, printable
from pmor.core.shown import Written
from pmor.machine.checks import ROUNDED_MM, GearboxReader
from pmor.machine.estimates import with_estimates
from pmor.machine.model import GearboxModel, HousingMatrices, pinion_torques, set_torques
from pmor.machine.settings import GearboxSections, Mesh, PlanetarySet
from pmor.machine.turning import never_back
from pmor.machine.weights import gears_on_shafts
from pmor.pair.model import gear_pair
from pmor.sets.loader import OnShafts, SetFile
from pmor.sets.loader import load as load_set

# Of a torque that follows from the loads.
TORQUE_DIGITS = 6


@dataclass(frozen=True)
class GearboxFile(Written):
    """A gearbox file that was read.

    Parameters
    ----------
    name : str
        Stem of the file name.
    text : str
        Of the file; empty of one in REXS.
    cases : dict of str to Case
        Of the meshes, ready to be trained.
    inputs : tuple of Path
        Files that were read.
    notes : tuple of str
        Assumptions about what a file does not say.
    """

    name: str
    text: str
    model: GearboxModel
    cases: dict[str, Case]
    inputs: tuple[Path, ...]
    notes: tuple[str, ...] = ()

    @property
    def sections(self) -> GearboxSections:
        """Of the file."""
        return self.model.sections

    @property
    def whole_text(self) -> str:
        """Text of the gearbox file and of those that it names."""
        named = {mesh.name for mesh in self.model.sections.meshes if mesh.case is not None or not self.text}
        cases = {f"case of {name}": case.text for name, case in self.cases.items() if name in named}
        sets = {f"set {name}": one.whole_text for name, one in self.model.sets.items()}
        housing = {f"housing, {key}": repr(matrix.tolist()) for key, matrix in self.model.of_housing.items()}
        return joined_files(self.text or repr(self.model.sections), {**cases, **sets, **housing})

    @property
    def never_back(self) -> str:
        """Shafts of loads that turn and that no few turns of a carrier bring back; empty without any."""
        return never_back(self.model)

    @property
    def angles_per_pitch(self) -> int:
        """Positions to a mesh cycle: as many as the case with most of them asks for."""
        return max((case.online.angles_per_pitch for case in self.cases.values()), default=0)

    @property
    def slips(self) -> list[str]:
        """A sentence for each value that is likely one in another unit."""
        of_meshes = (f"mesh {name}: {text}" for name, case in self.cases.items() for text in case_slips(case))
        return [*of_meshes, *(f"set {name}: {text}" for name, one in self.model.sets.items() for text in one.slips)]


def load(path: Path | str, read_set: Callable[[Path, OnShafts], SetFile] = load_set) -> GearboxFile:
    """Read and check a gearbox file, and the cases of its meshes.

    Parameters
    ----------
    read_set : callable
        Reads a file that the gearbox names for a set.

    Raises
    ------
    CaseError, GeometryError
        One line with file, place, rule and remedy.
    """
    path = Path(path)
    return parse_gearbox(read_text(path, "gearbox file"), printable(path.stem), str(path), (path,), read_set)


def parse_gearbox(
    text: str, name: str, where: str, inputs: tuple[Path, ...] = (),
    read_set: Callable[[Path, OnShafts], SetFile] = load_set,
) -> GearboxFile:  # fmt: skip
    """Check the text of a gearbox file; `where` names it in messages.

    Raises
    ------
    CaseError, GeometryError
    """
    reader = GearboxReader(where, sections_in(GearboxSections), inputs[0].parent if inputs else None)
    folder = reader.folder or Path()
    said = reader.section(parse_toml(text, where), GearboxSections, filled={"title": name})
    reader.check(said)
    cases = {mesh.name: placed_case(_case(reader, mesh), reader, mesh, said) for mesh in said.meshes}
    sets = {one.name: _set(reader, one, read_set) for one in said.sets}
    model, files = model_of(said, cases, sets), list(inputs[:1])
    files += [folder / mesh.case for mesh in said.meshes if mesh.case] + [folder / one.set for one in said.sets]
    torques = largest_torques(model)
    model = replace(model, sets={one.name: _set(reader, one, read_set, torques[one.name]) for one in said.sets})
    inside = [mesh for mesh in said.meshes if mesh.case is None and torques[mesh.name] > 0.0]
    cases |= {mesh.name: placed_case(_case(reader, mesh, torques[mesh.name]), reader, mesh, said) for mesh in inside}
    reader.check_gears(model, cases)
    reader.check_turned(model)
    model, read = with_housing(model, reader)
    files += read
    model, notes = with_estimates(model)
    return GearboxFile(name, text, model, cases, tuple(dict.fromkeys(files)), tuple(notes))


def with_housing(model: GearboxModel, reader: GearboxReader) -> tuple[GearboxModel, list[Path]]:
    """Return a gearbox on the housing that its file names, and the files of its matrices."""
    housing, each = model.sections.housing, "bearing to the housing"
    named = {key: name for key in ("stiffness", "mass", "surface") if (name := getattr(housing, key)) is not None}
    if not named:
        return model, []
    if housing.stiffness is None:
        key, name = next(iter(named.items()))
        reader.refuse(f'[housing] {key} = "{name}"', "needs the stiffness of the same seats: give stiffness too")
    stiffness = read_seats(reader, "housing", named.pop("stiffness"), model.seats, each, size=0)
    others = {key: read_seats(reader, "housing", name, model.seats, each, key, len(stiffness))
              for key, name in named.items()}  # fmt: skip
    moving = HousingMatrices(stiffness, **others)
    files = [reader.beside(name, "[housing]") for name in (housing.stiffness, *named.values())]
    return replace(model, housing=moving.at_seats(model.seats), housing_matrices=moving), files


def _case(reader: GearboxReader, mesh: Mesh, torque_Nm: float = 1.0) -> Case:
    """Return the case that a mesh names, with its changes; without one that of its own sections, under a torque."""
    where = f'{reader.where}: [[meshes]] "{mesh.name}"'
    if mesh.case is not None:
        case = load_case(reader.beside(mesh.case, f'[[meshes]] case = "{mesh.case}"'))
        return change_case(case, **mesh.sections) if mesh.sections else case
    text = changed_text("", {"load": {"torque_Nm": torque_Nm}, **mesh.sections})
    return parse_case(text, mesh.name, where, reader.folder)


def _set(
    reader: GearboxReader, one: PlanetarySet, read_set: Callable[[Path, OnShafts], SetFile],
    most_Nm: float | None = None,
) -> SetFile:  # fmt: skip
    """Return a set on its shafts, under a largest torque on its sun."""
    path = reader.beside(one.set, f'[[sets]] set = "{one.set}"')
    with reader.named(one):
        found = read_set(path, OnShafts(tuple(one.members), most_Nm))
    reader.check_set(one, found)
    return found


def largest_torques(model: GearboxModel) -> dict[str, float]:
    """Return the largest torques on pinions and suns over all loads, by mesh and by set, N m."""
    loads = [{**pinion_torques(model, load), **set_torques(model, load)} for load in model.sections.loads]
    names = [*model.pairs, *model.sets]
    largest = {name: max((abs(torques[name]) for torques in loads), default=0.0) for name in names}
    return {name: float(f"{torque:.{TORQUE_DIGITS}g}") for name, torque in largest.items()}


def placed_case(case: Case, reader: GearboxReader, mesh: Mesh, said: GearboxSections) -> Case:
    """Return a case on the axes of the gearbox."""
    where = f'{reader.where}: [[meshes]] "{mesh.name}"'
    refuse_beyond(case, "gearbox", where)
    shafts = {shaft.name: shaft for shaft in said.shafts}
    distance = math.dist(shafts[mesh.pinion.shaft].at_mm, shafts[mesh.wheel.shaft].at_mm)
    given = case.pair.centre_distance_mm
    if given is not None and abs(given - distance) > ROUNDED_MM:
        raise GeometryError(
            f"{where}: axes are {distance:.6g} mm apart, and centre_distance_mm = {given:g} in {mesh.case or 'pair'}: "
            "correct at_mm of a shaft, or leave centre_distance_mm out there"
        )
    stress = {"root_stress": case.root_stress}
    # That of a case file is for its runs: a gearbox solves it where it asks for it itself.
    asked = mesh.sections.get("mesh", {}).get("error_bar") is True
    bare = change_case(without_models(case), mesh={"error_bar": asked, "width": "whole"}, results=stress)
    return change_case(bare, pair={"centre_distance_mm": given or distance})


def model_of(said: GearboxSections, cases: dict[str, Case], sets: dict[str, SetFile]) -> GearboxModel:
    """Return the model of a gearbox, with the pairs of its cases."""
    pairs, shafts = {name: gear_pair(case) for name, case in cases.items()}, {one.name: one for one in said.shafts}
    heavy = said.meshes if any(said.gravity.vector) else ()
    gears = {mesh.name: gears_on_shafts(cases[mesh.name], pairs[mesh.name], mesh, shafts) for mesh in heavy}
    masses = {name: (pinion.mass_kg, wheel.mass_kg) for name, (pinion, wheel) in gears.items()}
    return GearboxModel(said, pairs, sets=sets, masses_kg=masses, cases=cases)
