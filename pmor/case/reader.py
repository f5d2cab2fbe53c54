"""Read TOML files into dataclasses: cases, studies, designs and campaigns alike.

The fields of a dataclass are the keys of a section; their annotations give type, range and unit (`pmor.case.values`).
A field that is a dataclass is a section inside, a tuple of dataclasses a list of sections. A word in the annotation of
such a field is its key in the file, if that is not the name of the field; `INLINE` puts the keys of a dataclass among
those of the section that holds it. A field of type `Sections` takes all other keys: sections of another case. One of
type `Keys` takes them as they are: keys of one section of another case.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, Field, dataclass, field, fields, is_dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Literal, NoReturn, TypeVar, get_args, get_origin, get_type_hints

from pmor.case.values import REMOVED, Refused, convert, toml_text
from pmor.core.errors import CaseError
from pmor.core.reading import MOST_TEXT, read_bytes
from pmor.core.wording import did_you_mean
from pmor.gear.topography import Topography, of_teeth, read_topography

Section = TypeVar("Section")
Sections = Mapping[str, Mapping[str, Any]]
Keys = Mapping[str, Any]
REST = Sections, Keys
INLINE = "inline"
NOTHING: Mapping[str, Any] = MappingProxyType({})
# Sections inside of sections, and values in them: files have five.
DEEPEST = 20


def read_text(path: Path, what: str, place: str = "") -> str:
    """Return the text of a file that a user names; CaseError where it cannot be read.

    Parameters
    ----------
    what : str
        Kind of the file, such as "case file".
    place : str
        Key that names it, for messages; by default the path itself.
    """
    place = place or str(path)
    try:
        return read_bytes(path, MOST_TEXT).decode("utf-8-sig")  # some editors put a byte order mark in front
    except FileNotFoundError:
        near = _files_in(path.parent, path.suffix) if path.parent.is_dir() else ""
        raise CaseError(f"{place}: there is no such {what}: check the path{near}") from None
    except IsADirectoryError:
        raise CaseError(f"{place}: is a folder: name a {what} in it{_files_in(path, '.toml')}") from None
    except PermissionError:
        raise CaseError(f"{place}: may not be read: check the permissions of the file") from None
    except UnicodeDecodeError:
        if path.suffix == ".h5":
            raise CaseError(f"{place}: is no {what} but an HDF5 file: a model is read by pmor.load_model") from None
        raise CaseError(f"{place}: cannot be read, is not UTF-8 text: save it as plain text in UTF-8") from None
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise CaseError(f"{place}: cannot be read ({why}): name a readable {what}") from None


def parse_toml(text: str, where: str) -> dict[str, Any]:
    """Return the content of a TOML text.

    Raises
    ------
    CaseError
        One line with the file and the place in it.
    """
    try:
        document = tomllib.loads(text)
    except RecursionError:
        raise _too_deep(where) from None
    except tomllib.TOMLDecodeError as error:
        raise CaseError(f"{where}: not valid TOML: {error}: correct that place in the file") from None
    except ValueError:  # Python's own limit, 4300 digits
        raise CaseError(f"{where}: not valid TOML: a number has too many digits: correct the file") from None
    level: list[Any] = [document]
    for _ in range(DEEPEST):
        level = [inner for outer in level for inner in (outer.values() if isinstance(outer, dict) else outer)
                 if isinstance(inner, dict | list)]  # fmt: skip
    if level:
        raise _too_deep(where)
    return document


def _too_deep(where: str) -> CaseError:
    return CaseError(f"{where}: not valid TOML: brackets or names nested too deeply: correct the file")


def _files_in(folder: Path, suffix: str) -> str:
    names = sorted(item.name for item in folder.glob(f"*{suffix}"))
    return f" (there is {', '.join(names[:5])})" if names else ""


def keys_of(kind: type) -> dict[str, Any]:
    """Return the keys of a section and their annotations; not the sections inside."""
    found: dict[str, Any] = {}
    for slot in slots_of(kind):
        if slot.inline:
            found |= keys_of(slot.inner)
        elif (slot.inner is None or slot.has_words) and not slot.rest:
            found[slot.name] = slot.hint
    return found


def sections_in(kind: type, name: str = "") -> dict[str, type]:
    """Return all sections inside a section by their names in the file: `grid`, `paper.ratio`."""
    found: dict[str, type] = {}
    for slot in slots_of(kind):
        if slot.inner is not None and not slot.inline:
            key = f"{name}.{slot.key}".removeprefix(".")
            found |= {key: slot.inner, **sections_in(slot.inner, key)}
    return found


@dataclass(frozen=True)
class Reader:
    """Makes dataclasses of TOML tables, with file, section and key in every refusal.

    Parameters
    ----------
    where : str
        Name of the file in messages.
    sections : mapping of str to type
        All sections of the format: an unknown key may belong in another one.
    folder : Path, optional
        Base of the names of files; without it they are whole paths.
    """

    where: str
    sections: Mapping[str, type] = field(default_factory=dict)
    folder: Path | None = None

    def refuse(self, place: str, rule: str) -> NoReturn:
        """Raise `CaseError`."""
        raise CaseError(f"{self.where}: {place}: {rule}")

    def beside(self, name: Path | str, place: str) -> Path:
        """Return the path of a file that a key names; CaseError where there is no folder to look for it in."""
        if self.folder is None and not Path(name).is_absolute():
            rule = "there is no folder to look for it in: write its whole path, or read the file with pmor.load"
            self.refuse(place, rule)
        return (self.folder or Path()) / name

    def value(self, value: Any, hint: Any, place: str) -> Any:
        """Check one value against the annotation of its key."""
        if Topography in get_args(hint):
            if isinstance(value, str):
                return self._topography(value, place)
            if isinstance(value, list) and value and all(isinstance(one, str) for one in value):
                grids = [self._topography(one, place) for one in value]
                if any(grid.teeth_um for grid in grids):
                    self.refuse(place, "lists a file that has all teeth: write its name alone, not as a list")
                try:
                    return of_teeth(grids)
                except CaseError as error:
                    self.refuse(place, str(error))
        try:
            return convert(value, hint)
        except Refused as refused:
            self.refuse(f"{place} = {toml_text(value)}", str(refused))

    def section(
        self, table: Any, kind: type[Section], name: str = "", filled: Mapping[str, Any] = NOTHING,
        given: Mapping[str, Any] = NOTHING, also: Sequence[str] = (),
    ) -> Section:  # fmt: skip
        """Read a section; CaseError where a key breaks its rule.

        Parameters
        ----------
        table : mapping
            As TOML gives it.
        kind : type
            Dataclass to make.
        name : str
            Of the section; empty for the file as a whole.
        filled : mapping
            Values of keys that the table leaves out.
        given : mapping
            Values of fields that are no keys.
        also : sequence of str
            Further keys that suggestions may name.
        """
        self.refuse_value(name, table)
        slots = [slot for slot in slots_of(kind) if slot.name not in given]  # type: ignore[arg-type]
        known = [key for slot in slots for key in slot.keys]
        others = {key: value for key, value in table.items() if key not in known}
        rest = next((slot.name for slot in slots if slot.rest), None)
        if rest is None:
            self.refuse_unknown(others, [*known, *also], name)
        values = dict(given)
        for slot in slots:
            if slot.name == rest:
                values[rest] = self._changes(others, name) if slot.hint == Sections else others
            elif slot.inline:
                own, usual = ({k: v for k, v in source.items() if k in slot.keys} for source in (table, filled))
                values[slot.name] = self.section(own, slot.inner, name, usual)
            else:
                values |= self._field(table, slot, name, filled)
        return kind(**values)

    def refuse_value(self, name: str, table: Any) -> None:
        """Raise `CaseError` for a value in the place of a section."""
        if not isinstance(table, Mapping):
            self.refuse(name, f"must be a section: write [{name}] on a line of its own")

    def refuse_unknown(self, table: Mapping[str, Any], valid: Sequence[str], name: str) -> None:
        """Raise `CaseError` for keys that a section does not have, with the closest one or the section that has it."""
        for key, value in table.items():
            if not name and isinstance(value, dict | list):
                self.refuse(f"[{key}]", f"unknown section: {did_you_mean(key, list(valid))}")
            homes = [f"[{section}]" for section, kind in self.sections.items() if key in keys_of(kind)]
            remedy = f"it belongs in {' or '.join(homes)}" if homes else did_you_mean(key, list(valid))
            remedy = REMOVED.get(key, remedy)
            place = f"[{name}] {key}: unknown key" if name else f"{key}: unknown key outside of the sections"
            raise CaseError(f"{self.where}: {place}: {remedy}")

    def list_of(self, tables: Any, name: str) -> list[Any]:
        """Return a list of sections as TOML gives it, checked to be one."""
        if not isinstance(tables, list | tuple) or not all(isinstance(table, Mapping) for table in tables):
            self.refuse(name, f"must be a list of sections: write [[{name}]], brackets doubled")
        return list(tables)

    def _field(self, table: Mapping[str, Any], slot: Slot, section: str, filled: Mapping[str, Any]) -> dict[str, Any]:
        """Read the content of a key: a section, a list of sections, or a value; empty where there is a default."""
        key, inner = slot.key, slot.inner
        if key not in table and key not in filled and slot.has_default:
            return {}
        place, name = f"[{section}] {key}" if section else key, f"{section}.{key}" if section else key
        if key not in table:
            if key in filled:
                return {slot.name: filled[key]}
            if inner is None:
                where = f"below [{section}]" if section else "at the top"
                self.refuse(place, f"is missing: add '{key} = ...' {where}")
            return {slot.name: self.section({}, inner, name)}
        if inner is None or (isinstance(table[key], str) and slot.has_words):
            return {slot.name: self.value(table[key], slot.hint, place)}
        if slot.is_list:
            tables = self.list_of(table[key], name)
            if not tables and not slot.has_default:
                self.refuse(f"{place} = []", "must have at least one: add it")
            return {slot.name: tuple(self.section(one, inner, name) for one in tables)}
        return {slot.name: self.section(table[key], inner, name)}

    def _changes(self, tables: dict[str, Any], section: str) -> dict[str, Any]:
        for key, value in tables.items():
            if not isinstance(value, Mapping):
                place = f"[{section}] {key}" if section else key
                remedy = 'give sections of the case file, as in contact = { scheme = "facet" }'
                self.refuse(f"{place} = {toml_text(value)}", f"unknown key: {remedy}")
        return tables

    def _topography(self, name: str, place: str) -> Topography:
        place = f"{place} = {toml_text(name)}"
        text = read_text(self.beside(name, place), "file beside the case", f"{self.where}: {place}")
        try:
            return read_topography(text)
        except CaseError as error:
            self.refuse(place, str(error))


def checked(section: Any, kind: type[Section], where: str, name: str) -> Section:
    """Return a section that was made in Python, checked by the rules for its keys in a file.

    CaseError where one is broken.

    Parameters
    ----------
    section : object
        An instance of `kind`.
    kind : type
    where, name : str
        Place and name of the section, for messages.
    """
    if not isinstance(section, kind):
        content = section if isinstance(section, Mapping) else {next(iter(keys_of(kind))): "..."}
        made = f"{kind.__name__}({', '.join(f'{key}={value}' for key, value in content.items())})"
        raise CaseError(f"{where}: {name} = {section!r:.60}: must be a {kind.__name__}: write {made}")
    written = {item.name: value for item in fields(kind)  # type: ignore[arg-type]
               if (value := getattr(section, item.name)) is not item.default}  # fmt: skip
    return Reader(where).section({key: _as_tables(v) for key, v in written.items() if v is not None}, kind, name)


def _as_tables(value: Any) -> Any:
    """Sections in a list as tables of what they give."""
    if not isinstance(value, tuple) or not all(is_dataclass(one) and not hasattr(one, "from_toml") for one in value):
        return value
    return tuple(vars(one) for one in value)


@dataclass(frozen=True)
class Slot:
    """A field of a section as files have it.

    Parameters
    ----------
    keys : tuple of str
        That it takes of a file; none of one that takes the rest.
    inner : type or None
        Dataclass of a field that is a section or a list of sections.
    has_words : bool
        Whether a word may stand for the section.
    """

    name: str
    hint: Any
    key: str
    keys: tuple[str, ...]
    inner: Any
    inline: bool
    rest: bool
    is_list: bool
    has_words: bool
    has_default: bool


@cache
def slots_of(kind: type) -> tuple[Slot, ...]:
    """Return the fields of a section: annotations are taken apart once, not for each of thousands of variants."""
    hints = get_type_hints(kind, include_extras=True)
    return tuple(_slot(item, hints[item.name]) for item in fields(kind))  # type: ignore[arg-type]


def _slot(item: Field[Any], hint: Any) -> Slot:
    words, inner, rest = _words(hint), _dataclass_in(hint), hint in REST
    key, inline = next(iter(words), item.name), INLINE in words
    keys = tuple(keys_of(inner)) if inline else () if rest else (key,)
    is_list = get_origin(get_args(hint)[0] if get_origin(hint) is Annotated else hint) is tuple
    has_words = any(get_origin(choice) is Literal for choice in get_args(hint))
    has_default = item.default is not MISSING
    return Slot(item.name, hint, key, keys, inner, inline, rest, is_list, has_words, has_default)


def _words(hint: Any) -> list[str]:
    return [word for word in get_args(hint)[1:] if isinstance(word, str)] if get_origin(hint) is Annotated else []


def _dataclass_in(hint: Any) -> Any:
    """The dataclass of a field that is a section or a list of sections; None of values."""
    if get_origin(hint) is Annotated:
        return _dataclass_in(get_args(hint)[0]) if _words(hint) else None
    kinds = [kind for kind in (hint, *get_args(hint)) if isinstance(kind, type) and is_dataclass(kind)]
    return next((kind for kind in kinds if kind is not Topography and not hasattr(kind, "from_toml")), None)
