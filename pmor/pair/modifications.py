"""Checks of a case's modifications that need the geometry of the teeth."""

from __future__ import annotations

import math

from pmor.case import Case
from pmor.case.flanks import ModifiedFlank, modified_flanks
from pmor.core.errors import CaseError
from pmor.core.ranges import RADIANS
from pmor.gear.modification import RELIEF_PLACES
from pmor.gear.pair import GearPair
from pmor.gear.profile import Profile, profiles

# A grid may end this much before the active profile, for the last digits of its file, deg.
GRID_SLACK = 1e-3
UNITS = {
    "roll_deg": "deg of roll", "roll_length_mm": "mm of roll length", "diameter_mm": "mm", "to_tip_mm": "mm",
    "from_start_mm": "mm", "percent": "% of the path of contact",
}  # fmt: skip


def refuse_modifications_off_the_flank(case: Case, pair: GearPair) -> None:
    """Raise CaseError where relief starts beyond the flank, or a topography does not cover the active profile.

    Parameters
    ----------
    pair : GearPair
        Its geometry.
    """
    flanks, active, of_gears = modified_flanks(case), pair.active_rolls, profiles(pair)
    for flank in flanks:
        tooth = pair.wheel if flank.wheel else pair.pinion
        low, high = sorted(map(math.degrees, active[flank.wheel]))
        modification, profile = flank.modification, of_gears[flank.wheel]
        if modification.tip_relief_um:
            ends = tooth.form_roll_angle, profile.tip
            _refuse_beyond(flank, "tip_relief_um", profile, ends, "below the tip circle")
        if modification.root_relief_um:
            ends = profile.start, profile.tip
            _refuse_beyond(flank, "root_relief_um", profile, ends, "above the start of the active profile")
        grid = modification.topography
        if grid is None or (grid.roll_deg[0] <= low + GRID_SLACK and grid.roll_deg[-1] >= high - GRID_SLACK):
            continue
        remedy = "widen the grid"
        if grid.roll_deg[-1] <= RADIANS.factor and grid.roll_deg[-1] * RADIANS.factor >= high - GRID_SLACK:
            remedy = "they look like radians: write degrees"
        raise CaseError(
            f"{flank.place} topography: its roll angles from {grid.roll_deg[0]:g} to {grid.roll_deg[-1]:g} deg do not "
            f"cover the active profile, {low:.6g} to {high:.6g} deg: {remedy}"
        )


def _refuse_beyond(flank: ModifiedFlank, amount: str, profile: Profile, ends: tuple[float, float], rule: str) -> None:
    """Refuse a relief that starts or ends beyond some roll angles, rad, in the measure of its key."""
    key = flank.modification.place_of(amount)
    if key is None:
        return  # refused by `pmor.case.flanks.check_flanks`
    measure, value = RELIEF_PLACES[amount][key], getattr(flank.modification, key)
    low, high = sorted(getattr(profile.point(roll), measure) for roll in ends)
    if low < value < high:
        return
    unit, remedy = UNITS[measure], "lower it" if value >= high else "raise it"
    for mistaken, name, factor in (("roll_deg", "radians", RADIANS.factor), ("diameter_mm", "a radius", 2.0)):
        if measure == mistaken and low < value * factor < high:
            remedy = f"looks like {name}: write {value * factor:.4g}"
    raise CaseError(
        f"{flank.place} {key} = {value:g}: must be {rule}, between {low:.6g} and {high:.6g} {unit}: {remedy}"
    )
