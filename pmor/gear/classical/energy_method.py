"""Tooth pair stiffness by the potential-energy method, with the gear body's share after Sainsot, Velex and Duverger.

Sources
-------
Yang, D. C. H., Lin, J. Y., J. Mech. Trans. Autom. Des. 109 (1987) 189-196: bending, compression and Hertz energy;
Tian, X., MSc thesis, University of Alberta (2004): shear energy added;
Yang, D. C. H., Sun, Z. S., J. Mech. Trans. Autom. Des. 107 (1985) 529-535: line contact stiffness;
Sainsot, P., Velex, P., Duverger, O., J. Mech. Des. 126 (2004) 748-752, doi:10.1115/1.1758252: gear body.

All compliances are per unit face width: mm of displacement along the line of action per N/mm, that is 1/MPa.
"""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import ArrayLike

from pmor.gear.classical.tooth_beam import FloatArray, ToothBeam, ToothLoad, beam_integrals, tooth_load

# X = A/theta^2 + B h^2 + C h/theta + D/theta + E h + F, table 1 of Sainsot, Velex and Duverger
_BODY_POLYNOMIALS = {
    "L": (-5.574e-5, -1.9986e-3, -2.3015e-4, 4.7702e-3, 0.0271, 6.8045),
    "M": (60.111e-5, 28.100e-3, -83.431e-4, -9.9256e-3, 0.1624, 0.9086),
    "P": (-50.952e-5, 185.50e-3, 0.0538e-4, 53.300e-3, 0.2895, 0.9236),
    "Q": (-6.2042e-5, 9.0889e-3, -4.0964e-4, 7.8297e-3, -0.1472, 0.6904),
}
BODY_RADIUS_RATIO_RANGE = (1.4, 7.0)
BODY_HALF_ANGLE_RANGE_RAD = (0.01, 0.12)


def hertz_compliance(youngs_modulus_1: float, poisson_1: float, youngs_modulus_2: float, poisson_2: float) -> float:
    """Line contact after Yang and Sun, independent of load and curvature.

    For equal gears 4 (1 - nu^2) / (pi E); for unlike materials the mean of the two gears' values.
    """
    return 2.0 / np.pi * ((1.0 - poisson_1**2) / youngs_modulus_1 + (1.0 - poisson_2**2) / youngs_modulus_2)


def tooth_compliance(
    beam: ToothBeam, radius_mm: ArrayLike, youngs_modulus_MPa: float, poissons_ratio: float
) -> FloatArray:
    """Bending, shear and compression of one tooth (m,) loaded at contact radii ``radius_mm`` (m,), 1/MPa.

    1/k_b = int M^2 / (E I) dy, 1/k_s = int 1.2 cos^2(a) / (G A) dy, 1/k_a = int sin^2(a) / (E A) dy from the root
    circle to the point of contact, with M = cos(a) (y_l - y): the moment of the force about the section at y.
    """
    load = tooth_load(beam, radius_mm)
    bending, shear = beam_integrals(beam, load.y_centre_line_mm, load.y_mm)
    cos2, sin2 = np.cos(load.angle_rad) ** 2, np.sin(load.angle_rad) ** 2
    total = 12.0 * cos2 * bending + (2.4 * (1.0 + poissons_ratio) * cos2 + sin2) * shear
    return np.asarray(total / youngs_modulus_MPa)


def body_compliance(
    beam: ToothBeam, radius_mm: ArrayLike, youngs_modulus_MPa: float, bore_radius_mm: float
) -> FloatArray:
    """Deflection of the gear body (an elastic ring fixed at the bore) under one tooth (m,), 1/MPa.

    cos^2(a) / E [L (u/S_f)^2 + M u/S_f + P (1 + Q tan^2 a)] with S_f = 2 r_f theta_f the tooth's arc on the root circle
    and u the height of the line of action above the root circle on the tooth's centre line.

    Notes
    -----
    The polynomials were fitted for r_f / r_bore = 1.4 to 7 and theta_f = 0.01 to 0.12 rad; outside a warning is given.
    """
    ratio, theta = beam.root_radius_mm / bore_radius_mm, beam.root_half_angle_rad
    _warn_outside_fit(ratio, theta)
    c = {
        name: a / theta**2 + b * ratio**2 + c_ * ratio / theta + d / theta + e * ratio + f
        for name, (a, b, c_, d, e, f) in _BODY_POLYNOMIALS.items()
    }
    load: ToothLoad = tooth_load(beam, radius_mm)
    u = (load.y_centre_line_mm - beam.root_radius_mm) / (2.0 * beam.root_radius_mm * theta)
    tan2 = np.tan(load.angle_rad) ** 2
    shape = c["L"] * u**2 + c["M"] * u + c["P"] * (1.0 + c["Q"] * tan2)
    return np.asarray(np.cos(load.angle_rad) ** 2 * shape / youngs_modulus_MPa)


def body_fit_note(beam: ToothBeam, bore_radius_mm: float) -> str:
    """Empty, or in words how far this gear lies outside the range of the body polynomials."""
    ratio, theta = beam.root_radius_mm / bore_radius_mm, beam.root_half_angle_rad
    parts = []
    if not BODY_RADIUS_RATIO_RANGE[0] <= ratio <= BODY_RADIUS_RATIO_RANGE[1]:
        parts.append(f"root/bore radius ratio {ratio:.2f} (fit: 1.4 to 7)")
    if not BODY_HALF_ANGLE_RANGE_RAD[0] <= theta <= BODY_HALF_ANGLE_RANGE_RAD[1]:
        parts.append(f"tooth half angle at the root circle {theta:.3f} rad (fit: 0.01 to 0.12)")
    return "body polynomials extrapolated: " + ", ".join(parts) if parts else ""


def _warn_outside_fit(ratio: float, theta: float) -> None:
    low, high = BODY_RADIUS_RATIO_RANGE
    low_t, high_t = BODY_HALF_ANGLE_RANGE_RAD
    if not (low <= ratio <= high and low_t <= theta <= high_t):
        warnings.warn(
            f"Sainsot body polynomials extrapolated: r_f/r_bore = {ratio:.3f} (1.4 to 7), "
            f"theta_f = {theta:.4f} rad (0.01 to 0.12)",
            stacklevel=3,
        )
