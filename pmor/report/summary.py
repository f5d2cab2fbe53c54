"""The summary of an online result: for machines, and in words for the screen."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from pmor.case import Case, beyond_training
from pmor.case.models import LEAST_ELEMENTS
from pmor.gear.pair import GearPair
from pmor.pair.limits import range_warnings
from pmor.pair.model import approach_estimate
from pmor.pair.samples import sample_data, sample_rows
from pmor.report.data_files import (
    write_ste_csv,
    write_stiffness_csv,
    write_stress_csv,
    write_summary_json,
    write_table_csv,
)
from pmor.report.data_sheet import sheet_of
from pmor.report.iso_blank_rows import (
    iso_blank_figures,
    iso_blank_rows,
    iso_root_stress,
    web_stress_figures,
    web_stress_rows,
    web_stress_table,
)
from pmor.report.results_data import HARRIS, RESULTS, write_results_data
from pmor.report.table import Cell, format_cell
from pmor.report.torque_table import (
    CAUSES,
    SHAFT_ORDER_COLUMNS,
    condition_rows,
    duty_of,
    shaft_order_rows,
    shaft_orders_of,
    torque_row,
    torque_rows,
)
from pmor.results.load_distribution import PRESSURE, line_states
from pmor.results.root_stress import GEARS, SIDES, LoadCycle
from pmor.results.sweep import (
    MIN_RIPPLE_POINTS,
    SteSweep,
    largest_error_um,
    mesh_orders,
    mesh_stiffness,
    ripple_um,
    torque_exponent,
)
from pmor_online.run import LostModel, OnlineResult
from pmor_online.samples import sampled_figures
from pmor_online.sweep import largest_size

CONDITIONS, STRESS, ORDERS = "conditions.csv", "stress.csv", "orders.csv"
WEB_STRESS, TOLERANCES = "web_stress.csv", "tolerances.csv"
TORQUES, STIFFNESS = "torques.csv", "stiffness.csv"
# Relative error of a model that solves the same equations as full FE.
ROUND_OFF = 1e-9
#: label, value, unit, note
Row = tuple[str, Cell, str, str]

#: figures of each model that a case compares
MODEL_FIGURES = (
    "basis", "rom_size", "basis_mib", "offline_s", "online_ms_per_position", "full_ms_per_position",
    "rom_vs_full_ste_max_rel", "rom_vs_full_ste_rms_rel", "ste_mean_um", "ste_peak_to_peak_um",
    "ste_error_estimate_max_um", "ste_mesh_error_percent", "n_positions_failed",
)  # fmt: skip


def result_files(case: Case) -> tuple[str, ...]:
    """Return the names of the files that `write_results` leaves."""
    of_lines = (HARRIS,) if case.reduction.shapes == "line_loads" else ()
    further = ((CONDITIONS, case.conditions), (STRESS, case.root_stress), (ORDERS, case.pitches > 1),
               (TOLERANCES, case.tolerances is not None),
               (WEB_STRESS, case.web_stress))  # fmt: skip
    return (
        "ste.csv",
        TORQUES,
        STIFFNESS,
        "summary.json",
        RESULTS,
        *of_lines,
        *(name for name, asked in further if asked),
    )


def summary(result: OnlineResult) -> dict[str, Any]:
    """Return the machine-readable summary; None for figures that were not asked for."""
    sheet = sheet_of(result.case, result.reduced.meshed.pair)
    return {
        **figures(result), "geometry": asdict(sheet), "models": [model_summary(model) for model in result.models]
    }  # fmt: skip


def model_summary(model: OnlineResult | LostModel) -> dict[str, Any]:
    """Return the figures of one of several models; None for all of them without a basis."""
    known = {} if isinstance(model, LostModel) else figures(model) | {"basis": model.basis_name}
    scheme, shapes = model.case.contact.scheme, model.case.reduction.shapes
    return {"name": scheme, "scheme": scheme, "shapes": shapes, **{key: known.get(key) for key in MODEL_FIGURES}}


def figures(result: OnlineResult) -> dict[str, Any]:
    """Return the figures of the case's own model."""
    case, sweep, comparison, i = result.reduced.basis.case, result.sweep, result.comparison, result.nominal
    return {
        "case": case.name, "flank": case.flank, "n_profile": case.mesh.profile_elements, "scheme": case.contact.scheme,
        "lodm": case.contact.lodm_profile if case.contact.kind == "nodal" else None, "n_angles": len(sweep.phi_rad),
        **torque_row(result, i), "ste_harmonics_um": mesh_orders(sweep, i).tolist(), "pitches": sweep.pitches,
        "shaft_orders": [asdict(order) for order in shaft_orders_of(result)] or None,
        "ste_ripple_um": ripple_um(sweep, i), "ste_torque_exponent": torque_exponent(sweep),
        "ste_error_estimate_max_um": largest_error_um(sweep),
        "extrapolated": beyond_training(case), "rom_size": largest_size(result.reduced),
        "rom_vs_full_ste_max_rel": comparison.max_relative_error if comparison else None,
        "rom_vs_full_ste_rms_rel": comparison.rms_relative_error if comparison else None,
        "online_ms_per_position": ms_per_position(sweep),
        "full_ms_per_position": ms_per_position(comparison.full) if comparison else None,
        "offline_s": result.reduced.basis.training.seconds, "basis_mib": result.basis_mib,
        "n_positions_failed": len(result.failures), **root_stress_figures(result), **iso_blank_figures(result),
        "web_stress": web_stress_figures(result),
        "torques": torque_rows(result), "duty": duty_of(result),
        "tolerances": tolerances_of(result),
        "verdict": None if result.verdict is None else result.verdict.data,
        "conditions": [row for listed in result.conditions for row in condition_rows(listed)] or None
    }  # fmt: skip


def root_stress_figures(result: OnlineResult) -> dict[str, Any]:
    """Return the root stress of pinion and wheel at the nominal torque; None without it."""
    stress = result.root_stress
    known = [] if stress is None else [stress.largest(result.nominal, gear) for gear in range(2)]
    stressed = [largest for largest in known if largest is not None]
    keys = {"max_MPa": "max_principal_MPa", "phi_rad": "phi_rad", "radius_mm": "radius_mm", "z_mm": "z_mm"}
    return {
        **{f"root_stress_{key}": [getattr(one, name) for one in stressed] or None for key, name in keys.items()},
        **_range_figures(stress.cycle if stress else None, result.nominal),
        "root_stress_iso6336_MPa": iso_root_stress(result) if stressed else None,
        **{key: list(values) if (values := result.root_stress_causes.get(key)) else None for key in CAUSES},
    }


def _range_figures(cycles: tuple[LoadCycle, LoadCycle] | None, torque: int) -> dict[str, Any]:
    """Ranges of the root stress of pinion and wheel, their limits; the range of the tooth whose range is least too."""
    ranges = [cycle.range_MPa[torque] for cycle in cycles or ()]
    ranges_MPa = dict[str, list[Any]]()
    for s, side in enumerate(SIDES):
        ranges_MPa[f"range_{side}_MPa"] = [float(of_teeth[:, s].max()) for of_teeth in ranges]
        ranges_MPa[f"range_{side}_least_MPa"] = [float(of_teeth[:, s].min()) for of_teeth in ranges]
        ranges_MPa[f"range_{side}_limits_MPa"] = [
            [float(ends[torque, of_teeth[:, s].argmax(), s]) for ends in (cycle.least_MPa, cycle.most_MPa)]
            for cycle, of_teeth in zip(cycles or (), ranges, strict=True)
        ]
    return {f"root_stress_{key}": values or None for key, values in ranges_MPa.items()}


def tolerances_of(result: OnlineResult) -> dict[str, Any] | None:
    """Return percentiles of pairs within tolerances under each torque as plain data; None without tolerances."""
    if result.samples is None:
        return None
    return sample_data(result.samples, sampled_figures(result.reduced, result.sweep), result.case.online.torques_Nm)


def summary_rows(result: OnlineResult) -> list[Row]:
    """Return the results at the nominal torque in words."""
    s = figures(result)
    exponent = s["ste_torque_exponent"]
    growth = f"; grows with torque^{exponent:.2f}" if math.isfinite(exponent) else ""
    return [
        ("STE mean", s["ste_mean_um"], "um", f"at {s['torque_Nm']:g} N m{on_coast(result.case)}, "
         f"over {s['n_angles']} angles of " + pitches_words(result.sweep) + growth),
        ("STE peak-to-peak", s["ste_peak_to_peak_um"], "um", ""),
        *_unloaded_rows(s),
        *_readings_rows(s, result),
        *_loss_rows(s),
        *_root_stress_rows(result),
        *web_stress_rows(result),
        *iso_blank_rows(result, s),
    ]  # fmt: skip


def accuracy_rows(result: OnlineResult) -> list[Row]:
    """Return in words how good the results are and how long they took."""
    s, case, comparison = figures(result), result.reduced.basis.case, result.comparison
    rows: list[Row] = [
        _known("numerical noise of the curve", s["ste_ripple_um"], "um",
               "standard deviation of the STE about a smooth curve where one pair carries the load",
               f"needs {MIN_RIPPLE_POINTS} angles with one pair in contact"),
        _known("STE error bar, max", s["ste_error_estimate_max_um"], "um", "of the reduction, estimated"
               + ("; too long where rows of points come and go" if case.contact.kind == "nodal" else " online"),
               "none: line loads are exact" if result.reduced.basis.shapes is None
               else "needs [reduction] error_estimate = true"),
        _known("STE error bar, mesh", s["ste_mesh_error_percent"], "%", "of the mean; from half as many elements",
               _no_mesh_error(case)),
        ("reduced model size", s["rom_size"], "", "unknowns at most"),
        ("online time", s["online_ms_per_position"], "ms", f"per position, {len(result.sweep.phi_rad)} angles x "
         f"{len(result.sweep.torque_Nm)} torques" + (", in parallel" if result.parallel else "")),
    ]  # fmt: skip
    if comparison is not None:
        positions = f"{comparison.full.ste_um.size} unseen positions"
        if comparison.max_relative_error < ROUND_OFF:
            positions += ": round-off, line loads are exact"
        rows += [
            ("reduced vs full, max", 100 * s["rom_vs_full_ste_max_rel"], "%", positions),
            ("reduced vs full, rms", 100 * s["rom_vs_full_ste_rms_rel"], "%", ""),
            ("full FE time", s["full_ms_per_position"], "ms", "per position, compliance condensed beforehand"),
        ]
    return [
        *rows,
        ("offline time", s["offline_s"], "s", "finite elements and training"),
        ("basis", s["basis_mib"], "MiB", ""),
    ]


def on_coast(case: Case) -> str:
    """Return which flanks carry, where they are not those of the drive."""
    return " on the coast flanks" if case.flank == "coast" else ""


def pitches_words(sweep: SteSweep) -> str:
    """Return the angular range of a sweep in words."""
    return "a pitch" if sweep.pitches == 1 else f"{sweep.pitches} pitches"


def _readings_rows(s: dict[str, Any], result: OnlineResult) -> list[Row]:
    """Rows of the quantities derived from line loads, and of the mesh stiffness."""
    secant = _known("mesh stiffness", s["mesh_stiffness_mean_N_per_mm_um"], "N/(mm um)", "secant, mean over the pitch",
                    "needs a position that converged")  # fmt: skip
    if result.case.reduction.shapes != "line_loads":
        return [secant]
    lacks = "the sweep is too long to keep its loads"
    edges = result.readings is not None and np.isnan(line_states(result.sweep).pressure_MPa[result.nominal]).any()
    return [
        secant,
        _known("K_Hβ", s["k_h_beta"], "", "largest over mean line load of the face, over the cycle", lacks),
        _known("contact ratio, loaded", s["effective_contact_ratio"], "",
               _unloaded_contact_ratio(result.reduced.meshed.pair), lacks),
        _known("flank pressure, max", s["flank_pressure_max_MPa"], "MPa", PRESSURE if edges else "of Hertz",
               "a sharp tip edge carries all" if edges else lacks),
    ]  # fmt: skip


def _loss_rows(s: dict[str, Any]) -> list[Row]:
    """Power lost in the mesh, where the case has a speed; and over its duty cycle."""
    rows: list[Row] = []
    for label, data in (("losses", s), ("losses, duty cycle", s["duty"] or {"losses_W": None})):
        if data["losses_W"] is not None:
            rows.append((label, data["losses_W"], "W", f"of {data['power_W']:.4g} W; load-dependent, without churning"))
    return rows


def _unloaded_contact_ratio(pair: GearPair) -> str:
    """The contact ratio of rigid flanks in words, beside which that under load stands."""
    transverse, overlap = pair.contact_ratio, pair.overlap_ratio
    if overlap == 0.0:
        return f"{transverse:.3f} without load; tooth pairs that carry, on average"
    return (
        f"{transverse + overlap:.3f} without load, {transverse:.3f} transverse + {overlap:.3f} overlap; "
        "tooth pairs that carry, on average"
    )


def _root_stress_rows(result: OnlineResult) -> list[Row]:
    s, rows = root_stress_figures(result), list[Row]()
    for gear, name in enumerate(GEARS if s["root_stress_max_MPa"] else ()):
        radius, phi, z = (s[f"root_stress_{key}"][gear] for key in ("radius_mm", "phi_rad", "z_mm"))
        note = f"largest principal, at r = {radius:.4g} mm, z = {z:.3g} mm, {math.degrees(phi):.3g} deg"
        nominal = s["root_stress_iso6336_MPa"][gear]
        if nominal is not None:
            note += f"; ISO 6336-3:2019: {nominal:.3g} MPa"
        if s["root_stress_nominal_flanks_MPa"]:
            note += f"; nominal flanks on aligned axes: {s['root_stress_nominal_flanks_MPa'][gear]:.4g} MPa"
        rows.append((f"root stress, {name}", s["root_stress_max_MPa"][gear], "MPa", note))
    cycles = result.root_stress.cycle if result.root_stress else None
    for name, cycle in zip(GEARS, cycles or (), strict=False):
        rows.append((f"root stress range, {name}", *_range_words(cycle, result.nominal)))
    return rows


def _range_words(cycle: LoadCycle, torque: int) -> tuple[float, str, str]:
    """Range on the side of the loaded flank, its unit, and all else in words."""
    tension, other = cycle.range_MPa[torque].T
    of_sides = zip((tension, other), cycle.least_MPa[torque].T, cycle.most_MPa[torque].T, strict=True)
    own, beside = (f"{low[t := int(span.argmax())]:.4g} to {high[t]:.4g} MPa" for span, low, high in of_sides)
    note = f"across the root over a load cycle, {own}; other side {other.max():.4g} MPa, {beside}"
    if len(tension) > 1:
        both = [f"{values.min():.4g} to {values.max():.4g}" for values in (tension, other)]
        note += f"; teeth differ: {both[0]}, {both[1]} MPa"
    return float(tension.max()), "MPa", note


def _no_mesh_error(case: Case) -> str:
    if case.contact.kind != "line":
        return "none: the mesh itself holds the local compliance"
    if case.reduction.shapes != "line_loads":
        return "none: that of exact line loads"
    return (
        f"needs {LEAST_ELEMENTS} elements over the profile"
        if case.mesh.error_bar
        else ("needs [mesh] error_bar = true")
    )


def _unloaded_rows(s: dict[str, Any]) -> list[Row]:
    """Rows of the transmission error without load, and the datum of both."""
    if s["unloaded_ste_mean_um"] is None:
        return []
    return [
        ("STE without load, mean", s["unloaded_ste_mean_um"], "um", f"of rigid flanks; {COUNTS_FROM}"),
        ("STE without load, p-p", s["unloaded_ste_peak_to_peak_um"], "um", ""),
        ("first touch", s["first_touch_um"], "um", "least STE without load"),
    ]


#: datum of transmission errors
COUNTS_FROM = "STE counts from plain involutes on aligned axes"


def _known(label: str, value: float | None, unit: str, note: str, lacks: str) -> Row:
    """A row of the summary; without a value, its note says what is required."""
    known = value is not None and math.isfinite(value)
    return (label, value, unit, note) if known else (label, None, "", lacks)


def write_results(result: OnlineResult, out: Path) -> None:
    """Write the tables that every run has; OutputError where that fails."""
    sweep, pair = result.sweep, result.reduced.meshed.pair
    write_ste_csv(out / "ste.csv", sweep)
    write_table_csv(out / TORQUES, torque_rows(result))
    write_stiffness_csv(out / STIFFNESS, sweep, mesh_stiffness(sweep, pair.pinion.base_radius, pair.common_width))
    write_summary(result, out)
    write_results_data(result, out)
    if result.root_stress is not None:
        write_stress_csv(out / STRESS, result.root_stress)
    if any(result.web_stress):
        write_table_csv(out / WEB_STRESS, web_stress_table(result))
    if result.samples is not None:
        write_table_csv(out / TOLERANCES, sample_rows(result.samples, sweep.torque_Nm))
    if sweep.pitches > 1:
        write_orders(result, out)
    if result.conditions:
        write_table_csv(out / CONDITIONS, [row for listed in result.conditions for row in condition_rows(listed)])


def write_orders(result: OnlineResult, out: Path) -> None:
    """Write the orders at all torques at which no position is missing."""
    write_table_csv(out / ORDERS, shaft_order_rows(result), SHAFT_ORDER_COLUMNS)


def write_summary(result: OnlineResult, out: Path) -> None:
    """Write the summary for machines: once what was asked for is there, and again with its comparison with full FE."""
    write_summary_json(out / "summary.json", summary(result))


def summary_text(title: str, rows: Sequence[Row]) -> str:
    """Short aligned lines for the screen from (label, value, unit, note) rows."""
    if not rows:
        return title
    values = [format_cell(value) for _, value, _, _ in rows]
    label_width, value_width = max(len(row[0]) for row in rows), max(map(len, values))
    unit_width = max(len(row[2]) for row in rows)
    lines = [
        f"  {label:<{label_width}}  {value:>{value_width}} {unit:<{unit_width}}  {note}".rstrip()
        for (label, _, unit, note), value in zip(rows, values, strict=True)
    ]
    return "\n".join([title, *lines])


def warnings(result: OnlineResult) -> tuple[str, ...]:
    """Return warnings: unusual geometry, extrapolation, positions that failed."""
    case, pair = result.reduced.basis.case, result.reduced.meshed.pair
    beyond = (f"extrapolated: {text}; see the error bar" for text in beyond_training(case))
    return (*range_warnings(case, pair, approach_estimate(case, pair)), *beyond, *result.all_failures)


def ms_per_position(sweep: SteSweep) -> float:
    """Return the wall time of a sweep per angle and torque, ms."""
    return 1e3 * sweep.seconds / sweep.ste_um.size
