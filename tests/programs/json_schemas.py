"""JSON Schemas of all kinds of files, from the dataclasses that the reader fills: editors complete and check by them.

    python -m tests.programs.json_schemas

writes them into `pmor/app/schemas`, from where `pmor schema` prints them. Draft 7 is what editors of TOML read. What no
single section knows is here: which sections a kind of file has, and what a section takes in the place of another.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, fields, is_dataclass
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pmor.app.records import FILES, KINDS
from pmor.campaigns.kind import Kind
from pmor.campaigns.kinds import KINDS as OF_CAMPAIGNS
from pmor.campaigns.settings import DesignsSection
from pmor.case.blank import BlankCase
from pmor.case.body import BodyCase, MatrixCase
from pmor.case.coast import TORQUES
from pmor.case.document import BLANK, COAST, CONDITION, GEARS, LOADS, MODIFICATION
from pmor.case.duty import TimedLoad
from pmor.case.gears import GearCase, PairCase
from pmor.case.reader import Slot, slots_of
from pmor.case.schema import SECTIONS, ConditionCase
from pmor.case.values import PER_CENT, forms_of
from pmor.core.ranges import Range, SignedTorque
from pmor.design.loader import MOST_VARIABLES
from pmor.design.settings import Design
from pmor.gear.modification import Modification
from pmor.gear.topography import Topography
from pmor.lab.study.settings import CELL, Cell, Count, ReferenceMesh, Study
from pmor.machine.settings import GearboxSections, GearPlace, Mesh
from pmor.sets.layout import SECOND_PAIR, SECOND_PLANET, SHARED
from pmor.sets.settings import SetSections
from pmor.storage.atomic import atomic_path
from tests.programs.key_table import default_text, documented, range_words

FOLDER = Path(__file__).parents[2] / "pmor" / "app" / "schemas"
DRAFT = "http://json-schema.org/draft-07/schema#"
Schema = dict[str, Any]
# One line of text, with a word.
LINE = r"^[^\n\r\t]*[^\s][^\n\r\t]*$"
TITLE = {"type": "string", "pattern": LINE, "description": "One line for the page; by default the name of the file."}
MEMBERS = ("sun", "planet", SECOND_PLANET, "ring")
# Fields that a section of a file does not have: the reader gives them.
GIVEN = {PairCase: GEARS, GearCase: ("blank", "body"), Study: ("name", "where", "changes")}


class Schemas:
    """The definitions of one kind of file, made as they are referred to."""

    def __init__(self) -> None:
        self.definitions: dict[str, Schema] = {}

    def section(self, kind: type, place: str = "", *, whole: bool = True, **more: Any) -> Schema:
        """Refer to a section; `whole` where its required keys are, `more` are properties in place of its own."""
        name = f"{kind.__module__.split('.')[1]}.{kind.__name__}{'' if whole else '.changes'}"
        name += f".{place}" if place in ("planets", "offline", "online", "compare", "results", "dynamics") else ""
        if name not in self.definitions:
            self.definitions[name] = {}  # those that hold it come first
            self.definitions[name] = self.content(kind, place, whole=whole, **more)
        return {"$ref": f"#/definitions/{name}"}

    def content(self, kind: type, place: str = "", *, whole: bool = True, **more: Any) -> Schema:
        """Say the keys and sections of a section."""
        summary, meanings = documented(kind)
        properties, required, rest = {}, [], False
        usual = {item.name: item.default for item in fields(kind)}
        for slot in slots_of(kind):
            if slot.name in GIVEN.get(kind, ()):
                continue
            if slot.inline:
                properties |= self.content(slot.inner)["properties"]
            elif slot.rest:
                rest = True
            else:
                default = default_text(place, slot.name, usual[slot.name])
                properties[slot.key] = self.field(slot, meanings.get(slot.name, ""), default, usual[slot.name])
                if default == "required" and self.needed(slot):
                    required.append(slot.key)
        properties |= more
        found: Schema = {"type": "object", "description": summary, "properties": properties}
        found |= {"required": required} if required and whole else {}
        return found | ({} if rest else {"additionalProperties": False})

    def needed(self, slot: Slot) -> bool:
        """Whether a field without default has keys without default."""
        return slot.inner is None or slot.is_list or slot.has_words or "required" in self.content(slot.inner)

    def field(self, slot: Slot, meaning: str, default: str, usual: Any) -> Schema:
        """Say what a key takes: a section, a list of sections, or a value with its meaning, range and default."""
        if slot.inner is not None:
            one = self.section(slot.inner, slot.key)
            if slot.is_list:
                return {"type": "array", "items": one} | ({} if slot.has_default else {"minItems": 1})
            return {"anyOf": [{**value(words_in(slot.hint)), **told(meaning, slot.hint, default)}, one]} \
                if slot.has_words else one
        found = told(meaning, slot.hint, default) | value(slot.hint)
        plain = usual is not MISSING and usual is not None and not isinstance(usual, Path) and usual != ()
        return found | ({"default": usual} if plain else {})

    def changes(self) -> Schema:
        """Say the sections of a case, none of whose keys is required."""
        sections = {name: self.section(kind, name, whole=False, **signed(name)) for name, kind in single_sections()}
        return sections | {gear: self.gear(whole=False) for gear in GEARS}

    def of_gear(self, *, planets: bool = False) -> Schema:
        """Say the sections of a gear: its flanks, and what is below its rim."""
        uneven = {"pitch_deviations_um": by_planet()} if planets else {}
        flanks = self.section(Modification, "planets" if planets else "", **uneven)
        blank = {"anyOf": [self.section(kind) for kind in (BlankCase, BodyCase, MatrixCase)]}
        return {MODIFICATION: flanks, COAST: flanks, BLANK: blank}

    def gear(self, *, whole: bool = True, planets: bool = False) -> Schema:
        """Refer to a gear with its sections."""
        return self.section(GearCase, "planets" if planets else "pinion", whole=whole, **self.of_gear(planets=planets))

    def whole(self, title: str, content: Schema) -> Schema:
        """Return the schema of a file."""
        return {"$schema": DRAFT, "title": f"pmor: {title}", **content, "definitions": self.definitions}


def value(hint: Any) -> Schema:
    """Say what an annotation takes, as `pmor.case.values.convert` does."""
    if get_origin(hint) in (UnionType, Union):
        choices = [choice for choice in get_args(hint) if choice is not NoneType]
        return value(choices[0]) if len(choices) == 1 else {"anyOf": [value(choice) for choice in choices]}
    if hint is Topography:
        return one_or_list({"type": "string", "pattern": LINE}, {})
    if get_origin(hint) is Literal:
        return {"enum": list(get_args(hint))}
    if get_origin(hint) is Annotated:
        kind, allowed = get_args(hint)
        if kind in (int, float):
            return number("integer" if kind is int else "number", allowed)
        inner = number("number", allowed)
        return one_or_list(inner, {} if allowed.in_order else {"uniqueItems": True})
    if hint is Cell:
        return {"type": "string", "pattern": f"^{CELL.pattern}$"}
    if hint is ReferenceMesh:
        return {"type": "array", "items": value(Count), "minItems": 3, "maxItems": 3}
    if get_origin(hint) is tuple:
        return one_or_list(value(get_args(hint)[0]), {"uniqueItems": True})
    return {"type": "boolean"} if hint is bool else {"type": "string", "pattern": LINE}


def number(kind: str, allowed: Range) -> Schema:
    """Say a number within its range; of per cent also text such as "5 %"."""
    low = "exclusiveMinimum" if allowed.low_excluded else "minimum"
    high = "exclusiveMaximum" if allowed.high_excluded else "maximum"
    found = {"type": kind, low: allowed.low, high: allowed.high}
    return {"anyOf": [found, {"type": "string", "pattern": f"^{PER_CENT.pattern}$"}]} if allowed.unit == "%" else found


def one_or_list(one: Schema, rules: Schema) -> Schema:
    """Say a value, or a list of such."""
    return {"anyOf": [one, {"type": "array", "items": one, "minItems": 1, **rules}]}


def by_planet() -> Schema:
    """Say deviations of teeth that planets may have each of their own."""
    slot = next(slot for slot in slots_of(Modification) if slot.name == "pitch_deviations_um")
    alike = value(slot.hint)
    own = {"type": "array", "items": {"type": "array", "items": alike["anyOf"][0]}}
    words = " Of planets also a list for each of them."
    return told(documented(Modification)[1][slot.name] + words, slot.hint, "–") | {"anyOf": [*alike["anyOf"], own]}


def words_in(hint: Any) -> Any:
    """The words of a key that may be a section too."""
    return next(choice for choice in get_args(hint) if get_origin(choice) is Literal)


def told(meaning: str, hint: Any, default: str) -> Schema:
    """Meaning, range with unit and default of a key in words, as an editor shows them."""
    ranges = [allowed for _, allowed in forms_of(hint) if isinstance(allowed, Range)]
    allowed = [f"{range_words(one)} {one.unit.replace('modules', '')}".strip() for one in ranges]
    allowed = [text for text in allowed if text != "any"]
    usual = "" if default == "–" else default if default == "required" else f"default: {default}"
    more = "; ".join([*allowed, *filter(None, [usual])])
    return {"description": f"{meaning}\n\n{more}" if more else meaning}


def single_sections() -> list[tuple[str, type]]:
    """Sections of a case that are not of one gear."""
    return [(name, kind) for name, kind in SECTIONS.items() if name.split(".")[0] not in GEARS]


def of_pair() -> Schema:
    """Return the schema of a case."""
    made = Schemas()
    sections = {name: made.section(kind, name, **signed(name)) for name, kind in single_sections()}
    wheel = made.gear(whole=False)
    alike = {"minProperties": 1, "propertyNames": {"enum": [MODIFICATION, COAST, BLANK]}}
    wheel = {"allOf": [wheel, {"anyOf": [{"required": ["teeth"]}, alike]}]}
    flanks = dict.fromkeys(GEARS, made.section(Modification))
    properties = {
        "title": TITLE, **sections, "pinion": made.gear(), "wheel": wheel,
        CONDITION: {"type": "array", "items": made.section(ConditionCase, CONDITION, **flanks)},
        LOADS: {"type": "array", "items": made.section(TimedLoad)},
    }  # fmt: skip
    required = ["load", "pair", "pinion"]
    return made.whole(KINDS["case"].words, closed(properties, required))


def signed(section: str) -> Schema:
    """Torques of a case, which are negative where they load the coast flanks."""
    keys = [key for name, key in (("load", "torque_Nm"), *TORQUES) if name == section]
    kind, found = SECTIONS[section], {}
    for slot in slots_of(kind):
        if slot.name in keys:
            usual = next(item.default for item in fields(kind) if item.name == slot.name)
            default = default_text(section, slot.name, usual)
            one = {**value(SignedTorque), "not": {"const": 0}}
            inner = one_or_list(one, {"uniqueItems": True}) if section != "load" else one
            found[slot.name] = told(documented(kind)[1][slot.name], SignedTorque, default) | inner
    return found


def closed(properties: Schema, required: Iterable[str] = ()) -> Schema:
    """Say an object with these properties alone."""
    needed = {"required": list(required)} if required else {}
    return {"type": "object", "properties": properties, **needed, "additionalProperties": False}


def of_set() -> Schema:
    """Return the schema of a set: planetary ones have sections by fixed names, trains by those of their gears."""
    made = Schemas()
    gears = {name: made.gear(planets=name.endswith("planet")) for name in MEMBERS}
    pair = made.section(PairCase, whole=False)
    shared = {name: made.section(SECTIONS[name], name, whole=False) for name in SHARED}
    shared["results"] = closed({key: made.content(SECTIONS["results"])["properties"][key] for key in ("root_stress",)})
    content = made.content(SetSections, **gears, **shared, **{SECOND_PAIR: pair}, title=TITLE)
    content["required"] = ["pair"]
    train = {"anyOf": [{"required": ["gears"]}, {"required": ["meshes"]}]}
    planetary = {
        "required": ["load", "sun", "planet", "ring"],
        "properties": {"pair": {"required": ["module_mm", "face_width_mm"]}},
        "propertyNames": {"enum": sorted(content["properties"])},
    }  # fmt: skip
    named = {"anyOf": [made.gear(), pair]}
    chosen = {"if": train, "then": {"required": ["gears", "meshes"]}, "else": planetary}
    return made.whole(KINDS["set"].words, content | {"additionalProperties": named, **chosen})


def of_gearbox() -> Schema:
    """Return the schema of a gearbox: a mesh names a case, or has its sections."""
    made = Schemas()
    gear = made.content(GearCase, "pinion", whole=False, **made.of_gear())["properties"]
    own = dict.fromkeys(GEARS, made.content(GearPlace, **gear) | {"additionalProperties": False})
    mesh = made.content(Mesh, **made.changes() | own) | {"additionalProperties": False}
    mesh["required"] = ["name", *GEARS]
    sections = {"required": ["pair"], "properties": {
        "pair": {"required": ["module_mm", "face_width_mm"]}, "pinion": {"required": ["teeth"]}}}  # fmt: skip
    mesh |= {"if": {"not": {"required": ["case"]}}, "then": sections}
    content = made.content(GearboxSections, title=TITLE, meshes={"type": "array", "items": mesh})
    return made.whole(KINDS["gearbox"].words, content)


def of_campaign() -> Schema:
    """Return the schema of a campaign: its relations, results and designs are of its base file's kind."""
    made, branches, properties = Schemas(), [], dict[str, Any]()
    for kind in OF_CAMPAIGNS.values():
        content = made.content(kind.sections, title=TITLE, designs=designs_of(made, kind))
        own = {key: content["properties"][key] for key in ("designs", "relations", "results")}
        for key, inside in content["properties"].items():
            any_of = [*properties.get(key, {}).get("anyOf", []), inside]
            properties[key] = {"anyOf": any_of} if key in own else inside  # editors complete keys of any of them
        others = [{"required": [key]} for key in OF_CAMPAIGNS if key != kind.key]
        branches.append({"properties": own, "required": [kind.key, "designs"], "not": {"anyOf": others}})
    pair, planetary, gearbox = branches
    chosen = {"if": {"required": ["gearbox"]}, "then": gearbox,
              "else": {"if": {"required": ["set"]}, "then": planetary, "else": pair}}  # fmt: skip
    return made.whole(KINDS["campaign"].words, closed(properties) | chosen)


def designs_of(made: Schemas, base: Kind) -> Schema:
    """Say what designs change: keys of sections, each one value, a list or a range."""
    parts: dict[str, dict[str, type]] = {}
    for name, kind in base.known.items():
        part, _, inside = name.partition(".")
        parts.setdefault(part, {})[inside] = kind
    names: dict[tuple[tuple[str, type], ...], str] = {}  # of parts with the same sections: gears
    for part, kinds in parts.items():
        name = names.setdefault(tuple(kinds.items()), f"designs.{base.key}.{part}")
        if name not in made.definitions:
            made.definitions[name] = varied_section(kinds)
    sections = {part: {"$ref": f"#/definitions/{names[tuple(kinds.items())]}"} for part, kinds in parts.items()}
    found = closed(made.content(DesignsSection)["properties"] | sections, ["method"])
    # Names of gears, meshes and shafts are those of the base file.
    return found | ({"additionalProperties": {"type": "object"}} if base.of_base else {})


def varied_section(kinds: Mapping[str, type]) -> Schema:
    """Say the keys that designs change of a section and of those inside, by their names in it."""
    found = closed({})
    for name, kind in kinds.items():
        level = found["properties"]
        for part in filter(None, name.split(".")):
            level = level.setdefault(part, closed({}))["properties"]
        meanings = documented(kind)[1]
        for slot in slots_of(kind):
            if slot.name not in GIVEN.get(kind, ()) and (slot.inner is None or slot.has_words) and not slot.rest:
                level[slot.key] = told(meanings.get(slot.name, ""), slot.hint, "–") | varied(slot.hint)
    return found


def varied(hint: Any) -> Schema:
    """Say a value of all designs, or a list or a range of numbers that differ."""
    words = [choice for choice in get_args(hint) if get_origin(choice) is Literal]
    fixed = value(words[0]) if words and any(is_dataclass(choice) for choice in get_args(hint)) else value(hint)
    numbers = [(kind, allowed) for kind, allowed in forms_of(hint) if kind in (int, float) and allowed is not None]
    if not numbers:
        return fixed
    kind, allowed = numbers[0]
    one = number("integer" if kind is int else "number", allowed)
    steps = {"type": "integer", "minimum": 2}
    span = closed({"from": one, "to": one, "steps": steps}, ["from", "to"])
    return {"anyOf": [fixed, {"type": "array", "items": one, "minItems": 1}, span]}


def of_design() -> Schema:
    """Return the schema of a design, which starts from one file of three kinds."""
    made = Schemas()
    content = made.content(Design, title=TITLE)
    content["properties"]["variables"] |= {"minItems": 1, "maxItems": MOST_VARIABLES}
    content["required"] = ["variables"]
    bases = [{"required": [key]} for key in ("case", "gearbox", "set")]
    return made.whole(KINDS["design"].words, content | {"oneOf": bases})


def of_study() -> Schema:
    """Return the schema of a study, whose variants have sections of a case."""
    made = Schemas()
    content = made.content(Study, title=TITLE)
    for name in ("lab.Variant", "lab.Rung", "lab.PeerSettings"):
        made.definitions[name]["properties"] |= made.changes()
        made.definitions[name]["additionalProperties"] = False
    return made.whole(KINDS["study"].words, content)


MADE = dict(zip(FILES, (of_pair, of_set, of_gearbox, of_design, of_campaign, of_study), strict=True))


def text_of(kind: str) -> str:
    """Return the text of the schema of a kind of file: a line for each key."""
    return laid_out(MADE[kind](), depth=4) + "\n"


def laid_out(content: Schema, depth: int) -> str:
    """Write an object with a line for each of its keys, so many levels deep."""
    if not depth or not isinstance(content, dict) or not content:
        return json.dumps(content, ensure_ascii=False)
    lines = [f"{json.dumps(key)}: {laid_out(inside, depth - 1)}" for key, inside in content.items()]
    return "{\n" + ",\n".join(lines) + "\n}"


if __name__ == "__main__":
    for kind in FILES:
        with atomic_path(FOLDER / f"{kind}.json") as temporary:
            temporary.write_text(text_of(kind), encoding="utf-8")
