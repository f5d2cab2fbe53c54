"""Checks of a case's modifications that need the geometry of the teeth."""

from __future__ import annotations

import math

from pmor.case import Case
from pmor.case.flanks import ModifiedFlank, modified_flanks
from pmor.core.errors import CaseError
from pmor.core.ranges import RADIANS
from pmor.gear.pair import GearPair

# A grid may end this much before the active profile, for the last digits of its file, deg.
GRID_SLACK = 1e-3


def refuse_modifications_off_the_flank(case: Case, pair: GearPair) -> None:
    """Raise CaseError where relief starts beyond the flank, or a topography does not cover the active profile.

    Parameters
    ----------
    pair : GearPair
        Its geometry.
    """
    for flank in modified_flanks(case):
        tooth = pair.wheel if flank.wheel else pair.pinion
        start, end = map(math.degrees, pair.active_rolls[flank.wheel])
        low, high = sorted((start, end))
        form, tip = math.degrees(tooth.form_roll_angle), math.degrees(tooth.tip_roll_angle)
        modification = flank.modification
        if modification.tip_relief_um:
            _refuse_beyond(flank, "tip_relief_start_roll_deg", form, tip, "below the tip circle")
        if modification.root_relief_um:
            _refuse_beyond(flank, "root_relief_end_roll_deg", start, tip, "above the start of the active profile")
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


def _refuse_beyond(flank: ModifiedFlank, key: str, low: float, high: float, rule: str) -> None:
    value = getattr(flank.modification, key)
    low, high = sorted((low, high))
    if not low < value < high:
        remedy = "lower it" if value >= high else "raise it"
        if low < value * RADIANS.factor < high:
            remedy = f"looks like radians: write {value * RADIANS.factor:.4g}"
        raise CaseError(
            f"{flank.place} {key} = {value:g}: must be {rule}, between {low:.6g} and {high:.6g} deg of roll: {remedy}"
        )
