"""Gearboxes and sets from their files, of whatever notation: TOML, or REXS."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from pmor.case.change import change_case
from pmor.case.reader import read_text, sections_in
from pmor.core.errors import CaseError, printable
from pmor.machine.checks import GearboxReader
from pmor.machine.estimates import with_estimates
from pmor.machine.loader import GearboxFile, largest_torques, model_of, placed_case
from pmor.machine.loader import parse_gearbox as parse_toml_gearbox
from pmor.machine.model import GearboxModel, held_torques, pinion_senses, set_torques
from pmor.rexs.gearbox import read_gearbox
from pmor.rexs.joints import stages
from pmor.rexs.model import is_rexs, read_rexs
from pmor.rexs.sets import STAGE, PlanetaryStage, ReadSet
from pmor.rexs.sets_on_shafts import StageOnShafts
from pmor.rexs.trains import on_fixed_axes, read_train
from pmor.sets.loader import OnShafts, SetFile, checked_set, sections_of
from pmor.sets.loader import load as load_set_toml
from pmor.sets.reader import SetReader
from pmor.sets.settings import SetSections

OFFSET_DIGITS = 9
# Relative; results of other programs have losses, or are rounded.
DIFFERS = 0.01


def is_one_set(path: Path) -> bool:
    """Return whether a REXS file is of a train on fixed axes, or of one planetary stage without stages beside it."""
    gearbox = read_rexs(path)
    if on_fixed_axes(gearbox):
        return True
    found = gearbox.of_kind(STAGE)
    return len(found) == 1 and PlanetaryStage(gearbox, path, found[0]).meshes == {*stages(gearbox)}


def read_set(path: Path) -> ReadSet:
    """Read the planetary stage of a REXS file, or a train on fixed axes.

    Raises
    ------
    FileFormatError
        When it is no REXS file.
    CaseError, GeometryError
        When it has no such stage, or does not say enough of it, with what is missing.
    """
    gearbox = read_rexs(path)
    if on_fixed_axes(gearbox):
        return read_train(gearbox, path)
    found = gearbox.of_kind(STAGE)
    if len(found) != 1:
        count = f"has {len(found)} planetary stages" if found else "has no planetary stage"
        raise CaseError(f"{path}: {count}: a set file has one; pmor run takes it as a gearbox")
    return PlanetaryStage(gearbox, path, found[0]).read()


def load_set(path: Path | str, shafts: OnShafts | None = None) -> SetFile:
    """Read and check a set file, or the planetary stage of a REXS file; parameters and errors as of the former.

    Raises
    ------
    CaseError, GeometryError, FileFormatError
        One line with file, place, rule and remedy.
    """
    path = Path(path)
    if not is_rexs(path):
        return load_set_toml(path, shafts)
    return _file(read_set(path), printable(path.stem), str(path), path, shafts)


def read_sections(path: Path) -> tuple[str, SetSections]:
    """Return the text of a set file, or of what a REXS file says, and its sections: gears are not put together yet.

    Raises
    ------
    CaseError, GeometryError, FileFormatError
    """
    if is_rexs(path):
        read = read_set(path)
        return read.text, read.sections
    text = read_text(path, "set file")
    return text, sections_of(text, path)


def load_gearbox(path: Path | str) -> GearboxFile:
    """Read and check a gearbox file, or a gearbox in REXS, and the cases of its meshes.

    Raises
    ------
    CaseError, GeometryError, FileFormatError
        One line with file, place, rule and remedy.
    """
    path = Path(path)
    if is_rexs(path):
        return _of_rexs(path)
    return parse_gearbox(read_text(path, "gearbox file"), printable(path.stem), str(path), (path,))


def parse_gearbox(text: str, name: str, where: str, inputs: tuple[Path, ...] = ()) -> GearboxFile:
    """Check the text of a gearbox file, as `pmor.machine.loader.parse_gearbox`, whose sets may be in REXS."""
    return parse_toml_gearbox(text, name, where, inputs, load_set)


def _of_rexs(path: Path) -> GearboxFile:
    """Take a REXS file: faces that are not centred lie in the frame of their mesh, which the first load turns."""
    found, reader = read_gearbox(path), GearboxReader(str(path))
    said = found.sections
    reader.check(said)
    cases = {mesh.name: placed_case(found.cases[mesh.name], reader, mesh, said) for mesh in said.meshes}
    # The sense of a torque does not change the teeth by which it is found.
    model = model_of(said, cases, {stage.name: _stage(path, stage, 1.0) for stage in found.stages})
    senses, most = pinion_senses(model, said.loads[0]), largest_torques(model)
    first = set_torques(model, said.loads[0])
    sets = {
        stage.name: _stage(path, stage, math.copysign(most[stage.name], first[stage.name])) for stage in found.stages
    }
    for name, offsets in found.face_offsets.items():
        along = -senses[name] if cases[name].flank == "coast" else senses[name]
        pinion, wheel = (round(along * offset, OFFSET_DIGITS) for offset in offsets)
        cases[name] = change_case(cases[name], pinion={"face_offset_mm": pinion}, wheel={"face_offset_mm": wheel})
    model, estimated = with_estimates(replace(model_of(said, cases, sets), housing=found.housing))
    reader.check_gears(model, cases)
    reader.check_turned(model)
    of_sets = [f"{name}: {note}" for name, one in sets.items() for note in (*one.changed, *one.notes)]
    notes = (*found.notes, *estimated, *_other_results(model, found.results), *of_sets)
    return GearboxFile(printable(path.stem), "", model, cases, (path,), notes)


def _stage(path: Path, stage: StageOnShafts, on_sun_Nm: float) -> SetFile:
    """Return a planetary stage of a REXS file as a set on its shafts."""
    part = stage.stage
    read = PlanetaryStage(part.gearbox, path, part.stage).read(on_sun_Nm)
    return _file(read, stage.name, f"{path}: {part.stage.label}", path, OnShafts(tuple(stage.seats)))


def _file(read: ReadSet, name: str, where: str, path: Path, shafts: OnShafts | None) -> SetFile:
    reader = SetReader(where, sections_in(SetSections), path.parent)
    return checked_set(reader, read.sections, name, read.text, (path,), read.notes, read.changed, shafts)


def _other_results(model: GearboxModel, results: Sequence[tuple[str, str, float]]) -> list[str]:
    """Return notes on torques that a file has as results, and that are others here."""
    loads, found = {load.name: load for load in model.sections.loads}, list[str]()
    for name, shaft, torque in results:
        own = held_torques(model, loads[name]).get(shaft)
        if own is not None and abs(own - torque) > DIFFERS * abs(torque):
            found.append(f"{name}: the file has {torque:.6g} N m on {shaft} as a result: {own:.6g} N m hold it here")
    return found
