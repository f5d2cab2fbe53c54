"""Read a gearbox file: TOML -> `GearboxSections`, checked as a whole, with the cases of its meshes."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

from pmor.case import Case, change_case, changed_text, load_case, parse_case, without_models
from pmor.case.capability import refuse_beyond
from pmor.case.reader import parse_toml, read_text, sections_in
from pmor.case.seats import read_seats
from pmor.case.slips import case_slips
from pmor.core.errors import GeometryError, printable
from pmor.export.rexs.model import ENDINGS
from pmor.machine.checks import ROUNDED_MM, GearboxReader
from pmor.machine.model import GearboxModel, pinion_senses, pinion_torques, set_torques
from pmor.machine.rexs import read_gearbox
from pmor.machine.rexs_follows import other_results, with_estimates
from pmor.machine.rexs_sets import StageOnShafts
from pmor.machine.settings import GearboxSections, Mesh, PlanetarySet
from pmor.machine.weights import gear_masses
from pmor.pair.model import gear_pair
from pmor.sets.loader import OnShafts, SetFile, parse_set
from pmor.sets.loader import load as load_set
from pmor.sets.rexs import PlanetaryStage

OFFSET_DIGITS = 9
# Of a torque that follows from the loads.
TORQUE_DIGITS = 6


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

    @property
    def slips(self) -> list[str]:
        """A sentence for each value that is likely one in another unit."""
        of_meshes = (f"mesh {name}: {text}" for name, case in self.cases.items() for text in case_slips(case))
        return [*of_meshes, *(f"set {name}: {text}" for name, one in self.model.sets.items() for text in one.slips)]


def load(path: Path | str) -> GearboxFile:
    """Read and check a gearbox file, TOML or REXS, and the cases of its meshes.

    Raises
    ------
    CaseError, GeometryError
        One line with file, place, rule and remedy.
    """
    path = Path(path)
    where, name = str(path), printable(path.stem)
    reader = GearboxReader(where, sections_in(GearboxSections), path.parent)
    if path.suffix.lower() in ENDINGS:
        return _of_rexs(path, reader)
    text = read_text(path, "gearbox file")
    said = reader.section(parse_toml(text, where), GearboxSections, filled={"title": name})
    reader.check(said)
    cases = {mesh.name: _placed(_case(reader, mesh), reader, mesh, said) for mesh in said.meshes}
    sets = {one.name: _set(reader, one) for one in said.sets}
    model, inputs = _model(said, cases, sets), [path, *(path.parent / mesh.case for mesh in said.meshes if mesh.case)]
    inputs += [path.parent / one.set for one in said.sets]
    torques = _largest_torques(model)
    model = replace(model, sets={one.name: _set(reader, one, torques[one.name]) for one in said.sets})
    inside = [mesh for mesh in said.meshes if mesh.case is None and torques[mesh.name] > 0.0]
    cases |= {mesh.name: _placed(_case(reader, mesh, torques[mesh.name]), reader, mesh, said) for mesh in inside}
    texts = [text, *(case.text for case in cases.values()), *(one.whole_text for one in sets.values())]
    reader.check_gears(model)
    reader.check_turned(model, cases)
    if (housing := said.housing.stiffness) is not None:
        model = replace(model, housing=read_seats(reader, "housing", housing, model.seats, "bearing to the housing"))
        inputs.append(path.parent / housing)
        texts.append((path.parent / housing).read_text(encoding="utf-8-sig"))
    return GearboxFile(name, "\n".join(texts), model, cases, tuple(dict.fromkeys(inputs)))


def _case(reader: GearboxReader, mesh: Mesh, torque_Nm: float = 1.0) -> Case:
    """Return the case that a mesh names, with its changes; without one that of its own sections, under a torque."""
    assert reader.folder is not None
    # That of a case file is for its runs, which have one.
    if mesh.sections.get("mesh", {}).get("error_bar") is True:
        rule = "a gearbox has no error bar of the mesh: leave it out, and run the pair's own case to see it"
        reader.refuse(f'[[meshes]] "{mesh.name}": mesh.error_bar = true', rule)
    if mesh.case is not None:
        case = load_case(reader.folder / mesh.case)
        return change_case(case, **mesh.sections) if mesh.sections else case
    text = changed_text("", {"load": {"torque_Nm": torque_Nm}, **mesh.sections})
    return parse_case(text, mesh.name, f'{reader.where}: [[meshes]] "{mesh.name}"', reader.folder)


def _set(reader: GearboxReader, one: PlanetarySet, most_Nm: float | None = None) -> SetFile:
    """Return a set on its shafts, under a largest torque on its sun."""
    assert reader.folder is not None
    with reader.named(one):
        found = load_set(reader.folder / one.set, OnShafts(tuple(one.members), most_Nm))
    reader.check_set(one, found)
    return found


def _largest_torques(model: GearboxModel) -> dict[str, float]:
    """Return the largest torques on pinions and suns over all loads, by mesh and by set, N m."""
    loads = [{**pinion_torques(model, load), **set_torques(model, load)} for load in model.sections.loads]
    names = [*model.pairs, *model.sets]
    largest = {name: max((abs(torques[name]) for torques in loads), default=0.0) for name in names}
    return {name: float(f"{torque:.{TORQUE_DIGITS}g}") for name, torque in largest.items()}


def _placed(case: Case, reader: GearboxReader, mesh: Mesh, said: GearboxSections) -> Case:
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
    bare = change_case(without_models(case), mesh={"error_bar": False, "width": "whole"}, results=stress)
    return change_case(bare, pair={"centre_distance_mm": given or distance})


def _of_rexs(path: Path, reader: GearboxReader) -> GearboxFile:
    """Take a REXS file: faces that are not centred lie in the frame of their mesh, which the first load turns."""
    found = read_gearbox(path)
    said = found.sections
    reader.check(said)
    cases = {mesh.name: _placed(found.cases[mesh.name], reader, mesh, said) for mesh in said.meshes}
    # The sense of a torque does not change the teeth by which it is found.
    model = _model(said, cases, {stage.name: _stage(path, stage, 1.0) for stage in found.stages})
    senses, most = pinion_senses(model, said.loads[0]), _largest_torques(model)
    first = set_torques(model, said.loads[0])
    sets = {
        stage.name: _stage(path, stage, math.copysign(most[stage.name], first[stage.name])) for stage in found.stages
    }
    for name, offsets in found.face_offsets.items():
        pinion, wheel = (round(senses[name] * offset, OFFSET_DIGITS) for offset in offsets)
        cases[name] = change_case(cases[name], pinion={"face_offset_mm": pinion}, wheel={"face_offset_mm": wheel})
    model, estimated = with_estimates(replace(_model(said, cases, sets), housing=found.housing), found.estimated)
    said = model.sections
    housing = [] if found.housing is None else found.housing.tolist()
    texts = repr(said), *(case.text for case in cases.values()), *(one.text for one in sets.values()), repr(housing)
    reader.check_gears(model)
    reader.check_turned(model, cases)
    of_sets = [f"{name}: {note}" for name, one in sets.items() for note in (*one.changed, *one.notes)]
    notes = (*found.notes, *estimated, *other_results(model, found.results), *of_sets)
    return GearboxFile(printable(path.stem), "\n".join(texts), model, cases, (path,), notes)


def _stage(path: Path, stage: StageOnShafts, on_sun_Nm: float) -> SetFile:
    """Return a planetary stage of a REXS file as a set on its shafts."""
    part = stage.stage
    read = PlanetaryStage(part.gearbox, path, part.stage).read(on_sun_Nm)
    where = f"{path}: {part.stage.label}"
    return parse_set(read.text, stage.name, where, (path,), read.notes, read.changed, OnShafts(tuple(stage.seats)))


def _model(said: GearboxSections, cases: dict[str, Case], sets: dict[str, SetFile]) -> GearboxModel:
    pairs, shafts = {name: gear_pair(case) for name, case in cases.items()}, {one.name: one for one in said.shafts}
    heavy = said.meshes if any(said.gravity.vector) else ()
    masses = {mesh.name: gear_masses(cases[mesh.name], pairs[mesh.name], mesh, shafts) for mesh in heavy}
    return GearboxModel(said, pairs, sets=sets, masses_kg=masses)
