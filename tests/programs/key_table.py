"""Tables of all keys of case, study, design, campaign, gearbox and set files, as Markdown, from the dataclasses.

    python -m tests.programs.key_table cases/manual/keys.md

writes that page. A section that stands at several places is told once, under all its headings; keys that have range,
default and meaning in common are one row.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from dataclasses import MISSING, fields, is_dataclass
from inspect import getdoc
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from pmor.campaigns.settings import GearboxCampaign, PairCampaign, SetCampaign
from pmor.case import ConditionCase
from pmor.case.body import MatrixCase
from pmor.case.document import COAST, CONDITION, LOADS
from pmor.case.duty import TimedLoad
from pmor.case.loader import (
    COMPARE_TORQUES,
    COMPARED_LOADS,
    DEFAULT_SHAPES,
    DYNAMICS_TORQUES,
    ELEMENTS_TO_AXIAL_PITCH,
    EXACT_ANGLES,
    HARRIS_TORQUES,
    OFFLINE_TORQUES,
    ONLINE_TORQUES,
    OTHER_SHAPES,
)
from pmor.case.reader import keys_of, sections_in
from pmor.case.schema import SECTIONS
from pmor.case.values import toml_text
from pmor.core.ranges import Range
from pmor.design.settings import Design
from pmor.gear.condition import Misalignment
from pmor.gear.modification import Modification, Wave
from pmor.gear.topography import Topography
from pmor.lab.study.settings import Study
from pmor.machine.settings import GearboxSections
from pmor.sets.settings import SetSections
from pmor.storage.atomic import atomic_path

HEAD = """# All keys

Made by `python -m tests.programs.key_table cases/manual/keys.md`. `pmor plan FILE` shows the keys of a file with their
defaults. Units stand in the names of the keys, words in quotes in a file. *list* is a list of such values, `> 0`
excludes the end, ends that no machine comes near are left out (*any*: both); a dash is a key that may be left out,
`[[name]]` may stand several times. All files but cases have a `title`, by default their name. A section is told where
it first stands. How a gear is made is told under `[pinion]`: `[wheel]` of a case, `[sun]`, `[planet]`, `[ring]` and
gears by their names of a set, and the sections of a mesh of a gearbox have these keys and sections too.
"""
NUMBERS = {int: "whole", float: "", tuple[float, ...]: "list", tuple[int, ...]: "list, whole"}
# Ends of ranges that only catch slips of unit.
LEAST_LENGTH, BEYOND = 0.001, 1e5
MOST_CHOICES, QUANTITIES = 12, "[quantities](quantities.md#names-of-results) of campaigns"
# Units that stand in the name of the key.
UNIT_WORDS = re.compile(
    r",? in (mm|um|degrees|GPa|N m|N/mm3|N/um|N s/mm|kN m/rad|kg m2|kg/m3|kg|rpm|Hz)\b(?=[.,;:) ])|, um(?=[.:])"
)
# Defaults that are multiples of the load.
MULTIPLES = {
    "offline": OFFLINE_TORQUES, "online": ONLINE_TORQUES, "compare": COMPARE_TORQUES, "results": HARRIS_TORQUES,
    "dynamics": DYNAMICS_TORQUES,
}  # fmt: skip
# Defaults that the rest of the case changes.
CHANGED = {
    ("mesh", "width_elements"): f"; of helical pairs with line contact {ELEMENTS_TO_AXIAL_PITCH:g} to an axial pitch",
    ("compare", "angles"): f"; `{EXACT_ANGLES}` of exact line loads alone",
    ("pinion", "rack_tip_radius"): "; less where the rack tooth has no room for it",
}


def formats() -> dict[str, dict[str, type]]:
    """Return the sections of each format by their headings; empty is what stands above the sections."""
    # Sections with the keys of another one: the wheel's, and those of coast flanks.
    case = {f"[{name}]": kind for name, kind in SECTIONS.items() if not name.startswith("wheel") and COAST not in name}
    case |= {
        f"[{name}]": kind for name, kind in sections_in(SECTIONS["wheel"], "wheel").items() if kind not in case.values()
    }
    case["[wheel.blank] mesh"] = case.pop("[wheel.body]")  # the same section with other keys
    case["[wheel.blank] matrix"] = MatrixCase
    others = {
        "study": Study,
        "design": Design,
        "campaign": PairCampaign,
        "set campaign": SetCampaign,
        "gearbox campaign": GearboxCampaign,
        "gearbox": GearboxSections,
        "set": SetSections,
    }
    waves = {f"[[{gear}.modification.waves]]": Wave for gear in ("pinion", "wheel")}
    return {"case": {**case, **waves, f"[[{CONDITION}]]": ConditionCase, f"[[{LOADS}]]": TimedLoad}} | {
        name: {"": root} | {_brackets(section, root): kind for section, kind in sections_in(root).items()
                            if root not in (SetCampaign, GearboxCampaign)
                            or kind not in sections_in(PairCampaign).values()}
        for name, root in others.items()
    }  # fmt: skip


def key_page() -> str:
    """Return the page: for each kind of file a table of its keys, section by section."""
    parts = [HEAD.rstrip()]
    told: dict[type, str] = {}
    for name, sections in formats().items():
        places: dict[type, list[str]] = {}
        for heading, kind in sections.items():
            places.setdefault(kind, []).append(heading)
        rows = [row for kind, headings in places.items() for row in _rows(headings, kind, told.get(kind))]
        told = {kind: f"`{headings[0]}` of a {name}" for kind, headings in places.items()} | told
        head = f"## Keys of a {name} file", "", "key | allowed | default | meaning", "---|---|---|---"
        parts.append("\n".join([*head, *rows]))
    return "\n\n".join(parts) + "\n"


def keys_in_file(kind: type) -> dict[str, Any]:
    """Return the keys of a section that are told under it; a study's own name and place are none."""
    elsewhere = {"title"}
    if kind is Study:
        elsewhere |= {"name", "where"}
    if kind is ConditionCase:
        elsewhere |= set(keys_of(Misalignment))
    return {key: hint for key, hint in keys_of(kind).items() if key not in elsewhere}


def _brackets(section: str, root: type) -> str:
    lists = {
        str(name)
        for field, hint in get_type_hints(root, include_extras=True).items()
        for kind, *words in [get_args(hint) if get_origin(hint) is Annotated else (hint,)]
        for name in (words or [field])
        if get_origin(kind) is tuple
    }
    return f"[[{section}]]" if section in lists else f"[{section}]"


def _rows(headings: Sequence[str], kind: type, told_as: str | None) -> list[str]:
    if told_as:
        return [_row([_bold(headings), "", "", f"As {told_as}."])]
    summary, meanings = documented(kind)
    defaults = {item.name: item.default for item in fields(kind)}
    told: dict[tuple[str, str, str], list[str]] = {}
    for key, annotation in keys_in_file(kind).items():
        default = default_text(headings[0].strip("[]"), key, defaults.get(key, MISSING))
        told.setdefault((_allowed(annotation), default, meanings[key]), []).append(f"`{key}`")
    sections = [(_bold(headings), "", "", summary)] if headings[0] else []
    return [_row(row) for row in [*sections, *((", ".join(keys), *row) for row, keys in told.items())]]


def _bold(headings: Sequence[str]) -> str:
    return ", ".join(f"**{heading}**" for heading in headings)


def _row(cells: Sequence[str]) -> str:
    return " | ".join(cell.replace("|", "\\|") for cell in cells).replace(" |  |", " | |")


def documented(kind: type) -> tuple[str, dict[str, str]]:
    """Summary of a dataclass and the meaning of each field, from its docstring."""
    text = getdoc(kind) or ""
    summary, _, parameters = text.partition("\n\nParameters\n----------\n")
    summary = " ".join(summary.split())
    summary = re.sub(r",? \(section[^)]*\)", "", summary)  # that is the heading
    meanings: dict[str, str] = {}
    for entry in re.split(r"\n(?=\S)", parameters.split("\n\n")[0]):
        names, _, meaning = entry.partition(" : ")
        described = " ".join(line.strip() for line in meaning.split("\n")[1:])
        described = re.sub(r"[;,] (None is|by default) left out", "", described).replace("None is", "left out:")
        described = UNIT_WORDS.sub("", described)
        meanings |= dict.fromkeys(names.split(", "), described[:1].upper() + described[1:])
    return summary, meanings


def _allowed(annotation: Any) -> str:
    if get_origin(annotation) in (UnionType, Union):
        return ", ".join(_allowed(choice) for choice in get_args(annotation) if choice is not NoneType)
    if annotation is Topography:
        return "CSV file"
    if get_origin(annotation) is Literal:
        choices = get_args(annotation)
        if len(choices) > MOST_CHOICES:  # they are a table of their own
            return "key of `[modification]`" if set(choices) <= set(keys_of(Modification)) else QUANTITIES
        return f"`{', '.join(str(choice) for choice in choices)}`"
    if hasattr(annotation, "from_toml"):
        return "such as `" + re.search("``(.*)``", annotation.from_toml.__doc__)[1] + "`"  # type: ignore[index]
    if get_origin(annotation) is tuple:
        item = get_args(annotation)[0]
        return f"{_allowed(item)}, or a list" if get_origin(item) is Literal else f"list: {_allowed(item)}"
    if get_origin(annotation) is Annotated:
        kind, allowed = get_args(annotation)
        assert isinstance(allowed, Range)
        return ", ".join(filter(None, [NUMBERS[kind], range_words(allowed)]))
    if is_dataclass(annotation):
        return "or its section"
    return "true, false" if annotation is bool else "text"


def range_words(allowed: Range) -> str:
    low = "> 0" if allowed.low_excluded or allowed.low == LEAST_LENGTH else f"{allowed.low:g}"
    unit = "" if allowed.unit != "modules" else " modules"
    if allowed.high >= BEYOND:
        return "any" if allowed.low <= -BEYOND else low if low == "> 0" else f"from {low}"
    return f"{low} to {'< ' * allowed.high_excluded}{allowed.high:g}{unit}"


def default_text(section: str, key: str, default: Any) -> str:
    if default is MISSING and section in MULTIPLES and key.endswith("torques_Nm"):
        alone = f"; {_shares(COMPARED_LOADS)} of exact line loads alone" if section == "compare" else ""
        return f"load × {_shares(MULTIPLES[section])}{alone}"
    if default is MISSING and section == CONDITION:
        return "its number" if key == "name" else "that of the case"
    if default is MISSING and key == "shapes":
        return " or ".join(f"`{shapes}`" for shapes in (DEFAULT_SHAPES["line"], OTHER_SHAPES))
    if default is MISSING:
        return "required"
    usual = "–" if default in (None, ()) else toml_text(default)
    usual = f"`{default}`" if isinstance(default, str) else usual
    return usual + CHANGED.get((section, key), "")


def _shares(factors: Sequence[float]) -> str:
    return ", ".join(f"{factor:g}" for factor in factors)


def main(path: Path) -> None:
    """Write the page."""
    with atomic_path(path) as temporary:
        temporary.write_text(key_page(), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
