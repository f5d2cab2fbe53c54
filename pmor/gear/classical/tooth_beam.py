"""A spur gear tooth as a cantilever of varying section, the domain of the classical deflection formulas.

The tooth stands on the +y axis of its own frame, the gear's axis at the origin. ``y`` is measured along the tooth's
centre line from the gear's axis, ``s(y)`` is the tooth's half thickness there: the involute above, below it the
trochoid which the rounded tip of the generating rack leaves. Lengths in mm, angles in rad, transverse section.

The module deliberately does not use the finite-element geometry: the classical results are printed beside the finite
elements as an independent check, so they should not share a mistake with them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class ToothBeam:
    """Outline of one tooth for beam formulas.

    Attributes
    ----------
    y_mm, half_thickness_mm : (n,) arrays
        Outline from the root circle (first point) to the tip circle (last point); ``y_mm`` ascends.
    start_radius_mm : float
        Where the involute begins, that is where it meets the root trochoid.
    half_angle_at_base_rad : float
        Half the angle that the tooth subtends on its base circle (of the involute, even if undercut).
    root_half_angle_rad : float
        Half the angle that the tooth subtends on its root circle (theta_f of Sainsot, Velex and Duverger).
    """

    y_mm: FloatArray
    half_thickness_mm: FloatArray
    base_radius_mm: float
    root_radius_mm: float
    tip_radius_mm: float
    start_radius_mm: float
    half_angle_at_base_rad: float
    root_half_angle_rad: float


@dataclass(frozen=True)
class ToothLoad:
    """Where and how the flank normal force acts at given contact radii; every array is (m,).

    Attributes
    ----------
    angle_rad
        Between the force and the normal of the tooth's centre line (alpha_m, alpha').
    y_mm, half_thickness_mm
        Point of contact in the tooth's frame.
    y_centre_line_mm
        Where the line of action cuts the tooth's centre line, from the gear's axis: base radius / cos(angle).
    """

    angle_rad: FloatArray
    y_mm: FloatArray
    half_thickness_mm: FloatArray
    y_centre_line_mm: FloatArray


def involute_function(angle_rad: ArrayLike) -> FloatArray:
    """inv(alpha) = tan(alpha) - alpha."""
    angle = np.asarray(angle_rad, dtype=float)
    return np.asarray(np.tan(angle) - angle)


def tooth_beam(
    z: int,
    module_mm: float,
    pressure_angle_rad: float,
    profile_shift: float = 0.0,
    addendum: float = 1.0,
    dedendum: float = 1.25,
    rack_tip_radius: float = 0.38,
    n_points: int = 400,
) -> ToothBeam:
    """Outline of a rack-generated spur tooth (nominal thickness, no backlash allowance).

    Parameters
    ----------
    z : int
        Number of teeth.
    module_mm, pressure_angle_rad : float
        Of the basic rack, in the transverse section.
    profile_shift, addendum, dedendum, rack_tip_radius : float
        In modules.
    n_points : int
        Points on the trochoid and, again, on the involute.

    Raises
    ------
    ValueError
        When the rack's tip radius does not fit between its flanks, or the tip is pointed.
    """
    pitch_radius = 0.5 * z * module_mm
    base_radius = pitch_radius * np.cos(pressure_angle_rad)
    tip_radius = pitch_radius + module_mm * (addendum + profile_shift)
    half_angle_at_base = float(
        np.pi / (2 * z) + 2 * profile_shift * np.tan(pressure_angle_rad) / z + involute_function(pressure_angle_rad)
    )

    def involute_half_angle(radius: FloatArray) -> FloatArray:
        return half_angle_at_base - involute_function(np.arccos(np.minimum(base_radius / radius, 1.0)))

    if involute_half_angle(np.array([tip_radius]))[0] <= 0:
        raise ValueError(f"the tooth tip is pointed below the tip circle of radius {tip_radius:.4g} mm")
    root_r, root_angle = _root_trochoid(
        z, module_mm, pressure_angle_rad, profile_shift, dedendum, rack_tip_radius, n_points
    )
    if _is_undercut(z, pressure_angle_rad, profile_shift, dedendum, rack_tip_radius):
        # The trochoid dips into the tooth and comes out again through the involute: keep it up to that crossing.
        cuts = (root_r >= base_radius) & (root_angle < involute_half_angle(np.maximum(root_r, base_radius)))
        keep = root_r <= (root_r[cuts].max() if cuts.any() else base_radius)
        root_r, root_angle = root_r[keep], root_angle[keep]
    start_radius = max(float(root_r[-1]), base_radius)
    # Equal steps of roll angle: the involute's natural parameter, dense near the base circle where it curves most.
    first, last = np.sqrt((np.array([start_radius, tip_radius]) / base_radius) ** 2 - 1.0)
    roll = np.linspace(first, last, n_points)[1:]
    flank_r = base_radius * np.sqrt(1.0 + roll**2)
    radius = np.concatenate([root_r, flank_r])
    half_angle = np.concatenate([root_angle, involute_half_angle(flank_r)])
    return ToothBeam(
        y_mm=radius * np.cos(half_angle),
        half_thickness_mm=radius * np.sin(half_angle),
        base_radius_mm=float(base_radius),
        root_radius_mm=float(root_r[0]),
        tip_radius_mm=float(tip_radius),
        start_radius_mm=start_radius,
        half_angle_at_base_rad=half_angle_at_base,
        root_half_angle_rad=float(half_angle[0]),
    )


def tooth_load(beam: ToothBeam, radius_mm: ArrayLike) -> ToothLoad:
    """Line of action of a flank normal force at contact radii ``radius_mm`` (m,).

    Raises
    ------
    ValueError
        For a radius outside the involute part of the tooth.
    """
    radius = np.atleast_1d(np.asarray(radius_mm, dtype=float))
    # The contact circles come out of square roots: allow them their rounding error, no more.
    slack = 1e-9 * beam.tip_radius_mm
    if radius.min() < beam.start_radius_mm - slack or radius.max() > beam.tip_radius_mm + slack:
        raise ValueError(
            f"contact at radius {radius.min():.4f} to {radius.max():.4f} mm leaves the involute, "
            f"which reaches from {beam.start_radius_mm:.4f} to {beam.tip_radius_mm:.4f} mm"
        )
    local_angle = np.arccos(np.minimum(beam.base_radius_mm / radius, 1.0))
    half_angle = beam.half_angle_at_base_rad - involute_function(local_angle)
    angle = local_angle - half_angle
    return ToothLoad(
        angle_rad=angle,
        y_mm=radius * np.cos(half_angle),
        half_thickness_mm=radius * np.sin(half_angle),
        y_centre_line_mm=beam.base_radius_mm / np.cos(angle),
    )


def beam_integrals(beam: ToothBeam, lever_mm: FloatArray, upper_mm: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The two section integrals that all beam formulas need, from the root circle up to ``upper_mm``.

    With d = 2 s the tooth thickness and y_l the point where the line of action cuts the centre line (``lever_mm``):

        bending = int (y_l - y)^2 / d^3 dy,        shear and compression = int dy / d        (both dimensionless)

    Parameters
    ----------
    lever_mm, upper_mm : (m,) arrays
        y_l and the upper limit, both from the gear's axis.
    """
    y0 = beam.y_mm[0]
    y = beam.y_mm - y0
    thickness = 2.0 * beam.half_thickness_mm
    upper = upper_mm - y0
    moments = [np.interp(upper, y, _running_integral(y, y**k / thickness**3)) for k in range(3)]
    lever = lever_mm - y0
    bending = lever**2 * moments[0] - 2.0 * lever * moments[1] + moments[2]
    return bending, np.interp(upper, y, _running_integral(y, 1.0 / thickness))


def _running_integral(x: FloatArray, f: FloatArray) -> FloatArray:
    """Trapezoidal integral of f over x, from the first point to each point."""
    return np.concatenate([[0.0], np.cumsum(0.5 * (f[1:] + f[:-1]) * np.diff(x))])


def _is_undercut(z: int, alpha: float, profile_shift: float, dedendum: float, rack_tip_radius: float) -> bool:
    """Does the straight part of the rack's flank reach below the interference point of the line of action?"""
    straight_depth = dedendum - rack_tip_radius * (1.0 - np.sin(alpha)) - profile_shift
    return bool(straight_depth > 0.5 * z * np.sin(alpha) ** 2)


def _root_trochoid(
    z: int, module: float, alpha: float, profile_shift: float, dedendum: float, rack_tip_radius: float, n_points: int
) -> tuple[FloatArray, FloatArray]:
    """Radius and half angle (n_points,) of the root fillet, from the root circle upwards.

    The rack's tip rounding has its centre C; the common normal of rack and gear always passes through the pitch
    point P, so the point being cut lies on the line P C, one tip radius beyond C. Rolling back turns it into
    the gear's frame.
    """
    pitch_radius = 0.5 * z * module
    tip = rack_tip_radius * module
    below_datum = dedendum * module - tip
    centre_x = np.pi * module / 4 + below_datum * np.tan(alpha) + tip / np.cos(alpha)
    if centre_x > np.pi * module / 2 * (1 + 1e-9):
        raise ValueError(
            f"rack tip radius {rack_tip_radius:g} modules does not fit between the rack's flanks: "
            "reduce it or the dedendum"
        )
    below_pitch = below_datum - profile_shift * module
    if abs(below_pitch) < 1e-9 * module:  # C on the pitch line: the direction P C would be undefined
        below_pitch = 1e-9 * module
    # Offset of C from P along the rack: from straight below P (root circle) to the normal of the straight flank.
    offset = np.linspace(0.0, -below_pitch / np.tan(alpha), n_points)
    distance = np.hypot(offset, below_pitch)
    side = np.sign(below_pitch)
    cut_x = offset * (1.0 + side * tip / distance)
    cut_y = pitch_radius - below_pitch * (1.0 + side * tip / distance)
    rolled = (offset - centre_x) / pitch_radius
    radius = np.hypot(cut_x, cut_y)
    # Angle from the tooth's centre line, positive towards the gap that this rack tooth cuts (+x).
    half_angle = np.arctan2(cut_x, cut_y) - rolled
    return radius, half_angle
