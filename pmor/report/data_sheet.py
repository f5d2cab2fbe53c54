"""The data sheet of a pair as tables: on pages, on the screen, in notebooks. Lengths in mm have four decimals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from pmor.case import Case
from pmor.gear.data_sheet import DataSheet, GearData, OneGear, data_sheet
from pmor.gear.pair import GearPair
from pmor.pair.drawn import gear_inertias
from pmor.report.table import Cell, Table

NOTE = (
    "Quantities and symbols of ISO 21771; tooth thicknesses are arcs. Roll lengths count on the line of action from "
    "the base circle, shares on the path of contact from the start of the gear's active profile to its end."
)

# From the end of the active profile to the tip circle, mm, that shows.
LEAST_DISTANCE = 5e-5
_PAIR: tuple[tuple[str, str, str, str], ...] = (
    ("gear ratio", "u", "gear_ratio", ""),
    ("normal module", "m_n", "normal_module_mm", "mm"),
    ("transverse module", "m_t", "transverse_module_mm", "mm"),
    ("normal pressure angle", "α_n", "normal_pressure_angle_deg", "deg"),
    ("transverse pressure angle", "α_t", "transverse_pressure_angle_deg", "deg"),
    ("helix angle", "β", "helix_angle_deg", "deg"),
    ("base helix angle", "β_b", "base_helix_angle_deg", "deg"),
    ("centre distance", "a_w", "centre_distance_mm", "mm"),
    ("reference centre distance", "a_d", "reference_centre_distance_mm", "mm"),
    ("centre distance without backlash", "", "zero_backlash_centre_distance_mm", "mm"),
    ("working transverse pressure angle", "α_wt", "working_transverse_pressure_angle_deg", "deg"),
    ("working normal pressure angle", "α_wn", "working_normal_pressure_angle_deg", "deg"),
    ("sum of profile shifts", "x_1 + x_2", "sum_of_profile_shifts", ""),
    ("normal backlash", "j_bn", "normal_backlash_mm", "mm"),
    ("normal backlash, least", "j_bn", "least_normal_backlash_mm", "mm"),
    ("normal backlash, largest", "j_bn", "largest_normal_backlash_mm", "mm"),
    ("backlash on the transverse line of action", "j_bt", "transverse_backlash_mm", "mm"),
    ("circumferential backlash", "j_wt", "circumferential_backlash_mm", "mm"),
    ("common face width", "b_w", "common_face_width_mm", "mm"),
    ("transverse base pitch", "p_et", "base_pitch_mm", "mm"),
    ("length of path of contact", "g_α", "path_of_contact_mm", "mm"),
    ("transverse contact ratio", "ε_α", "transverse_contact_ratio", ""),
    ("overlap ratio", "ε_β", "overlap_ratio", ""),
    ("total contact ratio", "ε_γ", "total_contact_ratio", ""),
    ("mesh frequency", "f_z", "mesh_frequency_Hz", "Hz"),
)
_GEARS: tuple[tuple[str, str, str, str], ...] = (
    ("number of teeth", "z", "teeth", ""),
    ("profile shift coefficient", "x", "profile_shift", ""),
    ("generating profile shift coefficient", "x_E", "generating_profile_shift", ""),
    ("tip alteration coefficient", "k", "tip_alteration", ""),
    ("reference diameter", "d", "reference_diameter_mm", "mm"),
    ("base diameter", "d_b", "base_diameter_mm", "mm"),
    ("working pitch diameter", "d_w", "working_pitch_diameter_mm", "mm"),
    ("tip diameter", "d_a", "tip_diameter_mm", "mm"),
    ("tip form diameter", "d_Fa", "tip_form_diameter_mm", "mm"),
    ("end of active profile, diameter", "d_Na", "end_of_active_profile_diameter_mm", "mm"),
    ("start of active profile, diameter", "d_Nf", "start_of_active_profile_diameter_mm", "mm"),
    ("root form diameter", "d_Ff", "root_form_diameter_mm", "mm"),
    ("root diameter", "d_f", "root_diameter_mm", "mm"),
    ("tip clearance", "c", "tip_clearance_mm", "mm"),
    ("normal tooth thickness, reference", "s_n", "normal_tooth_thickness_mm", "mm"),
    ("tooth thickness, reference", "s_t", "tooth_thickness_mm", "mm"),
    ("tooth thickness, tip", "s_at", "tip_tooth_thickness_mm", "mm"),
    ("tooth thickness, base", "s_bt", "base_tooth_thickness_mm", "mm"),
    ("teeth to span", "k", "span_teeth", ""),
    ("span", "W_k", "span_mm", "mm"),
    ("span, least", "W_k", "least_span_mm", "mm"),
    ("span, largest", "W_k", "largest_span_mm", "mm"),
    ("angular backlash", "j_φ", "angular_backlash_deg", "deg"),
    ("mass, teeth as a ring up to d", "m", "mass_kg", "kg"),
    ("polar moment of inertia", "J", "polar_inertia_kg_m2", "kg m²"),
    ("speed", "n", "speed_rpm", "1/min"),
    ("rotational frequency", "f", "rotational_frequency_Hz", "Hz"),
)
_POINTS = (
    ("start of active profile, SAP", "start_of_active_profile"),
    ("lowest point of single contact, LPSTC", "lowest_single_contact"),
    ("pitch point", "pitch_point"),
    ("highest point of single contact, HPSTC", "highest_single_contact"),
    ("end of active profile, EAP", "end_of_active_profile"),
    ("tip circle", "tip"),
    ("start of tip relief", "tip_relief_start"),
    ("end of root relief", "root_relief_end"),
)
_PLACES = "place", "roll angle, deg", "roll length, mm", "diameter, mm", "to the tip, mm", "share of path, %"


def sheet_of(case: Case, pair: GearPair) -> DataSheet:
    """Return the data sheet of a case, whose geometry is that of a pair."""
    pinion, wheel = gear_inertias(case, pair)
    sheet = data_sheet(
        pair, case.speed_rpm,
        (OneGear(case.pinion_modification, case.pair.pinion.thickness_allowances_mm, pinion),
         OneGear(case.wheel_modification, case.pair.wheel.thickness_allowances_mm, wheel)),
    )  # fmt: skip
    if case.flank == "coast":  # the pair is its image, the helix is that of the drawing
        return replace(sheet, helix_angle_deg=-sheet.helix_angle_deg, base_helix_angle_deg=-sheet.base_helix_angle_deg)
    return sheet


def sheet_tables(sheet: DataSheet) -> list[Table]:
    """Return the data sheet as tables: pair, gears, places on the profile of each gear."""
    both = sheet.pinion, sheet.wheel
    pair = [(_label(name, symbol, unit), _cell(sheet, key, unit))
            for name, symbol, key, unit in _PAIR if getattr(sheet, key) is not None]  # fmt: skip
    gears = [(_label(name, symbol, unit), *(_cell(gear, key, unit) for gear in both))
             for name, symbol, key, unit in _GEARS if any(getattr(gear, key) is not None for gear in both)]  # fmt: skip
    return [
        Table("Gear data: pair", ("quantity", "value"), pair, folded=True),
        Table("Gear data: gears", ("quantity", "pinion", "wheel"), gears, folded=True),
        Table("Places on the profile of the pinion", _PLACES, _places(sheet.pinion), folded=True),
        Table("Places on the profile of the wheel", _PLACES, _places(sheet.wheel), NOTE, folded=True),
    ]


def data_sheets(cases: Mapping[str, Case], pairs: Mapping[str, GearPair]) -> list[Table]:
    """Return the data sheets of the meshes of a machine, by their names."""
    return [
        replace(shown, title=f"{name}: {shown.title[0].lower()}{shown.title[1:]}", folded=True)
        for name, case in cases.items() for shown in sheet_tables(sheet_of(case, pairs[name]))
    ]  # fmt: skip


def _label(name: str, symbol: str, unit: str) -> str:
    return f"{name} {symbol}".strip() + (f", {unit}" if unit else "")


def _cell(data: DataSheet | GearData, key: str, unit: str) -> Cell:
    if unit in ("kg", "kg m²"):
        value: float | None = getattr(data, key)
        return None if value is None else f"{value:.5g}"
    return decimal(getattr(data, key), 2 if unit in ("Hz", "1/min") else 4)


def _places(gear: GearData) -> list[tuple[Cell, ...]]:
    """Rows from the root to the tip; the tip circle where the active profile ends below it."""
    named = {key: (name, getattr(gear, key)) for name, key in _POINTS}
    if gear.end_of_active_profile.to_tip_mm < LEAST_DISTANCE:
        del named["tip"]
    known = [(name, point) for name, point in named.values() if point is not None]
    return [
        (name, decimal(p.roll_deg), decimal(p.roll_length_mm), decimal(p.diameter_mm), decimal(p.to_tip_mm),
         decimal(p.percent, 2))
        for name, p in sorted(known, key=lambda item: item[1].roll_deg)
    ]  # fmt: skip


def decimal(value: float | None, digits: int = 4) -> Cell:
    """A number as on a drawing: with a fixed number of decimals, without a negative zero."""
    return value if value is None or isinstance(value, int) else f"{round(value, digits) + 0.0:.{digits}f}"
