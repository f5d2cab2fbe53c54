"""Backlash of the drawing against the least one that is usual, and what gives that: thinner teeth, or axes apart."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

from pmor.case import Case, change_case
from pmor.case.change import said_gears
from pmor.core.errors import PmorError
from pmor.gear.clearance import least_usual_backlash
from pmor.gear.pair import GearPair, tight_centre_distance, transverse_backlash
from pmor.pair.model import gear_pair
from pmor.results.verdict import Change, written

# Steps of allowances, um, and of a centre distance, mm; halvings of the interval in which that is looked for; backlash
# below which none is drawn, mm.
STEP_UM, STEP_MM, HALVINGS, NONE_MM = 1.0, 0.01, 40, 1e-4


class Remark(NamedTuple):
    """What is to be said of a drawing; `bad` where it was drawn so, and not left open."""

    text: str
    bad: bool


def backlash_remarks(case: Case, mesh: str = "") -> list[Remark]:
    """Return what is to be said of the backlash of a pair: nothing where there is enough.

    Parameters
    ----------
    mesh : str
        Its name in a gearbox, whose shafts say the centre distance; empty of a pair by itself.
    """
    pair = gear_pair(case)
    least, drawn = least_usual_backlash(pair), normal_backlash(pair)
    if drawn >= least:
        return []
    given = [text for text in (_thinner(case, pair, least, mesh), "" if mesh else _apart(case, pair, least)) if text]
    said = f"normal backlash is {drawn:.3f} mm" if drawn > NONE_MM else "no backlash is drawn"
    gives = f"{', or '.join(given)} gives the" if given else "below the"
    of = f" ({mesh})" * bool(mesh)
    return [Remark(f"{said}{of}: {gives} {least:.3f} mm that ISO/TR 10064-2 recommends", drawn > NONE_MM)]


def normal_backlash(pair: GearPair) -> float:
    """Return the backlash of the drawing normal to the flanks, mm (ISO 21771, 6.3: j_bn)."""
    return pair.backlash * math.cos(pair.base_helix_angle)


def _thinner(case: Case, pair: GearPair, least: float, mesh: str) -> str:
    """Allowance of both gears that gives a backlash; empty where teeth do not bear it."""
    more = (least - normal_backlash(pair)) / math.cos(math.radians(case.pair.pressure_angle_deg))
    taken = math.ceil(500.0 * more / STEP_UM) * STEP_UM
    filed = {name: getattr(case.pair, name).tooth_thickness_allowance_um or (0.0,) for name in said_gears(case)}
    keys = {name: {"tooth_thickness_allowance_um": tuple(one - taken for one in own)} for name, own in filed.items()}
    if not _gives(keys, case, least):
        return ""
    of = f"{mesh}: " * bool(mesh)
    return written(tuple(Change(f"{of}{name}", values) for name, values in keys.items()))


def _apart(case: Case, pair: GearPair, least: float) -> str:
    """Centre distance that gives a backlash; empty where teeth do not bear it."""
    tight = tight_centre_distance(pair.pinion, pair.wheel)
    drawn = abs(pair.centre_distance)
    near, far = sorted((drawn, drawn + math.copysign(pair.pinion.module, tight)))
    for _ in range(HALVINGS):
        middle = 0.5 * (near + far)
        found = transverse_backlash(pair.base_distance, tight, math.copysign(middle, tight))
        enough = found * math.cos(pair.base_helix_angle) >= least
        near, far = (near, middle) if enough == (tight > 0.0) else (middle, far)
    distance = round((math.ceil if tight > 0.0 else math.floor)(far / STEP_MM) * STEP_MM, 6)
    change = {"centre_distance_mm": distance}
    return written((Change("pair", change),)) if _gives({"pair": change}, case, least) else ""


def _gives(keys: Mapping[str, Mapping[str, object]], case: Case, least: float) -> bool:
    try:
        return normal_backlash(gear_pair(change_case(case, **keys))) >= least
    except PmorError:
        return False
