"""Read a campaign file: TOML -> sections -> checked values -> `Campaign`."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, NoReturn, Union, get_args, get_origin

from pmor.campaigns.figures import BY_KEY, USUAL
from pmor.campaigns.relations import split, text_of_design
from pmor.campaigns.settings import (
    MOST_DESIGNS,
    Campaign,
    DesignsSection,
    Method,
    Number,
    Relations,
    Span,
    StoreSection,
    Variable,
    Workers,
)
from pmor.campaigns.table import evenly
from pmor.case import change_case, load_case, parse_case, text_of
from pmor.case.document import parse_toml
from pmor.case.loader import SECTIONS, keys_of
from pmor.case.values import Refused, convert, did_you_mean, toml_text
from pmor.core.errors import CaseError

DESIGNS, RESULTS = "designs", "results"
PLAIN = {"relations": Relations, "workers": Workers, "store": StoreSection}
OWN = tuple(item.name for item in fields(DesignsSection))
RANGE_KEYS = ("from", "to", "steps")


def load_campaign(path: Path) -> Campaign:
    """Read and check a campaign file.

    Parameters
    ----------
    path : Path
        TOML file; base case and table of designs are looked for beside it.

    Raises
    ------
    CaseError
        One line with file, section, key, rule and remedy.
    """
    path = Path(path)
    text = _text(path, f"{path}: cannot be read", "name a readable campaign file")
    return _Reader(str(path), path, text).campaign(parse_toml(text, str(path)))


@dataclass(frozen=True)
class _Reader:
    """Turns TOML tables into settings, with the file in every refusal."""

    where: str
    path: Path
    text: str

    def campaign(self, document: dict[str, Any]) -> Campaign:
        """Read the whole file."""
        for name, value in document.items():
            if name in (DESIGNS, RESULTS, *PLAIN):
                if not isinstance(value, dict):
                    self.refuse(name, f"must be a section: write [{name}] on a line of its own")
            elif name not in ("title", "case"):
                self.refuse(name, f"unknown: {did_you_mean(name, ['title', 'case', DESIGNS, RESULTS, *PLAIN])}")
        title = self.value(document.get("title", self.path.stem), str, "title")
        if "case" not in document:
            self.refuse("case", 'is missing: name the base case, as in case = "osu_spur.toml"')
        base = self.path.parent / self.value(document["case"], str, "case")
        sections = {name: self.section(document.get(name, {}), kind, name) for name, kind in PLAIN.items()}
        designs = document.get(DESIGNS, {})
        own = {key: value for key, value in designs.items() if key in OWN}
        settings = self.section(own, DesignsSection, DESIGNS)
        self.check_method(settings)
        fixed, varied = self.keys(designs, settings)
        inputs: tuple[Path, ...] = (self.path, base)
        text = self.text
        if settings.file is not None:
            table = self.path.parent / settings.file
            csv_text = _text(table, f"{self.where}: [{DESIGNS}] file = {toml_text(settings.file)}: cannot be read",
                             "name a CSV file beside the campaign file")  # fmt: skip
            varied += self.csv_columns(csv_text, str(table), {*fixed, *(variable.name for variable in varied)})
            inputs, text = (*inputs, table), f"{text}\n{csv_text}"
        count = self.count(settings, varied)
        relations = sections["relations"]
        self.check_relations(relations, {*fixed, *(variable.name for variable in varied)})
        if relations.centre_distance_mm is not None:
            fixed["pair.centre_distance_mm"] = None  # that of the base case
        base_text = self.base_text(base, fixed)
        return Campaign(
            name=self.path.stem, title=title, source=self.path, source_text=self.text, text=f"{text}\n{base_text}",
            base=base, base_text=base_text, method=settings.method, variables=tuple(varied), count=count,
            relations=relations, results=self.results(document.get(RESULTS, {})), workers=sections["workers"],
            store=sections["store"], inputs=inputs,
        )  # fmt: skip

    def refuse(self, place: str, rule: str) -> NoReturn:
        """Raise CaseError."""
        raise CaseError(f"{self.where}: {place}: {rule}")

    def value(self, value: Any, hint: Any, place: str) -> Any:
        """Check one value against the type of its field."""
        try:
            return convert(value, hint)
        except Refused as refused:
            raise CaseError(f"{self.where}: {place} = {toml_text(value)}: {refused}") from None

    def section(self, table: Mapping[str, Any], kind: Any, name: str) -> Any:
        """Read a section whose keys are the fields of a dataclass."""
        keys = keys_of(kind)
        for key in table:
            if key not in keys:
                self.refuse(f"[{name}] {key}", f"unknown key: {did_you_mean(key, list(keys))}")
        for item in fields(kind):
            if item.name not in table and item.default is MISSING:
                self.refuse(f"[{name}] {item.name}", f"is missing: add '{item.name} = ...' below [{name}]")
        return kind(**{key: self.value(value, keys[key], f"[{name}] {key}") for key, value in table.items()})

    def results(self, table: Mapping[str, Any]) -> tuple[str, ...]:
        """Read which results are written."""
        for key in table:
            if key != "keys":
                self.refuse(f"[{RESULTS}] {key}", "unknown key: did you mean keys?")
        asked = table.get("keys", list(USUAL))
        if not isinstance(asked, list) or not asked:
            self.refuse(f"[{RESULTS}] keys = {toml_text(asked)}", 'must be a list, as in ["ste_peak_to_peak_um"]')
        for key in asked:
            if key not in BY_KEY:
                self.refuse(f"[{RESULTS}] keys: {toml_text(key)}", f"unknown: {did_you_mean(str(key), list(BY_KEY))}")
        return tuple(key for key in BY_KEY if key in asked)

    def check_method(self, settings: DesignsSection) -> None:
        """Refuse what a method does without, and the lack of what it needs."""
        for key, method, example in (("count", "sobol", "64"), ("file", "csv", '"designs.csv"')):
            given = getattr(settings, key) is not None
            if given and settings.method != method:
                self.refuse(f"[{DESIGNS}] {key}", f'is of method = "{method}", not "{settings.method}": remove it')
            if not given and settings.method == method:
                self.refuse(f"[{DESIGNS}] {key}", f"is missing: add '{key} = {example}' below [{DESIGNS}]")

    def keys(self, designs: Mapping[str, Any], settings: DesignsSection) -> tuple[dict[str, Any], list[Variable]]:
        """Part the keys of the case into those that all designs have in common and those that differ."""
        fixed, varied = dict[str, Any](), list[Variable]()
        for name, value in _leaves({key: v for key, v in designs.items() if key not in OWN}):
            hint, place = self.hint(name), f"[{DESIGNS}] {name} = {toml_text(value)}"
            if isinstance(value, Mapping):
                varied.append(Variable(name, self.span(name, value, hint, settings.method)))
            elif not isinstance(value, list) or _is_list(hint):
                fixed[name] = self.value(value, hint, f"[{DESIGNS}] {name}")
            elif not value:
                self.refuse(place, "must not be empty: give at least one value, or leave the key out")
            else:
                varied.append(Variable(name, self.listed(name, value, hint, settings.method)))
            if varied and varied[-1].name == name and settings.method == "csv":
                self.refuse(place, "differs from design to design: give it in the CSV file, or one value here")
        return fixed, varied

    def hint(self, name: str, place: str = f"[{DESIGNS}]") -> Any:
        """Type of a key of the case."""
        section, key = split(name)
        if section not in SECTIONS:
            self.refuse(f"{place} {name}", f"no section of a case: {did_you_mean(section, list(SECTIONS))}")
        keys = keys_of(SECTIONS[section])
        if key not in keys:
            self.refuse(f"{place} {name}", f"unknown key: {did_you_mean(key, list(keys))}")
        return keys[key]

    def listed(self, name: str, values: list[Any], hint: Any, method: Method) -> tuple[Number, ...]:
        """Check the values of a key that differs from design to design."""
        found = tuple(self.number(value, hint, f"[{DESIGNS}] {name}") for value in values)
        if method != "list" and len(set(found)) < len(found):
            self.refuse(f"[{DESIGNS}] {name} = {toml_text(values)}", "has a value twice: remove one")
        return found

    def number(self, value: Any, hint: Any, place: str) -> Number:
        """Check a value that differs from design to design: a number of its key's type."""
        if isinstance(value, bool) or not isinstance(value, int | float):
            rule = "only numbers may differ from design to design: write one value for all, or a campaign for each"
            self.refuse(f"{place} = {toml_text(value)}", rule)
        checked: Number = self.value(value, hint, place)
        return checked

    def span(self, name: str, table: Mapping[str, Any], hint: Any, method: Method) -> tuple[Number, ...] | Span:
        """Read a range: so many values of it, or all of it for Sobol's sequence."""
        place = f"[{DESIGNS}] {name}"
        needed = RANGE_KEYS[:2] if method == "sobol" else RANGE_KEYS
        if set(table) != set(needed):
            example = "{ from = 10.0, to = 20.0 }" if method == "sobol" else "{ from = 10.0, to = 20.0, steps = 3 }"
            self.refuse(f"{place} = {toml_text(dict(table))}", f'a range of method = "{method}" is {example}')
        low, high = (self.number(table[key], hint, f"{place}: {key}") for key in RANGE_KEYS[:2])
        if not low < high:
            self.refuse(place, f"from = {low:g} must be below to = {high:g}: exchange them, or give one value")
        whole = _is_whole(hint)
        if method == "sobol":
            return Span(low, high, whole)
        steps = table["steps"]
        if isinstance(steps, bool) or not isinstance(steps, int) or not 2 <= steps <= MOST_DESIGNS:
            self.refuse(f"{place}: steps = {toml_text(steps)}", "must be a whole number of at least 2")
        return evenly(low, high, steps, whole)

    def csv_columns(self, text: str, where: str, known: set[str]) -> list[Variable]:
        """Read a table of designs: keys of the case in its first line, a design in each further one."""
        reader = _Reader(where, self.path, text)
        rows = [row for row in csv.reader(io.StringIO(text)) if row]
        if len(rows) < 2:
            reader.refuse("line 1", "must name keys of the case, and each further line be a design: add them")
        names = [name.strip() for name in rows[0]]
        hints = [reader.hint(name, "line 1:") for name in names]
        for name in names:
            if names.count(name) > 1 or name in known:
                reader.refuse(f"line 1: {name}", "is given twice: remove one")
        columns: list[list[Number]] = [[] for _ in names]
        for number, row in enumerate(rows[1:], start=2):
            if len(row) != len(names):
                reader.refuse(f"line {number}", f"has {len(row)} values, the first line {len(names)}: correct it")
            for name, hint, cell, column in zip(names, hints, row, columns, strict=True):
                column.append(reader.number(_cell(cell), hint, f"line {number}: {name}"))
        return [Variable(name, tuple(column)) for name, column in zip(names, columns, strict=True)]

    def count(self, settings: DesignsSection, varied: list[Variable]) -> int:
        """Return how many designs there are."""
        if not varied:
            self.refuse(f"[{DESIGNS}]", "nothing differs from design to design: add a key of the case with a list, "
                        "as in pinion.teeth = [19, 20, 21]")  # fmt: skip
        lengths = {v.name: len(v.values) for v in varied if not isinstance(v.values, Span)}
        if settings.method == "sobol":
            assert settings.count is not None
            return settings.count
        if settings.method == "grid":
            total = math.prod(lengths.values())
            if total > MOST_DESIGNS:
                self.refuse(f"[{DESIGNS}]", f"{total} designs, and {MOST_DESIGNS} at most: take fewer values")
            return total
        shortest = min(lengths, key=lambda name: lengths[name])
        longest = max(lengths, key=lambda name: lengths[name])
        if lengths[shortest] != lengths[longest]:
            self.refuse(
                f"[{DESIGNS}] {shortest}", f"has {lengths[shortest]} values, {longest} has {lengths[longest]}: a list "
                'takes one of each for a design: write as many, or method = "grid"',
            )  # fmt: skip
        return lengths[longest]

    def check_relations(self, relations: Relations, named: set[str]) -> None:
        """Refuse designs that say what follows from relations."""
        for name in relations.solved:
            if name in named:
                self.refuse(f"[{DESIGNS}] {name}", "follows from [relations]: remove it here, or the relation there")
        if relations.centre_distance_mm is not None and "pair.centre_distance_mm" in named:
            self.refuse(f"[{DESIGNS}] pair.centre_distance_mm", "is fixed in [relations]: remove one of them")

    def base_text(self, base: Path, fixed: Mapping[str, Any]) -> str:
        """Return the text of the base case with what all designs have in common."""
        case = load_case(base)
        if case.compare.models is not None:
            case = change_case(case, compare={"models": None})
        text = text_of_design(text_of(case), fixed)
        found = parse_case(text, case.name, f"{self.where}: {base}")
        if found.reduction.shapes != "line_loads":
            self.refuse(str(base), f'has [contact] scheme = "{found.contact.scheme}" with [reduction] shapes = '
                        f'"{found.reduction.shapes}", and a campaign solves line loads alone: add '
                        f'contact.scheme = "line" and reduction.shapes = "line_loads" below [{DESIGNS}]')  # fmt: skip
        return text


def _text(path: Path, what: str, remedy: str) -> str:
    try:
        return path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise CaseError(f"{what}: there is no such file: {remedy}") from None
    except (OSError, ValueError) as error:
        raise CaseError(f"{what} ({error}): {remedy}") from None


def _leaves(table: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Keys with dots, and what stands under each; a table that is no section is a range."""
    for key, value in table.items():
        name = before + key
        inside = isinstance(value, Mapping) and (name in SECTIONS or any(s.startswith(f"{name}.") for s in SECTIONS))
        if inside:
            yield from _leaves(value, f"{name}.")
        else:
            yield name, value


def _kinds(hint: Any) -> Iterator[Any]:
    """Types that a field may have, without None and without their ranges."""
    for kind in get_args(hint) if get_origin(hint) in (UnionType, Union) else (hint,):
        if kind is not NoneType:
            yield get_args(kind)[0] if get_origin(kind) is Annotated else kind


def _is_whole(hint: Any) -> bool:
    return int in _kinds(hint)


def _is_list(hint: Any) -> bool:
    return any(get_origin(kind) is tuple for kind in _kinds(hint))


def _cell(text: str) -> Any:
    """The number in a field of a CSV file; its text where it is none."""
    for read in (int, float):
        try:
            return read(text)
        except ValueError:
            continue
    return text
