"""Keys of base files by section and name: ``pinion.modification.tip_relief_um`` has a dot in both.

Sections in a list, and numbers in one, have their place in it as a name, from 1:
``pins.bearings.1.roller.clearance_mm``, ``planets.tangential_um.2``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from typing import Annotated, Any, get_args, get_origin

from pmor.case.reader import keys_of
from pmor.case.values import forms_of
from pmor.core.errors import CaseError


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
    hint = hint_of(name, known)
    return next((allowed.unit for _, allowed in forms_of(hint) if allowed is not None), "")


def hint_of(name: str, known: Mapping[str, type]) -> Any:
    """Return the annotation of a key of known sections, or of a number in the list that a key is; None without one."""
    section, key = split(name)
    if section in known:
        return keys_of(known[section]).get(key)
    above, listed = split(section)
    hint = keys_of(known[above]).get(listed) if key.isdigit() and above in known else None
    parts = get_args(hint) if get_origin(hint) is Annotated else ()
    return Annotated[get_args(parts[0])[0], parts[1]] if parts and get_origin(parts[0]) is tuple else None


def parts_in(part: Any, name: str) -> dict[str, type]:
    """Return the sections of a part that was read by their names, its own the first, those in lists by their places."""
    found: dict[str, type] = {name: type(part)}
    for item in fields(part):
        value, key = getattr(part, item.name), f"{name}.{item.name}"
        if is_dataclass(value):
            found |= parts_in(value, key)
        elif isinstance(value, tuple):
            for number, inner in enumerate(value, start=1):
                found |= parts_in(inner, f"{key}.{number}") if is_dataclass(inner) else {}
    return found


def with_value(part: Any, path: Sequence[str], value: Any) -> Any:
    """Return a dataclass, a table or a list with one value in it changed, by the names on the way to it.

    Raises
    ------
    CaseError
        When a list has no such place.
    """
    if not path:
        return value
    step, rest = path[0], path[1:]
    if isinstance(part, list | tuple):
        number = int(step) if step.isdigit() else 0
        if not 1 <= number <= len(part):
            raise CaseError(f"{step}: the base file lists {len(part)} there: name one of them by its number, from 1 on")
        return type(part)((*part[: number - 1], with_value(part[number - 1], rest, value), *part[number:]))
    if is_dataclass(part) and not isinstance(part, type):
        return replace(part, **{step: with_value(getattr(part, step), rest, value)})
    return {**part, step: with_value(part.get(step, [] if rest and rest[0].isdigit() else {}), rest, value)}


def setting(document: Mapping[str, Any], design: Mapping[str, Any], name: str, known: Mapping[str, type]) -> Any:
    """Return the value of a key: of the design, of the base file, or the usual one."""
    section, key = split(name)
    if name in design:
        return design[name]
    usual = {field.name: field.default for field in fields(known[section])}
    return document.get(section, {}).get(key, usual[key])
