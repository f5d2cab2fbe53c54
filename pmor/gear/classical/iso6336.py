"""Tooth stiffness after ISO 6336-1, method B: a regression on c' of one tooth pair and c_gamma of the mesh.

Source: ISO 6336-1:2006, clause 9 (in the 2019 edition likewise): q' is Linke's and Schäfer's series for the minimum
flexibility of a tooth pair; constants C1 to C9 as printed there.
"""

from __future__ import annotations

import warnings

import numpy as np

STEEL_YOUNGS_MODULUS_MPA = 206_000.0  # the modulus for which the standard's regression holds
_C = (0.04723, 0.15551, 0.25791, -0.00635, -0.11654, -0.00193, -0.24188, 0.00529, 0.00182)


def single_stiffness(
    z_n1: float,
    z_n2: float,
    x_1: float = 0.0,
    x_2: float = 0.0,
    *,
    dedendum: float = 1.25,
    pressure_angle_deg: float = 20.0,
    helix_angle_rad: float = 0.0,
    specific_load_N_per_mm: float | None = None,
    modulus_ratio: float = 1.0,
    blank_factor: float = 1.0,
) -> float:
    """Maximum stiffness c' of one tooth pair per face width, in N/(mm um).

    c' = c'_th C_M C_R C_B cos(beta) E/E_st with c'_th = 1/q', C_M = 0.8 (measured against theoretical stiffness),
    C_R = ``blank_factor`` (1 for solid discs) and C_B = [1 + 0.5 (1.2 - h_fP/m_n)] [1 - 0.02 (20 deg - alpha_Pn)].

    Parameters
    ----------
    z_n1, z_n2 : float
        (Virtual) tooth numbers of pinion and wheel; infinite of a ring.
    x_1, x_2 : float
        Profile shift coefficients.
    dedendum, pressure_angle_deg : float
        Basic rack: h_fP / m_n and alpha_Pn.
    specific_load_N_per_mm : float, optional
        F_t K_A / b. Below 100 N/mm the standard lowers c' by the factor (F_t K_A / b / 100)^0.25.
    modulus_ratio : float
        E / E_st with E = 2 E1 E2 / (E1 + E2), for pairs other than steel on steel.

    Notes
    -----
    Stated range: x_1 >= x_2 and -0.5 <= x_1 + x_2 <= 2, external gears of any helix up to 45 deg; +5/-8 % for specific
    loads of 100 to 1600 N/mm. Outside a warning is given.
    """
    _warn_outside_range(x_1, x_2, helix_angle_rad, specific_load_N_per_mm)
    q = (
        _C[0]
        + _C[1] / z_n1
        + _C[2] / z_n2
        + _C[3] * x_1
        + _C[4] * x_1 / z_n1
        + _C[5] * x_2
        + _C[6] * x_2 / z_n2
        + _C[7] * x_1**2
        + _C[8] * x_2**2
    )
    basic_rack_factor = (1.0 + 0.5 * (1.2 - dedendum)) * (1.0 - 0.02 * (20.0 - pressure_angle_deg))
    stiffness = 0.8 * blank_factor * basic_rack_factor * np.cos(helix_angle_rad) * modulus_ratio / q
    if specific_load_N_per_mm is not None and specific_load_N_per_mm < 100.0:
        stiffness *= (specific_load_N_per_mm / 100.0) ** 0.25
    return float(stiffness)


def mesh_stiffness(single_stiffness_N_per_mm_um: float, contact_ratio: float) -> float:
    """Mean mesh stiffness c_gamma,alpha = c' (0.75 eps_alpha + 0.25), in the unit of c'.

    The standard states it for eps_alpha >= 1.2; below, its value is up to 10 % too high and a warning is given.
    """
    if contact_ratio < 1.2:
        warnings.warn(
            f"ISO 6336-1:2006: c_gamma is up to 10 % too high at a contact ratio of {contact_ratio:.3f} (below 1.2)",
            stacklevel=2,
        )
    return single_stiffness_N_per_mm_um * (0.75 * contact_ratio + 0.25)


def virtual_tooth_number(z: int, helix_angle_rad: float, pressure_angle_n_rad: float) -> float:
    """z_n = z / (cos^2 beta_b cos beta), with sin beta_b = sin beta cos alpha_n."""
    sin_base_helix = np.sin(helix_angle_rad) * np.cos(pressure_angle_n_rad)
    return float(z / ((1.0 - sin_base_helix**2) * np.cos(helix_angle_rad)))


def _warn_outside_range(x_1: float, x_2: float, helix_angle_rad: float, specific_load: float | None) -> None:
    outside = []
    if x_1 < x_2:
        outside.append(f"x_1 = {x_1:g} is below x_2 = {x_2:g}")
    if not -0.5 <= x_1 + x_2 <= 2.0:
        outside.append(f"x_1 + x_2 = {x_1 + x_2:g} is not in -0.5 to 2")
    if abs(helix_angle_rad) > np.radians(45.0):
        outside.append("helix angle above 45 deg")
    if specific_load is not None and specific_load > 1600.0:
        outside.append(f"specific load {specific_load:.0f} N/mm is above 1600 N/mm")
    if outside:
        warnings.warn("ISO 6336-1:2006 method B used outside its range: " + "; ".join(outside), stacklevel=3)
