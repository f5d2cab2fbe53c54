"""What a REXS file says of a sweep: transmission error, stiffness, and the load on the flanks."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pmor.arrays import FloatArray
from pmor.pair.conditions import conditions_of
from pmor.results.loads import ContactLoads
from pmor.results.sweep import SteSweep, mesh_stiffness
from pmor_online.model import ReducedPair, online_angles
from pmor_online.sweep import sweep_reduced_pair


@dataclass(frozen=True)
class StageResults:
    """Results over one mesh cycle under the nominal torque, at n angles.

    Attributes
    ----------
    torque_Nm : float
    phi_rad : (n,)
    ste_um : (n,)
    stiffness_N_per_mm : (n,)
        Secant mesh stiffness: force along the transverse line of action over the transmission error.
    z_mm, width_mm, load_N_per_mm : (m,)
        Of sections over the common face, from its beginning: place, share of the width, and line load, summed over
        tooth pairs, mean over the cycle.
    roll_rad : (k, 2)
        Of points of the flanks that carry: roll angles of pinion and wheel.
    point_z_mm : (k,)
    point_load_N_per_mm : (k,)
        Line load along the contact line.
    pressure_MPa : (k,)
        Hertz's largest pressure.
    """

    torque_Nm: float
    phi_rad: FloatArray
    ste_um: FloatArray
    stiffness_N_per_mm: FloatArray
    z_mm: FloatArray
    width_mm: FloatArray
    load_N_per_mm: FloatArray
    roll_rad: FloatArray
    point_z_mm: FloatArray
    point_load_N_per_mm: FloatArray
    pressure_MPa: FloatArray

    @property
    def face_load_factor(self) -> float:
        """Largest over mean line load of the face, K_Hbeta."""
        return float(self.load_N_per_mm.max() / np.average(self.load_N_per_mm, weights=self.width_mm))


def stage_results(reduced: ReducedPair) -> StageResults:
    """Sweep one mesh cycle under the nominal torque of the case of a reduced pair with line loads."""
    case, pair = reduced.basis.case, reduced.meshed.pair
    phi = online_angles(pair.pitch, case.online.angles_per_pitch)
    sweep = sweep_reduced_pair(reduced, phi, conditions_of(case, [case.torque_Nm]), recorded=True)
    stiffness = mesh_stiffness(sweep, pair.pinion.base_radius, pair.common_width).secant[0]
    loads = _loads(sweep)
    width = reduced.meshed.sections.width
    # Torque over base radius: the component along the transverse line of action; per width it is that along the line.
    load = -loads.force_N * loads.lever_mm / pair.pinion.base_radius
    share = load / width[loads.column] / (2.0 if reduced.meshed.mirrored else 1.0)
    over_face = _over_face(reduced, loads, share, len(phi))
    on_both = np.ones(len(share), dtype=bool)
    for gear, (low, high) in enumerate(pair.active_rolls):
        on_both &= (loads.roll_rad[:, gear] >= low) & (loads.roll_rad[:, gear] <= high)
    roll, carried = loads.roll_rad[on_both], share[on_both]
    return StageResults(
        case.torque_Nm, phi, sweep.ste_um[0], 1e3 * stiffness * pair.common_width, *over_face, roll,
        loads.z_mm[on_both], carried, _pressure(reduced, roll, carried),
    )  # fmt: skip


def _loads(sweep: SteSweep) -> ContactLoads:
    if sweep.states is None:
        raise TypeError("the sweep was not recorded")
    return sweep.states.loads


def _over_face(
    reduced: ReducedPair, loads: ContactLoads, share: FloatArray, angles: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Places, widths and line loads of the sections; of half the width with their images."""
    z, width = reduced.meshed.sections.z, reduced.meshed.sections.width
    total = np.bincount(loads.column, weights=share, minlength=len(z)) / angles
    if reduced.meshed.mirrored:
        images, middle = np.flatnonzero(z < 0.0)[::-1], np.where(z < 0.0, 1.0, 2.0)
        z, width, total = (
            np.concatenate([values, sign * values[images]])
            for values, sign in ((z, -1.0), (middle * width, 1.0), (total, 1.0))
        )
    return z - reduced.meshed.pair.common_face[0], width, total


def _pressure(reduced: ReducedPair, roll: FloatArray, load: FloatArray) -> FloatArray:
    """Hertz's pressure of line contact between cylinders, MPa: sqrt(w E' / (pi rho))."""
    pair, gears = reduced.meshed.pair, (reduced.basis.case.pair.pinion, reduced.basis.case.pair.wheel)
    flexibility = sum((1.0 - gear.poisson_ratio**2) / (1e3 * gear.youngs_modulus_GPa) for gear in gears)
    radii = roll * [pair.pinion.base_radius, pair.wheel.base_radius]
    curvature = math.cos(pair.base_helix_angle) * (1.0 / radii).sum(axis=1)
    return np.asarray(np.sqrt(load * curvature / (math.pi * flexibility)))
