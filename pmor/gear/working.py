"""Working geometry: a pair whose wheel's axis is off or tilted, checked as it stands.

In each transverse section the axes have a distance of their own (`pmor.gear.kernels.motion.section_offset`), and the
pair there is the one of that centre distance. Drawings without backlash have it from the allowances of tooth
thickness; where a case does not say them, backs of teeth may overlap by the least backlash that ISO/TR 10064-2
recommends, j_bn = 2/3 (0.06 + 0.0005 a + 0.03 m_n).
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import lru_cache

from pmor.core.errors import GeometryError
from pmor.gear.clearance import refuse_interference
from pmor.gear.condition import Misalignment
from pmor.gear.pair import GearPair, zero_backlash_centre_distance

# Working centre distances are checked to this step, mm: scattered ones share their checks.
STEP = 1e-3


class WorkingPair(GearPair):
    """A pair at its working centre distance, whose teeth may use up the allowances of their thickness."""

    @property
    def least_centre_distance(self) -> float:
        """Centre distance below which the teeth jam, mm."""
        if self.pinion.thickness_allowance or self.wheel.thickness_allowance:
            return super().least_centre_distance
        drawn = zero_backlash_centre_distance(self.pinion, self.wheel)
        recommended = 2.0 / 3.0 * (0.06 + 0.0005 * abs(drawn) + 0.03 * self.pinion.module)
        transverse = recommended / math.cos(self.base_helix_angle)
        return drawn - 0.5 * transverse / math.sin(math.acos(self.base_distance / drawn))


def refuse_working_geometry(pair: GearPair, misalignments: Iterable[Misalignment]) -> None:
    """Raise GeometryError where a pair does not mesh with its wheel's axis out of place.

    Parameters
    ----------
    pair : GearPair
        As drawn.
    """
    checked = dict[float, Misalignment]()
    for misalignment in misalignments:
        middle, *ends = (section_distance(pair, misalignment, z) for z in (0.0, *pair.common_face))
        checked |= {middle: misalignment, min(ends): misalignment}
        if not overlap_of_tips(pair, max(ends)) > 0.0:  # nan too
            raise GeometryError(
                f"{_place(misalignment)}: at a face the axes are {abs(max(ends)):.6g} mm apart, where tips do not "
                f"reach the mate's flank: {'raise' if pair.wheel.internal else 'lower'} it"
            )
    # Teeth jam and tips interfere at the shortest distance, contact is lost at the longest one.
    for distance in {min(checked), max(checked)} if checked else ():
        change = (distance - pair.centre_distance) / STEP
        reason = _reason(pair, math.floor(change) if change < 0.0 else math.ceil(change))
        if reason:
            raise GeometryError(f"{_place(checked[distance])}: at the working centre distance, {reason}")


def section_distance(pair: GearPair, misalignment: Misalignment, z: float) -> float:
    """Return the distance of the axes in the transverse section at z (mm), mm."""
    share = z / pair.face_width
    across = 1e-3 * misalignment.out_of_plane_um * share
    along = 1e-3 * (misalignment.centre_distance_um + misalignment.in_plane_um * share)
    return math.copysign(math.hypot(across, abs(pair.centre_distance) + along), pair.centre_distance)


def overlap_of_tips(pair: GearPair, distance: float) -> float:
    """Return by how much the tips at a centre distance overlap along the line of action, mm."""
    action_length = math.copysign(math.sqrt(max(distance**2 - pair.base_distance**2, 0.0)), distance)
    pinion, wheel = pair.tip_edges
    reached = pinion.roll_angle * pair.pinion.base_radius + wheel.roll_angle * pair.wheel.base_radius
    return reached - action_length


@lru_cache(maxsize=4096)
def _reason(pair: GearPair, steps: int) -> str:
    """Return why a pair does not mesh so many steps from its centre distance; empty where it does."""
    distance = pair.centre_distance + STEP * steps
    faces = pair.pinion_face, pair.wheel_face
    try:
        refuse_interference(WorkingPair(pair.pinion, pair.wheel, pair.face_width, distance, *faces, *pair.tip_edges))
    except GeometryError as error:
        return str(error)
    return ""


def _place(misalignment: Misalignment) -> str:
    values = {name: getattr(misalignment, name) for name in misalignment.__dataclass_fields__}
    return ", ".join(f"{name} = {value:g}" for name, value in values.items() if value)
