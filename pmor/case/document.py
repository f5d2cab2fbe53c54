"""The shape of a case file: sections by name, those inside of others brought beside them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

GEARS = ("pinion", "wheel")
MODIFICATION = "modification"
BLANK, HOLES, MESH, MATRIX = "blank", "holes", "mesh", "matrix"
COAST = "coast_modification"
CONDITION, LOADS = "condition", "loads"


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
