"""Read a design file: TOML -> sections -> checked values -> `Design`, with the case that it starts from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields, replace
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

from pmor.case import Case, change_case, check_flanks, load_case, without_models
from pmor.case.document import parse_toml
from pmor.case.values import Refused, convert, did_you_mean, toml_text
from pmor.core.errors import CaseError
from pmor.design.settings import (
    AMOUNT_KEYS,
    MISALIGNMENT_KEYS,
    Constraint,
    Design,
    Goal,
    Load,
    Scatter,
    Search,
    Trade,
    Variable,
)
from pmor.design.variables import assembly_at, corners
from pmor.gear.condition import Assembly
from pmor.gear.pair import GearPair
from pmor.pair.conditions import assembly_of
from pmor.pair.model import gear_pair
from pmor.pair.modifications import refuse_modifications_off_the_flank

Section = TypeVar("Section")
SECTIONS: dict[str, type] = {
    "load": Load, "objective": Goal, "scatter": Scatter, "search": Search, "pareto": Trade
}  # fmt: skip
LISTS: dict[str, type] = {"variables": Variable, "constraints": Constraint}
# What loads the halves of the face differently.
UNEVEN = ("helix_slope_um", "twist_um", "in_plane_um", "out_of_plane_um")
EXTENTS = {
    "tip_relief_um": "tip_relief_start_roll_deg",
    "root_relief_um": "root_relief_end_roll_deg",
    "end_relief_um": "end_relief_length_mm",
}
# More variables have more corners than anybody looks at; fewer samples than they have directions say nothing.
MOST_VARIABLES = 10


@dataclass(frozen=True)
class DesignFile:
    """A design file that was read.

    Parameters
    ----------
    name : str
        Stem of the file name.
    text : str
        Of the file and of the case that it names.
    design : Design
    case : Case
        Ready to be trained for it.
    inputs : tuple of Path
        Files that were read.
    """

    name: str
    text: str
    design: Design
    case: Case
    inputs: tuple[Path, ...]

    @property
    def base(self) -> Assembly:
        """The pair as the case builds it."""
        return assembly_of(self.case)


def load_design(path: Path | str) -> DesignFile:
    """Read and check a design file, and the case that it names.

    Raises
    ------
    CaseError
        One line with file, section, key, rule and remedy.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise CaseError(f"{path}: there is no such design file: check the path") from None
    except (OSError, ValueError) as error:
        raise CaseError(f"{path}: cannot be read ({error}): name a design file, as text in UTF-8") from None
    where = str(path)
    document = parse_toml(text, where)
    _check_sections(document, where)
    if not isinstance(document.get("case"), str):
        raise CaseError(f'{where}: case: is missing, or no text: add case = "..." with the file of the base case')
    base = path.parent / document["case"]
    case = load_case(base)
    design = read_design(document, case, path.stem, where)
    return DesignFile(path.stem, f"{text}\n{case.text}", design, case_of(design, case, where), (path, base))


def read_design(document: Mapping[str, Any], case: Case, name: str, where: str) -> Design:
    """Check a design against its case.

    Parameters
    ----------
    document : mapping
        As TOML reads it.
    case : Case
    name : str
        Title where it has none.
    where : str
        What messages call it.

    Raises
    ------
    CaseError
    """
    _check_sections(document, where)
    torques = case.online.torques_Nm
    asked = document.get("load", {})
    given = asked.get("torques_Nm", torques) if isinstance(asked, Mapping) else torques
    count = len(given) if isinstance(given, list | tuple) else len(torques)
    filled: dict[str, dict[str, Any]] = {"load": {"torques_Nm": torques, "weights": (1.0,) * count}}
    sections: dict[str, Any] = {
        key: _read_section(document.get(key, {}), kind, key, where, filled.get(key, {}))
        for key, kind in SECTIONS.items()
    }
    lists: dict[str, Any] = {key: _read_list(document.get(key, []), kind, key, where) for key, kind in LISTS.items()}
    title = document.get("title", name)
    if not isinstance(title, str):
        raise CaseError(f"{where}: title = {toml_text(title)}: must be text: put it in quotes")
    design = Design(title=title, case=str(document.get("case", case.name)), **sections, **lists)
    _check_together(design, where)
    check_ranges(design, case, where)
    return design


def case_of(design: Design, case: Case, where: str) -> Case:
    """Return the case as a design trains it: of the whole width where halves of the face are going to differ.

    Raises
    ------
    CaseError
        Where it has no line loads.
    """
    if case.reduction.shapes != "line_loads":
        raise CaseError(
            f'{where}: case: {case.name} has [reduction] shapes = "{case.reduction.shapes}": designs take line loads: '
            'write [contact] scheme = "line" and [reduction] shapes = "line_loads" there'
        )
    mesh: dict[str, Any] = {"error_bar": False}
    if case.mesh.width == "half" and uneven(design):
        mesh["width"] = "whole"
    stress = "root_stress_MPa" in design.results
    return (
        change_case(case, mesh=mesh, compare={"models": None})
        if stress
        else change_case(without_models(case), mesh=mesh)
    )


def uneven(design: Design) -> bool:
    """Whether variables or scatter load the halves of the face differently."""
    scattered = {**design.scatter.modifications, **design.scatter.axes}
    return bool(({v.key for v in design.variables} | set(scattered)) & set(UNEVEN))


def check_ranges(design: Design, case: Case, where: str) -> None:
    """Raise `CaseError` where the ends of the ranges are nothing for the gears, or the base case is not enough."""
    base, pair = assembly_of(case), gear_pair(case)
    varied = {(gear, v.key) for v in design.variables for gear in v.gears}
    scattered = design.scatter.modifications
    for gear, modification in (("pinion", base.pinion), ("wheel", base.wheel)):
        asked = [key for key in AMOUNT_KEYS if (gear, key) in varied or key in scattered]
        for amount, extent in EXTENTS.items():
            if amount in asked and getattr(modification, extent) is None and (gear, extent) not in varied:
                raise CaseError(
                    f"{where}: {amount}: the case does not say how far it goes on the {gear}: write {extent} below "
                    f"[{gear}.modification] of {case.name}, or make it a variable"
                )
    for number, x in enumerate(corners(design.variables)):
        if number >= 2**MOST_VARIABLES:
            break
        _check_corner(assembly_at(base, design.variables, x), case, pair, where)
    if case.mesh.width == "plane_strain" and (uneven(design) or any("helix" in v.key for v in design.variables)):
        raise CaseError(
            f'{where}: what differs over the width is nothing for [mesh] width = "plane_strain" of the case: write '
            '"whole" there, or leave it out'
        )


def _check_corner(assembly: Assembly, case: Case, pair: GearPair, where: str) -> None:
    asked = replace(
        case, pinion_modification=assembly.pinion, wheel_modification=assembly.wheel,
        mesh=replace(case.mesh, width="whole" if case.mesh.width == "half" else case.mesh.width),
    )  # fmt: skip
    check_flanks(asked, f"{where}: [[variables]] range")
    try:
        refuse_modifications_off_the_flank(asked, pair)
    except CaseError as error:
        raise CaseError(f"{where}: [[variables]] range: {error}") from None


def _check_sections(document: Mapping[str, Any], where: str) -> None:
    known = ["title", "case", *SECTIONS, *LISTS]
    for name in document:
        if name not in known:
            raise CaseError(f"{where}: {name}: unknown key or section: {did_you_mean(name, known)}")


def _read_list(tables: Any, kind: type, name: str, where: str) -> tuple[Any, ...]:
    if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
        raise CaseError(f"{where}: {name}: must be a list of sections: write [[{name}]], brackets doubled")
    return tuple(_read_section(table, kind, name, where, {}) for table in tables)


def _read_section(table: Any, kind: type[Section], section: str, where: str, filled: Mapping[str, Any]) -> Section:
    if not isinstance(table, Mapping):
        raise CaseError(f"{where}: {section}: must be a section: write [{section}] on a line of its own")
    hints, values = get_type_hints(kind, include_extras=True), dict(filled)
    for key, value in table.items():
        if key not in hints:
            raise CaseError(f"{where}: [{section}] {key}: unknown key: {did_you_mean(key, list(hints))}")
        try:
            values[key] = convert(list(value) if isinstance(value, tuple) else value, hints[key])
        except Refused as refused:
            raise CaseError(f"{where}: [{section}] {key} = {toml_text(value)}: {refused}") from None
    for item in fields(kind):  # type: ignore[arg-type]
        if item.name not in values and item.default is MISSING:
            raise CaseError(f"{where}: [{section}] {item.name}: is missing: add '{item.name} = ...' there")
    return kind(**values)


def _check_together(design: Design, where: str) -> None:
    if not design.variables:
        raise CaseError(f"{where}: [[variables]]: is missing: add one, with key and range")
    if len(design.variables) > MOST_VARIABLES:
        raise CaseError(
            f"{where}: [[variables]]: {len(design.variables)} of them: must be at most {MOST_VARIABLES}: fix some"
        )
    for v in design.variables:
        text = f"{where}: [[variables]] {v.name}"
        if len(v.range) != 2 or not v.range[0] < v.range[1]:
            raise CaseError(f"{text} range = {toml_text(v.range)}: must be the lowest and the highest value: [0, 40]")
        if v.step is not None and v.step > v.range[1] - v.range[0]:
            raise CaseError(
                f"{text} step = {v.step:g}: must be at most the range of {v.range[1] - v.range[0]:g}: lower it"
            )
    taken = [(gear, v.key) for v in design.variables for gear in v.gears]
    for gear, key in taken:
        if taken.count((gear, key)) > 1:
            raise CaseError(f"{where}: [[variables]] {key} of the {gear}: is there twice: remove one")
    load = design.load
    if len(load.weights) != len(load.torques_Nm) or not any(load.weights):
        raise CaseError(
            f"{where}: [load] weights = {toml_text(load.weights)}: give one number for each of the "
            f"{len(load.torques_Nm)} torques, and one above 0 at least"
        )
    if len(set(load.torques_Nm)) < len(load.torques_Nm):
        raise CaseError(f"{where}: [load] torques_Nm = {toml_text(load.torques_Nm)}: one is there twice: remove it")
    scatter = design.scatter
    if design.scatters and not (scatter.modifications or scatter.axes):
        raise CaseError(
            f'{where}: [objective] value = "{design.objective.value}": needs what scatters: add [scatter] with '
            f"standard deviations, such as {AMOUNT_KEYS[0]} = 2.0 or {MISALIGNMENT_KEYS[0]} = 10.0"
        )
    if design.pareto.against == design.objective.minimise:
        raise CaseError(
            f"{where}: [pareto] against = {toml_text(design.pareto.against)}: is the objective itself: choose another"
        )
