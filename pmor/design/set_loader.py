"""A design of a set: its file read with the torques, angles and width of the design, and checked with its ranges."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from pmor.case.values import toml_text
from pmor.core.errors import CaseError, PmorError
from pmor.core.wording import did_you_mean
from pmor.design.checks import check_ranges, check_together, uneven
from pmor.design.files import PINS, SetDesign, pins_of
from pmor.design.set_flanks import SECTIONS, CarryingFlank, of_case
from pmor.design.settings import Design
from pmor.sets.loader import SetFile, with_sections
from pmor.sets.settings import SetSections


def set_design(said: Design, base: SetFile, name: str, text: str, path: Path) -> SetDesign:
    """Return a design of a set that was read.

    Raises
    ------
    CaseError, GeometryError
        One line with file, place, rule and remedy.
    """
    where = str(path)
    load = said.load
    usual = tuple(sorted({base.plan.nominal_Nm, *base.sections.sweep.torques_Nm}))
    load = replace(load, torques_Nm=load.torques_Nm or usual)
    design = replace(said, load=replace(load, weights=load.weights or (1.0,) * len(load.labels)))
    _refuse_runout(design, base, where)
    check_together(design, where, pins_of(base))
    _refuse_unknown(design, base, where)
    changed = with_sections(base, sections_of(base.sections, design))
    found = SetDesign(name, f"{text}\n{base.whole_text}", design, (path, *base.inputs), changed, base)
    for variable in design.variables:
        _refuse_idle(variable.gear, variable.flank, found.flanks, f"{where}: [[variables]] {variable.name}")
    for case in changed.cases.values():
        own = of_case(design.variables, found.flanks, case.name)
        local = replace(design, variables=tuple(own.values()))
        try:
            check_ranges(local, case, where)
        except PmorError as error:
            raise _with_members(error, case.name, found) from None
    return found


def sections_of(said: SetSections, design: Design) -> SetSections:
    """Return the sections of a set file with the torques and the angles of a design, and as wide as it takes."""
    members: dict[str, Any] = dict(said.members)
    if uneven(design):
        members["mesh"] = {**members.get("mesh", {}), "width": "whole"}
    members["results"] = {"root_stress": "root_stress_MPa" in design.results}
    torques = tuple(sorted(design.load.torques_Nm))
    sweep = replace(said.sweep, angles_per_pitch=design.search.angles, torques_Nm=torques)
    return replace(said, sweep=sweep, tolerances=None, members=members)


def _refuse_unknown(design: Design, base: SetFile, where: str) -> None:
    """Refuse members that a set lacks, and what a design of a set does not have."""
    members = list(dict.fromkeys(body.member for body in base.plan.bodies))
    for variable in design.variables:
        if variable.gear not in members:
            known = ", ".join(map(toml_text, members))
            rule = "name the member that it is of" if variable.gear == "both" else did_you_mean(variable.gear, members)
            raise CaseError(f"{where}: [[variables]] gear = {toml_text(variable.gear)}: the set has {known}: {rule}")
    for key in design.scatter.axes:
        rule = f"is of pairs: leave it out, or write pins_tangential_um below [tolerances] of {base.name}"
        raise CaseError(f"{where}: [scatter] {key}: {rule}")
    asked = {design.objective.minimise, design.pareto.against, *(c.result for c in design.constraints)}
    if "k_gamma" in asked and not base.plan.planets:
        raise CaseError(f'{where}: "k_gamma": is of planets, and {base.name} has none: choose another result')


def _refuse_runout(design: Design, base: SetFile, where: str) -> None:
    """Refuse eccentricities that scatter: all teeth of all gears would meet in each of the draws."""
    sizes = base.sections.tolerances
    if sizes is None or not design.scatters:
        return
    for field in fields(sizes):
        if field.name.endswith("eccentricity_um") and getattr(sizes, field.name) > 0.0:
            raise CaseError(
                f'{where}: [objective] value = "{design.objective.value}": designs draw {", ".join(PINS)} of '
                f"[tolerances], not {field.name}: leave it out of {base.name}"
            )


def _refuse_idle(gear: str, flank: str, flanks: Sequence[CarryingFlank], place: str) -> None:
    """Refuse a variable of a flank that carries nothing."""
    carrying = [one.flank for one in flanks if one.member == gear]
    if flank != "both" and flank not in carrying:
        raise CaseError(
            f"{place}: the {flank} flanks of {gear} carry nothing under the torque of the set: write flank = "
            f'"{carrying[0]}", or leave it out'
        )


def _with_members(error: PmorError, case: str, file: SetDesign) -> PmorError:
    """Return an error of a case with the names of the set file."""
    text = str(error).replace(f" of {case}", f" of {file.set.name}")
    for one in file.flanks:
        if one.case == case:
            text = text.replace(f"[{one.gear}.modification]", f"[{one.member}.{SECTIONS[one.flank]}]")
            text = text.replace(f"[{one.gear}.", f"[{one.member}.").replace(f"the {one.gear}", f"the {one.member}")
            text = text.replace(f"{one.gear}.", f"{one.member}.")
    return type(error)(text)
