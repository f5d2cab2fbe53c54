"""Roots of an internal gear's teeth: as a shaper cutter leaves them, or with an arc of a given radius.

Signs are those of ISO 21771: tooth number, radii and centre distance of an internal gear are negative, and shifts count
towards its tips, so that cutter and ring mesh by the formulas of `pmor.gear.pair`. Source of generation by a shaper:
Litvin & Fuentes, Gear Geometry and Applied Theory (2004), ch. 6 and 11; DIN 3960:1987. All is transverse: the rounding
of the cutter's tip is an arc in that section.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pmor.core.arrays import ComplexArray, FloatArray
from pmor.core.errors import GeometryError
from pmor.gear.involute import inverse_involute, involute_function

# Of the rounding of a cutter's tip, that are followed past the ring's tips.
ROUNDING_POINTS = 7


@dataclass(frozen=True)
class Shaper:
    """A shaper cutter: an external gear with rounded tips.

    Parameters
    ----------
    teeth : int
    addendum, profile_shift : float
        In normal modules.
    tip_radius : float
        Of the rounding between its flanks and its tip circle, mm.
    """

    teeth: int
    addendum: float = 1.25
    tip_radius: float = 0.0
    profile_shift: float = 0.0


@dataclass(frozen=True)
class RingRoot:
    """Root of an internal gear.

    Parameters
    ----------
    radius : float
        Of the root circle, negative, mm.
    form_roll_angle : float
        Where the involute ends, rad.
    lowest_roll_angle : float
        Below which the cutter, on its base circle, leaves no involute, rad; 0 without one.
    section : callable
        Points of the fillet for parameters from 0 at the involute to 1 at the root circle, shape (n, 2), mm.
    tips : callable
        Points of a cutter's tip rounding, in the frame of the ring's tooth, at so many positions over the angle in
        which it is within the ring's root circle: complex, shape (points, positions), mm; none without a cutter.
    """

    radius: float
    form_roll_angle: float
    lowest_roll_angle: float
    section: Callable[[FloatArray], FloatArray]
    tips: Callable[[int], ComplexArray]


@dataclass(frozen=True)
class RingBase:
    """What the root of an internal gear's tooth depends on.

    Parameters
    ----------
    teeth : int
        Negative.
    transverse_module, transverse_pressure_angle, base_radius, base_half_angle : float
        mm, rad; radius and angle negative.
    widening : float
        2 tan(normal pressure angle): by which a shift, in modules, widens teeth at the reference circle.
    shift : float
        Generating profile shift in normal modules.
    module : float
        Normal module, mm.
    """

    teeth: int
    transverse_module: float
    transverse_pressure_angle: float
    base_radius: float
    base_half_angle: float
    widening: float
    shift: float
    module: float


def arc_root(base: RingBase, root_radius: float, radius: float) -> RingRoot:
    """Return a root whose fillet is an arc that touches involute and root circle.

    Parameters
    ----------
    root_radius : float
        Negative, mm.
    radius : float
        Of the arc, mm.

    Raises
    ------
    GeometryError
        Where the tooth space has no room for two such arcs.
    """
    place = f"root_fillet_mm = {radius:g}"
    centre = root_radius + radius
    along = -math.sqrt(max(centre**2 - base.base_radius**2, 0.0))
    roll = (along - radius) / base.base_radius
    start = 0.5 * math.pi + base.base_half_angle - roll
    middle = start + math.atan(along / base.base_radius)
    if centre > base.base_radius or middle - 0.5 * math.pi < math.pi / base.teeth:
        raise GeometryError(f"{place}: the tooth space, 1/{-base.teeth} of a turn, has no room for it: lower it")
    at = centre * complex(math.cos(middle), math.sin(middle))

    def section(parameter: FloatArray) -> FloatArray:
        # From the involute's normal, which the base circle's tangent is, to the radius through the centre.
        turned = start + 0.5 * math.pi + np.pi + np.asarray(parameter) * (middle - start - 0.5 * math.pi)
        points = at + radius * np.exp(1j * turned)
        return np.stack([points.real, points.imag], axis=-1)

    return RingRoot(root_radius, roll, 0.0, section, lambda positions: np.zeros((0, positions), dtype=complex))


def shaped_root(base: RingBase, shaper: Shaper) -> RingRoot:
    """Return the root that a shaper cutter leaves: the envelope of its tip rounding, or the path of its corner.

    Raises
    ------
    GeometryError
        Where there is no such cutter, or it cannot cut such a ring.
    """
    place = f"shaper teeth = {shaper.teeth}"
    if shaper.teeth >= -base.teeth:
        raise GeometryError(f"{place}: a cutter needs fewer teeth than its ring, {-base.teeth}: lower it")
    alpha, rounding = base.transverse_pressure_angle, shaper.tip_radius
    half = (0.5 * math.pi + base.widening * shaper.profile_shift) / shaper.teeth + involute_function(alpha)
    base_radius = 0.5 * shaper.teeth * base.transverse_module * math.cos(alpha)
    tip = 0.5 * shaper.teeth * base.transverse_module + base.module * (shaper.addendum + shaper.profile_shift)
    if tip - rounding <= base_radius:
        raise GeometryError(f"shaper tip_radius_mm = {rounding:g}: the cutter's teeth have no room for it: lower it")
    along = math.sqrt((tip - rounding) ** 2 - base_radius**2)
    roll = (rounding + along) / base_radius
    centre_angle = half - roll + math.atan(along / base_radius)
    if centre_angle < 0.0:
        remedy = "lower it" if rounding > 0.0 else "lower shaper addendum or profile_shift"
        raise GeometryError(f"shaper tip_radius_mm = {rounding:g}: the cutter's teeth are pointed below it: {remedy}")
    teeth = shaper.teeth + base.teeth
    target = involute_function(alpha) + base.widening * (shaper.profile_shift + base.shift) / teeth
    if target <= 0.0:
        raise GeometryError(
            f"shaper profile_shift = {shaper.profile_shift:g}: with the ring's {base.shift:g} too large for {place}: "
            "lower it, or take fewer teeth"
        )
    working = inverse_involute(target)
    distance = (base_radius + base.base_radius) / math.cos(working)
    action_length, pitch = distance * math.sin(working), 1j * base_radius / math.cos(working)
    form = (action_length - roll * base_radius) / base.base_radius
    first, last = roll - half - working, -centre_angle
    if roll * base_radius - rounding <= base_radius * math.tan(working):
        raise GeometryError(
            f"shaper tip_radius_mm = {rounding:g}: the rounding reaches the pitch circle at which it cuts: lower it, "
            "or raise shaper addendum"
        )

    def from_ring(points: ComplexArray, turned: FloatArray) -> ComplexArray:
        ring_roll = (action_length - (turned + half + working) * base_radius) / base.base_radius
        return -(points - 1j * distance) * np.exp(-1j * (ring_roll - base.base_half_angle - working))

    def section(parameter: FloatArray) -> FloatArray:
        turned = first + np.asarray(parameter) * (last - first)
        centre = (tip - rounding) * np.exp(1j * (0.5 * math.pi + centre_angle + turned))
        # The common normal of cutter and ring passes through the pitch point.
        normal = (centre - pitch) / np.abs(centre - pitch)
        points = from_ring(centre + rounding * normal, turned)
        return np.stack([points.real, points.imag], axis=-1)

    def tips(positions: int) -> ComplexArray:
        turned = np.linspace(-math.pi, math.pi, 2 * positions)[positions // 2 : -positions // 2]
        outward = np.linspace(0.5 * math.pi + half - roll, centre_angle, ROUNDING_POINTS if rounding else 1)
        points = (tip - rounding) * np.exp(1j * centre_angle) + rounding * np.exp(1j * outward)
        return from_ring(1j * points[:, None] * np.exp(1j * turned), turned)

    return RingRoot(distance - tip, form, action_length / base.base_radius, section, tips)
