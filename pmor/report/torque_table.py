"""Figures of a run at each torque and condition of its sweep: rows for machines, and tables of the page."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, fields
from typing import Any

import numpy as np

from pmor.case import Case, condition_words
from pmor.core.arrays import FloatArray
from pmor.gear.pair import GearPair
from pmor.report.table import Table, heads, table
from pmor.results.load_distribution import PRESSURE
from pmor.results.quantities import OF_MESHES
from pmor.results.root_stress import GEARS, RootStress
from pmor.results.shaft_orders import ShaftOrder, shaft_orders
from pmor.results.sweep import SteSweep, mesh_orders, mesh_stiffness, peak_to_peak_um, ste_mean_um
from pmor_online.conditions import ConditionSweep
from pmor_online.run import OnlineResult

# Conditions that a page lists; all of them are in the file.
MOST_LISTED = 100
N_ORDERS = 5
COLUMNS = ("torque_Nm", "ste_mean_um", "ste_peak_to_peak_um", "ste_order_1_um", "unloaded_ste_peak_to_peak_um")


def sweep_row(sweep: SteSweep, t: int) -> dict[str, Any]:
    """Return the figures of a sweep at one of its torques: plain values, units in the keys."""
    unloaded = None if sweep.unloaded_um is None else sweep.unloaded_um[t]
    return {
        "torque_Nm": float(sweep.torque_Nm[t]), "ste_mean_um": float(ste_mean_um(sweep)[t]),
        "ste_peak_to_peak_um": float(peak_to_peak_um(sweep)[t]),
        "unloaded_ste_mean_um": None if unloaded is None else float(np.mean(unloaded)),
        "unloaded_ste_peak_to_peak_um": None if unloaded is None else float(np.ptp(unloaded)),
        "first_touch_um": None if unloaded is None else float(np.min(unloaded)),
        "ste_mesh_error_percent": None if sweep.mesh_error_percent is None else float(sweep.mesh_error_percent[t]),
    }  # fmt: skip


def order_columns(sweep: SteSweep, t: int) -> dict[str, float]:
    """Return the first orders of the mesh at one of the torques."""
    return {f"ste_order_{k}_um": float(a) for k, a in enumerate(mesh_orders(sweep, t, N_ORDERS), start=1)}


def condition_rows(condition: ConditionSweep) -> list[dict[str, Any]]:
    """Return a row for each torque at which a condition was swept: plain values, units in the keys."""
    sweep = condition.sweep
    return [
        {
            "condition": condition.name, **asdict(condition.assembly.misalignment), **sweep_row(sweep, t),
            **order_columns(sweep, t),
            "n_positions_failed": int(np.count_nonzero(~sweep.converged[t])), "flank": condition.flank,
        }
        for t in range(len(sweep.torque_Nm))
    ]  # fmt: skip


def condition_table(result: OnlineResult) -> Table:
    """Return the table of a page: each condition at its own torque."""
    case, listed = result.reduced.basis.case, result.conditions[:MOST_LISTED]
    rows = [_row(case, number, condition) for number, condition in enumerate(listed)]
    note = "Each at its own torque; all torques and more orders are in conditions.csv."
    if len(listed) < len(result.conditions):
        note += f" The first {len(listed)} of {len(result.conditions)} conditions."
    columns = ["condition", "differences from the case", "torque, N m", "STE mean, µm", "STE peak-to-peak, µm",
               "first order, µm", "without load, peak-to-peak, µm"]  # fmt: skip
    return Table("Conditions", columns, rows, note, folded=True)


def _row(case: Case, number: int, condition: ConditionSweep) -> list[str | float | None]:
    """Cells of a condition at its own torque."""
    row = condition_rows(condition)[condition.own]
    words = "; ".join(condition_words(case, case.conditions[number]))
    return [condition.name, words or None, *(row[key] for key in COLUMNS)]


# Orders of each torque in the file.
MOST_ROWS = 200
# Of a page, beside the forces.
IN_LOAD_TABLE = (
    "torque_Nm", "mesh_stiffness_mean_N_per_mm_um", "mesh_stiffness_tangent_mean_N_per_mm_um", "k_h_beta",
    "effective_contact_ratio", "flank_pressure_max_MPa", "line_load_max_N_per_mm", "loss_factor",
    "root_stress_pinion_MPa", "root_stress_wheel_MPa",
)  # fmt: skip
#: of the table of orders, which has no row where a position is missing at every torque
SHAFT_ORDER_COLUMNS = ("torque_Nm", *(field.name for field in fields(ShaftOrder)))
#: root stress without some of its causes, by key of the summary
CAUSES = {
    "root_stress_nominal_flanks_MPa": "nominal flanks on aligned axes",
    "root_stress_aligned_axes_MPa": "flanks of the case on aligned axes",
}


def torque_rows(result: OnlineResult) -> list[dict[str, Any]]:
    """Return a row for each torque of a sweep: plain values, units in the keys; None for what is not available."""
    return [torque_row(result, t) for t in range(len(result.sweep.torque_Nm))]


def torque_row(result: OnlineResult, t: int) -> dict[str, Any]:
    """Return the figures at one of the torques, by its place."""
    figures = dict.fromkeys(OF_MESHES) if result.readings is None else result.readings.figures
    return figures_at(result.sweep, result.reduced.meshed.pair, figures, result.root_stress, t)


def figures_at(
    sweep: SteSweep, pair: GearPair, figures: Mapping[str, FloatArray | None], stress: RootStress | None, t: int
) -> dict[str, Any]:
    """Return the figures of a pair at one of the torques of its sweep, with those of its mesh where they are known."""
    secant = mesh_stiffness(sweep, pair.pinion.base_radius, pair.common_width).secant[t]
    tangent = None if sweep.stiffness_N_per_um is None else sweep.stiffness_N_per_um[t] / pair.common_width
    largest = [None if stress is None else stress.largest(t, gear) for gear in range(2)]
    return {
        **sweep_row(sweep, t), **order_columns(sweep, t),
        "mesh_stiffness_mean_N_per_mm_um": _mean(secant),
        "mesh_stiffness_tangent_mean_N_per_mm_um": None if tangent is None else _mean(tangent),
        **{key: None if values is None or np.isnan(values[t]) else float(values[t]) for key, values in figures.items()},
        **{f"root_stress_{name}_MPa": None if one is None else one.max_principal_MPa
           for name, one in zip(GEARS, largest, strict=True)},
        "n_positions_failed": int(np.count_nonzero(~sweep.converged[t])),
    }  # fmt: skip


def ste_table(rows: list[dict[str, Any]]) -> Table:
    """Return the transmission error at each torque."""
    keys = ("torque_Nm", "ste_mean_um", "ste_peak_to_peak_um", *(f"ste_order_{k}_um" for k in range(1, N_ORDERS + 1)))
    note = "Orders of the mesh frequency, amplitudes from zero to peak; all figures at each torque are in torques.csv."
    return table("Transmission error at each torque", heads(*keys), rows, note)


def shaft_order_table(result: OnlineResult) -> list[Table]:
    """Return the largest orders at the nominal torque, named; none of a sweep over a single pitch."""
    rows = [
        (order.name, order.mesh_order, order.pinion_order, order.wheel_order, order.amplitude_um)
        for order in shaft_orders_of(result)
    ]
    columns = ("order", "of the mesh", "of the pinion shaft", "of the wheel shaft", "amplitude, µm")
    note = "The largest, zero to peak, at the nominal torque; those of all torques are in orders.csv."
    return [Table("Shaft orders, and what makes them", columns, rows, note)] if rows else []


def shaft_orders_of(result: OnlineResult) -> list[ShaftOrder]:
    """Return the largest orders at the nominal torque of a sweep over several pitches."""
    pair = result.case.pair
    if result.sweep.pitches == 1:
        return []
    return shaft_orders(result.sweep, result.nominal, (pair.pinion.teeth, pair.wheel.teeth), pair.holes)


def shaft_order_rows(result: OnlineResult) -> list[dict[str, Any]]:
    """Return the orders at all torques, a row each."""
    pair, sweep = result.case.pair, result.sweep
    teeth = pair.pinion.teeth, pair.wheel.teeth
    return [
        {"torque_Nm": float(torque), **asdict(order)}
        for row, torque in enumerate(sweep.torque_Nm)
        for order in sorted(shaft_orders(sweep, row, teeth, pair.holes, MOST_ROWS), key=lambda order: order.mesh_order)
    ]


def load_table(result: OnlineResult, rows: list[dict[str, Any]]) -> Table:
    """Return stiffness, load distribution, stresses and forces at each torque."""
    columns = heads(*(key for key in IN_LOAD_TABLE if any(row[key] is not None for row in rows)))
    shown = table("", columns, rows)
    cells, names = list(map(list, shown.rows)), list(columns)
    note = "Stiffness: mean over the angles, per face width, secant unless tangent."
    if result.readings is not None:
        names += ["tangential force [N]", "separating force [N]", "axial force [N]"]
        for cells_of, forces in zip(cells, result.readings.forces.force_N[:, :, 0], strict=True):
            cells_of += [float(value) for value in np.abs(forces).max(axis=0)]
        note += (
            " K_Hβ: largest over mean line load of the face, added up over the cycle (ISO 6336-1:2006's w_max / w_m). "
            "Forces of the mesh on a gear across the plane of the axes, along the line of centres, along the axes: "
            f"largest over the cycle. Flank pressure: {PRESSURE}."
        )
    return Table("Stiffness, load distribution, stresses and forces at each torque", names, cells, note, folded=True)


def causes_table(figures: Mapping[str, Any]) -> list[Table]:
    """Return the root stress at nominal torque with and without modifications and misalignment, where it has any."""
    if not any(figures[key] for key in CAUSES):
        return []
    lines = {"ISO 6336-3:2019, method B, without factors of load": "root_stress_iso6336_MPa"}
    lines |= {words: key for key, words in CAUSES.items()} | {"flanks and axes of the case": "root_stress_max_MPa"}
    rows = [(words, *figures[key]) for words, key in lines.items() if figures[key] and None not in figures[key]]
    note = f"Largest principal stress over cycle, fillet and face at {figures['torque_Nm']:g} N m."
    return [Table("Root stress without modifications and misalignment", ("", "pinion, MPa", "wheel, MPa"), rows, note)]


def _mean(values: FloatArray) -> float:
    """Mean of the finite values; NaN without any."""
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else math.nan

