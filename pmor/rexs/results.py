"""Results of a sweep in a REXS file: transmission error, stiffness, load on the flanks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.errors import ConvergenceError
from pmor.pair.conditions import conditions_of
from pmor.results.load_distribution import face_load_factor, line_states, over_the_whole_face
from pmor.results.sweep import mesh_stiffness
from pmor_online.model import ReducedPair, sweep_angles
from pmor_online.sweep import sweep_reduced_pair


@dataclass(frozen=True)
class StageResults:
    """Results over the pitches of the case's sweep under the nominal torque, at n angles.

    Attributes
    ----------
    phi_rad : (n,)
    ste_um : (n,)
    stiffness_N_per_mm : (n,)
        Secant mesh stiffness: force along the transverse line of action over the transmission error.
    z_mm, load_N_per_mm : (m,)
        Of sections over the common face, from its beginning: place, and line load, summed over tooth pairs, mean over
        the angles.
    face_load_factor : float
        K_Hbeta (`pmor.results.load_distribution`).
    roll_rad : (k, 2)
        Of points of the flanks that carry over the first pitch: roll angles of pinion and wheel.
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
    load_N_per_mm: FloatArray
    face_load_factor: float
    roll_rad: FloatArray
    point_z_mm: FloatArray
    point_load_N_per_mm: FloatArray
    pressure_MPa: FloatArray


def stage_results(reduced: ReducedPair) -> StageResults:
    """Sweep a reduced pair with line loads over the angles of its case under the nominal torque.

    Raises
    ------
    ConvergenceError
        When a position has no equilibrium: a file has no number for it.
    """
    case, pair = reduced.basis.case, reduced.meshed.pair
    phi = sweep_angles(case)
    sweep = sweep_reduced_pair(reduced, phi, conditions_of(case, [case.torque_Nm]), recorded=True)
    if not sweep.converged.all():
        failed = f"{np.count_nonzero(~sweep.converged)} of {sweep.converged.size} positions"
        raise ConvergenceError(f"{case.name}: {failed} under {case.torque_Nm:g} N m have no equilibrium")
    stiffness = mesh_stiffness(sweep, pair.pinion.base_radius, pair.common_width).secant[0]
    lines = line_states(sweep)
    load, pressure = lines.load_N_per_mm[0], lines.pressure_MPa[0]
    z, over_face = over_the_whole_face(lines, load.sum(axis=1).mean(axis=0))
    # Points have a place on both flanks, and a pressure: not those at which an edge carries.
    kept = (load > 0.0) & np.isfinite(pressure)
    kept[case.online.angles_per_pitch :] = False
    for gear, (low, high) in enumerate(pair.active_rolls):
        kept &= (lines.roll_rad[..., gear] >= low) & (lines.roll_rad[..., gear] <= high)
    return StageResults(
        case.torque_Nm, phi, sweep.ste_um[0], 1e3 * stiffness * pair.common_width, z - pair.common_face[0], over_face,
        float(face_load_factor(lines)[0]), lines.roll_rad[kept], np.broadcast_to(lines.z_mm, load.shape)[kept],
        load[kept], pressure[kept],
    )  # fmt: skip
