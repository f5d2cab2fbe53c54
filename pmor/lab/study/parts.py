"""Part files: one JSON file per finished piece of work, so that an interrupted study goes on where it stopped."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pmor
from pmor.case import Case
from pmor.report.data_files import write_summary_json

# Raise when the content of a part changes its meaning: older ones are then computed anew.
PART_VERSION = 1


def part_key(name: str, cases: Mapping[str, Case], settings: Any) -> str:
    """Return the SHA-256, in hex, of everything that a piece of work depends on.

    Parameters
    ----------
    name : str
        Of the piece of work.
    cases : mapping of str to Case
        That it solves; comments and the like do not count.
    settings : JSON data
        What else it depends on.
    """
    said = {
        label: {name: value for name, value in asdict(case).items() if name not in ("text", "title")}
        for label, case in cases.items()
    }
    content = [PART_VERSION, pmor.__version__, name, said, settings]
    return hashlib.sha256(json.dumps(content, sort_keys=True, allow_nan=False).encode()).hexdigest()


def read_part(path: Path, key: str) -> dict[str, Any] | None:
    """Return the result in a part file, or None when there is none, or one made from other settings."""
    try:
        part = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None  # missing, or damaged: it is made anew
    return part["result"] if isinstance(part, dict) and part.get("key") == key else None


def write_part(path: Path, key: str, result: Mapping[str, Any]) -> dict[str, Any]:
    """Write a part file and return its result as `read_part` would: numbers, lists and null alone.

    Raises
    ------
    OutputError
    """
    write_summary_json(path, {"key": key, "result": result})
    found = read_part(path, key)
    assert found is not None
    return found
