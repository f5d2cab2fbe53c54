"""Cases made and changed in Python: by keyword, with the checks of a file and a text that reads back."""

import json
import tomllib
from collections.abc import Mapping
from dataclasses import MISSING, asdict, fields, is_dataclass, replace
from pathlib import Path
from typing import Any

from pmor.case.coast import TORQUES, as_drawn
from pmor.case.document import BLANK, COAST, CONDITION, GEARS, HOLES, LOADS, MODIFICATION, flattened
from pmor.case.gears import GearCase
from pmor.case.loader import parse_case
from pmor.case.reader import keys_of
from pmor.case.rings import OF_RACKS
from pmor.case.schema import SECTIONS, Case
from pmor.core.errors import CaseError
from pmor.core.wording import did_you_mean
from pmor.gear.modification import UNMODIFIED, other_places
from pmor.gear.topography import Topography


def make_case(name: str = "case", **settings: Any) -> Case:
    """Make a case without a file; see `pmor.app.cases`, which types the keywords out."""
    return case_of_settings(settings, name)


def case_of_settings(settings: Mapping[str, Any], name: str, folder: Path | None = None) -> Case:
    """Make a case of its sections, as `make_case`; files in them are beside a folder, and there are none without."""
    return parse_case(document_text(_changed({}, settings, name)), name, name, folder)


def change_case(case: Case, **settings: Any) -> Case:
    """Return a case with some settings changed; see `make_case`."""
    return parse_case(document_text(_changed(tomllib.loads(text_of(case)), settings, case.name)), case.name, case.name)


def said_gears(case: Case) -> tuple[str, ...]:
    """Return the gears that the file of a case has sections of: without a `[wheel]` it is the pinion once more."""
    return GEARS if "teeth" in tomllib.loads(text_of(case)).get("wheel", {}) else GEARS[:1]


def without_models(case: Case) -> Case:
    """Return a case of its own model alone, without stress: for the variation of its STE."""
    changes: dict[str, Any] = {} if case.compare.models is None else {"compare": {"models": None}}
    if case.root_stress:
        changes["results"] = {"root_stress": False}
    # Fields are replaced where they must be alone: text that is made anew says what its file left to other keys.
    case = case.without_web_stress() if case.web_stress else case
    return change_case(case, **changes) if changes else case


def for_motion(case: Case) -> Case:
    """Return a case without what its motion does not need: the other models that it compares, and error bars."""
    return change_case(without_models(case), mesh={"error_bar": False})


def changed_text(base: str, changes: Mapping[str, Mapping[str, Any]]) -> str:
    r"""Return the TOML text of a case with some keys changed; comments are lost.

    Parameters
    ----------
    base : str
        TOML text of a case.
    changes : mapping
        New values by section and key.

    Examples
    --------
    >>> print(changed_text('[mesh]\nprofile_elements = 16', {"mesh": {"profile_elements": 8}}).strip())
    [mesh]
    profile_elements = 8
    """
    return document_text(_changed(tomllib.loads(base), changes, "case"))


def text_of(case: Case) -> str:
    """Return TOML text that reads back as this very case.

    Its own, comments and all; a new one where fields of the dataclass were replaced since it was read.
    """
    try:
        if replace(parse_case(case.text, case.name, case.name), text=case.text) == case:
            return case.text
    except CaseError:
        pass
    document: dict[str, Any] = {"title": case.title, **sections_of(case)}
    if case.loads:
        document[LOADS] = [asdict(load) for load in case.loads]
    if case.conditions:
        listed = map(_shallow, case.conditions)
        document[CONDITION] = [condition | vars(condition.pop("misalignment")) for condition in listed]
    return document_text(document)


def sections_of(case: Case) -> dict[str, dict[str, Any]]:
    """Return all settings by section and key, in the order of a case file; of modifications, those that are there."""
    coast = case.flank == "coast"
    case = as_drawn(case)
    pair = asdict(case.pair)
    gears = {gear: _own_keys(pair.pop(gear)) for gear in GEARS}
    blanks = {f"{gear}.{BLANK}": gears[gear].pop(BLANK) for gear in GEARS}
    bodies = {f"{gear}.{BLANK}": gears[gear].pop("body") for gear in GEARS}
    sections = {"load": {"torque_Nm": case.torque_Nm, "speed_rpm": case.speed_rpm}, "pair": pair, **gears}
    sections |= {name: body for name, body in bodies.items() if body is not None}
    for name, blank in blanks.items():
        if blank is not None:
            holes = blank.pop(HOLES)
            sections |= {name: blank} | ({} if holes is None else {f"{name}.{HOLES}": holes})
    drive = case.pinion_modification, case.wheel_modification
    for gear, modification, other in zip(GEARS, drive, case.other_flanks, strict=True):
        usual = modification.alike
        for name, flank, default in ((MODIFICATION, modification, UNMODIFIED), (COAST, other, usual)):
            if flank != default:
                sections[f"{gear}.{name}"] = {
                    key: value for key, value in _shallow(flank).items() if value != getattr(default, key)
                }
    rest = [name for name in SECTIONS if name not in sections and MODIFICATION not in name and BLANK not in name]
    sections |= {name: asdict(settings) for name in rest if (settings := getattr(case, name)) is not None}
    if coast:
        sections["load"]["torque_Nm"] = -case.torque_Nm
        for section, key in TORQUES:
            sections[section][key] = tuple(-torque for torque in reversed(sections[section][key]))
    return sections


def _own_keys(gear: dict[str, Any]) -> dict[str, Any]:
    """Keys of a gear without those of a rack where a shaper makes its root, which refuses them when written."""
    if gear["shaper"] is None:
        return gear
    usual = {item.name: item.default for item in fields(GearCase) if item.name in OF_RACKS}
    return {key: value for key, value in gear.items() if key not in usual or value != usual[key]}


def _changed(document: dict[str, Any], settings: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Lay settings over a document, single keys first into the section that has them."""
    document = flattened(document)
    for key, value in flattened(settings).items():
        if key in ("title", CONDITION, LOADS):
            document[key] = value
        elif key in SECTIONS and value is None and BLANK in key:
            document = {name: keys for name, keys in document.items() if not name.startswith(key)}
        elif key in SECTIONS:
            if not isinstance(value, Mapping):
                first = next(iter(keys_of(SECTIONS[key])))
                raise CaseError(f"{where}: {key} = {value!r}: is a section: write {_keyword(key, first)}")
            document[key] = laid_over(document.get(key, {}), value)
        else:
            for section in _homes(key, document, where):
                document[section] = laid_over(document.get(section, {}), {key: value})
    return document


def laid_over(section: Mapping[str, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keys of a section with some changed, without others that said where a relief starts or ends."""
    replaced = other_places(key for key, value in values.items() if value is not None)
    return {key: value for key, value in section.items() if key not in replaced} | dict(values)


def merged(document: Mapping[str, Any], settings: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Return the sections of any file with some keys changed; None takes one away.

    Of a list of sections with names a mapping changes those that it names: ``shafts={"input": {"start_mm": 5.0}}``.
    """
    found = laid_over(document, {})
    for key, value in settings.items():
        own, value = found.get(key), written(value)
        if isinstance(own, list) and isinstance(value, Mapping):
            names = [section.get("name") for section in own]
            for name in value:
                if name not in names:
                    raise CaseError(f"{where}: {key}: {name}: no section has this name: {did_you_mean(name, names)}")
            changes = (value.get(name, {}) for name in names)
            value = [merged(section, more, where) for section, more in zip(own, changes, strict=True)]
        elif isinstance(own, Mapping) and isinstance(value, Mapping):
            value = merged(own, value, where)
        found = laid_over(found, {key: value})
    return {key: value for key, value in found.items() if value is not None}


def written(value: Any) -> Any:
    """Return a value as a file has it: of a section its keys that are not the defaults, its name first."""
    if isinstance(value, tuple | list):
        return [written(part) for part in value]
    if not is_dataclass(value) or isinstance(value, Topography | type):
        return value
    keys = dict[str, Any]()
    for item in fields(value):
        own = getattr(value, item.name)
        if own != (item.default if item.default_factory is MISSING else item.default_factory()):
            keys[item.name] = written(own)
    return {"name": keys.pop("name"), **keys} if "name" in keys else keys


def _homes(key: str, document: Mapping[str, Any], where: str) -> tuple[str, ...]:
    homes = tuple(name for name, kind in SECTIONS.items() if COAST not in name and key in keys_of(kind))
    if homes == GEARS:
        return GEARS if "wheel" in document else GEARS[:1]  # a wheel that is not mentioned is like the pinion
    if "pair" in homes:
        return ("pair",)  # common to both gears, even where a gear may have its own
    if len(homes) > 1:
        choices = " or ".join(_keyword(name, key) for name in homes)
        raise CaseError(f"{where}: {key}: more than one section has it: write {choices}")
    if not homes:
        keys = dict.fromkeys(key for kind in SECTIONS.values() for key in keys_of(kind))
        raise CaseError(f"{where}: {key}: no section has such a key: {did_you_mean(key, [*SECTIONS, *keys])}")
    return homes


def _keyword(section: str, key: str) -> str:
    gear, *inside = section.split(".")
    opened = "".join(f"'{name}': {{" for name in inside)
    return f"{gear}={{{opened}'{key}': ...{'}' * len(inside)}}}"


def _shallow(section: Any) -> dict[str, Any]:
    return {item.name: getattr(section, item.name) for item in fields(section)}


def document_text(document: Mapping[str, Any]) -> str:
    """Return the TOML text of sections, by their dotted names, of lists of sections, and of keys outside of them."""
    # Keys outside of sections first, then one level of sections with plain values; conditions of a case last.
    conditions = document.get(CONDITION, [])
    plain = {key: value for key, value in document.items() if key != CONDITION and not _is_sections(value)}
    lines = _lines(plain)
    for name, content in document.items():
        if isinstance(content, dict):
            lines += ["", f"[{name}]", *_lines(content)]
        elif name != CONDITION and _is_sections(content):
            lines += [line for keys in content for line in ("", f"[[{name}]]", *_lines(keys))]
    for condition in conditions:
        own = {key: value for key, value in condition.items() if key not in GEARS}
        lines += ["", f"[[{CONDITION}]]", *_lines(own)]
        for gear in GEARS:
            keys = condition.get(gear, {})
            lines += ["", f"[{CONDITION}.{gear}]", *_lines(_shallow(keys) if is_dataclass(keys) else keys)]
    return "\n".join(lines) + "\n"


def _is_sections(value: Any) -> bool:
    return isinstance(value, dict) or (isinstance(value, list) and bool(value) and isinstance(value[0], dict))


def _lines(keys: Mapping[str, Any]) -> list[str]:
    # Values that a file cannot express are left out.
    shown = {
        key: value for key, value in keys.items() if not (value is None or (isinstance(value, tuple) and not value))
    }
    return [f"{key} = {_toml(value)}" for key, value in shown.items()]


def _toml(value: Any) -> str:
    if hasattr(value, "tolist"):  # numpy's arrays and numbers
        value = value.tolist()
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_toml, value)) + "]"
    if is_dataclass(value):
        value = _shallow(value) if isinstance(value, Topography) else written(value)
    if isinstance(value, Mapping):
        return "{" + ", ".join(_lines(value)) + "}"
    if isinstance(value, float):
        return repr(value)
    # JSON writes text and whole numbers as TOML does; the rest becomes text, which the case file's rules refuse.
    return json.dumps(value, ensure_ascii=False, default=str)
