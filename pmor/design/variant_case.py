"""A variant of a design as a file of what it started from: a case, a gearbox or a set."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from pmor.case import Case, change_case, load_case, text_of
from pmor.case.change import document_text
from pmor.case.coast import mirrored_flank, other_by_default
from pmor.case.document import COAST, MODIFICATION
from pmor.case.reader import Reader, parse_toml
from pmor.core.arrays import FloatArray
from pmor.core.errors import CaseError, OutputError
from pmor.design.files import DesignFile, of_case
from pmor.design.loader import SECTIONS, uneven
from pmor.design.settings import Variable
from pmor.design.variables import assembly_at
from pmor.gear.modification import UNMODIFIED, Modification
from pmor.rexs.to_toml import gearbox_texts
from pmor.sets.loader import SetFile
from pmor.storage.atomic import atomic_path
from pmor.storage.design_file import DesignResults, read_design_file
from pmor.storage.results_folder import results_folder


def write_variant(file: DesignFile, folder: Path, number: int, *, overwrite: bool = False) -> Path:
    """Write the case, gearbox or set file of a variant into the folder of its results, and return its path.

    That of a gearbox has the cases of its meshes beside it.

    Raises
    ------
    CaseError, OutputError, FileFormatError
        When there is no such variant, or the results are those of another design.
    """
    stem = f"variant_{number}"
    texts = {f"{stem}{name}": text for name, text in _texts(file, folder / "design.h5", number, stem).items()}
    with results_folder(folder, tuple(texts), (), overwrite, file.inputs):
        for name, text in texts.items():
            with atomic_path(folder / name, True) as temporary:
                temporary.write_text(text, encoding="utf-8")
    return folder / f"{stem}.toml"


def _texts(file: DesignFile, results: Path, number: int, stem: str) -> dict[str, str]:
    """Return the texts of a variant's files by what follows the stem in their names, that of the variant first."""
    if not results.exists():
        raise OutputError(f"{results}: there are no results yet: run pmor.run_design first")
    stored = read_design_file(results)
    if stored.text != file.text:
        raise OutputError(f"{results}: was made from another design file, case or set: run pmor.run_design first")
    count = len(stored.arrays["x"])
    if number >= count:
        raise CaseError(f"variant {number}: variants are 0 to {count - 1}: choose one of them")
    head, name = f"# Variant {number} of the design {file.name}.\n\n", f"variant {number} of {file.design.title}"
    if isinstance(file.source, SetFile):
        return {".toml": head + _set_text(file, file.source, stored, number, name)}
    as_read = {file.meshes[0]: load_case(file.inputs[1])} if file.box is None else file.box.cases
    cases = {mesh: _case(file, mesh, as_read[mesh], stored, number, name) for mesh in file.meshes}
    if file.box is None:
        return {".toml": head + text_of(cases[file.meshes[0]])}
    sections = replace(file.box.model.sections, title=f"{file.box.model.sections.title}, {name}")
    model = replace(file.box.model, sections=sections)
    texts = gearbox_texts(replace(file.box, model=model, cases={**file.box.cases, **cases}), stem)
    return {".toml": head + texts.pop(""), **{beside.removeprefix(stem): text for beside, text in texts.items()}}


def _case(file: DesignFile, mesh: str, as_read: Case, stored: DesignResults, number: int, name: str) -> Case:
    """Return the case of a mesh with the flanks of a variant, on the angles that its results are of."""
    own = of_case(file.design.variables, file.flanks, mesh)
    x = stored.arrays["x"][number]
    assembly = assembly_at(file.base[mesh], list(own.values()), [x[place] for place in own])
    coast = as_read.flank == "coast"
    flanks = {gear: mirrored_flank(flank) if coast else flank
              for gear, flank in (("pinion", assembly.pinion), ("wheel", assembly.wheel))}  # fmt: skip
    changes: dict[str, Any] = {
        f"{gear}.{SECTIONS[as_read.flank]}": {key: value for key, value in vars(flank).items() if value is not None}
        for gear, flank in flanks.items()
    }
    changes["online"] = {"angles_per_pitch": int(stored.arrays["angles"][number])}
    if file.box is None:
        torques = {as_read.torque_Nm, *map(float, stored.arrays["torque"])}
        changes["online"]["torques_Nm"] = sorted(-torque if coast else torque for torque in torques)
    return change_case(as_read, title=f"{as_read.title}, {name}", **changes)


def _set_text(file: DesignFile, filed: SetFile, stored: DesignResults, number: int, name: str) -> str:
    """Return the set file with the flanks of a variant, on the angles and under the torques that its results are of."""
    design, sections = file.design, filed.sections
    document = parse_toml(filed.text, filed.name)
    document["title"] = f"{sections.title}, {name}"
    document["sweep"] = {
        **document.get("sweep", {}), "angles_per_pitch": int(stored.arrays["angles"][number]),
        "torques_Nm": sorted(design.load.torques_Nm),
    }  # fmt: skip
    if uneven(design):
        document["mesh"] = {**document.get("mesh", {}), "width": "whole"}
    if sections.carrier.stiffness is not None:
        document["carrier"]["stiffness"] = str(filed.inputs[1].resolve())
    members = members_at(filed, design.variables, stored.arrays["x"][number])
    written: dict[str, Any] = {}
    for section, content in document.items():
        own = dict(members[section]) if section in members and section != "mesh" else content
        flanks = {key: own.pop(key) for key in (MODIFICATION, COAST) if isinstance(own, dict) and key in own}
        written[_name(section)] = own
        written |= {f"{_name(section)}.{key}": keys for key, keys in flanks.items()}
    return document_text(written)


def members_at(
    file: SetFile, variables: Sequence[Variable], x: Sequence[float] | FloatArray
) -> Mapping[str, dict[str, Any]]:
    """Return the sections of the members of a set at values of the variables.

    A set file has the flanks of a member in its sections `modification`, the drive flanks, and `coast_modification`,
    which are as the others where nothing else is said.
    """
    members: dict[str, dict[str, Any]] = {name: dict(keys) for name, keys in file.sections.members.items()}
    reader = Reader(str(file.inputs[0]))
    for member in {variable.gear: None for variable in variables}:
        keys = members[member]
        drive = reader.section(keys.pop(MODIFICATION, {}), Modification, f"{member}.{MODIFICATION}")
        on_coast = keys.pop(COAST, {})
        coast = reader.section(on_coast, Modification, f"{member}.{COAST}", vars(other_by_default(drive, on_coast)))
        values: dict[str, dict[str, Any]] = {flank: {} for flank in SECTIONS}
        for variable, value in zip(variables, x, strict=True):
            for flank in variable.flanks if variable.gear == member else ():
                values[flank][variable.key] = float(value)
        drive, coast = drive.changed(values["drive"]), coast.changed(values["coast"])
        for section, changed, usual in ((MODIFICATION, drive, UNMODIFIED), (COAST, coast, drive.alike)):
            own = {key: value for key, value in vars(changed).items() if value not in (None, getattr(usual, key))}
            if own:
                keys[section] = own
    return members


def _name(name: str) -> str:
    """A name as TOML has it, in quotes where it needs them."""
    return name if re.fullmatch(r"[\w-]+", name, re.ASCII) else json.dumps(name, ensure_ascii=False)
