"""Variables of a set as flanks of its meshes, and as sections of its file.

A set file has the flanks of a member in its sections `modification`, the drive flanks, and `coast_modification`, which
are as the others where nothing else is said. Cases of meshes have those that carry.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from pmor.case.coast import other_by_default, without_pitch
from pmor.case.document import COAST, MODIFICATION
from pmor.case.reader import Reader
from pmor.core.arrays import FloatArray
from pmor.design.settings import Variable
from pmor.design.variables import AS_DRAWN, Draw, assembly_at
from pmor.gear.condition import Assembly
from pmor.gear.modification import UNMODIFIED, Modification
from pmor.sets.loader import SetFile

DRIVE = "drive"
SECTIONS = {DRIVE: MODIFICATION, "coast": COAST}


@dataclass(frozen=True)
class CarryingFlank:
    """A flank of a member that carries: as its file has it, and as a gear of a case.

    Parameters
    ----------
    member : str
    flank : {"drive", "coast"}
    case : str
    gear : {"pinion", "wheel"}
    """

    member: str
    flank: str
    case: str
    gear: str


def carrying_flanks(file: SetFile) -> tuple[CarryingFlank, ...]:
    """Return the flanks of all members that carry under the torque of a set."""
    found = {
        CarryingFlank(file.plan.bodies[body].member, file.cases[mesh.case].flank, mesh.case, gear): None
        for mesh in file.plan.meshes
        for gear, body in (("pinion", mesh.pinion), ("wheel", mesh.wheel))
    }
    return tuple(found)


def on_flanks(variable: Variable, flanks: Sequence[CarryingFlank]) -> list[CarryingFlank]:
    """Return the flanks that a variable changes."""
    return [flank for flank in flanks if flank.member == variable.gear and flank.flank in variable.flanks]


def of_case(variables: Sequence[Variable], flanks: Sequence[CarryingFlank], case: str) -> dict[int, Variable]:
    """Return the variables of a mesh as those of its case, by their numbers."""
    found: dict[int, Variable] = {}
    for number, variable in enumerate(variables):
        gears = [flank.gear for flank in on_flanks(variable, flanks) if flank.case == case]
        if gears:
            found[number] = replace(variable, gear=gears[0] if len(gears) == 1 else "both", flank="both")
    return found


def flanks_at(
    base: Assembly, variables: Mapping[int, Variable], x: Sequence[float] | FloatArray, draw: Draw = AS_DRAWN
) -> Assembly:
    """Return the flanks of a mesh at values of all variables, of which its case has its own (`of_case`)."""
    return assembly_at(base, list(variables.values()), [x[number] for number in variables], draw)


def members_at(
    file: SetFile, variables: Sequence[Variable], x: Sequence[float] | FloatArray
) -> dict[str, dict[str, Any]]:
    """Return the sections of the members of a set at values of the variables."""
    found: dict[str, dict[str, Any]] = {name: dict(keys) for name, keys in file.sections.members.items()}
    reader = Reader(str(file.inputs[0]))
    for member in {variable.gear: None for variable in variables}:
        keys = found[member]
        drive = reader.section(keys.pop(MODIFICATION, {}), Modification, f"{member}.{MODIFICATION}")
        said = keys.pop(COAST, {})
        coast = reader.section(said, Modification, f"{member}.{COAST}", vars(other_by_default(drive, said)))
        values: dict[str, dict[str, Any]] = {flank: {} for flank in SECTIONS}
        for variable, value in zip(variables, x, strict=True):
            for flank in variable.flanks if variable.gear == member else ():
                values[flank][variable.key] = float(value)
        drive, coast = drive.changed(values[DRIVE]), coast.changed(values["coast"])
        for section, changed, usual in ((MODIFICATION, drive, UNMODIFIED), (COAST, coast, without_pitch(drive))):
            own = {key: value for key, value in vars(changed).items() if value not in (None, getattr(usual, key))}
            if own:
                keys[section] = own
    return found


def parameter_names(flanks: Sequence[CarryingFlank]) -> dict[tuple[str, str], str]:
    """Return what parameters of the gears of cases, ``case, gear``, are told by: member, and flank where both carry."""
    sides = {flank.member: {one.flank for one in flanks if one.member == flank.member} for flank in flanks}
    return {
        (one.case, one.gear): one.member if len(sides[one.member]) == 1 else f"{one.member}.{one.flank}"
        for one in flanks
    }
