"""Read a design file: TOML -> `Design`, with the case, the gearbox or the set that it starts from, and check it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from pmor.case import Case, change_case, check_flanks, load_case, without_models
from pmor.case.capability import refuse_beyond
from pmor.case.document import COAST, GEARS, MODIFICATION
from pmor.case.duty import shares
from pmor.case.flanks import EXTENTS
from pmor.case.reader import Reader, checked, parse_toml, read_text, sections_in
from pmor.case.values import toml_text
from pmor.core.errors import CaseError, GeometryError, PmorError, printable
from pmor.core.wording import did_you_mean
from pmor.design.files import PINS, DesignFile, of_case, on_flanks, pins_of, source_text
from pmor.design.settings import (
    MISALIGNMENT_KEYS,
    OVER_MESHES,
    RESULTS_OF_MOTION,
    RESULTS_OF_SETS,
    Design,
    Load,
    Variable,
)
from pmor.design.variables import assembly_at, corners, drawn
from pmor.dynamics.whine.run import speeds_of
from pmor.gear.clearance import refuse_working_geometry
from pmor.gear.condition import Assembly
from pmor.gear.modification import AMOUNTS, OVER_WIDTH, UNEVEN, Modification
from pmor.gear.pair import GearPair
from pmor.machine.loader import GearboxFile
from pmor.machine.model import pinion_senses
from pmor.pair.conditions import assembly_of
from pmor.pair.model import gear_pair
from pmor.pair.modifications import refuse_modifications_off_the_flank
from pmor.rexs.files import load_gearbox, load_set
from pmor.sets.loader import SetFile, with_sections
from pmor.sets.settings import SetSections

Source = Case | GearboxFile | SetFile
# Place of a design without a file, in messages.
WHERE = "design"
READERS: Mapping[str, Callable[[Path], Source]] = {"case": load_case, "gearbox": load_gearbox, "set": load_set}
# More variables have too many corners of their ranges to check each, 2 to their number.
MOST_VARIABLES = 10
# Sections of flanks by their names.
SECTIONS = {"drive": MODIFICATION, "coast": COAST}


def load(path: Path | str) -> DesignFile:
    """Read and check a design file, and the case, the gearbox or the set that it names.

    Raises
    ------
    CaseError, GeometryError
        One line with file, section, key, rule and remedy.
    """
    path = Path(path)
    text, where, name = read_text(path, "design file"), str(path), printable(path.stem)
    said = _read(parse_toml(text, where), where, title=name)
    kind = _kind(said, where)
    base = path.parent / getattr(said, kind)
    source = READERS[kind](base)
    inputs = (path, base) if isinstance(source, Case) else (path, *source.inputs)
    return _design_file(said, source, where, name, text, inputs)


def settings_of(case: Case, sections: Mapping[str, Any]) -> DesignFile:
    """Return the settings that a design file with these sections, as TOML reads them, would give for a base case.

    CaseError where they give none.
    """
    said = _read(sections, WHERE, title=case.name, case=case.name)
    _kind(said, WHERE)
    return _design_file(said, case, WHERE, case.name, f"{sections!r}", ())


def _read(document: Mapping[str, Any], where: str, **filled: str) -> Design:
    return Reader(where, sections_in(Design)).section(document, Design, filled=filled)


def _kind(said: Design, where: str) -> str:
    """Return what a design starts from; refuse none or several of them, and keys that go with another one."""
    load, given = said.load, [key for key in READERS if getattr(said, key) is not None]
    if len(given) > 1:
        others = "one" if len(given) == 2 else "two"
        raise CaseError(f"{where}: {' and '.join(given)}: a design starts from one of them: leave {others} out")
    if not given:
        raise CaseError(f"{where}: case: is missing: add 'case = ...' at the top, or 'set = ...', or 'gearbox = ...'")
    named: dict[str, Any] = {"mesh": said.mesh, "[load] names": load.names, "[objective] meshes": said.objective.meshes}
    named |= {f"[[variables]] {v.key}: mesh": v.mesh for v in said.variables}
    named |= {f"[[constraints]] {c.result}: mesh": c.mesh for c in said.constraints}
    for place, value in named.items() if given != ["gearbox"] else ():
        if value and value != OVER_MESHES[0]:
            rule = "write torques_Nm" if "load" in place else "leave it out, or name the gearbox"
            raise CaseError(f"{where}: {place} = {toml_text(value)}: is of a gearbox: {rule}")
    if given == ["gearbox"] and load.torques_Nm:
        rule = "torques are those of the gearbox's load cases: leave them out, or choose load cases by names"
        raise CaseError(f"{where}: [load] torques_Nm = {toml_text(load.torques_Nm)}: {rule}")
    asked = [("[objective] minimise", said.objective.minimise), ("[pareto] against", said.pareto.against),
             *(("[[constraints]] result", constraint.result) for constraint in said.constraints)]  # fmt: skip
    for place, key in asked if given != ["set"] else ():
        if key in RESULTS_OF_SETS:
            raise CaseError(f"{where}: {place} = {toml_text(key)}: is of a set: write one of a pair")
    for place, key in asked if given != ["gearbox"] else ():
        if key in RESULTS_OF_MOTION:
            rule = "is of a gearbox in motion: put the pair in a gearbox file, with its shafts and bearings"
            if given == ["set"]:
                rule = "is of meshes of two gears in a gearbox: sets are designed at rest; take a result of sets"
            raise CaseError(f"{where}: {place} = {toml_text(key)}: {rule}")
    return given[0]


def _design_file(
    said: Design, source: Source, where: str, name: str, text: str, inputs: tuple[Path, ...]
) -> DesignFile:
    if isinstance(source, GearboxFile):
        said = _of_meshes(said, source, where)
    elif not said.load.torques_Nm:
        torques = (
            source.online.torques_Nm if isinstance(source, Case)
            else tuple(sorted({source.plan.nominal_Nm, *source.sections.sweep.torques_Nm}))
        )  # fmt: skip
        said = replace(said, load=replace(said.load, torques_Nm=torques))
    design = replace(said, load=replace(said.load, weights=said.load.weights or (1.0,) * len(said.load.labels)))
    if isinstance(source, SetFile):
        _refuse_runout(design, source, where)
    check_together(design, where, pins_of(source))
    _refuse_members(design, source, where)
    file = _with_cases(DesignFile(name, f"{text}\n{source_text(source)}", design, inputs, source, {}), where)
    for variable in design.variables:
        _refuse_idle(variable, file, where)
    for case in dict.fromkeys(file.meshes):
        own = of_case(design.variables, file.flanks, case)
        try:
            check_ranges(replace(design, variables=tuple(own.values())), file.cases[case], where)
        except PmorError as error:
            raise _with_members(error, case, file) from None
    check_scatter(file, where)
    return file


def _with_cases(file: DesignFile, where: str) -> DesignFile:
    """Return a design file with the cases of its meshes, ready to be trained for it."""
    design, source = file.design, file.source
    if isinstance(source, SetFile):
        changed = with_sections(source, sections_of(source.sections, design))
        return replace(file, cases=changed.cases, set=changed)
    cases = {source.name: source} if isinstance(source, Case) else source.cases
    designed = design.mesh or tuple(cases)
    ready = {
        name: case_of(design, case, where) if name in designed else without_models(case) for name, case in cases.items()
    }
    return replace(file, cases=ready)


def _of_meshes(said: Design, box: GearboxFile, where: str) -> Design:
    """Return a design with the meshes of its gearbox and the load cases: all that carry on the flanks of the first."""
    names = [name for name in box.cases if name not in box.model.shared]
    for shared in box.model.shared.intersection(said.mesh):
        rule = "one of its gears has several meshes, which its flanks move too: design it as a set with [[gears]]"
        raise CaseError(f"{where}: mesh = {toml_text(shared)}: {rule}")
    named = [("mesh", mesh) for mesh in said.mesh] + [("[[variables]] mesh", v.mesh) for v in said.variables]
    named += [("[[constraints]] mesh", constraint.mesh) for constraint in said.constraints]
    named += [("[objective] meshes", said.objective.meshes)] if said.objective.meshes not in OVER_MESHES else []
    for place, mesh in named:
        known = names if place == "mesh" else list(said.mesh or names)
        if mesh is not None and mesh not in known:
            raise CaseError(f"{where}: {place} = {toml_text(mesh)}: {box.name} has none: {did_you_mean(mesh, known)}")
    if said.moves:
        refuse_beyond(box, "dynamics", f"{where}: gearbox")
        refuse_beyond(box, "quiet", f"{where}: gearbox")
        speeds_of(box)
        known = [bearing.name for bearing in box.model.sections.bearings]
        if said.motion.bearing is not None and said.motion.bearing not in known:
            rule = f"{box.name} has none: {did_you_mean(said.motion.bearing, known)}"
            raise CaseError(f"{where}: [motion] bearing = {toml_text(said.motion.bearing)}: {rule}")
    refuse_beyond(box, "design", f"{where}: gearbox")
    meshes, model = said.mesh or tuple(names), box.model
    if len(meshes) == 1:  # its results are those of the design
        constraints = tuple(replace(constraint, mesh=None) for constraint in said.constraints)
        said = replace(said, constraints=constraints, objective=replace(said.objective, meshes=OVER_MESHES[0]))
    senses = {}
    for load in model.sections.loads:
        of_all = pinion_senses(model, load)
        senses[load.name] = [of_all[mesh] for mesh in meshes]
    chosen = said.load.names
    for name in chosen:
        if name not in senses:
            rule = f"{box.name} has no such load case: {did_you_mean(name, list(senses))}"
            raise CaseError(f"{where}: [load] names: {toml_text(name)}: {rule}")
    first = senses[chosen[0] if chosen else next(iter(senses))]
    others = [name for name in chosen if senses[name] != first]
    if others:
        rule = f"carries on other flanks than {toml_text(chosen[0])}: design these in a file of their own"
        raise CaseError(f"{where}: [load] names: {toml_text(others[0])}: {rule}")
    chosen = chosen or tuple(name for name, sense in senses.items() if sense == first)
    times = dict(zip(senses, shares(model.sections.loads), strict=False))
    weights = said.load.weights or tuple(times[name] for name in chosen if times)
    return replace(said, mesh=meshes, load=Load(names=chosen, weights=weights))


def case_of(design: Design, case: Case, where: str) -> Case:
    """Return the case as a design trains it, of the whole width if need be; CaseError without line loads."""
    refuse_beyond(case, "design", f"{where}: case")
    mesh: dict[str, Any] = {"error_bar": False}
    if case.mesh.width == "half" and uneven(design):
        mesh["width"] = "whole"
    if "root_stress_MPa" in design.results:
        return change_case(case, mesh=mesh, compare={"models": None})
    return change_case(without_models(case), mesh=mesh)


def sections_of(said: SetSections, design: Design) -> SetSections:
    """Return the sections of a set file with the torques and the angles of a design, and as wide as it takes."""
    members: dict[str, Any] = dict(said.members)
    if uneven(design):
        members["mesh"] = {**members.get("mesh", {}), "width": "whole"}
    members["results"] = {"root_stress": "root_stress_MPa" in design.results}
    torques = tuple(sorted(design.load.torques_Nm))
    sweep = replace(said.sweep, angles_per_pitch=design.search.angles, torques_Nm=torques)
    return replace(said, sweep=sweep, tolerances=None, members=members)


def _refuse_members(design: Design, source: Source, where: str) -> None:
    """Refuse gears that a pair or a set lacks, and what a design of a set does not have."""
    of_set = isinstance(source, SetFile)
    members = list(dict.fromkeys(b.member for b in source.plan.bodies)) if of_set else [*GEARS, "both"]  # type: ignore[union-attr]
    for variable in design.variables:
        if variable.gear in members:
            continue
        text = f"{where}: [[variables]] gear = {toml_text(variable.gear)}"
        if not of_set:
            raise CaseError(f"{text}: a pair has none: {did_you_mean(variable.gear, members)}")
        rule = "name the member that it is of" if variable.gear == "both" else did_you_mean(variable.gear, members)
        raise CaseError(f"{text}: the set has {', '.join(map(toml_text, members))}: {rule}")
    if not isinstance(source, SetFile):
        return
    for key in design.scatter.axes:
        rule = f"is of pairs: leave it out, or write pins_tangential_um below [tolerances] of {source.name}"
        raise CaseError(f"{where}: [scatter] {key}: {rule}")
    asked = {design.objective.minimise, design.pareto.against, *(c.result for c in design.constraints)}
    if "k_gamma" in asked and not source.plan.planets:
        raise CaseError(f'{where}: "k_gamma": is of planets, and {source.name} has none: choose another result')


def _refuse_runout(design: Design, base: SetFile, where: str) -> None:
    """Refuse eccentricities that scatter: all teeth of all gears would meet in each of the draws."""
    sizes = base.sections.tolerances
    if sizes is None or not design.scatters:
        return
    for field in fields(sizes):
        if field.name.endswith(("eccentricity_um", "flank_tolerance_class")) and getattr(sizes, field.name):
            raise CaseError(
                f'{where}: [objective] value = "{design.objective.value}": designs draw {", ".join(PINS)} of '
                f"[tolerances], not {field.name}: leave it out of {base.name}"
            )


def _refuse_idle(variable: Variable, file: DesignFile, where: str) -> None:
    """Refuse a variable of a flank that carries nothing."""
    if on_flanks(variable, file.flanks):
        return
    others = on_flanks(replace(variable, flank="both"), file.flanks)
    loads = "set" if file.set is not None else "case"
    gear = "both gears" if variable.gear == "both" else variable.gear
    raise CaseError(
        f"{where}: [[variables]] {variable.name}: the {variable.flank} flanks of {gear} carry nothing under the torque "
        f'of the {loads}: write flank = "{others[0].flank}", or leave it out'
    )


def _with_members(error: PmorError, case: str, file: DesignFile) -> PmorError:
    """Return an error of a case with the names of the file that a design starts from."""
    if file.set is None:
        return error
    text = str(error).replace(f" of {case}", f" of {file.set.name}")
    for one in file.flanks:
        if one.case == case:
            text = text.replace(f"[{one.gear}.modification]", f"[{one.member}.{SECTIONS[one.flank]}]")
            text = text.replace(f"[{one.gear}.", f"[{one.member}.").replace(f"the {one.gear}", f"the {one.member}")
            text = text.replace(f"{one.gear}.", f"{one.member}.")
    return type(error)(text)



def uneven(design: Design) -> bool:
    """Whether variables or scatter load the halves of the face differently."""
    return not _moved(design).isdisjoint((*UNEVEN, *MISALIGNMENT_KEYS[:2]))


def _moved(design: Design) -> set[str]:
    """Keys that variables or scatter change."""
    return {v.key for v in design.variables}.union(design.scatter.modifications, design.scatter.axes)


def check_ranges(design: Design, case: Case, where: str) -> None:
    """Raise `CaseError` where the ends of the ranges do not fit the gears, or the base case lacks an extent."""
    base, pair = assembly_of(case), gear_pair(case)
    varied = {(gear, v.key) for v in design.variables for gear in v.gears}
    scattered = design.scatter.modifications
    for gear, modification in (("pinion", base.pinion), ("wheel", base.wheel)):
        asked = [key for key in AMOUNTS if (gear, key) in varied or key in scattered]
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
    if case.mesh.width == "plane_strain" and (uneven(design) or _moved(design).intersection(OVER_WIDTH)):
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


def check_scatter(file: DesignFile, where: str) -> None:
    """Raise GeometryError where axes scatter so far that gears do not mesh any more."""
    draws = drawn(file, file.design.scatter, file.design.scatter.draws) if file.design.scatter.axes else ()
    for number, name in enumerate(file.meshes if draws else ()):
        case = file.cases[name]
        axes = [assembly_at(assembly_of(case), (), (), draw.meshes[number]).misalignment for draw in draws]
        try:
            refuse_working_geometry(gear_pair(case), axes)
        except GeometryError as error:
            raise GeometryError(f"{where}: [scatter] draws {error}: lower the scatter") from None


def check_together(design: Design, where: str, pins: Collection[str] = ()) -> None:
    """Raise `CaseError` where settings of a design contradict each other, whatever it starts from.

    Pins of its set that scatter are given by their keys.
    """
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
    taken = [
        (gear, flank, v.key, mesh) for v in design.variables for gear in v.gears for flank in v.flanks
        for mesh in ([v.mesh] if v.mesh is not None else design.mesh or [None])
    ]  # fmt: skip
    for gear, flank, key, mesh in taken:
        if taken.count((gear, flank, key, mesh)) > 1:
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
    if design.scatters and not (scatter.modifications or scatter.axes or pins):
        raise CaseError(
            f'{where}: [objective] value = "{design.objective.value}": needs a scatter: add [scatter] with '
            f"standard deviations, such as {AMOUNTS[0]} = 2.0 or {MISALIGNMENT_KEYS[0]} = 10.0"
        )
    if design.pareto.against == design.objective.minimise:
        raise CaseError(
            f"{where}: [pareto] against = {toml_text(design.pareto.against)}: is the objective itself: choose another"
        )
