"""Settings of a case, for people (`describe`) and for the bookkeeping of bases (`basis_key`)."""

import hashlib
import json
import tomllib
from collections.abc import Sequence
from dataclasses import asdict, fields
from typing import Any

from pmor.case.change import sections_of
from pmor.case.coast import flank_of, mirrored_flank
from pmor.case.document import BLANK, GEARS, MATRIX, MESH, MODIFICATION, flattened
from pmor.case.flanks import trained_flanks
from pmor.case.schema import Case, ConditionCase
from pmor.case.width import meshed_width

# Values of a list that people read one by one.
LONGEST_LIST = 8


def describe(case: Case) -> list[tuple[str, Any, bool]]:
    """List all settings of a case, in the order and with the names of the case file.

    Returns
    -------
    list of (key, value, is_default)
        `key` is `section.name`, with the unit in the name; `is_default` is true where the case file does not say it.
    """
    document = flattened(tomllib.loads(case.text))
    settings = [("title", case.title, "title" not in document)]
    for section, values in sections_of(case).items():
        written = document.get(section, {})
        for key, value in values.items():
            shown = value["file"] if isinstance(value, dict) and "file" in value else value
            settings.append((f"{section}.{key}", shown, key not in written))
    return settings


def condition_words(case: Case, condition: ConditionCase) -> list[str]:
    """Return the misalignment of a listed condition, and the keys in which its modifications differ from the case's."""
    off = ", ".join(f"{name} {value:g}" for name, value in vars(condition.misalignment).items() if value)
    own = (case.pinion_modification, case.wheel_modification)
    if flank_of(condition) != case.flank:
        own = case.other_flanks
        off = ", ".join(filter(None, [f"{flank_of(condition)} flanks", off]))
    pinion, wheel = map(mirrored_flank, own) if case.flank == "coast" else own
    flanks = [
        f"{gear} {item.name} = {_value_words(getattr(modification, item.name))}"
        for gear, modification, usual in (
            ("pinion", condition.pinion, pinion),
            ("wheel", condition.wheel, wheel),
        )
        for item in fields(modification)
        if getattr(modification, item.name) not in (getattr(usual, item.name), None)
    ]
    return [*([off] if off else []), *flanks]


def _value_words(value: object) -> str:
    return f"[{short_list(value)}]" if isinstance(value, tuple) else str(value)


def short_list(values: Sequence[float | str | tuple[float, ...]]) -> str:
    """Return values of a list as text; of many, the first ones and the last."""
    texts = [
        value if isinstance(value, str) else f"[{short_list(value)}]" if isinstance(value, tuple) else f"{value:.12g}"
        for value in values
    ]
    if len(texts) > LONGEST_LIST:
        texts = [*texts[:3], "...", texts[-1]]
    return ", ".join(texts)


def basis_key(case: Case) -> str:
    """SHA-256, in hex, of everything that determines a basis: pair, mesh, contact, reduction and training.

    Two cases with the same key can share one basis: sweep, comparison, output and comments do not enter, nor does the
    training where there is none. Modifications do where full solves on such flanks train the shapes
    (`pmor.case.flanks.trained_flanks`).
    """
    parts: dict[str, Any] = {name: asdict(getattr(case, name)) for name in ("pair", "mesh", "contact", "reduction")}
    for gear in GEARS:
        # Where the file of a body is does not matter, and a gear without one is as it was before there were such.
        if (body := parts["pair"][gear].pop("body")) is not None:
            del body[MESH if MESH in body else MATRIX]["file"]
            parts["pair"][gear]["body"] = body
    parts["meshed"] = meshed_width(case)
    if case.reduction.trained:
        parts["offline"] = asdict(case.offline)
    if case.root_stress:
        parts["root_stress"] = True
    flanks = trained_flanks(case)
    if any(flank.present for flank in flanks):
        parts["flanks"] = {"pinion": asdict(flanks[0]), "wheel": asdict(flanks[1])}
    text = json.dumps(parts, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def basis_settings(case: Case) -> dict[str, Any]:
    """Return everything that enters `basis_key`, each by its name for people."""
    sections = sections_of(case)
    blanks = [name for name in sections if f".{BLANK}" in name]
    names = ["pair", *GEARS, *blanks, "mesh", "contact", "reduction", *(["offline"] if case.reduction.trained else [])]
    settings = {f"[{name}] {key}": value for name in names for key, value in sections[name].items()}
    for gear, flank in zip(GEARS, trained_flanks(case), strict=True):
        settings |= {f"[{gear}.{MODIFICATION}] {key}": value for key, value in asdict(flank).items()}
    settings["the flanks that carry"] = case.flank
    return settings | {"[results] root_stress": case.root_stress, "the meshed part of the width": meshed_width(case)}
