"""Light blanks: factors of ISO 6336 beside finite elements, stress on webs and at the edges of their holes."""

from __future__ import annotations

import math
import warnings
from typing import Any

import numpy as np

from pmor.gear.classical.formulas import iso_stiffness
from pmor.gear.classical.iso6336 import LEAST_RIM, THINNEST, WEB
from pmor.gear.classical.iso6336_root import nominal_root_stress
from pmor.pair.iso_blank import IsoBlank, blank_factor, iso_blanks
from pmor.results.root_stress import EDGES, GEARS, WebCycle
from pmor_online.run import OnlineResult

# Difference between finite elements and the standard that is named, of the standard's figure.
FAR_APART = 0.2


def iso_root_stress(result: OnlineResult) -> tuple[float | None, float | None]:
    """Return the nominal root stress of pinion and wheel at the nominal torque by ISO 6336-3, with Y_B, MPa."""
    pair = result.reduced.meshed.pair
    plain, blanks = nominal_root_stress(pair, result.case.torque_Nm), iso_blanks(result.case, pair)
    if blanks is None:
        return plain
    pinion, wheel = (
        None if stress is None or blank.root_stress is None else stress * blank.root_stress
        for stress, blank in zip(plain, blanks, strict=True)
    )
    return pinion, wheel


def iso_blank_figures(result: OnlineResult) -> dict[str, Any]:
    """Return C_R and Y_B of pinion and wheel, and the mesh stiffness with C_R; None of solid gears."""
    case, pair = result.case, result.reduced.meshed.pair
    blanks, stiffness = iso_blanks(case, pair), None
    if blanks is not None:
        moduli = 1e3 * case.pair.pinion.youngs_modulus_GPa, 1e3 * case.pair.wheel.youngs_modulus_GPa
        load = 1e3 * case.torque_Nm / pair.pinion.base_radius / pair.common_width
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the table of classical formulas has them
            _, stiffness = iso_stiffness(pair, load, moduli, blank_factor(case, pair))
    return {
        "mesh_stiffness_iso6336_N_per_mm_um": stiffness,
        "web_factor_iso6336": None if blanks is None else [blank.stiffness for blank in blanks],
        "rim_factor_iso6336": None if blanks is None else [blank.root_stress for blank in blanks],
    }


def iso_blank_rows(result: OnlineResult, figures: dict[str, Any]) -> list[tuple[str, float | None, str, str]]:
    """Return C_R and Y_B in words, each with what it makes of stiffness and root stress beside finite elements."""
    blanks = iso_blanks(result.case, result.reduced.meshed.pair)
    if blanks is None:
        return []
    ours = figures["mesh_stiffness_tangent_mean_N_per_mm_um"] or figures["mesh_stiffness_mean_N_per_mm_um"]
    theirs = figures["mesh_stiffness_iso6336_N_per_mm_um"]
    rows = list[tuple[str, float | None, str, str]]()
    for place, (name, blank) in enumerate(zip(GEARS, blanks, strict=True)):
        if blank == IsoBlank():
            continue
        words = f"b_s/b = {blank.web_over_width:.3g}, s_R/m_n = {blank.rim_in_modules:.3g}"
        if not blank.in_range:
            words += f", beyond its range: {WEB[0]:g} to {WEB[1]:g}, {LEAST_RIM:g} at least"
        words += (
            f"; with it c_γα = {theirs:.4g} N/(mm um); finite elements {ours:.4g}, another quantity: in it web and hub "
            "twist, which C_R leaves out"
        )
        rows.append((f"C_R of ISO 6336-1:2006, {name}", blank.stiffness, "", words))
        words = f"s_R/h_t = {blank.rim_over_height:.3g}"
        if blank.root_stress is None:
            words += f": ISO 6336-3:2019 has no factor below {THINNEST:g}"
        elif figures["root_stress_max_MPa"] and (nominal := figures["root_stress_iso6336_MPa"][place]) is not None:
            beside = _beside(figures["root_stress_max_MPa"][place], nominal)
            words += f"; with it σ_F0 = {nominal:.4g} MPa, finite elements {beside}"
        rows.append((f"Y_B of ISO 6336-3:2019, {name}", blank.root_stress, "", words))
    return rows


def _beside(ours: float, theirs: float) -> str:
    apart = ours / theirs - 1.0
    far = ", more than 20 % apart" if abs(apart) > FAR_APART else ""
    return f"{ours:.4g} ({100.0 * apart:+.0f} %{far})"


#: figures of a part by the attributes of its cycle
VALUES = {"von_mises_max_MPa": "von_mises_MPa", "phi_rad": "phi_rad", "range_MPa": "range_MPa",
          "range_most_MPa": "most_MPa", "range_least_MPa": "least_MPa"}  # fmt: skip
PLACES = {"": "place", "range_": "range_place"}
AXES = "radius_mm", "angle_deg", "z_mm"


def web_stress_table(result: OnlineResult) -> list[dict[str, Any]]:
    """Return a row for each torque, gear and part of its web: plain values, None for what is not known."""
    return [
        {"torque_Nm": float(torque), "gear": gear, "part": part, **_figures(cycle, t)}
        for t, torque in enumerate(result.sweep.torque_Nm)
        for gear, cycles in zip(GEARS, result.web_stress, strict=True)
        for part, cycle in cycles.items()
    ]


def web_stress_figures(result: OnlineResult) -> list[dict[str, Any] | None] | None:
    """Return the stress of both webs at the nominal torque, by their parts; None where it was not asked for."""
    if not any(result.web_stress):
        return None
    return [
        {name: _figures(cycle, result.nominal) for name, cycle in cycles.items()} or None
        for cycles in result.web_stress
    ]


def _figures(cycle: WebCycle, torque: int) -> dict[str, float | None]:
    figures = {key: float(getattr(cycle, name)[torque]) for key, name in VALUES.items()}
    for start, name in PLACES.items():
        places = zip(AXES, getattr(cycle, name)[torque].tolist(), strict=True)
        figures |= {start + axis: value for axis, value in places}
    return {key: value if np.isfinite(value) else None for key, value in figures.items()}


def web_stress_rows(result: OnlineResult) -> list[tuple[str, float | None, str, str]]:
    """Return the stress of both webs in words."""
    rows = list[tuple[str, float | None, str, str]]()
    for gear, parts in zip(GEARS, web_stress_figures(result) or (), strict=False):
        for part, s in (parts or {}).items():
            what = "stress at hole edges" if part == EDGES else "stress of web"
            if s["von_mises_max_MPa"] is None:
                rows.append((f"{what}, {gear}", None, "", "needs positions that converged"))
                continue
            place = f"r = {s['radius_mm']:.4g} mm, {s['angle_deg']:.4g} deg, z = {s['z_mm']:.3g} mm"
            note = f"largest von Mises, at {place}, pinion at {math.degrees(s['phi_rad']):.3g} deg"
            note += "; range over a load cycle "
            if s["range_MPa"] is None:
                note += "unknown: the sweep covers no whole one"
            else:
                note += f"{s['range_MPa']:.4g} MPa, {s['range_least_MPa']:.3g} to {s['range_most_MPa']:.3g} MPa"
            rows.append((f"{what}, {gear}", s["von_mises_max_MPa"], "MPa", note))
    return rows
