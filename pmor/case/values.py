"""Check one value of a TOML file against the type and the range that the schema gives its key.

All functions return the converted value or raise `Refused` with rule and remedy; `pmor.case.reader` adds file, section
and key.
"""

import json
import math
import re
from dataclasses import fields
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pmor.core.errors import CaseError
from pmor.core.ranges import Range
from pmor.core.wording import did_you_mean
from pmor.gear.topography import Topography

LONGEST_SHOWN_VALUE = 60
PER_CENT = re.compile(r"\s*(\d+\.?\d*)\s*%\s*")
TORQUE_UNIT = "N m"
NO_LOAD = "without load there is no contact to solve: a small torque, such as 0.001, shows the flanks"
OTHER_FLANKS = (
    "a negative torque loads the coast flanks, and those of one list load the same flanks: give [load] torque_Nm the "
    "same sign, or a [[condition]] with this torque"
)


# Words and keys of earlier versions, and the remedy.
REMOVED = {
    "members": "was renamed: write meshes = ...",
    "grassmann": 'between subspaces was removed, no better than linear with aligned modes: write "linear"',
    "strip": 'pressure integrated over strips was removed: write "line", or "direct" for penalty contact',
    "thin_slices": "leave it out, and run 'pmor lab slices CASE' for this comparison",
}


class Refused(Exception):
    """A value that breaks a rule; the message is the rule and the remedy."""


def toml_text(value: object) -> str:
    """Write a value about as the case file does, on one line and not too long."""
    if isinstance(value, list | tuple):
        text = "[" + ", ".join(toml_text(item) for item in value) + "]"
    elif isinstance(value, bool | str):
        text = json.dumps(value, ensure_ascii=False)
    elif isinstance(value, int) and value.bit_length() > 200:
        text = "a very large whole number"  # Python refuses to print integers of more than 4300 digits
    else:
        text = str(value)
    return text if len(text) <= LONGEST_SHOWN_VALUE else text[: LONGEST_SHOWN_VALUE - 3] + "..."


def plain(value: Any) -> Any:
    """Return numpy's numbers and arrays as Python's, also in lists."""
    value = value.tolist() if hasattr(value, "tolist") else value
    return [plain(item) for item in value] if isinstance(value, list | tuple) else value


def convert(value: object, annotation: Any) -> Any:
    """Check `value` against the annotation of its field and return it in the field's type.

    Parameters
    ----------
    value : object
        As the TOML reader gives it, or as Python has it.
    annotation : type
        A form of the schemas: bool, str, Path, Literal, tuple of Literal; `Annotated` int, float or tuple of float with
        a `Range`; a `Topography`; a class with a static method `from_toml`; a tuple of these; one of these or None; a
        number or words.
    """
    value = plain(value)
    if get_origin(annotation) in (UnionType, Union):
        choices = [choice for choice in get_args(annotation) if choice is not NoneType]
        words = [choice for choice in choices if get_origin(choice) is Literal]
        annotation = words[0] if words and isinstance(value, str) else choices[0]
    if annotation is Topography:
        return _topography(value)
    if get_origin(annotation) is Literal:
        return _choice(value, list(get_args(annotation)))
    if get_origin(annotation) is Annotated:
        kind, allowed = get_args(annotation)
        if kind is int:
            return _whole_number(value, allowed)
        return _number(value, allowed) if kind is float else _numbers(value, allowed)
    if hasattr(annotation, "from_toml"):
        return annotation.from_toml(value)
    if get_origin(annotation) is tuple:
        item = get_args(annotation)[0]
        return _choices(value, list(get_args(item))) if get_origin(item) is Literal else _items(value, item)
    if annotation is bool:
        return _switch(value)
    return Path(_line(value)) if annotation is Path else _line(value)


def forms_of(annotation: Any) -> list[tuple[Any, Range | None]]:
    """Return the types that a value may have, each with its range; None is no type of a value."""
    union = get_origin(annotation) in (UnionType, Union)
    kinds = [kind for kind in (get_args(annotation) if union else (annotation,)) if kind is not NoneType]
    return [get_args(kind)[:2] if get_origin(kind) is Annotated else (kind, None) for kind in kinds]


def _topography(value: object) -> Topography:
    if isinstance(value, Topography):
        return value
    if not isinstance(value, dict) or {*value, "teeth_um"} != {field.name for field in fields(Topography)}:
        raise Refused('must be the name of a CSV file, in quotes: write "flank.csv", or a list with one of each tooth')
    try:
        grids = (value["amount_um"], *value.get("teeth_um", ()))
        rows, *teeth = (tuple(tuple(map(float, row)) for row in grid) for grid in grids)
        return Topography(tuple(map(float, value["roll_deg"])), tuple(map(float, value["z_mm"])), rows, tuple(teeth))
    except (TypeError, ValueError):
        raise Refused("must hold lists of numbers: correct it") from None
    except CaseError as error:
        raise Refused(str(error)) from None


def _items(value: object, item: Any) -> tuple[Any, ...]:
    entries = value if isinstance(value, list) else [value]
    if not entries:
        raise Refused("must be a list with at least one entry: put the values in brackets")
    try:
        items = tuple(convert(entry, item) for entry in entries)
    except Refused as refused:
        raise Refused(f"each value {refused}") from None
    if len(set(items)) < len(items):
        raise Refused("has an entry twice: remove one")
    return items


def _switch(value: object) -> bool:
    if not isinstance(value, bool):
        raise Refused("must be true or false, without quotes")
    return value


def _line(value: object) -> str:
    if not isinstance(value, str):
        raise Refused('must be text: put it in quotes, as in "..."')
    if not value.strip() or not value.isprintable():
        raise Refused("must be one line of printable text: write at least one word, without line breaks")
    return value


def _choice(value: object, valid: list[str]) -> str:
    quoted = [json.dumps(word) for word in valid]
    if not isinstance(value, str):
        raise Refused(f"must be text: write one of {', '.join(quoted)}")
    if value not in valid:
        if value in REMOVED:
            raise Refused(REMOVED[value])
        raise Refused(f"unknown choice: {did_you_mean(value, valid)}")
    return value


def _choices(value: object, valid: list[str]) -> tuple[str, ...]:
    """One choice, or a list of different ones."""
    chosen = tuple(_choice(item, valid) for item in (value if isinstance(value, list) else [value]))
    if not chosen:
        raise Refused(f"must not be empty: write one or more of {', '.join(map(json.dumps, valid))}")
    if len(set(chosen)) < len(chosen):
        raise Refused("one of them is there twice: remove one")
    return chosen


def _reject_non_number(value: object) -> None:
    if isinstance(value, str):
        raise Refused("must be a number: remove the quotes")
    if isinstance(value, list):
        raise Refused("must be one number, not a list: remove the brackets")
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise Refused("must be a number: write digits, such as 20 or 1.5")


def _whole_number(value: object, allowed: Range) -> int:
    _reject_non_number(value)
    if isinstance(value, float):
        nearest = f": write {value:.0f}" if math.isfinite(value) and abs(value) < 1e9 else ""
        raise Refused(f"must be a whole number without decimal point{nearest}")
    assert isinstance(value, int)
    _check_range(value, allowed)
    return value


def _number(value: object, allowed: Range) -> float:
    if allowed.unit == "%" and isinstance(value, str) and (match := PER_CENT.fullmatch(value)):
        value = float(match[1])
    _reject_non_number(value)
    assert isinstance(value, int | float)
    try:
        number = float(value) + 0.0  # turns -0.0 into 0.0, so that equal cases have equal keys
    except OverflowError:  # an integer of hundreds of digits
        number = math.inf
    _check_range(number, allowed)
    # Evenly spaced torques come as 70.10000000000001 out of other programs; files and curves are labelled by them.
    return float(f"{number:.12g}") if allowed.unit == TORQUE_UNIT else number


def _numbers(value: object, allowed: Range) -> tuple[float, ...]:
    if isinstance(value, int | float) and not isinstance(value, bool):
        return (_number(value, allowed),)
    if not isinstance(value, list):
        raise Refused("must be a number, or a list of numbers in brackets, as in [20.0, 70.0]")
    if not value:
        raise Refused("must not be empty: give at least one value, or leave the key out for the default")
    try:
        numbers = [_number(item, allowed) for item in value]
    except Refused as refused:
        raise Refused(f"each value {refused}") from None
    if allowed.in_order:
        return tuple(numbers)
    numbers.sort()
    for smaller, larger in zip(numbers[:-1], numbers[1:], strict=True):
        if smaller == larger:
            raise Refused(f"{larger} is there twice: remove one")
    return tuple(numbers)


def _check_range(value: int | float, allowed: Range) -> None:
    if isinstance(value, float) and not math.isfinite(value):
        raise Refused(f"must be a finite number: write one that is {range_text(allowed)}")
    if not allowed.contains(value):
        raise Refused(f"must be {range_text(allowed)}: {_remedy(value, allowed)}")


def range_text(allowed: Range) -> str:
    """Return the range in words, with its unit: `above 0 and below 1`."""
    if not (allowed.low_excluded or allowed.high_excluded):
        text = f"between {allowed.low:g} and {allowed.high:g}"
    else:
        low, high = "above" if allowed.low_excluded else "at least", "below" if allowed.high_excluded else "at most"
        text = f"{low} {allowed.low:g} and {high} {allowed.high:g}"
    return f"{text} ({allowed.unit})" if allowed.unit else text


def _remedy(value: int | float, allowed: Range) -> str:
    if allowed.unit == TORQUE_UNIT and value <= 0.0:
        return OTHER_FLANKS if value < 0.0 else NO_LOAD
    for unit in allowed.mistaken_for:
        converted = value * unit.factor
        if allowed.contains(converted):
            return wrong_unit_text(value, unit.name, unit.symbol, converted, allowed.unit)
    return "raise it" if value <= allowed.low else "lower it"


def wrong_unit_text(value: float, name: str, symbol: str, converted: float, unit: str) -> str:
    """Remedy for a value in the wrong unit, such as "looks like radians: 0.349 rad = 20 deg, write 20.0"."""
    return f"looks like {name}: {value:g} {symbol} = {converted:.4g} {unit}, write {float(f'{converted:.4g}')}"
