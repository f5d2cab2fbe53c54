"""Gear data sheets beside published ones, to the digits that they print.

Sheets: KHK, Gear Technical Reference (also SDP/SI, Elements of Metric Gear Technology), pairs with profile shift and
tip shortening, and spans; hanslhansl/din3990, test of a pair 19/104 after ISO 21771; MESYS, gear geometry calculators;
gearcalc's pair h20. That of ISO/TR 6336-30, example 1, was computed from its data by others.
"""

from __future__ import annotations

import math
from typing import Any

from pmor.gear.data_sheet import data_sheet, span
from pmor.gear.pair import GearPair, zero_backlash_centre_distance
from pmor.gear.tooth import Tooth
from pmor.lab.validation.check import Check

# Of a printed number: it is rounded, and so may its inputs be.
LAST_DIGIT = 0.51
UNITS = {"mm": "mm", "deg": "deg"}


def rack_gear(
    teeth: int, module: float, helix_deg: float = 0.0, shift: float = 0.0, addendum: float = 1.0, **others: float
) -> Tooth:
    """Return a gear by the data of a sheet, with a pressure angle of 20 deg."""
    return Tooth(teeth, module, math.radians(20.0), math.radians(helix_deg), shift, addendum, **others)


TAN = math.tan(math.radians(20.0))
# Gears, centre distance where it is not that without backlash, data of the pair, data of pinion and wheel.
SHEETS: dict[str, tuple[tuple[Tooth, Tooth], float | None, dict[str, str], dict[str, tuple[str, str]]]] = {
    "KHK spur 12/24": (
        (rack_gear(12, 3.0, 0.0, 0.6, tip_shortening=0.38), rack_gear(24, 3.0, 0.0, 0.36, tip_shortening=0.38)), None,
        {"working_transverse_pressure_angle_deg": "26.0886", "reference_centre_distance_mm": "54.000",
         "sum_of_profile_shifts": "0.960", "transverse_contact_ratio": "1.202", "centre_distance_mm": "56.500"},
        {"reference_diameter_mm": ("36.000", "72.000"), "base_diameter_mm": ("33.8289", "67.6579"),
         "working_pitch_diameter_mm": ("37.667", "75.333"), "tip_diameter_mm": ("44.840", "79.400"),
         "root_diameter_mm": ("32.100", "66.660")},
    ),
    "KHK helical 12/60": (
        (rack_gear(12, 3.0, 30.0, 0.09809, tip_shortening=0.00195),
         rack_gear(60, 3.0, -30.0, 0.0, tip_shortening=0.00195)), None,
        {"centre_distance_mm": "125.000", "working_transverse_pressure_angle_deg": "23.1126",
         "transverse_pressure_angle_deg": "22.79588"},
        {"reference_diameter_mm": ("41.569", "207.846"), "base_diameter_mm": ("38.322", "191.611"),
         "working_pitch_diameter_mm": ("41.667", "208.333"), "root_diameter_mm": ("34.658", "200.346"),
         "tip_diameter_mm": ("48.154", "213.842")},
    ),
    "DIN 3990 spur 19/104": (
        (rack_gear(19, 4.0, 0.0, 0.5), rack_gear(104, 4.0, 0.0, 0.15)), None,
        {"working_transverse_pressure_angle_deg": "21.531902292465", "gear_ratio": "5.473684210526",
         "centre_distance_mm": "248.506843355171", "transverse_contact_ratio": "1.536323594583",
         "total_contact_ratio": "1.536323594583"},
        {"base_diameter_mm": ("71.416639179729", "390.912130246938"), "tip_diameter_mm": ("88.0", "425.2"),
         "root_diameter_mm": ("70.0", "407.2"), "working_pitch_diameter_mm": ("76.774471930866", "420.239214779476")},
    ),
    "ISO/TR 6336-30 helical 17/103": (
        (rack_gear(17, 8.0, 15.8, 0.145), rack_gear(103, 8.0, -15.8, 0.0)), 500.0,
        {"working_transverse_pressure_angle_deg": "21.0661", "transverse_contact_ratio": "1.5493",
         "overlap_ratio": "1.0834"},
        {"base_diameter_mm": ("132.1986", "800.9678")},
    ),
    "gearcalc helical 17/43": (
        (rack_gear(17, 1.0, 20.0), rack_gear(43, 1.0, -20.0)), None,
        {"transverse_contact_ratio": "1.4918785", "total_contact_ratio": "2.580562"}, {},
    ),
    "MESYS spur 20": (
        (rack_gear(20, 1.0, rack_tip_radius=0.25),) * 2, None, {},
        {"base_diameter_mm": ("18.7939",) * 2, "tip_diameter_mm": ("22.0000",) * 2,
         "root_diameter_mm": ("17.5000",) * 2, "normal_tooth_thickness_mm": ("1.5708",) * 2,
         "tip_tooth_thickness_mm": ("0.6949",) * 2,
         "root_form_diameter_mm": ("18.8003",) * 2},
    ),
    "MESYS spur 30, allowances -60 and -30 um": (
        (rack_gear(30, 1.0, rack_tip_radius=0.2, thickness_allowance=-0.06),
         rack_gear(30, 1.0, rack_tip_radius=0.2, thickness_allowance=-0.03)), None, {},
        {"base_diameter_mm": ("28.1908",) * 2, "tip_diameter_mm": ("32.0000",) * 2,
         "root_diameter_mm": ("27.3352", "27.4176"), "root_form_diameter_mm": ("28.3762", "28.4047"),
         "normal_tooth_thickness_mm": ("1.5108", "1.5408"), "tip_tooth_thickness_mm": ("0.6734", "0.7054"),
         "generating_profile_shift": ("-0.0824", "-0.0412")},
    ),
    # A public example of ISO 21771, equations 62 and 63: normal backlash and the sum of generating profile shifts.
    "helical 31/30, backlash 0.03 mm": (
        (rack_gear(31, 3.5, 21.0, 0.291, thickness_allowance=2.0 * 3.5 * TAN * (0.639346541 - 0.651877131252)),
         rack_gear(30, 3.5, -21.0, 0.651877131252 - 0.291)), None,
        {"centre_distance_mm": "116.500000", "working_transverse_pressure_angle_deg": "23.8707609654",
         "reference_centre_distance_mm": "114.3447280708", "normal_backlash_mm": "0.030000"}, {},
    ),
}  # fmt: skip
WIDTHS = {"ISO/TR 6336-30 helical 17/103": 100.0, "gearcalc helical 17/43": 10.0}
# Gear, teeth over which it is measured, span in mm.
SPANS = [
    (rack_gear(24, 3.0, 0.0, 0.4), 4, "32.8266"), (rack_gear(24, 3.0, 25.0, 0.4), 5, "42.0085"),
    (rack_gear(20, 1.0), 2, "4.7083"),
]  # fmt: skip


def data_sheets() -> list[Check]:
    """Return the checks of data sheets."""
    found = []
    for name, (gears, distance, of_pair, of_gears) in SHEETS.items():
        pair = GearPair(*gears, WIDTHS.get(name, 20.0), distance or zero_backlash_centre_distance(*gears))
        sheet = data_sheet(pair)
        found += [_check(f"{name}, {_words(key)}", key, printed, sheet) for key, printed in of_pair.items()]
        for key, both in of_gears.items():
            sides = {"pinion": sheet.pinion, "wheel": sheet.wheel}
            found += [
                _check(f"{name}, {_words(key)}, {side}", key, printed, gear)
                for (side, gear), printed in zip(sides.items(), both, strict=True)
            ]
    return found + [
        _row(f"KHK, span over {teeth} teeth, z = {gear.teeth}", "mm", printed, span(gear, teeth), "published sheet")
        for gear, teeth, printed in SPANS
    ]


def _check(words: str, key: str, printed: str, data: Any) -> Check:
    unit = UNITS.get(key.rpartition("_")[2], "1")
    return _row(words, unit, printed, float(getattr(data, key)), "published sheet")


def _row(words: str, unit: str, printed: str, ours: float, source: str) -> Check:
    digits = 10.0 ** -len(printed.partition(".")[2])
    return Check(words, unit, float(printed), ours, source, LAST_DIGIT * digits / abs(float(printed)))


def _words(key: str) -> str:
    return key.removesuffix("_mm").removesuffix("_deg").replace("_", " ")
