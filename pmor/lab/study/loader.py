"""Read a study file: TOML -> sections -> checked values -> `Study`."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable
from dataclasses import MISSING, dataclass, fields, replace
from pathlib import Path
from typing import Any, get_type_hints

from pmor.case.schema import Range
from pmor.case.values import Refused, convert, did_you_mean, toml_text
from pmor.errors import CaseError
from pmor.lab.study.settings import (
    Cell,
    ConventionalSettings,
    FigureSettings,
    GridSettings,
    Member,
    PaperRatio,
    PaperSettings,
    PeerSettings,
    QuickSettings,
    ReferenceSettings,
    Rung,
    Study,
    TimingSettings,
    TrainingSettings,
    Variant,
)

# Sections that stand alone, and those that may be there several times.
SECTIONS: dict[str, type] = {
    "grid": GridSettings,
    "reference": ReferenceSettings,
    "conventional": ConventionalSettings,
    "timing": TimingSettings,
    "paper": PaperSettings,
    "figures": FigureSettings,
    "quick": QuickSettings,
}
OTHERS = ("variant", "rung", "training", "peer")
REQUIRED = ("grid", "reference")

CELL = re.compile(r"([1-9]\d{0,2})@([1-9]\d?)")
WHOLE = Range(1, 10_000)
PEER_ANGLES = get_type_hints(PeerSettings, include_extras=True)["angles"]


def load_study(path: Path) -> Study:
    """Read and check a study file.

    Parameters
    ----------
    path : Path
        TOML file; its base case is looked for beside it.

    Raises
    ------
    CaseError
        One line with file, section, key, rule and remedy.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, ValueError) as error:
        raise CaseError(f"{path}: cannot be read ({error}): name a readable study file") from None
    return parse_study(text, path.stem, str(path), path.parent)


def parse_study(text: str, name: str, where: str, folder: Path) -> Study:
    """Check the text of a study file.

    Parameters
    ----------
    text : str
        TOML text.
    name : str
        Name of the study.
    where : str
        What error messages call the text, usually the path.
    folder : Path
        Where the base case is looked for.

    Returns
    -------
    Study
    """
    try:
        document = tomllib.loads(text)
    except ValueError as error:
        raise CaseError(f"{where}: not valid TOML: {error}: correct that place in the file") from None
    reader = _Reader(where)
    reader.refuse_unknown(document, [*SECTIONS, *OTHERS, "title", "base"], "")
    if "base" not in document:
        raise CaseError(f"{where}: base: is missing: add 'base = \"...\"', a case file beside it")
    sections = {
        key: reader.section(document.get(key, {}), kind, key)
        for key, kind in SECTIONS.items()
        if key in document or key in REQUIRED
    }
    study = Study(
        name=name,
        title=reader.value(document.get("title", name), str, "", "title"),
        base=folder / reader.value(document["base"], str, "", "base"),
        grid=sections["grid"],
        variants=tuple(map(reader.variant, reader.tables(document, "variant"))),
        rungs=tuple(map(reader.rung, reader.tables(document, "rung"))),
        reference=sections["reference"],
        conventional=sections.get("conventional", ConventionalSettings()),
        timing=sections.get("timing", TimingSettings()),
        trainings=tuple(
            reader.section(table, TrainingSettings, "training") for table in reader.tables(document, "training")
        ),
        paper=sections.get("paper", PaperSettings()),
        peer=reader.peer(document["peer"]) if "peer" in document else None,
        figures=sections.get("figures", FigureSettings()),
        quick=sections.get("quick"),
        where=where,
    )
    _check_together(study)
    return study


@dataclass(frozen=True)
class _Reader:
    """Turns TOML tables into settings, with file, section and key in every refusal."""

    where: str

    def tables(self, document: dict[str, Any], name: str) -> list[dict[str, Any]]:
        tables = document.get(name, [])
        if isinstance(tables, list) and all(isinstance(table, dict) for table in tables):
            return tables
        raise CaseError(f"{self.where}: {name}: must be a list of sections: write [[{name}]]")

    def section(self, table: Any, kind: type, name: str) -> Any:
        if not isinstance(table, dict):
            raise CaseError(f"{self.where}: {name}: must be a section: write [{name}] on a line of its own")
        hints = get_type_hints(kind, include_extras=True)
        self.refuse_unknown(table, list(hints), f"[{name}] ")
        values = {}
        for key, hint in hints.items():
            if key not in table:
                continue
            if hint == tuple[PaperRatio, ...]:
                values[key] = tuple(self.section(item, PaperRatio, f"{name}.{key}") for item in self.tables(table, key))
            else:
                values[key] = self.value(table[key], hint, f"[{name}] ", key)
        for item in fields(kind):
            if item.name not in values and item.default is MISSING:
                raise CaseError(f"{self.where}: [{name}] {item.name}: is missing: add '{item.name} = ...' there")
        return kind(**values)

    def variant(self, table: dict[str, Any]) -> Variant:
        values, changes = self.with_changes(table, {"name": str, "cell": Cell}, "variant")
        for key in ("name", "cell"):
            if key not in values:
                raise CaseError(f"{self.where}: [variant] {key}: is missing: add '{key} = ...' there")
        return Variant(replace(values["cell"], variant=values["name"]), changes)

    def rung(self, table: dict[str, Any]) -> Rung:
        values, changes = self.with_changes(table, {"name": str, "cells": tuple[Cell, ...]}, "rung")
        for key in ("name", "cells"):
            if key not in values:
                raise CaseError(f"{self.where}: [rung] {key}: is missing: add '{key} = ...' there")
        cells = tuple(replace(cell, variant=values["name"]) for cell in values["cells"])
        return Rung(values["name"], cells, changes)

    def peer(self, table: Any) -> PeerSettings:
        values, changes = self.with_changes(table, {"cell": Cell, "angles": PEER_ANGLES}, "peer")
        if "cell" not in values:
            raise CaseError(f"{self.where}: [peer] cell: is missing: add 'cell = ...' there")
        return PeerSettings(**values, changes=changes)

    def with_changes(self, table: Any, known: dict[str, Any], name: str) -> tuple[dict[str, Any], dict[str, Any]]:
        """Read a table of known keys and of sections of the case file, which `pmor.case` checks."""
        if not isinstance(table, dict):
            raise CaseError(f"{self.where}: {name}: must be a section: write [{name}] on a line of its own")
        changes = {key: value for key, value in table.items() if key not in known}
        for key, value in changes.items():
            if not isinstance(value, dict):
                remedy = 'give sections of the case file, as in contact = { scheme = "facet" }'
                raise CaseError(f"{self.where}: [{name}] {key} = {toml_text(value)}: unknown key: {remedy}")
        values = {key: self.value(table[key], hint, f"[{name}] ", key) for key, hint in known.items() if key in table}
        return values, changes

    def value(self, value: Any, hint: Any, place: str, key: str) -> Any:
        try:
            return FORMS[hint](value) if hint in FORMS else convert(value, hint)
        except Refused as refused:
            raise CaseError(f"{self.where}: {place}{key} = {toml_text(value)}: {refused}") from None

    def refuse_unknown(self, table: dict[str, Any], valid: list[str], place: str) -> None:
        for key in table:
            if key not in valid:
                raise CaseError(f"{self.where}: {place}{key}: unknown key: {did_you_mean(key, valid)}")


def _cell(value: Any) -> Cell:
    match = CELL.fullmatch(value) if isinstance(value, str) else None
    if match is None:
        raise Refused('must be elements@LoDM over the profile: write text such as "16@4"')
    return Cell(int(match[1]), int(match[2]))


def _list_of(read: Callable[[Any], Any]) -> Callable[[Any], tuple[Any, ...]]:
    def read_list(value: Any) -> tuple[Any, ...]:
        if not isinstance(value, list) or not value:
            raise Refused("must be a list with at least one entry: put the values in brackets")
        items = tuple(map(read, value))
        if len(set(items)) < len(items):
            raise Refused("has an entry twice: remove one")
        return items

    return read_list


def _whole(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not WHOLE.contains(value):
        raise Refused(f"each value must be a whole number between {WHOLE.low:g} and {WHOLE.high:g}")
    return value


def _member(value: Any) -> Member:
    if not isinstance(value, list) or len(value) != 3:
        raise Refused("each member must be [elements over the profile, over the width, LoDM], such as [96, 12, 4]")
    return Member(*map(_whole, value))


def _torques(value: Any) -> tuple[float, ...]:
    good = isinstance(value, list) and value and all(
        isinstance(t, int | float) and not isinstance(t, bool) and 0.0 < t < 1e12 for t in value
    )  # fmt: skip
    if not good:
        raise Refused("each set must be a list of torques in N m above 0, as in [[100.0], [20.0, 180.0]]")
    return tuple(sorted(float(t) for t in value))


def _seconds(value: Any) -> tuple[tuple[Cell, float], ...]:
    if not isinstance(value, dict):
        raise Refused('must be a table of seconds by cell, as in { "16@4" = 29.0 }')
    positive = Range(0.0, 1e9, "s", low_excluded=True)
    for number in value.values():
        if isinstance(number, bool) or not isinstance(number, int | float) or not positive.contains(number):
            raise Refused("each number must be seconds above 0")
    return tuple((_cell(key), float(number)) for key, number in value.items())


# How values that a case file does not know are read.
FORMS: dict[Any, Callable[[Any], Any]] = {
    Cell: _cell,
    tuple[Cell, ...]: _list_of(_cell),
    tuple[int, ...]: _list_of(_whole),
    tuple[tuple[float, ...], ...]: _list_of(_torques),
    tuple[tuple[Cell, float], ...]: _seconds,
    tuple[Member, ...]: _list_of(_member),
}


def _check_together(study: Study) -> None:
    """Raise `CaseError` where values that are fine alone do not go together."""

    def refuse(place: str, rule: str) -> None:
        raise CaseError(f"{study.where}: {place}: {rule}")

    for section, family in (("reference", study.reference), ("quick", study.quick)):
        sizes = [(m.n_profile, m.n_width) for m in family.members] if family is not None else [(1, 1), (2, 1)]
        finer = all(a[0] < b[0] and a[1] <= b[1] for a, b in zip(sizes[:-1], sizes[1:], strict=True))
        if len(sizes) not in (2, 3) or not finer:
            refuse(f"[{section}] members", "must be two or three meshes, from coarse to fine over the profile")
    varied = [variant.cell for variant in study.variants] + [cell for rung in study.rungs for cell in rung.cells]
    if len(set(varied)) < len(varied):
        refuse("[variant], [rung] name", "two variants of a cell have the same name: rename one")
    for training in study.trainings:
        if any(max(training.angles) % n for n in training.angles):
            refuse("[training] angles", "each must divide the largest, so that one set of angles is unseen by all")
    grid = set(study.grid.cells)
    for place, cells in (
        ("[conventional] solved", study.conventional.solved),
        ("[figures] along_angle", study.figures.along_angle),
    ):
        for cell in cells:
            if cell not in grid:
                refuse(f"{place}: {cell.label}", "is not among the [grid] cells: add it there or remove it here")
