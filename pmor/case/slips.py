"""Values that are allowed, and yet likely ones in another unit: named in warnings, never refused."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from typing import Any, get_type_hints

from pmor.case.document import GEARS, MODIFICATION
from pmor.case.schema import Case
from pmor.case.values import forms_of, toml_text, wrong_unit_text


def case_slips(case: Case) -> list[str]:
    """Return a sentence for each value of a case that is likely one in another unit."""
    pair = case.pair
    sections: dict[str, Any] = {"pair": pair, "misalignment": case.misalignment}
    for gear, flank in zip(GEARS, (case.pinion_modification, case.wheel_modification), strict=True):
        sections[f"{gear}.{MODIFICATION}"] = flank
    for number, condition in enumerate(case.conditions, start=1):
        sections[f"condition {number}"] = condition.misalignment
    return slips(sections)


def slips(sections: Mapping[str, Any]) -> list[str]:
    """Return a sentence for each value of some sections, dataclasses by their names, that is likely in another unit."""
    return [sentence for name, section in sections.items() for sentence in _slips_of(section, name)]


def _slips_of(section: Any, name: str) -> Iterator[str]:
    hints = get_type_hints(type(section), include_extras=True)
    for item in fields(section):
        value = getattr(section, item.name)
        numbers = [abs(n) for n in (value if isinstance(value, tuple) else [value]) if isinstance(n, float)]
        largest = max(numbers, default=0.0)
        for _, allowed in () if is_dataclass(value) else forms_of(hints[item.name]):
            if allowed is None or not 0.0 < largest < allowed.least:
                continue
            unit = allowed.mistaken_for[0]
            remedy = wrong_unit_text(largest, unit.name, unit.symbol, largest * unit.factor, allowed.unit)
            yield f"[{name}] {item.name} = {toml_text(value)}: is below {allowed.least:g} {allowed.unit}: {remedy}"
