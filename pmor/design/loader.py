"""Read a design file: TOML -> `Design`, with the case, or the gearbox and its mesh, that it starts from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pmor.case import Case, change_case, check_flanks, load_case, short_list, without_models
from pmor.case.capability import refuse_beyond
from pmor.case.flanks import EXTENTS
from pmor.case.reader import Reader, checked, parse_toml, read_text, sections_in
from pmor.case.values import toml_text
from pmor.core.errors import CaseError, GeometryError, printable
from pmor.core.wording import did_you_mean
from pmor.design.settings import AMOUNT_KEYS, MISALIGNMENT_KEYS, Design, Load
from pmor.design.variables import assembly_at, corners, drawn
from pmor.gear.condition import Assembly
from pmor.gear.modification import Modification
from pmor.gear.pair import GearPair
from pmor.gear.working import refuse_working_geometry
from pmor.machine.duty import shares
from pmor.machine.loader import GearboxFile
from pmor.machine.loader import load as load_gearbox
from pmor.machine.model import pinion_senses
from pmor.pair.conditions import assembly_of
from pmor.pair.model import gear_pair
from pmor.pair.modifications import refuse_modifications_off_the_flank

# Place of a design without a file, in messages.
WHERE = "design"
# Keys that load the halves of the face differently.
UNEVEN = ("helix_slope_um", "twist_um", "in_plane_um", "out_of_plane_um")
# More variables have too many corners of their ranges to check each, 2 to their number.
MOST_VARIABLES = 10


@dataclass(frozen=True)
class DesignFile:
    """A design file that was read."""

    name: str  # Stem of the file name
    text: str  # Of the file and of the case that it names
    design: Design
    case: Case  # Ready to be trained for it
    inputs: tuple[Path, ...]  # Files that were read
    box: GearboxFile | None = None  # That the design names in place of a case

    @property
    def mesh(self) -> str:
        """Name of the mesh of the gearbox."""
        return str(self.design.mesh)

    @property
    def base(self) -> Assembly:
        """The pair as the case builds it."""
        return assembly_of(self.case)


def load(path: Path | str) -> DesignFile:
    """Read and check a design file, and the case or the gearbox that it names.

    Raises
    ------
    CaseError
        One line with file, section, key, rule and remedy.
    """
    path = Path(path)
    text, where = read_text(path, "design file"), str(path)
    said, name = _read(parse_toml(text, where), where, title=printable(path.stem)), printable(path.stem)
    _refuse_base(said, where)
    if said.case is not None:
        base = path.parent / said.case
        case = load_case(base)
        design = _complete(said, case, where)
        return DesignFile(name, f"{text}\n{case.text}", design, case_of(design, case, where), (path, base))
    box = load_gearbox(path.parent / str(said.gearbox))
    case, design = box.cases[_mesh(said, box, where)], replace(said, load=_loads(said, box, where))
    design = _complete(design, case, where)
    trained = case_of(design, case, where)
    return DesignFile(name, f"{text}\n{box.text}", design, trained, (path, *box.inputs), box)


def settings_of(case: Case, sections: Mapping[str, Any]) -> DesignFile:
    """Return the settings that a design file with these sections, as TOML reads them, would give for a base case.

    CaseError where they give none.
    """
    said = _read(sections, WHERE, title=case.name, case=case.name)
    _refuse_base(said, WHERE)
    design = _complete(said, case, WHERE)
    return DesignFile(case.name, f"{sections!r}\n{case.text}", design, case_of(design, case, WHERE), ())


def _read(document: Mapping[str, Any], where: str, **filled: str) -> Design:
    return Reader(where, sections_in(Design)).section(document, Design, filled=filled)


def _refuse_base(said: Design, where: str) -> None:
    """Refuse a design of neither or both of a case and a gearbox, and keys that go with the other one."""
    load, of_case, of_box = said.load, said.case is not None, said.gearbox is not None
    if of_case and of_box:
        raise CaseError(f"{where}: case and gearbox: a design starts from one of them: leave one out")
    if not of_case and not of_box:
        raise CaseError(f"{where}: case: is missing: add 'case = ...' at the top, or gearbox and mesh")
    if of_case and said.mesh is not None:
        raise CaseError(f"{where}: mesh = {toml_text(said.mesh)}: is of a gearbox: leave it out, or name the gearbox")
    if of_case and load.names:
        rule = "load cases are of a gearbox: write torques_Nm"
        raise CaseError(f"{where}: [load] names = {toml_text(load.names)}: {rule}")
    if of_box and load.torques_Nm:
        rule = "torques are those of the gearbox's load cases: leave them out, or choose load cases by names"
        raise CaseError(f"{where}: [load] torques_Nm = {toml_text(load.torques_Nm)}: {rule}")


def _mesh(said: Design, box: GearboxFile, where: str) -> str:
    names = list(box.cases)
    if said.mesh is None:
        raise CaseError(f"{where}: mesh: is missing: name one of {short_list(names)}")
    if said.mesh not in names:
        raise CaseError(
            f"{where}: mesh = {toml_text(said.mesh)}: {box.name} has none: {did_you_mean(said.mesh, names)}"
        )
    return said.mesh


def _loads(said: Design, box: GearboxFile, where: str) -> Load:
    """Return the load cases by names: those that are asked for, or all that carry on the same flanks as the first."""
    model = box.model
    senses = {load.name: pinion_senses(model, load)[str(said.mesh)] for load in model.sections.loads}
    names = said.load.names
    for name in names:
        if name not in senses:
            rule = f"{box.name} has no such load case: {did_you_mean(name, list(senses))}"
            raise CaseError(f"{where}: [load] names: {toml_text(name)}: {rule}")
    first = senses[names[0] if names else next(iter(senses))]
    others = [name for name in names if senses[name] != first]
    if others:
        rule = f"carries on other flanks than {toml_text(names[0])}: design these in a file of their own"
        raise CaseError(f"{where}: [load] names: {toml_text(others[0])}: {rule}")
    names = names or tuple(name for name, sense in senses.items() if sense == first)
    times = dict(zip(senses, shares(model.sections.loads), strict=False))
    return replace(said.load, names=names, weights=said.load.weights or tuple(times[name] for name in names if times))


def _complete(design: Design, case: Case, where: str) -> Design:
    """Return a design with the loads of its case where it has none, checked with it."""
    load = design.load
    if not load.names:
        load = replace(load, torques_Nm=load.torques_Nm or case.online.torques_Nm)
    design = replace(design, load=replace(load, weights=load.weights or (1.0,) * len(load.labels)))
    _check_together(design, where)
    check_ranges(design, case, where)
    return design


def case_of(design: Design, case: Case, where: str) -> Case:
    """Return the case as a design trains it, of the whole width if need be; CaseError without line loads."""
    refuse_beyond(case, "design", f"{where}: case")
    mesh: dict[str, Any] = {"error_bar": False}
    if case.mesh.width == "half" and uneven(design):
        mesh["width"] = "whole"
    if "root_stress_MPa" in design.results:
        return change_case(case, mesh=mesh, compare={"models": None})
    return change_case(without_models(case), mesh=mesh)


def uneven(design: Design) -> bool:
    """Whether variables or scatter load the halves of the face differently."""
    scattered = {**design.scatter.modifications, **design.scatter.axes}
    return bool(({v.key for v in design.variables} | set(scattered)) & set(UNEVEN))


def check_ranges(design: Design, case: Case, where: str) -> None:
    """Raise `CaseError` where the ends of the ranges do not fit the gears, or the base case lacks an extent."""
    base, pair = assembly_of(case), gear_pair(case)
    varied = {(gear, v.key) for v in design.variables for gear in v.gears}
    scattered = design.scatter.modifications
    for gear, modification in (("pinion", base.pinion), ("wheel", base.wheel)):
        asked = [key for key in AMOUNT_KEYS if (gear, key) in varied or key in scattered]
        for amount, extents, _ in EXTENTS:
            given = [key for key in extents if getattr(modification, key) is not None]
            given = [key for key in extents if (gear, key) in varied] or given
            if amount in asked and not given:
                raise CaseError(
                    f"{where}: {amount}: the case does not say how far it goes on the {gear}: write {extents[0]} below "
                    f"[{gear}.modification] of {case.name}, or make it a variable"
                )
            for key in set(extents) & set(scattered) - set(given):
                raise CaseError(
                    f"{where}: [scatter] {key}: {' and '.join(given) or 'nothing'} says how far {amount} goes on the "
                    f"{gear}: write it as {key}, or leave the scatter out"
                )
    for x in corners(design.variables):
        _check_corner(assembly_at(base, design.variables, x), case, pair, where)
    if design.scatter.axes:
        _refuse_scatter(design, base, pair, where)
    if case.mesh.width == "plane_strain" and (uneven(design) or any("helix" in v.key for v in design.variables)):
        raise CaseError(
            f'{where}: flanks or axes differ over the width, and the case has [mesh] width = "plane_strain": write '
            '"whole" there, or leave it out'
        )


def _check_corner(assembly: Assembly, case: Case, pair: GearPair, where: str) -> None:
    asked = replace(
        case, pinion_modification=assembly.pinion, wheel_modification=assembly.wheel,
        mesh=replace(case.mesh, width="whole" if case.mesh.width == "half" else case.mesh.width),
    )  # fmt: skip
    place = f"{where}: [[variables]] range"
    for gear, flank in (("pinion", assembly.pinion), ("wheel", assembly.wheel)):
        checked(flank, Modification, place, f"{gear}.modification")
    check_flanks(asked, place)
    try:
        refuse_modifications_off_the_flank(asked, pair)
    except CaseError as error:
        raise CaseError(f"{place}: {error}") from None


def _refuse_scatter(design: Design, base: Assembly, pair: GearPair, where: str) -> None:
    draws = drawn(design.scatter, design.scatter.draws)
    try:
        refuse_working_geometry(pair, [assembly_at(base, (), (), draw).misalignment for draw in draws])
    except GeometryError as error:
        raise GeometryError(f"{where}: [scatter] draws {error}: lower the scatter") from None


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
    if len(load.weights) != len(load.labels) or not any(load.weights):
        what = "load cases" if load.names else "torques"
        raise CaseError(
            f"{where}: [load] weights = {toml_text(load.weights)}: give one number for each of the "
            f"{len(load.labels)} {what}, and one above 0 at least"
        )
    if len(set(load.torques_Nm)) < len(load.torques_Nm):
        raise CaseError(f"{where}: [load] torques_Nm = {toml_text(load.torques_Nm)}: one is there twice: remove it")
    scatter = design.scatter
    if design.scatters and not (scatter.modifications or scatter.axes):
        raise CaseError(
            f'{where}: [objective] value = "{design.objective.value}": needs a scatter: add [scatter] with '
            f"standard deviations, such as {AMOUNT_KEYS[0]} = 2.0 or {MISALIGNMENT_KEYS[0]} = 10.0"
        )
    if design.pareto.against == design.objective.minimise:
        raise CaseError(
            f"{where}: [pareto] against = {toml_text(design.pareto.against)}: is the objective itself: choose another"
        )
