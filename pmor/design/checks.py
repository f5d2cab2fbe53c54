"""What a design file must keep: ranges that fit the gears, settings that do not contradict each other."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from pmor.case import Case, check_flanks
from pmor.case.flanks import EXTENTS
from pmor.case.reader import checked
from pmor.case.values import toml_text
from pmor.core.errors import CaseError, GeometryError
from pmor.design.files import DesignFile
from pmor.design.settings import AMOUNT_KEYS, MISALIGNMENT_KEYS, Design
from pmor.design.variables import assembly_at, corners, drawn
from pmor.gear.clearance import refuse_working_geometry
from pmor.gear.condition import Assembly
from pmor.gear.modification import Modification
from pmor.gear.pair import GearPair
from pmor.pair.conditions import assembly_of
from pmor.pair.model import gear_pair
from pmor.pair.modifications import refuse_modifications_off_the_flank

# Keys that load the halves of the face differently.
UNEVEN = ("helix_slope_um", "twist_um", "in_plane_um", "out_of_plane_um")
# More variables have too many corners of their ranges to check each, 2 to their number.
MOST_VARIABLES = 10


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
            f"standard deviations, such as {AMOUNT_KEYS[0]} = 2.0 or {MISALIGNMENT_KEYS[0]} = 10.0"
        )
    if design.pareto.against == design.objective.minimise:
        raise CaseError(
            f"{where}: [pareto] against = {toml_text(design.pareto.against)}: is the objective itself: choose another"
        )
