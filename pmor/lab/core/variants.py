"""Changes of a case by section and key: all laboratories vary these."""

from __future__ import annotations

from typing import Any

from pmor.case.reader import Sections


def merged(*changes: Sections) -> dict[str, dict[str, Any]]:
    """Return all changes in one; where they name the same key the last one counts."""
    result: dict[str, dict[str, Any]] = {}
    for sections in changes:
        for name, keys in sections.items():
            result.setdefault(name, {}).update(keys)
    return result
