"""Read a design file: TOML -> `Design`, with the case, the gearbox and its mesh, or the set that it starts from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from pmor.case import Case, change_case, load_case, short_list, without_models
from pmor.case.capability import refuse_beyond
from pmor.case.document import GEARS
from pmor.case.reader import Reader, parse_toml, read_text, sections_in
from pmor.case.values import toml_text
from pmor.core.errors import CaseError, printable
from pmor.core.wording import did_you_mean
from pmor.design.checks import check_ranges, check_together, uneven
from pmor.design.files import PairDesign, SetDesign
from pmor.design.set_loader import set_design
from pmor.design.settings import OBJECTIVES_OF_SETS, RESULTS_OF_SETS, Design, Load
from pmor.machine.duty import shares
from pmor.machine.loader import GearboxFile
from pmor.machine.model import pinion_senses
from pmor.rexs.files import load_gearbox, load_set

# Place of a design without a file, in messages.
WHERE = "design"


def load(path: Path | str) -> PairDesign | SetDesign:
    """Read and check a design file, and the case, the gearbox or the set that it names.

    Raises
    ------
    CaseError
        One line with file, section, key, rule and remedy.
    """
    path = Path(path)
    text, where = read_text(path, "design file"), str(path)
    said, name = _read(parse_toml(text, where), where, title=printable(path.stem)), printable(path.stem)
    _refuse_base(said, where)
    if said.set is not None:
        return set_design(said, load_set(path.parent / said.set), name, text, path)
    if said.case is not None:
        base = path.parent / said.case
        case = load_case(base)
        design = _complete(said, case, where)
        return PairDesign(name, f"{text}\n{case.text}", design, (path, base), case_of(design, case, where))
    box = load_gearbox(path.parent / str(said.gearbox))
    case, design = box.cases[_mesh(said, box, where)], replace(said, load=_loads(said, box, where))
    design = _complete(design, case, where)
    trained = case_of(design, case, where)
    return PairDesign(name, f"{text}\n{box.text}", design, (path, *box.inputs), trained, box)


def settings_of(case: Case, sections: Mapping[str, Any]) -> PairDesign:
    """Return the settings that a design file with these sections, as TOML reads them, would give for a base case.

    CaseError where they give none.
    """
    said = _read(sections, WHERE, title=case.name, case=case.name)
    _refuse_base(said, WHERE)
    design = _complete(said, case, WHERE)
    return PairDesign(case.name, f"{sections!r}\n{case.text}", design, (), case_of(design, case, WHERE))


def _read(document: Mapping[str, Any], where: str, **filled: str) -> Design:
    return Reader(where, sections_in(Design)).section(document, Design, filled=filled)


def _refuse_base(said: Design, where: str) -> None:
    """Refuse a design of none or several of a case, a gearbox and a set, and keys that go with another one."""
    load, given = said.load, [key for key in ("case", "gearbox", "set") if getattr(said, key) is not None]
    if len(given) > 1:
        others = "one" if len(given) == 2 else "two"
        raise CaseError(f"{where}: {' and '.join(given)}: a design starts from one of them: leave {others} out")
    if not given:
        raise CaseError(f"{where}: case: is missing: add 'case = ...' at the top, or 'set = ...', or gearbox and mesh")
    if given != ["gearbox"]:
        if said.mesh is not None:
            raise CaseError(
                f"{where}: mesh = {toml_text(said.mesh)}: is of a gearbox: leave it out, or name the gearbox"
            )
        if load.names:
            rule = "load cases are of a gearbox: write torques_Nm"
            raise CaseError(f"{where}: [load] names = {toml_text(load.names)}: {rule}")
    elif load.torques_Nm:
        rule = "torques are those of the gearbox's load cases: leave them out, or choose load cases by names"
        raise CaseError(f"{where}: [load] torques_Nm = {toml_text(load.torques_Nm)}: {rule}")
    if given != ["set"]:
        _refuse_keys_of_sets(said, where)


def _refuse_keys_of_sets(said: Design, where: str) -> None:
    for variable in said.variables:
        if variable.gear not in (*GEARS, "both"):
            remedy = did_you_mean(variable.gear, [*GEARS, "both"])
            raise CaseError(f"{where}: [[variables]] gear = {toml_text(variable.gear)}: a pair has none: {remedy}")
        if variable.flank != "both":
            rule = "is of a set, whose planets carry on both flanks: leave it out"
            raise CaseError(f"{where}: [[variables]] flank = {toml_text(variable.flank)}: {rule}")
    named: list[tuple[str, str, tuple[str, ...]]] = [
        ("[objective] minimise", said.objective.minimise, OBJECTIVES_OF_SETS),
        ("[pareto] against", said.pareto.against, RESULTS_OF_SETS),
        *(("[[constraints]] result", constraint.result, RESULTS_OF_SETS) for constraint in said.constraints),
    ]
    for place, key, of_sets in named:
        if key in of_sets:
            raise CaseError(f"{where}: {place} = {toml_text(key)}: is of a set: write one of a pair")


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
    check_together(design, where)
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
