"""A gearbox that was read as a gearbox file with its cases, sets and housing beside it, to be changed by hand."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pmor.case.change import document_text, written
from pmor.core.errors import printable
from pmor.machine.loader import GearboxFile
from pmor.storage.atomic import atomic_path, refuse_existing


def write_gearbox_toml(file: GearboxFile, path: Path, overwrite: bool) -> list[Path]:
    """Write a gearbox file and what it names beside it; return all paths. OutputError where one cannot be."""
    texts = gearbox_texts(file, path.stem)
    paths = [path, *(path.parent / name for name in texts if name)]
    for one in paths:
        refuse_existing(one, overwrite)
    for one, text in zip(paths, texts.values(), strict=True):
        with atomic_path(one, overwrite) as temporary:
            temporary.write_text(text, encoding="utf-8")
    return paths


def gearbox_texts(file: GearboxFile, stem: str) -> dict[str, str]:
    """Return texts of files by their names; that of the gearbox is the first one, without a name.

    Parameters
    ----------
    stem : str
        That names of the files beside it begin with.
    """
    beside = {f"{stem}_{name}.toml": case.text for name, case in file.cases.items()}
    beside |= {f"{stem}_{name}.toml": part.text for name, part in file.model.sets.items()}
    document: dict[str, Any] = written(file.sections)
    for name, key in (("meshes", "case"), ("sets", "set")):
        for keys in document.get(name, ()):
            keys[key] = f"{stem}_{keys['name']}.toml"
    for keys in document.get("meshes", ()):  # what it says of its case is in that
        keys.pop("changes", None)
        keys["pinion"].pop("gear", None)
        keys["wheel"].pop("gear", None)
    housing = {key: f"{stem}_housing_{key}.csv" for key in file.model.of_housing}
    document |= {"housing": housing} if housing else {}
    for key, matrix in file.model.of_housing.items():
        rows = [",".join(map(repr, row)) for row in matrix.tolist()]
        beside[housing[key]] = "\n".join(rows) + "\n"
    notes = "".join(f"# {printable(note)}\n" for note in file.notes)
    return {"": notes + document_text(document), **beside}
