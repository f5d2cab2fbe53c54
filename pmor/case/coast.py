"""Coast flanks, which a negative torque loads, as the flanks of a mirrored pair.

A pair that is turned backwards is the image of one that drives, mirrored about the plane of its axes, x to -x: its
helix has the other hand, the wheel's axis is off to the other side across that plane, teeth follow in the opposite
order. What counts along the axes or in their plane stays. A case of coast flanks is that image: each stage solves it as
any other case. Its torques are amounts; angles, tooth numbers and transmission errors count clockwise, the way in which
the torque turns the pinion.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from pmor.case.gears import GearCase
from pmor.case.schema import Case, ConditionCase
from pmor.case.values import toml_text
from pmor.core.errors import CaseError
from pmor.gear.condition import Misalignment
from pmor.gear.modification import Modification, other_places

#: lists of torques that have the sign of the nominal one
TORQUES = (
    ("offline", "torques_Nm"), ("online", "torques_Nm"), ("compare", "torques_Nm"), ("results", "harris_torques_Nm"),
    ("dynamics", "torques_Nm"),
)  # fmt: skip


def in_amounts(document: Mapping[str, Any], where: str) -> tuple[dict[str, Any], bool]:
    """Return a document with the amounts of negative torques, and whether it has such; conditions keep their signs.

    Raises
    ------
    CaseError
        Where a list has torques of the other sign.
    """
    load = document.get("load")
    coast = isinstance(load, Mapping) and _number(load.get("torque_Nm")) and load["torque_Nm"] < 0
    if not coast:
        return dict(document), False
    amounts = dict(document) | {"load": {**document["load"], "torque_Nm": -document["load"]["torque_Nm"]}}
    for section, key in TORQUES:
        table = document.get(section)
        if not isinstance(table, Mapping) or key not in table:
            continue
        values = table[key] if isinstance(table[key], list) else [table[key]]
        if any(_number(value) and value > 0 for value in values):
            raise CaseError(
                f"{where}: [{section}] {key} = {toml_text(table[key])}: torques have the sign of [load] torque_Nm, "
                "which loads the coast flanks: write them negative, or give those of the drive flanks as [[condition]]"
            )
        amounts[section] = {**table, key: [-value if _number(value) else value for value in values]}
    return amounts, True


def other_flank(case: Case) -> Case:
    """Return the image of a case in which its other flanks carry; that of the image is the case itself."""
    pair = replace(
        case.pair, helix_angle_deg=-case.pair.helix_angle_deg or 0.0, pinion=_mirrored_gear(case.pair.pinion),
        wheel=_mirrored_gear(case.pair.wheel),
    )  # fmt: skip
    out_of_plane = tuple(sorted(-value or 0.0 for value in case.offline.out_of_plane_um))
    pinion, wheel = map(mirrored_flank, case.other_flanks)
    return replace(
        case, flank="drive" if case.flank == "coast" else "coast", pair=pair, pinion_modification=pinion,
        wheel_modification=wheel, misalignment=mirrored_axes(case.misalignment),
        other_flanks=(mirrored_flank(case.pinion_modification), mirrored_flank(case.wheel_modification)),
        offline=replace(case.offline, out_of_plane_um=out_of_plane),
    )  # fmt: skip


def _mirrored_gear(gear: GearCase) -> GearCase:
    """Holes and lugs on the other side of the line of centres, and the image of a body."""
    if gear.lugs is not None:
        return replace(gear, held=gear.lugs.image)
    if gear.body is not None:
        return replace(gear, body=gear.body.image)
    if gear.blank is None or gear.blank.holes is None:
        return gear
    holes = replace(gear.blank.holes, first_deg=-gear.blank.holes.first_deg or 0.0)
    return replace(gear, blank=replace(gear.blank, holes=holes))


def as_drawn(case: Case) -> Case:
    """Return a case with its gears as they are drawn, whichever flanks carry."""
    return other_flank(case) if case.flank == "coast" else case


def mirrored_axes(misalignment: Misalignment) -> Misalignment:
    """Return the place of the wheel's axis in the image."""
    return replace(misalignment, out_of_plane_um=-misalignment.out_of_plane_um or 0.0)


def mirrored_flank(modification: Modification) -> Modification:
    """Return a modification with its teeth in the opposite order, the first one first."""
    pitch, grid = modification.pitch_deviations_um, modification.topography
    if grid is not None:
        grid = replace(grid, teeth_um=grid.teeth_um[:1] + grid.teeth_um[:0:-1])
    return replace(modification, pitch_deviations_um=pitch[:1] + pitch[:0:-1], topography=grid)


def flank_of(condition: ConditionCase) -> str:
    """Return which flanks the torque of a condition loads: drive or coast."""
    return "coast" if condition.torque_Nm < 0.0 else "drive"


def as_solved(condition: ConditionCase) -> ConditionCase:
    """Return a condition as its flanks see it: of coast flanks the image, the torque as an amount."""
    if flank_of(condition) == "drive":
        return condition
    return replace(
        condition, torque_Nm=-condition.torque_Nm, misalignment=mirrored_axes(condition.misalignment),
        pinion=mirrored_flank(condition.pinion), wheel=mirrored_flank(condition.wheel),
    )  # fmt: skip


def other_by_default(modification: Modification, given: Iterable[str]) -> Modification:
    """Return what the other flanks have where a file says some of their keys, and nothing of the rest."""
    return modification.alike.changed(dict.fromkeys(other_places(given)))


def _number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
