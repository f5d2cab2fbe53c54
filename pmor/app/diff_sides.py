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

from pmor.case.document import files_in
from pmor.core.errors import FileFormatError, printable
from pmor.core.shown import keys_of
from pmor.report.curves import Curves, curves_of
from pmor.results.quantities import OF_DESIGNS, TABLE, Quantity
from pmor.results.tabular import parted

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
APART = (
    "geometry", "models", "conditions", "fits", "fine_angles", "pareto", "chosen", "modes", "peaks", "base", "verdict",
    "folds", "run_up", "run_down", "largest", "waterfall", "axes_um", "micrometres", "micrometre_targets",
)  # fmt: skip
# Of a design and of a pair in motion: of the search, and of the table of the force law.
WITHIN = ("objective_searched_um", "force_table_error_max_N", "force_table_error_rms_N", "force_table_largest_N",
          "force_table_ste_error_um")  # fmt: skip
# Of a pair in motion, from its table: largest over the speeds.
OVER_SPEEDS = ("dte_rms_um", "dte_peak_to_peak_um", "dynamic_factor", "largest_force_N", "separation_um")
NAMED = ("name", "load", "mesh", "gear", "planet", "bearing", "shaft")
FURTHER = ("dynamics.json", "design.json", "campaign.json")
AXES = {3: ("x", "y", "z"), 2: ("y", "z")}
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
        figures |= dict(_over_speeds(columns)) if "dte_rms_um" in columns else {}
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


def _over_speeds(columns: Mapping[str, Sequence[str]]) -> Iterator[tuple[Place, float | None]]:
    """Yield the largest figures of motion over all speeds and branches under each torque."""
    torques = [float(torque) for torque in columns["torque_Nm"]]
    for torque in dict.fromkeys(torques):
        for key in OVER_SPEEDS:
            told = [float(text) for text, own in zip(columns[key], torques, strict=True) if own == torque and text]
            yield (f"{torque:g} N m", "largest over the speeds", key), max(told, default=None)


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
    nominal, of_loads = data.get("torque_Nm"), data.get("loads")
    if isinstance(of_loads, list) and of_loads and isinstance(of_loads[0], str):  # a design
        best = data.get("best") or {}
        yield from _walk(best.get("parameters", {}), (), "", further)
        for number, load in enumerate(of_loads):
            own = {key: value[number] for key, value in best.items() if isinstance(value, list)}
            yield from _walk(own, (), load, further)
        single = {key: value for key, value in best.items() if not isinstance(value, list | dict)}
        yield from _walk(single, (), "", further)
        return
    rows.sort(key=lambda row: row.get("torque_Nm") != nominal)
    for row in rows:
        names = [row[key] for key in LOADS[listed or ""] if key in row]
        load = str(names[0]) if names and isinstance(names[0], str) else f"{names[0]:g} N m" if names else ""
        yield from _walk(row, (), load, further)
    first = rows[0] if rows and nominal is not None else {}
    told = (*first, *LOADS, *APART, *(("ste_harmonics_um",) if "ste_order_1_um" in first else ()))
    rest = {key: value for key, value in data.items() if key not in told}
    yield from _walk(rest, (), f"{nominal:g} N m" if nominal is not None and not listed else "", further)


def _walk(
    node: Mapping[str, Any], part: tuple[str, ...], load: str, further: bool
) -> Iterator[tuple[Place, float | None]]:
    for key, value in node.items():
        if key in APART or key == "ste_harmonics_um" and "ste_order_1_um" in node:
            continue
        if isinstance(value, dict):
            yield from _walk(value, (*part, key.replace("_", " ")), load, further)
        elif isinstance(value, list) and value and all(isinstance(item, dict) for item in value):
            for number, item in enumerate(value):
                yield from _walk(item, (*part, _name(item, key, number)), load, further)
        elif (of := quantity(key, further)) is None or key in (*NAMED, *WITHIN):
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
    if len(values) == 2 and "gear" in of.per:
        return list(zip(("pinion", "wheel"), values, strict=True))
    along = "bearing" in of.per or "shaft" in of.per
    words = AXES.get(len(values), ()) if along else ("",) * (len(values) == 1)
    return list(zip(words, values, strict=True)) if words else []


def quantity(key: str, further: bool = False) -> Quantity | None:
    """Return a quantity by its key, of rigid supports too; None of what is none.

    Parameters
    ----------
    further : bool
        Make one of a key that the table does not have, by the unit at its end.
    """
    plain = key.rpartition(".")[2]
    found = TABLE.get(OF_DESIGNS.get(plain, plain) if further else plain)
    if found is not None:  # heads that stand beside that of the mean on pages
        return replace(found, symbol=f"STE mean, {found.symbol}") if found.symbol.startswith("of ") else found
    if key.startswith(RIGID) and (found := TABLE.get(key.removeprefix(RIGID))) is not None:
        return replace(found, key=key, symbol=f"{found.symbol}, rigid")
    words, unit = parted(plain)
    return Quantity(key, unit, words, per="") if further and unit else None


def documents(text: str) -> dict[str, dict[str, str]] | None:
    """Return the keys of the files in a text by what these are of; None where the first one is no TOML.

    Of others that are none, such as matrices, all is the value of one key.
    """
    found = dict[str, dict[str, str]]()
    for name, own in files_in(text).items():
        try:
            found[name] = dict(keys_of(tomllib.loads(own)))
        except tomllib.TOMLDecodeError:
            if not name:
                return None
            found[name] = {"content": own.strip()}
    return found
