"""Data sheets beside published ones of the same gears, to the digits that they print."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from pmor.gear.data_sheet import data_sheet, span
from pmor.gear.pair import GearPair, zero_backlash_centre_distance
from pmor.gear.tooth import Tooth
from pmor.validation.check import Check

# Of the last digit that is printed: rounded, and so may be what goes in.
ROUNDED = 0.51
BOLSOVER = "bolsover.com, examples of its gear calculator"
APPLIED = "standardsapplied.com, helical gear design"
MACHINECALCS = "machinecalcs.com, span over teeth"
DIN = "hanslhansl/din3990, test of its ISO 21771"
MESYS = "MESYS, gear calculators on the web"
GEARCALC = "printed by a public gear program"
EXAMPLE = "public example of ISO 21771, equations 62 and 63"


def _gear(teeth: int, module: float, helix_deg: float = 0.0, shift: float = 0.0, **others: float) -> Tooth:
    return Tooth(teeth, module, math.radians(20.0), math.radians(helix_deg), shift, **others)  # type: ignore[arg-type]


@dataclass(frozen=True)
class Sheet:
    """A published sheet.

    Parameters
    ----------
    source : str
    gears : (Tooth, Tooth)
        At the centre distance without backlash of their drawing.
    of_pair : dict
        Printed numbers by the fields of `pmor.gear.data_sheet.DataSheet`.
    of_gears : dict
        Those of pinion and wheel by the fields of `pmor.gear.data_sheet.GearData`.
    width : float
        Face width, mm.
    """

    source: str
    gears: tuple[Tooth, Tooth]
    of_pair: dict[str, str] = field(default_factory=dict)
    of_gears: dict[str, tuple[str, ...]] = field(default_factory=dict)
    width: float = 20.0


# The wheel of the last one takes the rest of the sum of profile shifts.
SHIFTS, GENERATING, PINION = 0.651877131252, 0.639346541, 0.291
SHEETS = {
    "spur 12/24": Sheet(
        BOLSOVER, (_gear(12, 3.0, 0.0, 0.6, tip_shortening=0.38), _gear(24, 3.0, 0.0, 0.36, tip_shortening=0.38)),
        {"working_transverse_pressure_angle_deg": "26.0886", "transverse_contact_ratio": "1.202",
         "centre_distance_mm": "56.500"},
        {"base_diameter_mm": ("33.8289", "67.6579"), "working_pitch_diameter_mm": ("37.667", "75.333"),
         "tip_diameter_mm": ("44.840", "79.400"), "root_diameter_mm": ("32.100", "66.660")},
    ),
    "helical 12/60": Sheet(
        BOLSOVER,
        (_gear(12, 3.0, 30.0, 0.09809, tip_shortening=0.00195), _gear(60, 3.0, -30.0, tip_shortening=0.00195)),
        {"centre_distance_mm": "125.000", "working_transverse_pressure_angle_deg": "23.1126",
         "transverse_pressure_angle_deg": "22.79588", "transverse_contact_ratio": "1.294", "overlap_ratio": "1.061"},
        {"reference_diameter_mm": ("41.569", "207.846"), "base_diameter_mm": ("38.322", "191.611"),
         "working_pitch_diameter_mm": ("41.667", "208.333"), "tip_diameter_mm": ("48.154", "213.842"),
         "root_diameter_mm": ("34.658", "200.346")},
    ),
    "spur 19/104": Sheet(
        DIN, (_gear(19, 4.0, 0.0, 0.5), _gear(104, 4.0, 0.0, 0.15)),
        {"working_transverse_pressure_angle_deg": "21.531902292465", "centre_distance_mm": "248.506843355171",
         "transverse_contact_ratio": "1.536323594583"},
        {"base_diameter_mm": ("71.416639179729", "390.912130246938"), "tip_diameter_mm": ("88.0", "425.2"),
         "root_diameter_mm": ("70.0", "407.2"), "working_pitch_diameter_mm": ("76.774471930866", "420.239214779476")},
    ),
    "helical 17/43": Sheet(
        GEARCALC, (_gear(17, 1.0, 20.0), _gear(43, 1.0, -20.0)),
        {"transverse_contact_ratio": "1.4918785", "total_contact_ratio": "2.580562"},
        width=10.0,
    ),
    "spur 20": Sheet(
        MESYS, (_gear(20, 1.0, rack_tip_radius=0.25),) * 2, {},
        {"base_diameter_mm": ("18.7939",), "tip_diameter_mm": ("22.0000",), "root_diameter_mm": ("17.5000",),
         "root_form_diameter_mm": ("18.8003",), "normal_tooth_thickness_mm": ("1.5708",),
         "tip_tooth_thickness_mm": ("0.6949",)},
    ),
    "spur 30, allowances -60 and -30 µm": Sheet(
        MESYS, (_gear(30, 1.0, rack_tip_radius=0.2, thickness_allowance=-0.06),
                _gear(30, 1.0, rack_tip_radius=0.2, thickness_allowance=-0.03)), {},
        {"root_diameter_mm": ("27.3352", "27.4176"), "root_form_diameter_mm": ("28.3762", "28.4047"),
         "normal_tooth_thickness_mm": ("1.5108", "1.5408"), "tip_tooth_thickness_mm": ("0.6734", "0.7054"),
         "generating_profile_shift": ("-0.0824", "-0.0412")},
    ),
    "helical 31/30": Sheet(
        EXAMPLE, (_gear(31, 3.5, 21.0, PINION,
                        thickness_allowance=2.0 * 3.5 * math.tan(math.radians(20.0)) * (GENERATING - SHIFTS)),
                  _gear(30, 3.5, -21.0, SHIFTS - PINION)),
        {"centre_distance_mm": "116.500000", "working_transverse_pressure_angle_deg": "23.8707609654",
         "reference_centre_distance_mm": "114.3447280708", "normal_backlash_mm": "0.030000"},
    ),
}  # fmt: skip
# Source, gear, teeth to span, printed, unit: that of the module.
SPANS = [
    (APPLIED, "helical 24, 8 normal diametral pitch", _gear(24, 0.125, 15.0), 4, "1.33794", "in"),
    (MACHINECALCS, "spur 20, module 2", _gear(20, 2.0), 3, "15.321", "mm"),
    (MESYS, "spur 20", _gear(20, 1.0), 2, "4.7083", "mm"),
]


def data_sheets() -> list[Check]:
    """Return the checks of data sheets."""
    found = []
    for name, said in SHEETS.items():
        sheet = data_sheet(GearPair(*said.gears, said.width, zero_backlash_centre_distance(*said.gears)))
        found += [_check(key, name, printed, getattr(sheet, key), said.source) for key, printed in said.of_pair.items()]
        found += [
            _check(key, f"{name}, {gear}", printed, getattr(getattr(sheet, gear), key), said.source)
            for key, both in said.of_gears.items() for gear, printed in zip(("pinion", "wheel"), both, strict=False)
        ]  # fmt: skip
    found += [_check(f"span_{unit}", f"{name}, {teeth} teeth", printed, span(gear, teeth), source)
              for source, name, gear, teeth, printed, unit in SPANS]  # fmt: skip
    return found


def _check(key: str, name: str, printed: str, ours: float, source: str) -> Check:
    words, _, unit = key.rpartition("_")
    words, unit = (words, unit) if unit in ("mm", "in", "deg") else (key, "1")
    theirs = float(printed)
    digits = ROUNDED * 10.0 ** -len(printed.partition(".")[2])
    return Check(f"{words.replace('_', ' ')}, {name}", unit, theirs, ours, source, digits / abs(theirs))
