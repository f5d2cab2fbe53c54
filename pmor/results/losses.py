"""Load-dependent losses of a mesh from its line loads.

The friction force of a section is mu times its normal force F / cos(beta_b), and acts through the sliding velocity;
with the roll angles u_1, u_2 at the point of contact that is omega_1 r_b1 |u_1 - u_2|. Over the power of the mesh,
F_bt omega_1 r_b1,

    P_V = P mu H_VL,    H_VL = mean over the cycle of sum F |u_1 - u_2| / (F_bt cos(beta_b)).

Rigid spur pairs that share the load equally have H_V of Ohlendorf (Dissertation, TH Munich, 1958). Friction is mean
over the mesh: that of Schlenk (Dissertation, TU Munich, 1995), from measurements on gears; other formulas give up to
twice as much. Churning and bearings are left out.
"""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.gear.pair import GearPair
from pmor.results.load_distribution import SectionLoads


class SlidingLoads(SectionLoads, Protocol):
    """Fields of line contact states that a loss factor needs, such as `pmor.results.loads.LineStates`."""

    @property
    def roll_rad(self) -> FloatArray: ...  # noqa: D102


def loss_factor(pair: GearPair, lines: SlidingLoads) -> FloatArray:
    """Return H_VL of each torque, shape (D,); NaN where nothing carries.

    Parameters
    ----------
    pair : GearPair
        External or internal: flanks of a ring slide by the difference of the roll angles too, as their signs have it.
    lines : SlidingLoads
        Of a sweep over whole pitches, over the whole width or half of it.
    """
    sliding = np.abs(lines.roll_rad[..., 0] - lines.roll_rad[..., 1])
    force = lines.load_N_per_mm * lines.width_mm
    total = force.sum(axis=(2, 3))
    lost = np.einsum("daps,aps->da", force, np.where(np.isfinite(sliding), sliding, 0.0))
    share = np.divide(lost, total, out=np.full(total.shape, np.nan), where=total > 0.0)
    return np.asarray(share.mean(axis=1) / math.cos(pair.base_helix_angle))


def friction_schlenk(
    pair: GearPair, force_N: float, pinion_rpm: float, viscosity_mPas: float, roughness_um: float,
    lubricant_factor: float,
) -> float:  # fmt: skip
    """Return the mean coefficient of friction of a mesh after Schlenk (1995).

    Parameters
    ----------
    pair : GearPair
    force_N : float
        In the transverse plane.
    pinion_rpm : float
    viscosity_mPas : float
        Dynamic viscosity at the temperature of the oil.
    roughness_um : float
        Ra, mean of both gears.
    lubricant_factor : float
        X_L; 1 of mineral oil.
    """
    omega = 2.0 * math.pi * abs(pinion_rpm) / 60.0
    tangential = 1e-3 * omega * pair.pinion.base_radius / math.cos(pair.working_pressure_angle)
    sum_velocity = 2.0 * tangential * math.sin(pair.working_pressure_angle)
    radius = pair.pitch_point_radius / math.cos(pair.base_helix_angle)
    load = force_N / pair.common_width / (sum_velocity * radius)
    return float(0.048 * load**0.2 * viscosity_mPas**-0.05 * roughness_um**0.25 * lubricant_factor)
