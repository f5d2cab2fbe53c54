"""Rows of rolling elements in one bearing: where they stand, which way each takes thrust, how they are preloaded.

A row at p along the axis has the displacement of the inner ring there; of rows that take thrust along -x the image in
the middle plane is solved, x to -x. Rows are half a pitch of their elements apart around the axis.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.ranges import Range
from pmor.core.roots_and_minima import root

if TYPE_CHECKING:
    from pmor.body.roller_bearing import RollerBearing
    from pmor.body.rolling_bearing import BallBearing

DOF = 5
# Along x, y, z, about y, about z: what a mirror across the axis does to them.
MIRROR = np.array([-1.0, 1.0, 1.0, -1.0, -1.0])
# Which way the rows take thrust, in the order of x.
SIGNS = {"tandem": (1.0, 1.0), "back_to_back": (1.0, -1.0), "face_to_face": (-1.0, 1.0)}

Rating = Annotated[float, Range(1.0, 1e10, "N")]


@dataclass(frozen=True, kw_only=True)
class BearingRows:
    """Rows of one bearing.

    Parameters
    ----------
    rows : int
        Number of rows of rolling elements.
    row_spacing_mm : float
        Distance from the middle of one row to that of the next; `at_mm` is the middle of all.
    arrangement : {"tandem", "back_to_back", "face_to_face"}
        All rows take thrust along the same way, or two of them each one way: back to back (O) the normals of both
        meet the axis outside of the rows, face to face (X) between them.
    axial_preload_mm : float
        Way by which the inner ring of each row is pushed into the outer one along the axis, beyond where the other keys
        have it; negative leaves play. It needs a contact angle, whose sign says which way.
    axial_preload_N : float
        The force that pushes it there, in place of the way: that which a row carries where shaft and housing do not
        move. Clearance is used up by it.
    dynamic_rating_N : float or None
        C of the whole bearing, ISO 281; None is by its geometry.
    """

    rows: Annotated[int, Range(1, 8)] = 1
    row_spacing_mm: Annotated[float, Range(0.0, 1e4, "mm")] = 0.0
    arrangement: Literal["tandem", "back_to_back", "face_to_face"] = "tandem"
    axial_preload_mm: Annotated[float, Range(-5.0, 1.0, "mm")] = 0.0
    axial_preload_N: Annotated[float, Range(0.0, 1e9, "N")] = 0.0
    dynamic_rating_N: Rating | None = None

    @property
    def preloaded(self) -> bool:
        """Whether rows are preloaded along the axis, or have play there."""
        return bool(self.axial_preload_mm or self.axial_preload_N)

    @property
    def row_signs(self) -> tuple[float, ...]:
        """Of each row in the order of x, -1 of one that is the image of the contact angle's."""
        return (1.0,) * self.rows if self.arrangement == "tandem" else SIGNS[self.arrangement]

    @property
    def row_places(self) -> tuple[float, ...]:
        """Of each row along x, mm."""
        return tuple(self.row_spacing_mm * (row - 0.5 * (self.rows - 1)) for row in range(self.rows))

    @cached_property
    def row_maps(self) -> FloatArray:
        """What takes a displacement of the inner ring to that of each row, or of its image, (r, 5, 5)."""
        maps = np.tile(np.eye(DOF), (self.rows, 1, 1))
        places = np.array(self.row_places)
        maps[:, 1, 4], maps[:, 2, 3] = places, -places
        image = np.where(np.array(self.row_signs)[:, None] < 0.0, MIRROR, 1.0)
        return np.asarray(image[:, :, None] * maps)


def azimuths(count: int, rows: int, first_deg: float) -> FloatArray:
    """Return where all elements of rows of so many stand, from y towards z, (r, n), rad."""
    pitch = 2.0 * math.pi / count
    return math.radians(first_deg) + pitch * (np.arange(count) + 0.5 * np.arange(rows)[:, None])


def directions(azimuth: FloatArray, radius: FloatArray | float) -> tuple[FloatArray, FloatArray]:
    """Return the rows that take a displacement of the inner ring to u_r and u_a at some azimuths, shape (n, 5) each."""
    radial, axial = np.zeros((2, len(azimuth), DOF))
    radial[:, 1], radial[:, 2] = np.cos(azimuth), np.sin(azimuth)
    axial[:, 0] = 1.0
    axial[:, 3], axial[:, 4] = radius * np.sin(azimuth), -radius * np.cos(azimuth)
    return radial, axial


def preload(bearing: BallBearing | RollerBearing) -> float:
    """Return by how much the inner ring of a row is pushed along +x, mm: against its contact angle's thrust."""
    way = math.copysign(1.0, bearing.contact_angle_deg)
    if not bearing.axial_preload_N or not bearing.contact_angle_deg:
        return way * bearing.axial_preload_mm

    def pushed(amount: float) -> float:
        row = replace(bearing, rows=1, arrangement="tandem", axial_preload_N=0.0, axial_preload_mm=amount)
        return way * float(row.state(np.zeros(DOF)).force[0]) - bearing.axial_preload_N

    least, most = -1e-3, 1e-3
    while pushed(least) > 0.0:
        least *= 2.0
    while pushed(most) < 0.0:
        most *= 2.0
    return way * root(pushed, least, most, 1e-13)
