"""The shape of a case file: sections by name, those inside of others brought beside them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

GEARS = ("pinion", "wheel")
MODIFICATION = "modification"
BLANK, HOLES, MESH, MATRIX = "blank", "holes", "mesh", "matrix"
COAST = "coast_modification"
CONDITION, LOADS = "condition", "loads"

# Begins a file within the text of a machine that several describe: a comment of TOML.
FILE = "# file: "


def joined_files(first: str, others: Mapping[str, str]) -> str:
    """Return the texts of several files as one, the first as it is, the others by what they are of."""
    return "\n".join([first, *(f"{FILE}{name}\n{text}" for name, text in others.items())])


def files_in(text: str) -> dict[str, str]:
    """Return the texts of the files in one that `joined_files` made; the first has no name."""
    first, *others = f"\n{text}".split(f"\n{FILE}")
    return {"": first.removeprefix("\n"), **{name: own for name, _, own in (other.partition("\n") for other in others)}}


def flattened(document: Mapping[str, Any], gears: Sequence[str] = GEARS) -> dict[str, Any]:
    """Return a document with `[pinion.modification]` beside `[pinion]`; so are all sections of flanks and blanks.

    A wheel with a modification or a blank alone has the pinion's geometry, as a wheel without a section.
    """
    flat: dict[str, Any] = {}
    for name, content in document.items():
        within = (MODIFICATION, COAST, BLANK) if name in gears else (HOLES,) if name.endswith(f".{BLANK}") else ()
        inside = [key for key in within if isinstance(content, Mapping) and key in content]
        if not inside:
            flat[name] = content
            continue
        rest = {key: value for key, value in content.items() if key not in inside}
        if rest or name != GEARS[1]:
            flat[name] = rest
        flat |= flattened({f"{name}.{key}": content[key] for key in inside}, gears)
    return flat
