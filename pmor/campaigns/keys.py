"""Keys of base files by section and name: ``pinion.modification.tip_relief_um`` has a dot in both."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from pmor.case.reader import keys_of
from pmor.case.values import forms_of


def split(name: str) -> tuple[str, str]:
    """Part the name of a key into its section and itself."""
    section, _, key = name.rpartition(".")
    return section, key


def by_section(design: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the keys of a design by their sections."""
    found: dict[str, dict[str, Any]] = {}
    for name, value in design.items():
        section, key = split(name)
        found.setdefault(section, {})[key] = value
    return found


def unit_of(name: str, known: Mapping[str, type]) -> str:
    """Return the unit of a key of known sections; empty where it has none."""
    section, key = split(name)
    hint = keys_of(known[section])[key]
    return next((allowed.unit for _, allowed in forms_of(hint) if allowed is not None), "")


def setting(document: Mapping[str, Any], design: Mapping[str, Any], name: str, known: Mapping[str, type]) -> Any:
    """Return the value of a key: of the design, of the base file, or the usual one."""
    section, key = split(name)
    if name in design:
        return design[name]
    usual = {field.name: field.default for field in fields(known[section])}
    return document.get(section, {}).get(key, usual[key])
