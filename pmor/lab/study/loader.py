"""Read a study file: TOML -> sections -> checked values -> `Study`.

The fields of the dataclasses are the keys of the file. A tuple of dataclasses is a list of sections, named without the
plural's s; what is no field of a section that has `changes` belongs to the case file, which `pmor.case` checks.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass, fields, is_dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, get_args, get_origin, get_type_hints

from pmor.case.document import parse_toml
from pmor.case.values import Refused, convert, did_you_mean, toml_text
from pmor.core.errors import CaseError
from pmor.core.ranges import Range
from pmor.lab.core.variants import Sections
from pmor.lab.study.settings import Cell, Member, Study

CELL = re.compile(r"([1-9]\d{0,2})@([1-9]\d?)")
WHOLE = Range(1, 10_000)


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
    """
    document = parse_toml(text, where)
    study: Study = _Reader(where).section(document, Study, "", {"name": name, "where": where, "changes": {}})
    study = replace(study, title=study.title or name, base=folder / study.base)
    _check_together(study)
    return study


@dataclass(frozen=True)
class _Reader:
    """Turns TOML tables into dataclasses, with file, section and key in every refusal."""

    where: str

    def section(self, table: Any, kind: Any, name: str, given: Mapping[str, Any] = MappingProxyType({})) -> Any:
        """Read a section; `given` are fields that the file does not have."""
        if not isinstance(table, dict):
            raise CaseError(f"{self.where}: {name}: must be a section: write [{name}] on a line of its own")
        place, hints = f"[{name}] " if name else "", get_type_hints(kind, include_extras=True)
        values = dict(given)
        keys = {_key(item.name, hints[item.name]): item for item in fields(kind)
                if item.name not in given and hints[item.name] != Sections}  # fmt: skip
        if "changes" in hints and "changes" not in given:
            values["changes"] = self.changes({k: v for k, v in table.items() if k not in keys}, place)
        else:
            for key in table:
                if key not in keys:
                    raise CaseError(f"{self.where}: {place}{key}: unknown key: {did_you_mean(key, list(keys))}")
        for key, item in keys.items():
            hint = hints[item.name]
            if key in table:
                values[item.name] = self.field(table[key], hint, name, key)
            elif item.default is MISSING and _section_in(hint) is not None:
                values[item.name] = self.section({}, hint, key)
            elif item.default is MISSING:
                raise CaseError(f"{self.where}: {place}{key}: is missing: add '{key} = ...' there")
        return kind(**values)

    def field(self, value: Any, hint: Any, section: str, key: str) -> Any:
        """Read what stands under a key: a section, a list of sections, or a value."""
        inner, name = _section_in(hint), f"{section}.{key}" if section else key
        if inner is None:
            try:
                return FORMS[hint](value) if hint in FORMS else convert(value, hint)
            except Refused as refused:
                place = f"[{section}] " if section else ""
                raise CaseError(f"{self.where}: {place}{key} = {toml_text(value)}: {refused}") from None
        if get_origin(hint) is not tuple:
            return self.section(value, inner, name)
        if isinstance(value, list) and all(isinstance(table, dict) for table in value):
            return tuple(self.section(table, inner, name) for table in value)
        raise CaseError(f"{self.where}: {name}: must be a list of sections: write [[{name}]]")

    def changes(self, tables: dict[str, Any], place: str) -> dict[str, Any]:
        """Return sections of the case file."""
        for key, value in tables.items():
            if not isinstance(value, dict):
                remedy = 'give sections of the case file, as in contact = { scheme = "facet" }'
                raise CaseError(f"{self.where}: {place}{key} = {toml_text(value)}: unknown key: {remedy}")
        return tables


def _key(name: str, hint: Any) -> str:
    listed = get_origin(hint) is tuple and _section_in(hint) is not None
    return name.removesuffix("s") if listed else name


def _section_in(hint: Any) -> Any:
    """The dataclass that a field holds one or several of, if it is a section; values have their own forms."""
    if hint in FORMS:
        return None
    return next((kind for kind in (hint, *get_args(hint)) if isinstance(kind, type) and is_dataclass(kind)), None)


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


# How values that a case file does not know are read.
FORMS: dict[Any, Callable[[Any], Any]] = {
    Path: lambda value: Path(convert(value, str)),
    Cell: _cell,
    tuple[Cell, ...]: _list_of(_cell),
    tuple[int, ...]: _list_of(_whole),
    tuple[Member, ...]: _list_of(_member),
}


def _check_together(study: Study) -> None:
    """Raise `CaseError` where values that are fine alone do not go together."""

    def refuse(place: str, rule: str) -> None:
        raise CaseError(f"{study.where}: {place}: {rule}")

    if not study.reduced_cells and study.reference is not None:
        refuse("[grid] cells", "is missing: add 'cells = ...' there")
    if study.reduced_cells and study.reference is None:
        refuse("[reference] members", "is missing: add 'members = ...' there")
    if not study.cells:
        refuse("[[variant]]", "is missing: add one, or [grid] cells with a [reference]")
    for section, family in (("reference", study.reference), ("quick", study.quick)):
        sizes = [(m.n_profile, m.n_width) for m in family.members] if family is not None else [(1, 1), (2, 1)]
        finer = all(a[0] < b[0] and a[1] <= b[1] for a, b in zip(sizes[:-1], sizes[1:], strict=True))
        if len(sizes) not in (2, 3) or not finer:
            refuse(f"[{section}] members", "must be two or three meshes, from coarse to fine over the profile")
    varied = study.cells[len(study.grid.cells) :]
    if len(set(varied)) < len(varied):
        refuse("[variant], [rung] name", "two variants of a cell have the same name: rename one")
    grid = set(study.grid.cells)
    for cell in study.conventional.solved:
        if cell not in grid:
            rule = "is not among the [grid] cells: add it there or remove it here"
            refuse(f"[conventional] solved: {cell.label}", rule)
    meshes = sorted({cell.n_profile for cell in study.cells})
    for n in study.conventional.stepped:
        if n not in meshes:
            refuse(f"[conventional] stepped: {n}", f"no cell has as many elements: choose of {meshes} or add a cell")
