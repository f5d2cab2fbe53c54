"""Read a campaign file: TOML -> its sections -> `Campaign`, its base file and its table of designs read."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, get_origin

from pmor.campaigns.campaign import Campaign, Span, Variable
from pmor.campaigns.keys import hint_of, split
from pmor.campaigns.kind import Kind, Number
from pmor.campaigns.kinds import KINDS
from pmor.campaigns.settings import MOST_DESIGNS, CampaignSections, DesignsSection, GearboxResults, Method
from pmor.campaigns.table import evenly
from pmor.case.reader import Reader, keys_of, parse_toml, read_text, sections_in
from pmor.case.values import forms_of, toml_text
from pmor.core.errors import printable
from pmor.core.wording import did_you_mean

DESIGNS = "designs"
RANGE_KEYS = ("from", "to", "steps")


def load(path: Path | str) -> Campaign:
    """Read and check a campaign file.

    Parameters
    ----------
    path : Path or str
        TOML file; base file and table of designs are looked for beside it.

    Raises
    ------
    CaseError
        One line with file, section, key, rule and remedy.
    """
    path = Path(path)
    text = read_text(path, "campaign file")
    document = parse_toml(text, str(path))
    kind = KINDS[next((key for key in reversed(KINDS) if key in document), "case")]
    reader = _Reader(str(path), sections_in(kind.sections), kind=kind)
    said = reader.section(document, kind.sections, filled={"title": printable(path.stem)})
    if kind.of_base is not None:
        reader = replace(reader, kind=kind.of_base(path.parent / getattr(said, kind.key)))
    return reader.campaign(said, path, text)


@dataclass(frozen=True, kw_only=True)
class _Reader(Reader):
    """Reads the designs of a campaign file, and its table of designs."""

    kind: Kind

    def campaign(self, said: CampaignSections, path: Path, text: str) -> Campaign:
        """Return a campaign, its base file and its table of designs read."""
        designs, base = said.designs, path.parent / getattr(said, self.kind.key)
        self.check_method(designs)
        self.check_results(said)
        fixed, varied = self.keys(designs)
        inputs, made_from = [path, base], text
        if designs.file is not None:
            inputs.append(path.parent / designs.file)
            place = f"{self.where}: [{DESIGNS}] file = {toml_text(designs.file)}"
            csv_text = read_text(inputs[-1], "CSV file beside the campaign file", place)
            table = _Reader(str(inputs[-1]), kind=self.kind)
            varied += table.csv_columns(csv_text, {*fixed, *(variable.name for variable in varied)})
            made_from += f"\n{csv_text}"
        count = self.count(designs, varied)
        self.check_relations(said, {*fixed, *(variable.name for variable in varied)})
        fixed |= dict.fromkeys(said.relations.frees)
        base_text = self.kind.base_text(base, said.relations, fixed, self.where)
        made_from += f"\n{base_text}"
        return Campaign(self.kind, said, tuple(inputs), text, made_from, base_text, tuple(varied), count)

    def check_method(self, settings: DesignsSection) -> None:
        """Refuse keys of another method, and a method without its key."""
        for key, method, example in (("count", "sobol", "64"), ("file", "csv", '"designs.csv"')):
            given = getattr(settings, key) is not None
            if given and settings.method != method:
                self.refuse(f"[{DESIGNS}] {key}", f'is of method = "{method}", not "{settings.method}": remove it')
            if not given and settings.method == method:
                self.refuse(f"[{DESIGNS}] {key}", f"is missing: add '{key} = {example}' below [{DESIGNS}]")

    def keys(self, designs: DesignsSection) -> tuple[dict[str, Any], list[Variable]]:
        """Part the keys of the base file into those that all designs have in common and those that differ."""
        fixed, varied = dict[str, Any](), list[Variable]()
        for name, value in _leaves(designs.keys, self.kind.known):
            hint, place = self.hint(name), f"[{DESIGNS}] {name}"
            if not isinstance(value, Mapping | list) or (
                isinstance(value, list) and any(get_origin(kind) is tuple for kind, _ in forms_of(hint))
            ):
                fixed[name] = self.value(value, hint, place)
                continue
            if designs.method == "csv":
                rule = "differs from design to design: give it in the CSV file, or one value here"
                self.refuse(f"{place} = {toml_text(value)}", rule)
            if isinstance(value, Mapping):
                varied.append(Variable(name, self.span(name, value, hint, designs.method)))
            else:
                varied.append(Variable(name, self.listed(name, value, hint, designs.method)))
        return fixed, varied

    def hint(self, name: str, place: str = f"[{DESIGNS}]") -> Any:
        """Type of a key of the base file."""
        section, key = split(name)
        known = self.kind.known
        if (found := hint_of(name, known)) is not None:
            return found
        if section not in known:
            self.refuse(f"{place} {name}", f"no section of a {self.kind.key}: {did_you_mean(section, list(known))}")
        self.refuse(f"{place} {name}", f"unknown key: {did_you_mean(key, list(keys_of(known[section])))}")

    def listed(self, name: str, values: list[Any], hint: Any, method: Method) -> tuple[Number, ...]:
        """Check the values of a key that differs from design to design."""
        if not values:
            self.refuse(f"[{DESIGNS}] {name} = []", "must not be empty: give at least one value, or leave the key out")
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
        whole = any(kind is int for kind, _ in forms_of(hint))
        if method == "sobol":
            return Span(low, high, whole)
        steps = table["steps"]
        if isinstance(steps, bool) or not isinstance(steps, int) or not 2 <= steps <= MOST_DESIGNS:
            self.refuse(f"{place}: steps = {toml_text(steps)}", "must be a whole number of at least 2")
        return evenly(low, high, steps, whole)

    def csv_columns(self, text: str, known: set[str]) -> list[Variable]:
        """Read a table of designs: keys of the base file in its first line, a design in each further one."""
        try:
            rows = [row for row in csv.reader(io.StringIO(text)) if row]
        except csv.Error as error:
            self.refuse("no table", f"{error}: write values between commas")
        if len(rows) < 2:
            self.refuse("line 1", f"must name keys of the {self.kind.key}, and each further line be a design: add them")
        names = [name.strip() for name in rows[0]]
        hints = [self.hint(name, "line 1:") for name in names]
        for name in names:
            if names.count(name) > 1 or name in known:
                self.refuse(f"line 1: {name}", "is given twice: remove one")
        columns: list[list[Number]] = [[] for _ in names]
        for number, row in enumerate(rows[1:], start=2):
            if len(row) != len(names):
                self.refuse(f"line {number}", f"has {len(row)} values, the first line {len(names)}: correct it")
            for name, hint, cell, column in zip(names, hints, row, columns, strict=True):
                column.append(self.number(_cell(cell), hint, f"line {number}: {name}"))
        return [Variable(name, tuple(column)) for name, column in zip(names, columns, strict=True)]

    def count(self, settings: DesignsSection, varied: list[Variable]) -> int:
        """Return the number of designs."""
        if not varied:
            self.refuse(f"[{DESIGNS}]", "nothing differs from design to design: add a key of the "
                        f"{self.kind.key} with a list, as in {self.kind.gear}.teeth = [19, 20, 21]")  # fmt: skip
        lengths = {v.name: len(v.values) for v in varied if not isinstance(v.values, Span)}
        if settings.method == "sobol":
            assert settings.count is not None
            return settings.count
        if settings.method == "one_at_a_time":
            return 1 + sum(length - 1 for length in lengths.values())
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

    def check_results(self, said: CampaignSections) -> None:
        """Refuse results that the base has none of, where the file names its own."""
        known = dict.fromkeys(split(figure.key)[1] for figure in self.kind.figures)
        for key in said.results.keys if said.results.keys != type(said.results)().keys else ():
            if key not in known:
                rule = f"is none of this {self.kind.key}: take some of {', '.join(known)}"
                self.refuse(f'[results] keys: "{key}"', rule)
        for load in said.results.loads if isinstance(said.results, GearboxResults) else ():
            if load not in self.kind.of_loads:
                self.refuse(f'[results] loads: "{load}"', did_you_mean(load, list(self.kind.of_loads)))

    def check_relations(self, said: CampaignSections, named: set[str]) -> None:
        """Refuse designs with keys that follow from relations."""
        relations = said.relations
        for name in relations.solved:
            if name in named:
                self.refuse(f"[{DESIGNS}] {name}", "follows from [relations]: remove it here, or the relation there")
        for name in relations.frees:
            if name in named:
                self.refuse(f"[{DESIGNS}] {name}", "is fixed in [relations]: remove one of them")


def _leaves(table: Mapping[str, Any], known: Mapping[str, type], before: str = "") -> Iterator[tuple[str, Any]]:
    """Keys with dots, and their values; a table that is no section, and no list by places, is a range."""
    for key, value in table.items():
        name = before + key
        inside = isinstance(value, Mapping) and (
            name in known or any(s.startswith(f"{name}.") for s in known) or all(place.isdigit() for place in value)
        )
        if inside:
            yield from _leaves(value, known, f"{name}.")
        else:
            yield name, value


def _cell(text: str) -> Any:
    """The number in a field of a CSV file; its text where it is none."""
    for read in (int, float):
        try:
            return read(text)
        except ValueError:
            continue
    return text
