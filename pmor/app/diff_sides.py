"""Folders of results as they are compared: figures by load and part, curves, and the keys of their files."""

from __future__ import annotations

import csv
import json
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import h5py

from pmor.core.errors import FileFormatError, printable
from pmor.report.curves import Curves, curves_of
from pmor.results.quantities import TABLE, Quantity

#: load, part, key
Place = tuple[str, str, str]


@dataclass(frozen=True)
class Source:
    """Files of a kind of results: what they are, the table of curves, the file that holds what they are made from."""

    words: str
    table: str
    origin: str


SOURCES = {
    "summary.json": Source("a pair", "ste.csv", "results.h5"),
    "set.json": Source("a set", "ste.csv", "results.h5"),
    "gearbox.json": Source("a gearbox", "ste.csv", "results.h5"),
    "dynamics.json": Source("a machine in motion", "response.csv", "results.h5"),
    "design.json": Source("a design", "", "design.h5"),
    "campaign.json": Source("a campaign", "", "campaign.h5"),
}
# Attributes of HDF5 files that hold the text that results are made from.
TEXTS = ("case_text", "text", "campaign_text", "source_text")
# Lists of loads in the data of results, by what names each.
LOADS = {"loads": ("name", "load"), "torques": ("torque_Nm",), "responses": ("torque_Nm",)}
# What is no figure of the machine at its loads, or is there under its loads too.
APART = ("geometry", "models", "conditions", "fits", "fine_angles", "pareto", "chosen", "modes", "peaks", "base")
NAMED = ("name", "load", "mesh", "gear", "planet", "bearing", "shaft")
# Units of keys that the table does not have, of motion, designs and campaigns.
UNITS = ("um", "N", "MPa", "Hz", "rpm", "mrad", "mW", "percent", "N_per_mm")
FURTHER = ("dynamics.json", "design.json", "campaign.json")
MOST_VALUES, AXES = 3, {3: ("x", "y", "z"), 2: ("y", "z")}
MOST_ORDERS = 5
RIGID = "rigid_"


@dataclass(frozen=True)
class Side:
    """One of the folders.

    Parameters
    ----------
    loads : tuple of str
        The nominal one first.
    text : str or None
        That the results are made from; None where the folder does not hold it.
    version : str or None
        Of the program.
    """

    name: str
    file: str
    figures: Mapping[Place, float | None]
    loads: tuple[str, ...]
    curves: Curves | None
    text: str | None
    version: str | None
    failures: tuple[str, ...]


def read_sides(folders: Sequence[Path]) -> list[Side]:
    """Read both folders, the results of one kind where they have such; FileFormatError where one has none."""
    found = [_results_in(folder) for folder in folders]
    common = [name for name in found[0] if name in found[1]]
    sides = [_side(folder, (common or names)[0]) for folder, names in zip(folders, found, strict=True)]
    if sides[0].name == sides[1].name:
        sides = [replace(side, name=printable(str(folder))) for side, folder in zip(sides, folders, strict=True)]
    return sides


def _results_in(folder: Path) -> list[str]:
    if folder.is_file():
        raise FileFormatError(f"{folder}: is a file: name the folder of results that it is in")
    found = [name for name in SOURCES if (folder / name).is_file()]
    if not found:
        what = "holds no results" if folder.is_dir() else "there is no such folder"
        raise FileFormatError(f"{folder}: {what}: name one with {', '.join(SOURCES)}, as pmor run leaves it")
    return found


def _side(folder: Path, name: str) -> Side:
    source = SOURCES[name]
    try:
        data = json.loads((folder / name).read_text(encoding="utf-8"))
        columns = _table(folder / source.table) if source.table else {}
        figures = dict(_figures(_of_campaign(data) if name == "campaign.json" else data, name in FURTHER))
        curves = curves_of(columns) if columns else None
    except (ValueError, AttributeError, KeyError, TypeError, OSError) as error:
        raise FileFormatError(f"{folder / name}: is damaged, or none of pmor ({error}): make it anew") from error
    text, version = _origin(folder / source.origin)
    failed = data.get("n_positions_failed")
    failures = [*data.get("failures", ()), *([f"{failed} positions failed"] if failed else [])]
    loads = tuple(dict.fromkeys(load for load, _, _ in figures if load))
    return Side(printable(folder.resolve().name), name, figures, loads, curves, text, version, tuple(failures))


def _of_campaign(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return the ends of the results over all designs as figures."""
    ends = ("least", "most")
    return {f"{end} of all designs": {key: value[end] for key, value in data["results"].items()} for end in ends}


def _table(path: Path) -> dict[str, list[str]]:
    if not path.is_file():
        return {}
    with path.open(encoding="utf-8", newline="") as file:
        heads, *rows = csv.reader(file)
    return {head: list(column) for head, column in zip(heads, zip(*rows, strict=True), strict=True)} if rows else {}


def _origin(path: Path) -> tuple[str | None, str | None]:
    """Return the text and the version that results are of, as far as their file tells."""
    try:
        with h5py.File(path, "r") as file:
            told = {key: value.decode() if isinstance(value, bytes) else str(value)
                    for key in (*TEXTS, "pmor_version") if (value := file.attrs.get(key)) is not None}  # fmt: skip
    except OSError:
        return None, None
    return next((told[key] for key in TEXTS if key in told), None), told.get("pmor_version")


def _figures(data: Mapping[str, Any], further: bool) -> Iterator[tuple[Place, float | None]]:
    """Yield the figures of results by load, part and key; those at the nominal load first."""
    listed = next((key for key in LOADS if isinstance(data.get(key), list) and data[key]), None)
    rows = [] if listed is None else [row for row in data[listed] if isinstance(row, dict)]
    nominal = data.get("torque_Nm")
    rows.sort(key=lambda row: row.get("torque_Nm") != nominal)
    for row in rows:
        names = [row[key] for key in LOADS[listed or ""] if key in row]
        load = str(names[0]) if names and isinstance(names[0], str) else f"{names[0]:g} N m" if names else ""
        yield from _walk(row, (), load, further)
    first = rows[0] if rows and nominal is not None else {}
    rest = {key: value for key, value in data.items() if key not in (*first, *LOADS, *APART)}
    yield from _walk(rest, (), f"{nominal:g} N m" if nominal is not None and not listed else "", further)


def _walk(
    node: Mapping[str, Any], part: tuple[str, ...], load: str, further: bool
) -> Iterator[tuple[Place, float | None]]:
    for key, value in node.items():
        if isinstance(value, dict):
            yield from _walk(value, (*part, key.replace("_", " ")), load, further)
        elif isinstance(value, list) and value and all(isinstance(item, dict) for item in value):
            for number, item in enumerate(value) if key not in APART else ():
                yield from _walk(item, (*part, _name(item, key, number)), load, further)
        elif (of := quantity(key, further)) is None or key in NAMED:
            continue
        elif isinstance(value, int | float) and not isinstance(value, bool) or value is None:
            yield (load, ", ".join((*part, *filter(None, key.split(".")[:-1]))), key), value
        elif isinstance(value, list) and all(isinstance(one, int | float | None) for one in value):
            for words, one in _components(of, value):
                yield (load, ", ".join((*part, words) if words else part), key), one


def _name(item: Mapping[str, Any], key: str, number: int) -> str:
    named = next((str(item[name]) for name in NAMED if isinstance(item.get(name), str)), None)
    if named is None and "at_mm" in item:
        return f"bearing at {item['at_mm']:g} mm"
    return named or f"{key.removesuffix('s').replace('_', ' ')} {number + 1}"


def _components(of: Quantity, values: Sequence[float | None]) -> list[tuple[str, float | None]]:
    """Return values of a list with what each is of; none of a series."""
    if "orders" in of.symbol:
        return [(f"order {number + 1}", value) for number, value in enumerate(values[:MOST_ORDERS])]
    if len(values) > MOST_VALUES:
        return []
    words = AXES.get(len(values), ("",))
    if len(values) == 2 and of.per in ("gear", "load"):
        words = ("pinion", "wheel")
    return list(zip(words, values, strict=True))


def quantity(key: str, further: bool = False) -> Quantity | None:
    """Return a quantity by its key, of rigid supports too; None of what is none.

    Parameters
    ----------
    further : bool
        Make one of a key that the table does not have, by the unit at its end.
    """
    found = TABLE.get(key.rpartition(".")[2])
    if found is not None:
        return found
    if key.startswith(RIGID) and (found := TABLE.get(key.removeprefix(RIGID))) is not None:
        return replace(found, key=key, symbol=f"{found.symbol}, rigid")
    unit = next((unit for unit in UNITS if key.endswith(f"_{unit}")), None) if further else None
    if unit is None:
        return None
    shown = {"percent": "%", "N_per_mm": "N/mm"}.get(unit, unit)
    return Quantity(key, shown, key.removesuffix(f"_{unit}").replace("_", " "))


def documents(text: str) -> list[dict[str, Any]] | None:
    """Return the documents that a text holds one after the other, as of a gearbox; None where it is no TOML."""
    found, lines, start = list[dict[str, Any]](), text.splitlines(), 0
    while start < len(lines):
        parsed, end = None, len(lines)
        while end > start:
            try:
                parsed = tomllib.loads("\n".join(lines[start:end]))
                break
            except tomllib.TOMLDecodeError as error:
                at = getattr(error, "lineno", None) or _line_of(str(error))
                end = min(end - 1, start + at - 1) if at else end - 1
        if parsed is None:
            return None
        found.append(parsed)
        start = end
    return found


def _line_of(words: str) -> int | None:
    """Line that an error of TOML names."""
    _, _, place = words.partition("at line ")
    digits = place.partition(",")[0]
    return int(digits) if digits.isdigit() else None
