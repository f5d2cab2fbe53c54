"""The edge between flank and tip land, rounded or chamfered: where the involute ends before it.

Both are taken in the transverse section. A rounding is an arc that touches flank and tip circle. Its centre lies its
radius r below the tip circle and below the flank. With the involute at roll angle u at r_b (e + u e'), e' its outward
normal (`pmor.line.kernels.contact_point`), the centre is r_b e + (r_b u - r) e', so that

    r_b^2 + (r_b u - r)^2 = (r_a - r)^2.

A chamfer takes its height off the radius on the flank, and as much off the tip land (45 degrees).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from pmor.core.errors import GeometryError
from pmor.gear.tooth import Tooth


@dataclass(frozen=True)
class TipEdge:
    """Where a flank ends towards the tip.

    Parameters
    ----------
    roll_angle : float
        At which the usable flank ends, rad.
    radius : float
        Of the rounded edge that goes on from there, mm; 0 for a sharp one, at the tip circle or at a chamfer.
    """

    roll_angle: float
    radius: float = 0.0


def tip_edge(tooth: Tooth, rounding: float = 0.0, chamfer: float = 0.0) -> TipEdge:
    """Return where the usable flank of a tooth ends.

    Parameters
    ----------
    rounding, chamfer : float
        Radius of a rounded edge, height of a chamfer, mm; one of them at most.

    Raises
    ------
    GeometryError
        When the edge takes more than the flank or half of the tip land has room for.
    """
    if rounding > 0.0:
        return TipEdge(_rounded(tooth, rounding), rounding)
    if chamfer > 0.0:
        return TipEdge(_chamfered(tooth, chamfer))
    return TipEdge(tooth.tip_roll_angle)


def _rounded(tooth: Tooth, radius: float) -> float:
    base, centre = tooth.base_radius, tooth.tip_radius - radius
    place = f"tip_rounding_mm = {radius:g}"
    if centre / base <= 1.0:
        raise GeometryError(f"{place}: more than the flank's height above the base circle: lower it")
    along = math.copysign(math.sqrt(centre**2 - base**2), base)
    roll = (radius + along) / base
    _refuse_short_flank(tooth, roll, place)
    if base * (tooth.base_half_angle - roll + math.atan(along / base)) < 0.0:  # beyond the middle of the tooth
        raise GeometryError(f"{place}: takes more than half of the tip land of {_tip_land(tooth):.4g} mm: lower it")
    return roll


def _chamfered(tooth: Tooth, height: float) -> float:
    place = f"tip_chamfer_mm = {height:g}"
    roll = tooth.roll_angle_at(tooth.tip_radius - min(height, abs(tooth.tip_radius)))
    _refuse_short_flank(tooth, roll, place)
    if height > 0.5 * _tip_land(tooth):
        raise GeometryError(f"{place}: takes more than half of the tip land of {_tip_land(tooth):.4g} mm: lower it")
    return roll


def _refuse_short_flank(tooth: Tooth, roll: float, place: str) -> None:
    if tooth.base_radius * (roll - tooth.form_roll_angle) <= 0.0:
        allowed = tooth.tip_radius - tooth.base_radius * math.hypot(1.0, tooth.form_roll_angle)
        raise GeometryError(f"{place}: leaves nothing of the flank, which is {allowed:.4g} mm high: lower it")


def _tip_land(tooth: Tooth) -> float:
    return 2.0 * tooth.tip_radius * tooth.half_thickness_angle(tooth.tip_roll_angle)
