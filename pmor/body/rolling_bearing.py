"""Rolling bearings by their inner geometry, and those with balls: forces and stiffness of ISO/TS 16281:2008.

Rings are rigid. The inner ring moves by (x, y, z) and tilts by (about y, about z) against the outer one; x is the axis.
Each ball presses both rings together along one normal by the approach delta:

    delta = |(r, a)| - A,  r = A cos(alpha) - s / 2 + u_r,  a = A sin(alpha) + u_a,    Q = c_P delta^1.5

with u_r = y cos(psi) + z sin(psi) and u_a = x + R (theta_y sin(psi) - theta_z cos(psi)) at the azimuth psi, R the
radius of the point of contact, A the distance between the centres of curvature of both raceways, and s the radial
clearance. Loads are sums over all elements, and so is the tangent stiffness; both follow from one potential, so that
the tangent is symmetric. Centrifugal and gyroscopic loads are left out. Rollers: `pmor.body.roller_bearing`.

ISO 76:2006 rates a bearing at rest by the pressure of its most loaded element: at C_0 it is 4,200 MPa of balls, 4,000
MPa of rollers, which leave a permanent deformation of 1e-4 of their diameter. Loads go with the third power of the
pressure of balls, with its square of rollers; so does the static safety S_0 = C_0 / P_0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, NamedTuple, Protocol

import numpy as np

from pmor.body.bearing_rows import DOF as DOF
from pmor.body.bearing_rows import BearingRows, azimuths, directions, preload
from pmor.core.arrays import FloatArray
from pmor.core.ranges import Length, PoissonRatio, Range
from pmor.core.roots_and_minima import root

# Displacements across, and about an axis across.
RADIAL, TILT = np.eye(DOF)[1], np.eye(DOF)[3]
POINT = 1.5
# ISO 76:2006: pressure at which the static load rating is reached, MPa.
BALL_PRESSURE = 4200.0

Clearance = Annotated[float, Range(-0.2, 1.0, "mm")]
ContactAngle = Annotated[float, Range(-90.0, 90.0, "deg")]
Elements = Annotated[int, Range(3, 400)]
# Grooves that are closer to the ball than any that is made have ellipses of contact without bounds.
Osculation = Annotated[float, Range(0.501, 1.0)]


class BearingState(NamedTuple):
    """State of a bearing under a displacement of its inner ring: (x, y, z, about y, about z).

    Attributes
    ----------
    force : ndarray, shape (5,)
        On the inner ring that moves it so, N and N mm.
    stiffness : ndarray, shape (5, 5)
        Its derivative.
    lamina_force : ndarray, shape (r, n, m)
        Of each rolling element of each row, of rollers by their laminae, N.
    row_force : ndarray, shape (r, 5)
        Share of each row in `force`.
    pressure : float
        Largest contact pressure of any of them, on either ring, MPa.
    static_safety : float
        S_0; infinite without load.
    """

    force: FloatArray
    stiffness: FloatArray
    lamina_force: FloatArray
    row_force: FloatArray
    pressure: float
    static_safety: float

    @property
    def element_force(self) -> FloatArray:
        """Of each rolling element, N, row by row, (r n,)."""
        return np.asarray(self.lamina_force.sum(axis=2).ravel())


class PointContact(NamedTuple):
    """Contact of a ball with a raceway (Hertz).

    Attributes
    ----------
    axes : float
        chi: the longer axis of the ellipse of contact over the shorter one.
    curvature : float
        Sum of the curvatures, 1/mm.
    """

    axes: float
    curvature: float

    @property
    def compliance(self) -> float:
        """K(chi) (sum rho / (chi^2 E(chi)))^(1/3)."""
        return _first(self.axes) * (self.curvature / (self.axes**2 * _second(self.axes))) ** (1.0 / 3.0)

    def pressure(self, load: float, modulus: float) -> float:
        """Return the pressure in the middle of the ellipse, MPa; `modulus` is E / (1 - nu^2) of both bodies."""
        size = (3.0 * load / (modulus * self.curvature)) ** (1.0 / 3.0)
        second = _second(self.axes)
        longer = (2.0 * self.axes**2 * second / math.pi) ** (1.0 / 3.0) * size
        return 1.5 * load / (math.pi * longer**2 / self.axes) if load > 0.0 else 0.0


class RollingBearing(Protocol):
    """A bearing whose force is a function of the displacement of its inner ring."""

    def state(self, displacement: FloatArray) -> BearingState:
        """Return force and stiffness under a displacement, shape (5,), mm and rad."""


@dataclass(frozen=True)
class BallBearing(BearingRows):
    """Deep-groove or angular-contact ball bearing of steel.

    Parameters
    ----------
    balls : int
        Number of balls in a row.
    ball_diameter_mm : float
        Diameter of a ball.
    pitch_diameter_mm : float
        Diameter of the circle of the centres of the rolling elements.
    clearance_mm : float
        Radial internal clearance s, from one side to the other; negative is preload.
    contact_angle_deg : float
        Nominal; positive takes thrust of the inner ring along +x, negative along -x, 0 both.
    inner_osculation : float
        Radius of the inner raceway's groove over the ball's diameter.
    outer_osculation : float
        Radius of the outer raceway's groove over the ball's diameter.
    youngs_modulus_GPa : float
        Young's modulus of balls and rings.
    poisson_ratio : float
        Poisson's ratio of balls and rings.
    first_ball_deg : float
        Azimuth of a ball, from y towards z; each further row stands half a pitch on.
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

    balls: Elements
    ball_diameter_mm: Length
    pitch_diameter_mm: Length
    clearance_mm: Clearance = 0.0
    contact_angle_deg: ContactAngle = 0.0
    inner_osculation: Osculation = 0.52
    outer_osculation: Osculation = 0.53
    youngs_modulus_GPa: Annotated[float, Range(1.0, 1000.0, "GPa")] = 207.0
    poisson_ratio: PoissonRatio = 0.3
    first_ball_deg: Annotated[float, Range(-360.0, 360.0, "deg")] = 0.0

    @property
    def words(self) -> str:
        """What it is."""
        return f"{counted(self.rows, self.balls)} balls, ISO/TS 16281"

    @property
    def count(self) -> int:
        """Balls in a row."""
        return self.balls

    @property
    def ratio(self) -> float:
        """gamma."""
        return self.ball_diameter_mm * math.cos(math.radians(self.contact_angle_deg)) / self.pitch_diameter_mm

    @property
    def azimuth(self) -> FloatArray:
        """Of all balls, (r, n), rad."""
        return azimuths(self.balls, self.rows, self.first_ball_deg)

    @property
    def element_mm(self) -> tuple[float, float]:
        """Diameter and length of a rolling element."""
        return self.ball_diameter_mm, self.ball_diameter_mm

    @cached_property
    def contacts(self) -> tuple[PointContact, PointContact]:
        """Contacts of a ball with the inner and the outer raceway."""
        gamma = self.ratio
        inner = _point_contact(self.ball_diameter_mm, gamma / (1.0 - gamma), self.inner_osculation)
        return inner, _point_contact(self.ball_diameter_mm, -gamma / (1.0 + gamma), self.outer_osculation)

    @property
    def modulus(self) -> float:
        """E / (1 - nu^2), MPa."""
        return 1e3 * self.youngs_modulus_GPa / (1.0 - self.poisson_ratio**2)

    @property
    def stiffness_constant(self) -> float:
        """c_P, N/mm^1.5 (ISO/TS 16281, eq. 12 and 13)."""
        return 1.48 * self.modulus * sum(contact.compliance for contact in self.contacts) ** -POINT

    def pressure(self, load: float) -> float:
        """Return the larger pressure of a ball's contacts with both raceways, MPa, under a load, N."""
        return max(contact.pressure(load, self.modulus) for contact in self.contacts)

    @cached_property
    def _directions(self) -> tuple[FloatArray, FloatArray]:
        """Rows that take a displacement of the inner ring to u_r and u_a of all balls, (r n, 5) each."""
        rise = (self.inner_osculation - 0.5) * self.ball_diameter_mm * math.cos(math.radians(self.contact_angle_deg))
        both = zip(self.azimuth, self.row_maps, strict=True)
        parts = [directions(azimuth, 0.5 * self.pitch_diameter_mm + rise) + (turn,) for azimuth, turn in both]
        radial, axial = (np.concatenate([part[way] @ part[2] for part in parts]) for way in (0, 1))
        return radial, axial

    @cached_property
    def pushed(self) -> float:
        """Axial preload of a row along +x, mm."""
        return preload(self)

    def state(self, displacement: FloatArray) -> BearingState:
        """Return force and stiffness under a displacement, shape (5,), mm and rad."""
        angle, diameter = math.radians(self.contact_angle_deg), self.ball_diameter_mm
        distance = (self.inner_osculation + self.outer_osculation - 1.0) * diameter
        radial, axial = self._directions
        r = distance * math.cos(angle) - 0.5 * self.clearance_mm + radial @ displacement
        a = distance * math.sin(angle) + self.pushed + axial @ displacement
        length = np.hypot(r, a)
        normal = (r[:, None] * radial + a[:, None] * axial) / length[:, None]
        load, slope = power_law(self.stiffness_constant, length - distance, POINT)
        turning = load / length
        stiffness = np.einsum("n,ni,nj->ij", slope - turning, normal, normal)
        for direction in (radial, axial):
            stiffness += np.einsum("n,ni,nj->ij", turning, direction, direction)
        pressure = self.pressure(float(load.max()))
        by_row = (load[:, None] * normal).reshape(self.rows, -1, DOF).sum(axis=1)
        return BearingState(
            load @ normal, stiffness, load.reshape(self.rows, -1, 1), by_row, pressure,
            static_safety(BALL_PRESSURE, pressure, 3),
        )  # fmt: skip


def power_law(constant: float, approach: FloatArray, exponent: float) -> tuple[FloatArray, FloatArray]:
    """Return loads and their derivatives by the approach; none where there is no contact."""
    pressed = np.maximum(approach, 0.0)
    return constant * pressed**exponent, constant * exponent * pressed ** (exponent - 1.0)


def counted(rows: int, count: int) -> str:
    """Return how many elements there are, in words."""
    return f"{rows} x {count}" if rows > 1 else str(count)


def static_safety(permitted: float, pressure: float, exponent: int) -> float:
    """Return S_0; infinite without load."""
    return float((permitted / pressure) ** exponent) if pressure > 0.0 else math.inf


def _point_contact(diameter: float, ratio: float, osculation: float) -> PointContact:
    """Return the contact of a ball with one raceway; `ratio` is its diameter over that of the raceway, signed."""
    groove = 0.5 / osculation
    total = 2.0 / diameter * (2.0 + ratio - groove)
    difference = (ratio + groove) / (2.0 + ratio - groove)
    axes = root(lambda chi: 1.0 - 2.0 / (chi**2 - 1.0) * (_first(chi) / _second(chi) - 1.0) - difference, 1.001, 1e3)
    return PointContact(float(axes), float(total))


def _first(chi: float) -> float:
    return _elliptic_integrals(chi)[0]


def _second(chi: float) -> float:
    return _elliptic_integrals(chi)[1]


def _elliptic_integrals(chi: float) -> tuple[float, float]:
    """Return K and E of the modulus sqrt(1 - 1 / chi^2), by the arithmetic-geometric mean (DLMF 19.8)."""
    larger, smaller, off, weight = 1.0, 1.0 / chi, 0.5 * (1.0 - chi**-2), 1.0
    while larger - smaller > 1e-8 * larger:  # the difference is squared in each step
        difference = 0.5 * (larger - smaller)
        larger, smaller = 0.5 * (larger + smaller), math.sqrt(larger * smaller)
        off += weight * difference**2
        weight *= 2.0
    first = math.pi / (larger + smaller)
    return first, first * (1.0 - off)
