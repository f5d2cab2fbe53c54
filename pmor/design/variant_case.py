"""A variant of a design as a case file, or as a set file."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from pmor.case import change_case, load_case, text_of
from pmor.case.change import document_text
from pmor.case.document import COAST, MODIFICATION
from pmor.case.reader import parse_toml
from pmor.core.arrays import FloatArray
from pmor.core.errors import CaseError, OutputError
from pmor.design.checks import uneven
from pmor.design.files import PairDesign, SetDesign
from pmor.design.set_flanks import members_at
from pmor.design.variables import assembly_at
from pmor.storage.atomic import atomic_path
from pmor.storage.design_file import read_design_file
from pmor.storage.results_folder import results_folder


def write_variant(file: PairDesign | SetDesign, folder: Path, number: int, *, overwrite: bool = False) -> Path:
    """Write the case file of a variant, or its set file, into the folder of its results, and return its path.

    Raises
    ------
    CaseError, OutputError, FileFormatError
        When there is no such variant, or the results are those of another design.
    """
    path = folder / f"variant_{number}.toml"
    text = _text(file, folder / "design.h5", number)
    with results_folder(folder, (path.name,), (), overwrite, file.inputs), atomic_path(path, True) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return path


def _text(file: PairDesign | SetDesign, results: Path, number: int) -> str:
    if not results.exists():
        raise OutputError(f"{results}: there are no results yet: run pmor.run_design first")
    found = read_design_file(results)
    if found.text != file.text:
        raise OutputError(f"{results}: was made from another design file, case or set: run pmor.run_design first")
    count = len(found.arrays["x"])
    if number >= count:
        raise CaseError(f"variant {number}: variants are 0 to {count - 1}: choose one of them")
    head = f"# Variant {number} of the design {file.name}.\n\n"
    if isinstance(file, SetDesign):
        return head + _set_text(file, found.arrays["x"][number], int(found.arrays["angles"][number]), number)
    base = load_case(file.inputs[1]) if file.box is None else file.box.cases[file.mesh]
    assembly = assembly_at(file.base, file.design.variables, found.arrays["x"][number])
    sections = {"pinion.modification": assembly.pinion, "wheel.modification": assembly.wheel}
    changes: dict[str, Any] = {
        name: {k: v for k, v in vars(m).items() if v is not None} for name, m in sections.items()
    }
    # Those of a gearbox are off by round-off; cases have twelve digits of a torque.
    torques = sorted({base.torque_Nm, *(float(f"{torque:.12g}") for torque in found.arrays["torque"])})
    changes["online"] = {"angles_per_pitch": int(found.arrays["angles"][number]), "torques_Nm": torques}
    changed = change_case(base, title=f"{base.title}, variant {number} of {file.design.title}", **changes)
    return head + text_of(changed)


def _set_text(file: SetDesign, x: FloatArray, angles: int, number: int) -> str:
    """Return the set file with the flanks of a variant, on the angles and under the torques that its results are of."""
    design, sections = file.design, file.filed.sections
    document = parse_toml(file.filed.text, file.filed.name)
    document["title"] = f"{sections.title}, variant {number} of {design.title}"
    document["sweep"] = {
        **document.get("sweep", {}), "angles_per_pitch": angles, "torques_Nm": sorted(design.load.torques_Nm)
    }  # fmt: skip
    if uneven(design):
        document["mesh"] = {**document.get("mesh", {}), "width": "whole"}
    if sections.carrier.stiffness is not None:
        document["carrier"]["stiffness"] = str(file.filed.inputs[1].resolve())
    members = members_at(file.filed, design.variables, x)
    found: dict[str, Any] = {}
    for name, content in document.items():
        own = dict(members[name]) if name in members and name != "mesh" else content
        flanks = {key: own.pop(key) for key in (MODIFICATION, COAST) if isinstance(own, dict) and key in own}
        found[_name(name)] = own
        found |= {f"{_name(name)}.{key}": keys for key, keys in flanks.items()}
    return document_text(found)


def _name(name: str) -> str:
    """A name as TOML has it, in quotes where it needs them."""
    return name if re.fullmatch(r"[\w-]+", name, re.ASCII) else json.dumps(name, ensure_ascii=False)
