"""Roller bearings by their inner geometry, laminae and loads of ISO/TS 16281:2008; rings as in `rolling_bearing`.

Rollers are cut into laminae, each pressed by

    delta = u_r cos(alpha) + u_a sin(alpha) - s / 2 cos(alpha) - 2 P,    q = c_s delta^(10/9)

with P the drop of the roller's profile. A lamina at p along its roller is at x = p cos(alpha), R = D_pw / 2 - p
sin(alpha): tilted, it moves along the radius too.

*Tapered* rollers have the normal of the outer raceway at both: what their cone angle leaves, some hundredths of the
load, presses them on the rib of the inner ring; that force and its friction are left out.

*Spherical* roller bearings have barrel rollers on a sphere, on which they roll until all their laminae are pressed
alike: the normals of all meet in its middle.

ISO 76:2006 rates a bearing at rest by the pressure of its most loaded element: at C_0 it is 4,000 MPa of rollers.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np

from pmor.body.bearing_estimate import LINE, LINE_LENGTH_EXPONENT, LINE_STIFFNESS
from pmor.body.bearing_rows import DOF, SIGNS, BearingRows, Rating, azimuths, directions, preload
from pmor.body.rolling_bearing import (
    BearingState,
    Clearance,
    ContactAngle,
    Elements,
    counted,
    power_law,
    static_safety,
)
from pmor.core.arrays import FloatArray
from pmor.core.ranges import Length, Range

LAMINAE = 41
# ISO/TS 16281, 5.4: logarithmic profile of cylindrical and tapered rollers.
PROFILE = 0.00035
# ISO/TS 16281 has its stiffness of rollers for steel; its modulus, MPa.
STEEL_MODULUS, STEEL_RATIO = 207e3, 0.3
# ISO 76:2006: pressure at which the static load rating is reached, MPa.
ROLLER_PRESSURE = 4000.0


@dataclass(frozen=True)
class Rollers:
    """What all bearings with rollers of steel have; `RollerBearing` says what the keys are."""

    rollers: Elements
    roller_diameter_mm: Length
    effective_length_mm: Length
    pitch_diameter_mm: Length
    clearance_mm: Clearance = 0.0
    contact_angle_deg: ContactAngle = 0.0
    laminae: Annotated[int, Range(1, 1001)] = LAMINAE
    first_roller_deg: Annotated[float, Range(-360.0, 360.0, "deg")] = 0.0

    @property
    def words(self) -> str:
        """What it is."""
        return f"{counted(self.row_count, self.rollers)} rollers, ISO/TS 16281"

    @property
    def row_count(self) -> int:
        """Rows of rollers."""
        raise NotImplementedError

    @property
    def lines(self) -> tuple[FloatArray, FloatArray]:
        """Rows that take a displacement of the inner ring to the approach of each lamina, and their gaps."""
        raise NotImplementedError

    @property
    def count(self) -> int:
        """Rollers in a row."""
        return self.rollers

    @property
    def ratio(self) -> float:
        """gamma."""
        return self.roller_diameter_mm * math.cos(math.radians(self.contact_angle_deg)) / self.pitch_diameter_mm

    @property
    def azimuth(self) -> FloatArray:
        """Of all rollers, (r, n), rad."""
        return azimuths(self.rollers, self.row_count, self.first_roller_deg)

    @property
    def element_mm(self) -> tuple[float, float]:
        """Diameter and length of a rolling element."""
        return self.roller_diameter_mm, self.effective_length_mm

    @property
    def stiffness_constant(self) -> float:
        """c_L, N/mm^(10/9) (ISO/TS 16281, eq. 19)."""
        return float(LINE_STIFFNESS * self.effective_length_mm**LINE_LENGTH_EXPONENT)

    @property
    def lamina_places(self) -> FloatArray:
        """Of the laminae along a roller, from its middle, (m,), mm."""
        return ((np.arange(self.laminae) + 0.5) / self.laminae - 0.5) * self.effective_length_mm

    def pressure(self, line_load: float) -> float:
        """Return the pressure of a roller on the inner raceway, the larger one, MPa, by its line load, N/mm (Hertz)."""
        radius = 0.5 * self.roller_diameter_mm * (1.0 - self.ratio)
        modulus = 0.5 * STEEL_MODULUS / (1.0 - STEEL_RATIO**2)
        return math.sqrt(line_load * modulus / (math.pi * radius))

    def state(self, displacement: FloatArray) -> BearingState:
        """Return force and stiffness under a displacement, shape (5,), mm and rad."""
        normal, gap = self.lines
        approach = normal @ displacement - gap
        load = np.zeros_like(approach)
        pressed = np.flatnonzero(approach > 0.0)
        carrying = normal[pressed]
        load[pressed], slope = power_law(self.stiffness_constant / self.laminae, approach[pressed], LINE)
        pressure = self.pressure(float(load.max()) * self.laminae / self.effective_length_mm)
        by_row = (load.reshape(self.row_count, 1, -1) @ normal.reshape(self.row_count, -1, DOF))[:, 0]
        return BearingState(
            by_row.sum(axis=0), (carrying.T * slope) @ carrying,
            load.reshape(self.row_count, self.rollers, self.laminae), by_row, pressure,
            static_safety(ROLLER_PRESSURE, pressure, 2),
        )  # fmt: skip


@dataclass(frozen=True)
class RollerBearing(Rollers, BearingRows):
    """Cylindrical, needle or tapered roller bearing of steel, its rollers cut into laminae.

    Parameters
    ----------
    rollers : int
        Number of rollers in a row.
    roller_diameter_mm : float
        Diameter of a roller.
    effective_length_mm : float
        Effective length of a roller.
    pitch_diameter_mm : float
        Diameter of the circle of the centres of the rolling elements.
    clearance_mm : float
        Radial internal clearance s, from one side to the other; negative is preload.
    contact_angle_deg : float
        0 of a cylindrical roller bearing, which takes no thrust; of a tapered one that of the outer raceway: positive
        takes thrust of the inner ring along +x, negative along -x.
    laminae : int
        Odd, so that one is in the middle.
    logarithmic_profile : bool
        Whether rollers have the profile of ISO/TS 16281; otherwise they are cylindrical.
    first_roller_deg : float
        Azimuth of a roller, from y towards z; each further row stands half a pitch on.
    rows : int
        Number of rows of rolling elements.
    row_spacing_mm : float
        Distance from the middle of one row to that of the next; `at_mm` is the middle of all.
    arrangement : {"tandem", "back_to_back", "face_to_face"}
        All rows take thrust along the same way, or two of them each one way: back to back (O) the normals of both
        meet the axis outside of the rows, face to face (X) between them.
    axial_preload_mm : float
        Way by which the inner ring of each row is pushed into the outer one along the axis, beyond where the clearance
        has it; negative leaves play. It needs a contact angle, whose sign says which way.
    axial_preload_N : float
        The force that pushes it there, in place of the way: what a row carries where shaft and housing do not move.
        It uses up the clearance.
    dynamic_rating_N : float or None
        C of the whole bearing, for its life; None is by its geometry, ISO 281.
    """

    logarithmic_profile: bool = True

    @property
    def row_count(self) -> int:
        """Rows of rollers."""
        return self.rows

    @cached_property
    def pushed(self) -> float:
        """Axial preload of a row along +x, mm."""
        return preload(self)

    @cached_property
    def lines(self) -> tuple[FloatArray, FloatArray]:
        """Rows that take a displacement of the inner ring to the approach of each lamina, and their gaps."""
        angle, place = math.radians(self.contact_angle_deg), self.lamina_places
        drop = logarithmic_drop(self) if self.logarithmic_profile else np.zeros_like(place)
        along_axis = np.tile(place, self.rollers) * math.cos(angle)
        # The line of laminae is perpendicular to the normal: of positive angles it nears the axis towards +x.
        radius = 0.5 * self.pitch_diameter_mm - np.tile(place, self.rollers) * math.sin(angle)
        normals = []
        for azimuth, turn in zip(self.azimuth, self.row_maps, strict=True):
            psi = np.repeat(azimuth, self.laminae)
            radial, axial = directions(psi, radius)
            # A tilted ring moves a lamina off the middle plane along the radius too.
            radial[:, 3], radial[:, 4] = -along_axis * np.sin(psi), along_axis * np.cos(psi)
            normals.append((math.cos(angle) * radial + math.sin(angle) * axial) @ turn)
        normal = np.concatenate(normals)
        gap = 0.5 * self.clearance_mm * math.cos(angle) - self.pushed * math.sin(angle)
        return normal, gap + 2.0 * np.tile(drop, self.rows * self.rollers)


@dataclass(frozen=True)
class SphericalRollerBearing(Rollers):
    """Spherical roller bearing of steel: barrel rollers on an outer raceway that is a sphere about `at_mm`.

    Parameters
    ----------
    rollers : int
        Number of rollers in a row.
    roller_diameter_mm : float
        Diameter of a roller.
    effective_length_mm : float
        Effective length of a roller.
    pitch_diameter_mm : float
        Diameter of the circle of the centres of the rolling elements.
    clearance_mm : float
        Radial internal clearance s, from one side to the other; negative is preload.
    contact_angle_deg : float
        Contact angle of the rows, each away from the other one; of a single row as of other bearings, 0 of barrel
        roller bearings.
    laminae : int
        Odd, so that one is in the middle.
    first_roller_deg : float
        Azimuth of a roller, from y towards z; the further row stands half a pitch on.
    rows : int
        1 or 2: their middles are where both contact angles meet the sphere.
    profile_radius_mm : float or None
        Radius of a barrel along its axis, both raceways with the radius of the sphere; None is the logarithmic profile
        of ISO/TS 16281 against it.
    dynamic_rating_N : float or None
        C of the whole bearing, for its life; None is by its geometry, ISO 281.
    """

    rows: Annotated[int, Range(1, 2)] = 2
    profile_radius_mm: Length | None = None
    dynamic_rating_N: Rating | None = None

    @property
    def row_count(self) -> int:
        """Rows of rollers."""
        return self.rows

    @property
    def row_signs(self) -> tuple[float, ...]:
        """Of each row in the order of x, -1 of one that is the image of the contact angle's."""
        return SIGNS["face_to_face"] if self.rows == 2 else (1.0,)

    @property
    def row_places(self) -> tuple[float, ...]:
        """Of each row along x, mm."""
        place = 0.5 * self.pitch_diameter_mm * math.tan(math.radians(self.contact_angle_deg))
        return tuple(sign * place for sign in self.row_signs)

    @property
    def sphere_mm(self) -> float:
        """Radius of the outer raceway."""
        reach = 0.5 * self.pitch_diameter_mm / math.cos(math.radians(self.contact_angle_deg))
        return reach + 0.5 * self.roller_diameter_mm

    @cached_property
    def lines(self) -> tuple[FloatArray, FloatArray]:
        """Rows that take a displacement of the inner ring to the approach of each lamina, and their gaps.

        Normals meet in the middle of the sphere. A roller rolls along it until its laminae are pressed alike: there is
        no moment about this middle, and a tilt about it presses none.
        """
        angle, place = math.radians(self.contact_angle_deg), self.lamina_places
        if self.profile_radius_mm is None:
            drop = logarithmic_drop(self)
        else:
            barrel, sphere = (radius - np.sqrt(radius**2 - place**2)
                              for radius in (self.profile_radius_mm, self.sphere_mm))  # fmt: skip
            drop = barrel - sphere
        normal = np.zeros((self.rows, self.rollers, DOF))
        normal[..., 0] = math.sin(angle) * np.array(self.row_signs)[:, None]
        normal[..., 1], normal[..., 2] = math.cos(angle) * np.cos(self.azimuth), math.cos(angle) * np.sin(self.azimuth)
        gap = 0.5 * self.clearance_mm * math.cos(angle)
        return (
            np.repeat(normal.reshape(-1, DOF), self.laminae, axis=0),
            gap + 2.0 * np.tile(drop, self.rows * self.rollers),
        )


def logarithmic_drop(rollers: Rollers) -> FloatArray:
    """Return the profile of ISO/TS 16281, 5.4, at the laminae of a roller, (m,), mm."""
    if rollers.laminae == 1:
        return np.zeros(1)
    along = 2.0 * rollers.lamina_places / rollers.effective_length_mm
    return np.asarray(-PROFILE * rollers.roller_diameter_mm * np.log1p(-(along**2)))
