"""ISO 6336-1, method B: tooth stiffness, light blanks, dynamic factor, face load factor.

Tooth stiffness: a regression on c' of one tooth pair and c_gamma of the mesh. Source: ISO 6336-1:2006, clause 9 (in the
2019 edition likewise): q' is Linke's and Schäfer's series for the minimum flexibility of a tooth pair; constants C1 to
C9 as printed there.

A light blank: factors of stiffness and of root stress for a web and a thin rim.

Dynamic factor K_v: the dynamic mesh force over the nominal one, by formulas.

Source: ISO 6336-1:2006, clause 6, equations (9) to (22) and the table of C_v1 to C_v7.
Running-in, which depends on the material, is left out: deviations count in full, and K_v is larger for it.

Misalignment by the shafts and face load factor (7.6, method C): a shaft as one formula.

    f_sh = F_m / b 0.023 (|B* + K' l s / d_1^2 (d_1 / d_sh)^4 - 0.3| + 0.3) (b / d_1)^2,    F_bx = 1.33 f_sh + f_ma

with B* = 1 of spur and single helical gears, l the span of the bearings and s the distance of the pinion from its
middle, of an overhung pinion from the bearing beside it; K' after figure 13, which DIN 3990-11:1989 has as figure 3.2:
0.48 and 0.8 (a, b), 1.33 of an overhung pinion with and without stiffening (c). Bearings and housing are rigid, and the
mate's shaft is in the factor 1.33.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass

import numpy as np

from pmor.core.arrays import FloatArray

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


# Web over face width, and rim over normal module, between which the factor of stiffness is stated; the nearest value
# counts beyond.
WEB, LEAST_RIM = (0.2, 1.2), 1.0
# Rim over tooth height from which a rim does not raise the root stress, and below which the standard has no factor.
THICK, THINNEST = 1.2, 0.5


def web_factor(web_over_width: float, rim_in_modules: float) -> float:
    """Gear blank factor C_R of the stiffness c': 1 for solid discs.

    Source: ISO 6336-1:2006, clause 9: C_R = 1 + ln(b_s/b) / (5 exp(s_R / (5 m_n))).

    Parameters
    ----------
    web_over_width : float
        b_s / b, thickness of the web over face width.
    rim_in_modules : float
        s_R / m_n, thickness of the rim below the root circle.
    """
    web = min(max(web_over_width, WEB[0]), WEB[1])
    return 1.0 + math.log(web) / (5.0 * math.exp(max(rim_in_modules, LEAST_RIM) / 5.0))


def rim_factor(rim_over_height: float) -> float | None:
    """Rim thickness factor Y_B of the root stress of external gears; None of rims that the standard bids to avoid.

    Source: ISO 6336-3:2019: Y_B = 1.6 ln(2.242 h_t / s_R) for 0.5 < s_R / h_t < 1.2, 1 above.

    Parameters
    ----------
    rim_over_height : float
        s_R / h_t, thickness of the rim below the root circle over the height of a tooth.
    """
    if rim_over_height >= THICK:
        return 1.0
    return 1.6 * math.log(2.242 / rim_over_height) if rim_over_height >= THINNEST else None


#: ranges of the resonance ratio, by rising speed
RANGES = ("subcritical", "main resonance", "intermediate", "supercritical")
# Resonance ratios at which the main resonance and the intermediate range end.
MAIN_END, INTERMEDIATE_END = 1.15, 1.5
# Of this grade and coarser ones B_k is 1, whatever the tip relief (note to equation (17)).
COARSE_GRADE = 6
# Line load, N/mm, below which the main resonance begins earlier.
LIGHT_LOAD = 100.0


@dataclass(frozen=True)
class DynamicFactor:
    """K_v of a pair under a load, over the speed.

    Parameters
    ----------
    line_load : float
        F_t K_A / b, N/mm.
    stiffness : float
        c' of one tooth pair per face width, N/(mm um).
    contact_ratio : float
        Total, eps_gamma.
    pitch_um, form_um : float
        Deviations of the base pitch and of the profile's form, um.
    relief_um : float or None
        Design tip relief C_a, um; None takes B_k = 1.
    """

    line_load: float
    stiffness: float
    contact_ratio: float
    pitch_um: float
    form_um: float
    relief_um: float | None

    @property
    def main_begin(self) -> float:
        """Resonance ratio N_S at which the main resonance begins, equations (11) and (12)."""
        return 0.5 + 0.35 * math.sqrt(min(self.line_load / LIGHT_LOAD, 1.0))

    @property
    def limits(self) -> tuple[float, float, float]:
        """Resonance ratios that part the `RANGES`."""
        return self.main_begin, MAIN_END, INTERMEDIATE_END

    def at(self, ratio: FloatArray) -> FloatArray:
        """Return K_v at resonance ratios N, mesh frequency over the natural one: equations (13) to (22)."""
        pitch, form = (self.stiffness * f / self.line_load for f in (self.pitch_um, self.form_um))
        relief = 1.0 if self.relief_um is None else abs(1.0 - self.stiffness * self.relief_um / self.line_load)
        c = _weights(self.contact_ratio)
        n = np.asarray(ratio, dtype=float)
        below = 1.0 + n * (c[0] * pitch + c[1] * form + c[2] * relief)
        amid = 1.0 + c[0] * pitch + c[1] * form + c[3] * relief
        above = c[4] * pitch + c[5] * form + c[6]
        between = above + (amid - above) * (INTERMEDIATE_END - n) / (INTERMEDIATE_END - MAIN_END)
        begin, end, far = self.limits
        return np.select([n <= begin, n <= end, n < far], [below, np.full_like(n, amid), between], above)


def single_from_mesh_stiffness(mesh_stiffness: float, transverse_contact_ratio: float) -> float:
    """Return c' whose mean mesh stiffness c_gamma,alpha = c' (0.75 eps_alpha + 0.25) is known, equation (91)."""
    return mesh_stiffness / (0.75 * transverse_contact_ratio + 0.25)


def _weights(contact_ratio: float) -> tuple[float, ...]:
    """C_v1 to C_v7: shares of pitch deviation, form, stiffness cycle; the last is the remainder beyond resonance."""
    e = contact_ratio
    rest = 0.75 if e <= 1.5 else 0.125 * math.sin(math.pi * (e - 2.0)) + 0.875 if e <= 2.5 else 1.0
    if e <= 2.0:
        return 0.32, 0.34, 0.23, 0.90, 0.47, 0.47, rest
    return 0.32, 0.57 / (e - 0.3), 0.096 / (e - 1.56), (0.57 - 0.05 * e) / (e - 1.44), 0.47, 0.12 / (e - 1.74), rest


# K' of a pinion between two bearings, without and with stiffening by its own body, where d_1 / d_sh reaches this.
PLAIN, STIFFENED, STIFFENING_RATIO = 0.8, 0.48, 1.15
# Of an overhung pinion, to which torque comes past both bearings.
OVERHUNG = 1.33
# s / l below which they hold, between two bearings and of overhung pinions.
LARGEST_OFFSET, LARGEST_OVERHANG = 0.3, 0.5
# c_gamma of steel gears, N/(mm um), for want of a better one (DIN 3990-11:1989, 3.4.3.1).
SLICE_STIFFNESS = 20.0
# Of case-hardened flanks, um.
RUNNING_IN, MOST_RUNNING_IN = 0.15, 6.0


def shaft_misalignment(
    line_load: float, width: float, diameter: float, shaft_diameter: float, span: float, offset: float,
    overhung: bool = False,
) -> float:  # fmt: skip
    """Return f_sh of a pinion on two bearings, um.

    Parameters
    ----------
    line_load : float
        F_m / b: tangential force at the reference circle over the face width, N/mm.
    width, diameter, shaft_diameter, span : float
        b, d_1, d_sh, l, mm.
    offset : float
        s, mm: positive where the pinion stands nearer to the bearing at whose side torque enters, so that torsion and
        bending load the same end of the face (K' > 0); of an overhung pinion from the bearing beside it.
    overhung : bool
        Whether it stands beside the bearings; torque comes past both of them.
    """
    constant = OVERHUNG if overhung else STIFFENED if diameter / shaft_diameter >= STIFFENING_RATIO else PLAIN
    bent = constant * span * offset / diameter**2 * (diameter / shaft_diameter) ** 4
    return 0.023 * line_load * (abs(1.0 + bent - 0.3) + 0.3) * (width / diameter) ** 2


def running_in(misalignment: float) -> float:
    """Return y_beta of case-hardened flanks, um, by F_bx, um."""
    return min(RUNNING_IN * misalignment, MOST_RUNNING_IN)


def face_load_factor(misalignment: float, stiffness: float, line_load: float) -> float:
    """Return K_Hbeta (eq. 41 and 43).

    Parameters
    ----------
    misalignment : float
        F_by after running in, um.
    stiffness : float
        c_gamma,beta, N/(mm um).
    line_load : float
        F_m / b, N/mm.
    """
    size = misalignment * stiffness / line_load
    return 1.0 + 0.5 * size if size <= 2.0 else math.sqrt(2.0 * size)


def sliced_face_load_factor(overlap: FloatArray, line_load: float, stiffness: float = SLICE_STIFFNESS) -> float:
    """Return K_Hbeta of slices that do not feel each other, under any misalignment and flanks.

    Parameters
    ----------
    overlap : ndarray, shape (n,)
        By how much the flanks overlap in the middles of equal slices where they just carry, um, from any level on.
    line_load : float
        Mean over the face, N/mm.
    stiffness : float
        Of a slice, N/(mm um).
    """
    # The k highest slices carry, down to the level at which they take the load.
    high = np.sort(overlap)[::-1]
    level = (np.cumsum(high) - len(high) * line_load / stiffness) / np.arange(1, len(high) + 1)
    carrying = int((high > level).sum())
    return float(stiffness * (high[0] - level[carrying - 1]) / line_load)
