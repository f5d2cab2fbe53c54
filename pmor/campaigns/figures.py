"""The figures of a pair: the same, to the last bit, as a run of its case gives."""

from __future__ import annotations

import numpy as np

from pmor.campaigns.kind import PEAKS, Figure
from pmor.campaigns.peaks import settled_peaks
from pmor.core.arrays import FloatArray
from pmor.pair.conditions import conditions_of
from pmor.pair.drawn import gear_inertias
from pmor.results.load_distribution import (
    effective_contact_ratio,
    face_load_factor,
    largest_pressure,
    line_states,
)
from pmor.results.root_stress import RootStress
from pmor.results.sweep import SteSweep, mesh_orders, mesh_stiffness, peak_to_peak_um, ste_mean_um
from pmor_online.model import ReducedPair, online_angles
from pmor_online.sweep import sweep_reduced_pair

FIGURES = (
    Figure("ste_mean_um", "STE, mean", "um"),
    Figure("ste_peak_to_peak_um", "STE, peak-to-peak", "um"),
    Figure("ste_peak_to_peak_worst_um", "STE, peak-to-peak at the worst torque", "um"),
    Figure("ste_order_1_um", "STE, first mesh order", "um"),
    Figure("ste_order_2_um", "STE, second mesh order", "um"),
    Figure("ste_order_3_um", "STE, third mesh order", "um"),
    Figure("ste_mesh_error_percent", "STE, error bar of the mesh", "%"),
    Figure("mesh_stiffness_mean_N_per_mm_um", "mesh stiffness", "N/(mm um)"),
    Figure("mesh_stiffness_tangent_mean_N_per_mm_um", "mesh stiffness, tangent", "N/(mm um)"),
    Figure("flank_pressure_max_MPa", "flank pressure", "MPa"),
    Figure("k_h_beta", "K_Hβ", "1"),
    Figure("root_stress_pinion_MPa", "root stress, pinion", "MPa"),
    Figure("root_stress_wheel_MPa", "root stress, wheel", "MPa"),
    Figure("contact_ratio", "transverse contact ratio", "1"),
    Figure("overlap_ratio", "overlap ratio", "1"),
    Figure("effective_contact_ratio", "contact ratio under load", "1"),
    Figure("centre_distance_mm", "centre distance", "mm"),
    Figure("mass_kg", "mass of both gears", "kg"),
    Figure("mass_pinion_kg", "mass, pinion", "kg"),
    Figure("mass_wheel_kg", "mass, wheel", "kg"),
    Figure("inertia_pinion_kg_m2", "polar inertia, pinion", "kg m2"),
    Figure("inertia_wheel_kg_m2", "polar inertia, wheel", "kg m2"),
    # Of the tip relief that suits a design (`pmor.campaigns.relief`), found where they are asked for.
    Figure("best_tip_relief_um", "best tip relief, of both gears", "um"),
    Figure("best_tip_relief_start_pinion_roll_deg", "best tip relief, start on the pinion", "deg"),
    Figure("best_tip_relief_start_wheel_roll_deg", "best tip relief, start on the wheel", "deg"),
    Figure("best_ste_peak_to_peak_um", "STE, peak-to-peak, best tip relief", "um"),
)
FIRST = (
    PEAKS[0], "mass_kg", "flank_pressure_max_MPa", "root_stress_pinion_MPa", "root_stress_wheel_MPa", "k_h_beta",
    "effective_contact_ratio",
)  # fmt: skip
ORDERS = 3


def figures_of(reduced: ReducedPair, sweep: SteSweep, stress: RootStress | None) -> dict[str, float | None]:
    """Return all figures at the nominal torque of a recorded sweep; None where the case does not ask for it."""
    case, pair = reduced.basis.case, reduced.meshed.pair
    i, lines = case.online.torques_Nm.index(case.torque_Nm), line_states(sweep)
    orders, spans = mesh_orders(sweep, i), peak_to_peak_um(sweep)
    secant = mesh_stiffness(sweep, pair.pinion.base_radius, pair.common_width).secant[i]
    tangent, mesh_error = sweep.stiffness_N_per_um, sweep.mesh_error_percent
    roots = [None if stress is None else stress.largest(i, gear) for gear in range(2)]
    pinion, wheel = gear_inertias(case, pair)
    numbers = {
        "ste_mean_um": ste_mean_um(sweep)[i],
        "ste_peak_to_peak_um": spans[i],
        "ste_peak_to_peak_worst_um": spans.max(),
        **{f"ste_order_{k + 1}_um": orders[k] if k < len(orders) else None for k in range(ORDERS)},
        "ste_mesh_error_percent": None if mesh_error is None else mesh_error[i],
        "mesh_stiffness_mean_N_per_mm_um": _mean(secant),
        "mesh_stiffness_tangent_mean_N_per_mm_um": None if tangent is None else _mean(tangent[i] / pair.common_width),
        "flank_pressure_max_MPa": float(largest_pressure(lines.pressure_MPa[i], (0, 1, 2))),
        "k_h_beta": face_load_factor(lines)[i],
        "root_stress_pinion_MPa": None if roots[0] is None else roots[0].max_principal_MPa,
        "root_stress_wheel_MPa": None if roots[1] is None else roots[1].max_principal_MPa,
        "contact_ratio": pair.contact_ratio,
        "overlap_ratio": pair.overlap_ratio,
        "effective_contact_ratio": effective_contact_ratio(sweep)[i],
        "centre_distance_mm": pair.centre_distance,
        "mass_kg": pinion.mass_kg + wheel.mass_kg,
        "mass_pinion_kg": pinion.mass_kg,
        "mass_wheel_kg": wheel.mass_kg,
        "inertia_pinion_kg_m2": pinion.polar_kg_m2,
        "inertia_wheel_kg_m2": wheel.polar_kg_m2,
    }
    return {key: known(value) for key, value in numbers.items()}


def peaks_of(reduced: ReducedPair) -> dict[str, float]:
    """Return the peak-to-peak STE of the pair of a case on fine angles: see `pmor.campaigns.peaks`.

    Raises
    ------
    ConvergenceError
    """
    case = reduced.basis.case

    def spans(angles: int) -> FloatArray:
        phi = online_angles(reduced.meshed.pair.pitch, angles, case.pitches)
        return peak_to_peak_um(sweep_reduced_pair(reduced, phi, conditions_of(case, case.online.torques_Nm)))

    return settled_peaks(spans, case.online.angles_per_pitch, case.online.torques_Nm.index(case.torque_Nm))


def _mean(values: FloatArray) -> float | None:
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else None


def known(value: float | None) -> float | None:
    """Return a plain number; None for one that is none."""
    return float(value) if value is not None and np.isfinite(value) else None
