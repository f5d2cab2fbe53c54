"""A gearbox that was read as a gearbox file with its cases, sets and housing beside it, to be changed by hand."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, fields, is_dataclass, replace
from pathlib import Path
from typing import Any

from pmor.core.errors import printable
from pmor.machine.loader import GearboxFile
from pmor.machine.settings import GearboxSections, Mesh, PlanetarySet
from pmor.storage.atomic import atomic_path, refuse_existing

TABLES = ("shafts", "bearings", "meshes", "sets", "loads")


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
    said = file.model.sections
    beside = {f"{stem}_{name}.toml": case.text for name, case in file.cases.items()}
    beside |= {f"{stem}_{name}.toml": one.text for name, one in file.model.sets.items()}
    housing: dict[str, str] = {}
    if file.model.housing is not None:
        rows = [",".join(map(repr, row)) for row in file.model.housing.tolist()]
        housing[f"{stem}_housing.csv"] = "\n".join(rows) + "\n"
    lines = [*(f"# {printable(note)}" for note in file.notes), f"title = {_value(said.title)}", *_tables(said, stem)]
    lines += _table("gravity", _keys(said.gravity)) + _table("lubricant", _keys(said.lubricant))
    lines += _table("housing", dict.fromkeys(["stiffness"] if housing else [], f"{stem}_housing.csv"))
    return {"": "\n".join(lines) + "\n", **beside, **housing}


def _tables(said: GearboxSections, stem: str) -> Iterator[str]:
    for name in TABLES:
        for one in getattr(said, name):
            if isinstance(one, Mesh):  # what it says of its case is in that
                places = {gear: replace(getattr(one, gear), gear={}) for gear in ("pinion", "wheel")}
                one = replace(one, changes={}, **places)
            keys = _keys(one)
            if isinstance(one, Mesh):
                keys["case"] = f"{stem}_{one.name}.toml"
            if isinstance(one, PlanetarySet):
                keys["set"] = f"{stem}_{one.name}.toml"
            yield from ["", f"[[{name}]]", *(f"{key} = {_value(value)}" for key, value in keys.items())]


def _table(name: str, keys: Mapping[str, Any]) -> list[str]:
    return ["", f"[{name}]", *(f"{key} = {_value(value)}" for key, value in keys.items())] if keys else []


def _keys(section: Any) -> dict[str, Any]:
    """Keys of a section that are not the defaults."""
    found = dict[str, Any]()
    for item in fields(section):
        value = getattr(section, item.name)
        usual = item.default if item.default_factory is MISSING else item.default_factory()
        if value != usual:
            found[item.name] = value
    return found


def _value(value: Any) -> str:
    if is_dataclass(value):
        return "{ " + ", ".join(f"{key} = {_value(item)}" for key, item in _keys(value).items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_value, value)) + "]"
    if isinstance(value, bool | str | Path):
        return json.dumps(value if isinstance(value, bool) else str(value), ensure_ascii=False)
    return repr(value)
