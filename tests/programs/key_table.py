"""The table of all keys of a case file, as Markdown, straight from the schema.

    python -m tests.programs.key_table cases/README.md

puts it between the markers of that file.
"""

from __future__ import annotations

import re
import sys
from dataclasses import MISSING, fields
from inspect import getdoc
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pmor.case import ConditionCase
from pmor.case.document import CONDITION
from pmor.case.loader import (
    COMPARE_TORQUES,
    DEFAULT_SHAPES,
    DYNAMICS_TORQUES,
    HARRIS_TORQUES,
    OFFLINE_TORQUES,
    ONLINE_TORQUES,
    OTHER_SHAPES,
    SECTIONS,
    keys_of,
)
from pmor.case.values import range_text, toml_text
from pmor.core.ranges import Range
from pmor.gear.topography import Topography
from pmor.storage.atomic import atomic_path

BEGIN, END = "<!-- keys: made by `python -m tests.programs.key_table cases/README.md` -->", "<!-- end of keys -->"
# Defaults that are multiples of the load.
MULTIPLES = {
    "offline": OFFLINE_TORQUES, "online": ONLINE_TORQUES, "compare": COMPARE_TORQUES, "results": HARRIS_TORQUES,
    "dynamics": DYNAMICS_TORQUES,
}  # fmt: skip


def key_tables() -> str:
    """Return a heading and a table for each section: key, what is allowed, default, meaning."""
    sections = [_section(f"[{name}]", kind) for name, kind in SECTIONS.items() if not name.startswith("wheel")]
    return "\n\n".join([*sections, _section(f"[[{CONDITION}]]", ConditionCase)])


def with_key_tables(text: str) -> str:
    """Return a Markdown text with the tables between its markers.

    Raises
    ------
    ValueError
        When it has no markers.
    """
    if BEGIN not in text or END not in text:
        raise ValueError(f"the text lacks the lines {BEGIN!r} and {END!r}")
    before, after = text.split(BEGIN)[0], text.split(END)[1]
    return f"{before}{BEGIN}\n\n{key_tables()}\n\n{END}{after}"


def _section(heading: str, kind: type) -> str:
    summary, meanings = _documented(kind)
    lines = [f"### `{heading}`", "", summary, "", "| key | allowed | default | meaning |", "| --- | --- | --- | --- |"]
    defaults = {item.name: item.default for item in fields(kind)}
    for key, annotation in keys_of(kind).items():
        cells = f"`{key}`", _allowed(annotation), _default(heading.strip("[]"), key, defaults[key]), meanings[key]
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(lines)


def _documented(kind: type) -> tuple[str, dict[str, str]]:
    """Summary of a dataclass and the meaning of each field, from its docstring."""
    text = getdoc(kind) or ""
    summary, _, parameters = text.partition("\n\nParameters\n----------\n")
    summary = re.sub(r" \(section[^)]*\)", "", summary)  # that is the heading
    meanings: dict[str, str] = {}
    for entry in re.split(r"\n(?=\S)", parameters.split("\n\n")[0]):
        names, _, meaning = entry.partition(" : ")
        described = " ".join(line.strip() for line in meaning.split("\n")[1:]).replace("None is", "left out:")
        meanings |= dict.fromkeys(names.split(", "), described)
    return summary, meanings


def _allowed(annotation: Any) -> str:
    if get_origin(annotation) in (UnionType, Union):
        return ", ".join(_allowed(choice) for choice in get_args(annotation) if choice is not NoneType)
    if annotation is Topography:
        return "name of a CSV file"
    if get_origin(annotation) is Literal:
        return ", ".join(f"`{toml_text(choice)}`" for choice in get_args(annotation))
    if get_origin(annotation) is tuple:
        return f"{_allowed(get_args(annotation)[0])}, or a list of them"
    if get_origin(annotation) is Annotated:
        kind, allowed = get_args(annotation)
        assert isinstance(allowed, Range)
        words = {int: "whole number", float: "number", tuple[float, ...]: "list of numbers"}[kind]
        return f"{words}, {range_text(allowed)}"
    return "`true`, `false`" if annotation is bool else "text"


def _default(section: str, key: str, default: Any) -> str:
    if default is MISSING and section in MULTIPLES:
        return "load × " + ", ".join(f"{factor:g}" for factor in MULTIPLES[section])
    if default is MISSING and section == CONDITION:
        return "its number" if key == "name" else "that of the case"
    if default is MISSING and key == "shapes":
        return " or ".join(f"`{toml_text(shapes)}`" for shapes in (DEFAULT_SHAPES["line"], OTHER_SHAPES))
    if default is MISSING:
        return "**required**"
    return "left out" if default is None else f"`{toml_text(default)}`"


def main(path: Path) -> None:
    """Put the tables into a file."""
    text = with_key_tables(path.read_text(encoding="utf-8"))
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
