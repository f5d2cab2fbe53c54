"""The shape of a case file: sections by name, those inside of others brought beside them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

GEARS = ("pinion", "wheel")
MODIFICATION = "modification"
CONDITION = "condition"


def flattened(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return a document with `[pinion.modification]` beside `[pinion]`, under that name; the same for the wheel.

    A wheel with a modification alone has the pinion's geometry, as a wheel without a section.
    """
    flat: dict[str, Any] = {}
    for name, content in document.items():
        if name not in GEARS or not isinstance(content, Mapping) or MODIFICATION not in content:
            flat[name] = content
            continue
        rest = {key: value for key, value in content.items() if key != MODIFICATION}
        if rest or name == GEARS[0]:
            flat[name] = rest
        flat[f"{name}.{MODIFICATION}"] = content[MODIFICATION]
    return flat
