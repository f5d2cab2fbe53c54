"""Tooth deflection after Weber and Banaschek: w = w_B (tooth) + w_F (fillet and body) + w_H (Hertzian approach).

Source: Weber, C., Banaschek, K., "Formänderung und Profilrücknahme bei gerad- und schrägverzahnten Rädern",
Schriftenreihe Antriebstechnik 11, Vieweg 1955, in the form with explicit Poisson's ratio; with nu = 0.3 the factors
become the familiar 10.92, 3.1, 0.294, 5.2, 1 and 1.4. Plane strain; the body is an elastic half-plane, so the bore
plays no part. Deflections are along the line of action; compliances per face width in 1/MPa (mm per N/mm).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pmor.gear.classical.tooth_beam import FloatArray, ToothBeam, beam_integrals, tooth_load


def tooth_compliance(
    beam: ToothBeam, radius_mm: ArrayLike, youngs_modulus_MPa: float, poissons_ratio: float
) -> FloatArray:
    """w_B b/F (m,): bending, shear and compression of the tooth, loaded where the line of action cuts its centre line.

    cos^2(a) (1 - nu^2)/E [12 int (y_l - y)^2/d^3 dy + (2.4/(1 - nu) + tan^2 a) int dy/d], from the root circle to y_l.
    """
    load = tooth_load(beam, radius_mm)
    bending, shear = beam_integrals(beam, load.y_centre_line_mm, load.y_centre_line_mm)
    nu = poissons_ratio
    shape = 12.0 * bending + (2.4 / (1.0 - nu) + np.tan(load.angle_rad) ** 2) * shear
    return np.asarray(np.cos(load.angle_rad) ** 2 * (1.0 - nu**2) / youngs_modulus_MPa * shape)


def body_compliance(
    beam: ToothBeam, radius_mm: ArrayLike, youngs_modulus_MPa: float, poissons_ratio: float
) -> FloatArray:
    """w_F b/F (m,): rotation and shift of the tooth's foundation, an elastic half-plane.

    cos^2(a) (1 - nu^2)/E [18/pi (u/d_f)^2 + 2 (1 - 2 nu)/(1 - nu) u/d_f + 4.8/pi (1 + (1 - nu)/2.4 tan^2 a)],
    d_f the tooth's chord where it meets the root circle, u the height of the line of action above it.
    """
    load = tooth_load(beam, radius_mm)
    nu = poissons_ratio
    u = (load.y_centre_line_mm - beam.y_mm[0]) / (2.0 * beam.half_thickness_mm[0])
    tan2 = np.tan(load.angle_rad) ** 2
    shape = 18.0 / np.pi * u**2 + 2.0 * (1.0 - 2.0 * nu) / (1.0 - nu) * u
    shape = shape + 4.8 / np.pi * (1.0 + (1.0 - nu) / 2.4 * tan2)
    return np.asarray(np.cos(load.angle_rad) ** 2 * (1.0 - nu**2) / youngs_modulus_MPa * shape)


def hertz_half_width(
    load_N_per_mm: ArrayLike,
    curvature_radius_1_mm: ArrayLike,
    curvature_radius_2_mm: ArrayLike,
    youngs_modulus_1: float,
    poisson_1: float,
    youngs_modulus_2: float,
    poisson_2: float,
) -> FloatArray:
    """Half width of the contact strip of two parallel cylinders, mm (Hertz 1882)."""
    rho_1, rho_2 = np.asarray(curvature_radius_1_mm, float), np.asarray(curvature_radius_2_mm, float)
    flexibility = (1.0 - poisson_1**2) / youngs_modulus_1 + (1.0 - poisson_2**2) / youngs_modulus_2
    reduced = rho_1 * rho_2 / (rho_1 + rho_2)
    return np.asarray(np.sqrt(4.0 / np.pi * np.asarray(load_N_per_mm, float) * reduced * flexibility))


def hertz_compliance(
    half_width_mm: ArrayLike, depth_mm: ArrayLike, youngs_modulus_MPa: float, poissons_ratio: float
) -> FloatArray:
    """w_H b/F of one gear: approach of the flank to a point at ``depth_mm`` below it, under Hertz's pressure.

    (1 - nu^2)/(pi E) [2 ln(2 t / a) - nu/(1 - nu)], t the distance along the line of action from the flank to the
    tooth's centre line, a the half width of contact (so the approach grows slightly less than in proportion to load).
    """
    nu = poissons_ratio
    ratio = 2.0 * np.asarray(depth_mm, float) / np.asarray(half_width_mm, float)
    return np.asarray((1.0 - nu**2) / (np.pi * youngs_modulus_MPa) * (2.0 * np.log(ratio) - nu / (1.0 - nu)))


def depth_to_centre_line(beam: ToothBeam, radius_mm: ArrayLike) -> FloatArray:
    """t (m,): distance along the line of action from the flank to the tooth's centre line, mm."""
    load = tooth_load(beam, radius_mm)
    return np.asarray(load.half_thickness_mm / np.cos(load.angle_rad))
