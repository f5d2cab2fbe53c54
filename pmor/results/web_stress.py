"""Stress on the webs of a pair over the load cycle: where, when, and how far it goes."""

from __future__ import annotations

from dataclasses import dataclass

from pmor.core.arrays import FloatArray
from pmor.core.shown import brief

#: parts of a web
FACES, EDGES = "web", "hole_edge"


@brief
@dataclass(frozen=True, eq=False)
class WebCycle:
    """Stress on the faces of a web, or at the edges of its holes, over the load cycle: D torques.

    Places are radius, mm, angle, degrees, and z, mm. Angles count from the line from the gear's centre to its mate's,
    counter-clockwise seen from +z, at pinion angle 0, as `first_deg` of holes does. Where nothing makes teeth differ
    they are places of one tooth's sector, and all sectors are alike.

    Attributes
    ----------
    von_mises_MPa : (D,)
        Largest of all points at all angles.
    phi_rad : (D,)
        Pinion angle at which it is.
    place : (D, 3)
        Where it is.
    range_MPa : (D,)
        Largest less least normal stress in one direction in the surface, largest over points and directions; NaN where
        the angles do not cover what repeats.
    most_MPa, least_MPa : (D,)
        Of this point and direction.
    range_place : (D, 3)
        Where it is.
    """

    von_mises_MPa: FloatArray
    phi_rad: FloatArray
    place: FloatArray
    range_MPa: FloatArray
    most_MPa: FloatArray
    least_MPa: FloatArray
    range_place: FloatArray


#: of one gear, by the parts that it has; none of gears without a web, or where it was not asked for
WebCycles = dict[str, WebCycle]
