"""Rolling bearings by their inner geometry: forces and stiffness of ISO/TS 16281:2008.

Rings are rigid. The inner ring moves by (x, y, z) and tilts by (about y, about z) against the outer one; x is the axis.
Each ball, and each lamina of a roller, presses both rings together along one normal by the approach delta:

    ball      delta = |(r, a)| - A,  r = A cos(alpha) - s / 2 + u_r,  a = A sin(alpha) + u_a,    Q = c_P delta^1.5
    lamina    delta = u_r cos(alpha) + u_a sin(alpha) - s / 2 cos(alpha) - 2 P,                  q = c_s delta^(10/9)

with u_r = y cos(psi) + z sin(psi) and u_a = x + R (theta_y sin(psi) - theta_z cos(psi)) at the azimuth psi, R the
radius of the point of contact, A the distance between the centres of curvature of both raceways, s the radial clearance
and P the drop of the roller's profile. A lamina at p along its roller is at x = p cos(alpha), R = D_pw / 2 - p
sin(alpha): tilted, it moves along the radius too. Loads are sums over all elements, and so is the tangent stiffness;
both follow from one potential, so that the tangent is symmetric. Centrifugal and gyroscopic loads are left out.

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
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

from pmor.body.bearing_estimate import LINE, LINE_LENGTH_EXPONENT, LINE_STIFFNESS
from pmor.core.arrays import FloatArray
from pmor.core.ranges import Length, PoissonRatio, Range

DOF = 5
# Displacements across, and about an axis across.
RADIAL, TILT = np.eye(DOF)[1], np.eye(DOF)[3]
LAMINAE = 41
POINT = 1.5
# ISO/TS 16281, 5.4: logarithmic profile of cylindrical and tapered rollers.
PROFILE = 0.00035
# ISO/TS 16281 has its stiffness of rollers for steel; its modulus, MPa.
STEEL_MODULUS, STEEL_RATIO = 207e3, 0.3
# ISO 76:2006: pressure at which the static load rating is reached, MPa.
BALL_PRESSURE, ROLLER_PRESSURE = 4200.0, 4000.0

Clearance = Annotated[float, Range(-0.2, 1.0, "mm")]
ContactAngle = Annotated[float, Range(-90.0, 90.0, "deg")]
Elements = Annotated[int, Range(3, 400)]
# Grooves that are closer to the ball than any that is made have ellipses of contact without bounds.
Osculation = Annotated[float, Range(0.501, 1.0)]
# Length of the slenderest needles that are made over their diameter, with some reserve (ISO 3096:1996 goes to 10).
SLENDEREST = 12.0
# By which elements of full bearings may overlap: their sizes are rounded.
ROUNDED = 1e-3


class BearingState(NamedTuple):
    """State of a bearing under a displacement of its inner ring: (x, y, z, about y, about z).

    Attributes
    ----------
    force : ndarray, shape (5,)
        On the inner ring that moves it so, N and N mm.
    stiffness : ndarray, shape (5, 5)
        Its derivative.
    element_force : ndarray, shape (n,)
        Of each rolling element, N.
    pressure : float
        Largest contact pressure of any of them, on either ring, MPa.
    static_safety : float
        S_0; infinite without load.
    """

    force: FloatArray
    stiffness: FloatArray
    element_force: FloatArray
    pressure: float
    static_safety: float


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
class BallBearing:
    """Deep-groove or angular-contact ball bearing of steel.

    Parameters
    ----------
    balls : int
        Their number.
    ball_diameter_mm, pitch_diameter_mm : float
        Of a ball, and of the circle of their centres.
    clearance_mm : float
        Radial clearance s; negative is preload.
    contact_angle_deg : float
        Nominal; positive takes thrust of the inner ring along +x, negative along -x, 0 both.
    inner_osculation, outer_osculation : float
        Radii of the raceways' grooves over the ball's diameter.
    youngs_modulus_GPa, poisson_ratio : float
        Of balls and rings.
    first_ball_deg : float
        Azimuth of a ball, from y towards z.
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
        return f"{self.balls} balls, ISO/TS 16281"

    @property
    def element_mm(self) -> tuple[float, float]:
        """Diameter and length of a rolling element."""
        return self.ball_diameter_mm, self.ball_diameter_mm

    @cached_property
    def contacts(self) -> tuple[PointContact, PointContact]:
        """Contacts of a ball with the inner and the outer raceway."""
        gamma = self.ball_diameter_mm * math.cos(math.radians(self.contact_angle_deg)) / self.pitch_diameter_mm
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

    def state(self, displacement: FloatArray) -> BearingState:
        """Return force and stiffness under a displacement, shape (5,), mm and rad."""
        angle, diameter = math.radians(self.contact_angle_deg), self.ball_diameter_mm
        distance = (self.inner_osculation + self.outer_osculation - 1.0) * diameter
        groove_radius = 0.5 * self.pitch_diameter_mm + (self.inner_osculation - 0.5) * diameter * math.cos(angle)
        azimuth = math.radians(self.first_ball_deg) + 2.0 * math.pi * np.arange(self.balls) / self.balls
        radial, axial = directions(azimuth, groove_radius)
        r = distance * math.cos(angle) - 0.5 * self.clearance_mm + radial @ displacement
        a = distance * math.sin(angle) + axial @ displacement
        length = np.hypot(r, a)
        normal = (r[:, None] * radial + a[:, None] * axial) / length[:, None]
        load, slope = power_law(self.stiffness_constant, length - distance, POINT)
        turning = load / length
        stiffness = np.einsum("n,ni,nj->ij", slope - turning, normal, normal)
        for direction in (radial, axial):
            stiffness += np.einsum("n,ni,nj->ij", turning, direction, direction)
        pressure = self.pressure(float(load.max()))
        return BearingState(load @ normal, stiffness, load, pressure, _safety(BALL_PRESSURE, pressure, 3))


@dataclass(frozen=True)
class RollerBearing:
    """Cylindrical or tapered roller bearing of steel, its rollers cut into laminae.

    Parameters
    ----------
    rollers : int
        Their number.
    roller_diameter_mm, effective_length_mm, pitch_diameter_mm : float
        Of a roller, and of the circle of their centres.
    clearance_mm : float
        Radial clearance s; negative is preload.
    contact_angle_deg : float
        0 of a cylindrical roller bearing, which takes no thrust; positive takes thrust of the inner ring along +x.
    laminae : int
        Odd, so that one is in the middle.
    logarithmic_profile : bool
        Of the rollers, after ISO/TS 16281; otherwise cylindrical.
    first_roller_deg : float
        Azimuth of a roller, from y towards z.
    """

    rollers: Elements
    roller_diameter_mm: Length
    effective_length_mm: Length
    pitch_diameter_mm: Length
    clearance_mm: Clearance = 0.0
    contact_angle_deg: ContactAngle = 0.0
    laminae: Annotated[int, Range(1, 1001)] = LAMINAE
    logarithmic_profile: bool = True
    first_roller_deg: Annotated[float, Range(-360.0, 360.0, "deg")] = 0.0

    @property
    def words(self) -> str:
        """What it is."""
        return f"{self.rollers} rollers, ISO/TS 16281"

    @property
    def element_mm(self) -> tuple[float, float]:
        """Diameter and length of a rolling element."""
        return self.roller_diameter_mm, self.effective_length_mm

    @property
    def stiffness_constant(self) -> float:
        """c_L, N/mm^(10/9) (ISO/TS 16281, eq. 19)."""
        return float(LINE_STIFFNESS * self.effective_length_mm**LINE_LENGTH_EXPONENT)

    def pressure(self, line_load: float) -> float:
        """Return the pressure of a roller on the inner raceway, the larger one, MPa, by its line load, N/mm (Hertz)."""
        gamma = self.roller_diameter_mm * math.cos(math.radians(self.contact_angle_deg)) / self.pitch_diameter_mm
        radius = 0.5 * self.roller_diameter_mm * (1.0 - gamma)
        modulus = 0.5 * STEEL_MODULUS / (1.0 - STEEL_RATIO**2)
        return math.sqrt(line_load * modulus / (math.pi * radius))

    @cached_property
    def laminae_of_all(self) -> tuple[FloatArray, FloatArray]:
        """Rows that take a displacement of the inner ring to the approach of each lamina, (n, 5), and their gaps."""
        angle = math.radians(self.contact_angle_deg)
        azimuth = math.radians(self.first_roller_deg) + 2.0 * math.pi * np.arange(self.rollers) / self.rollers
        place = ((np.arange(self.laminae) + 0.5) / self.laminae - 0.5) * self.effective_length_mm
        drop = np.zeros_like(place)
        if self.logarithmic_profile and self.laminae > 1:
            along = 2.0 * place / self.effective_length_mm
            drop = -PROFILE * self.roller_diameter_mm * np.log1p(-(along**2))
        psi = np.repeat(azimuth, self.laminae)
        along_axis = np.tile(place, self.rollers) * math.cos(angle)
        # The line of laminae is perpendicular to the normal: of positive angles it nears the axis towards +x.
        radius = 0.5 * self.pitch_diameter_mm - np.tile(place, self.rollers) * math.sin(angle)
        radial, axial = directions(psi, radius)
        # A tilted ring moves a lamina off the middle plane along the radius too.
        radial[:, 3], radial[:, 4] = -along_axis * np.sin(psi), along_axis * np.cos(psi)
        normal = math.cos(angle) * radial + math.sin(angle) * axial
        return normal, 0.5 * self.clearance_mm * math.cos(angle) + 2.0 * np.tile(drop, self.rollers)

    def state(self, displacement: FloatArray) -> BearingState:
        """Return force and stiffness under a displacement, shape (5,), mm and rad."""
        normal, gap = self.laminae_of_all
        approach = normal @ displacement - gap
        load = np.zeros_like(approach)
        pressed = np.flatnonzero(approach > 0.0)
        carrying = normal[pressed]
        load[pressed], slope = power_law(self.stiffness_constant / self.laminae, approach[pressed], LINE)
        pressure = self.pressure(float(load.max()) * self.laminae / self.effective_length_mm)
        return BearingState(
            load @ normal, (carrying.T * slope) @ carrying, load.reshape(self.rollers, -1).sum(axis=1), pressure,
            _safety(ROLLER_PRESSURE, pressure, 2),
        )  # fmt: skip


def impossible(bearing: BallBearing | RollerBearing) -> tuple[str, str] | None:
    """Return keys that no bearing has together, with their values, and the rule; None of a possible bearing."""
    pitch, angle = bearing.pitch_diameter_mm, math.radians(bearing.contact_angle_deg)
    if isinstance(bearing, BallBearing):
        name, count, diameter, length = "ball", bearing.balls, bearing.ball_diameter_mm, 0.0
    else:
        name, count, diameter = "roller", bearing.rollers, bearing.roller_diameter_mm
        length = bearing.effective_length_mm
    room = pitch * math.sin(math.pi / count)
    if diameter > (1.0 + ROUNDED) * room:
        keys = f"{name}s = {count}, {name}_diameter_mm = {diameter:g}, pitch_diameter_mm = {pitch:g}"
        return keys, f"the {name}s overlap: so many have room on that circle up to {room:.4g} mm; correct one of them"
    if length > SLENDEREST * diameter:
        rule = f"must be at most {SLENDEREST:g} times roller_diameter_mm = {diameter:g}: correct one of them"
        return f"effective_length_mm = {length:g}", rule
    if length * abs(math.sin(angle)) + diameter * math.cos(angle) >= pitch:
        rule = f"rollers reach the axis inside of pitch_diameter_mm = {pitch:g}: correct one of them"
        return f"effective_length_mm = {length:g}, contact_angle_deg = {bearing.contact_angle_deg:g}", rule
    return None


def directions(azimuth: FloatArray, radius: FloatArray | float) -> tuple[FloatArray, FloatArray]:
    """Return the rows that take a displacement of the inner ring to u_r and u_a at some azimuths, shape (n, 5) each."""
    radial, axial = np.zeros((2, len(azimuth), DOF))
    radial[:, 1], radial[:, 2] = np.cos(azimuth), np.sin(azimuth)
    axial[:, 0] = 1.0
    axial[:, 3], axial[:, 4] = radius * np.sin(azimuth), -radius * np.cos(azimuth)
    return radial, axial


def power_law(constant: float, approach: FloatArray, exponent: float) -> tuple[FloatArray, FloatArray]:
    """Return loads and their derivatives by the approach; none where there is no contact."""
    pressed = np.maximum(approach, 0.0)
    return constant * pressed**exponent, constant * exponent * pressed ** (exponent - 1.0)


def _safety(permitted: float, pressure: float, exponent: int) -> float:
    return float((permitted / pressure) ** exponent) if pressure > 0.0 else math.inf


def _point_contact(diameter: float, ratio: float, osculation: float) -> PointContact:
    """Return the contact of a ball with one raceway; `ratio` is its diameter over that of the raceway, signed."""
    groove = 0.5 / osculation
    total = 2.0 / diameter * (2.0 + ratio - groove)
    difference = (ratio + groove) / (2.0 + ratio - groove)
    axes = brentq(lambda chi: 1.0 - 2.0 / (chi**2 - 1.0) * (_first(chi) / _second(chi) - 1.0) - difference, 1.001, 1e3)
    return PointContact(float(axes), float(total))


def _first(chi: float) -> float:
    return float(ellipk(1.0 - chi**-2))


def _second(chi: float) -> float:
    return float(ellipe(1.0 - chi**-2))
