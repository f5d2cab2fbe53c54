"""Data sheets, stiffness and nominal root stress after standards, beside published ones of the same drawings."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from pmor.gear.classical.iso6336 import mesh_stiffness, single_stiffness, virtual_tooth_number
from pmor.gear.classical.iso6336_root import nominal_root_stress, root_factors
from pmor.gear.data_sheet import data_sheet, span
from pmor.gear.inertia import disc
from pmor.gear.pair import GearPair, zero_backlash_centre_distance
from pmor.gear.profile import ProfilePoint
from pmor.gear.tooth import Tooth
from pmor.validation.check import Check
from pmor.validation.machines import drawn

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
    checks = []
    for name, theirs in SHEETS.items():
        sheet = data_sheet(GearPair(*theirs.gears, theirs.width, zero_backlash_centre_distance(*theirs.gears)))
        checks += [
            _check(key, name, printed, getattr(sheet, key), theirs.source) for key, printed in theirs.of_pair.items()
        ]
        checks += [
            _check(key, f"{name}, {gear}", printed, getattr(getattr(sheet, gear), key), theirs.source)
            for key, both in theirs.of_gears.items() for gear, printed in zip(("pinion", "wheel"), both, strict=False)
        ]  # fmt: skip
    checks += [_check(f"span_{unit}", f"{name}, {teeth} teeth", printed, span(gear, teeth), source)
              for source, name, gear, teeth, printed, unit in SPANS]  # fmt: skip
    return checks


def _check(key: str, name: str, printed: str, ours: float, source: str) -> Check:
    words, _, unit = key.rpartition("_")
    words, unit = (words, unit) if unit in ("mm", "in", "deg") else (key, "1")
    theirs = float(printed)
    digits = ROUNDED * 10.0 ** -len(printed.partition(".")[2])
    return Check(f"{words.replace('_', ' ')}, {name}", unit, theirs, ours, source, digits / abs(theirs))


HS, LS, HELICAL, SPUR, TR, OSU, PAPER = (
    "FVA high-speed stage 27/51", "FVA low-speed stage 23/34", "helical pair 17/43", "spur pair 17/43",
    "ISO/TR 6336-30, example 1, 17/103", "Ohio State rig 50/50", "paper's pair 21/21",
)  # fmt: skip
FVA = "drawing, REXS example of the FVA"
PUBLIC = "printed by a public gear program"
APART = "independent script"
STANDARD = "printed in ISO/TR 6336-30"
# Quantity, unit, how we have it, and what others say: pair, figure, source, half a unit of its last digit.
Ours = Callable[[GearPair], float]
Said = tuple[str, float, str, float]
GEOMETRY: list[tuple[str, str, Ours, list[Said]]] = [
    ("centre distance without backlash", "mm", lambda pair: pair.least_centre_distance,
     [(HS, 190.0, FVA, 2e-4), (LS, 190.0, FVA, 2e-4), (HELICAL, 31.9253, PUBLIC, 5e-5)]),
    ("working transverse pressure angle", "deg", lambda pair: math.degrees(pair.working_pressure_angle),
     [(HS, 22.8062, APART, 2e-4), (LS, 21.7751, APART, 2e-4), (TR, 21.0661, APART, 5e-5)]),
    ("transverse contact ratio", "1", lambda pair: pair.contact_ratio,
     [(HS, 1.4705, APART, 6e-5), (LS, 1.5376, APART, 6e-5), (SPUR, 1.6211, APART, 5e-5),
      (TR, 1.5493, APART, 6e-5)]),
    ("overlap ratio", "1", lambda pair: pair.overlap_ratio,
     [(HS, 1.2675, APART, 5e-5), (LS, 0.6293, APART, 5e-5), (TR, 1.0834, APART, 5e-5)]),
    ("roll angle, SAP", "deg", lambda pair: data_sheet(pair).pinion.start_of_active_profile.roll_deg,
     [(OSU, 14.540, APART, 4e-3)]),
    ("roll angle, LPSTC", "deg", lambda pair: _roll(data_sheet(pair).pinion.lowest_single_contact),
     [(OSU, 19.970, APART, 4e-3)]),
    ("roll angle, HPSTC", "deg", lambda pair: _roll(data_sheet(pair).pinion.highest_single_contact),
     [(OSU, 21.740, APART, 4e-3)]),
    ("roll angle, tip", "deg", lambda pair: data_sheet(pair).pinion.tip.roll_deg, [(OSU, 27.170, APART, 4e-3)]),
]  # fmt: skip
# ISO 6336-1, N/(mm um): pair, dedendum of the rack, c' and c_gamma alpha, each with its digits, source. The contact
# ratio of the standard's example is that of tip diameters in round figures.
STIFFNESS = [
    (SPUR, 1.25, 12.5049, 5e-5, 18.3300, 5e-5, PUBLIC), (HELICAL, 1.25, 12.2176, 5e-5, 16.7248, 5e-5, APART),
    (HS, 1.25, 13.7622, 5e-5, 18.6182, 5e-5, APART), (LS, 1.25, 13.2130, 5e-5, 18.5409, 5e-5, APART),
    (TR, 1.4, 12.37047, 5e-6, 17.46485, 3e-3, STANDARD),
]  # fmt: skip
# ISO 6336-3, MPa: pair, torque in N m, stress of pinion and wheel; to one decimal, by another program.
ROOT = [
    (PAPER, 100.0, 89.1, 89.1), (OSU, 340.0, 190.2, 190.2), (HS, 500.0, 70.0, 72.1), (LS, 1000.0, 66.8, 66.4),
    (SPUR, 20.0, 710.4, 648.9),
]  # fmt: skip
FACTORS = [(PAPER, 1.6686, 1.7940), (OSU, 1.1916, 2.1132)]


def geometry() -> list[Check]:
    """Return the checks of geometry."""
    return [
        Check(f"{quantity}, {name}", unit, theirs, ours(drawn(name)), source, digits / theirs)
        for quantity, unit, ours, published in GEOMETRY for name, theirs, source, digits in published
    ]  # fmt: skip


def standards() -> list[Check]:
    """Return the checks of ISO 6336 and of the inertia of discs."""
    checks = []
    for name, dedendum, single, digits, mesh, mesh_digits, source in STIFFNESS:
        pair = drawn(name)
        gears = pair.pinion, pair.wheel
        helix = abs(pair.pinion.helix_angle)
        virtual = [virtual_tooth_number(gear.teeth, helix, gear.pressure_angle) for gear in gears]
        ours = single_stiffness(
            virtual[0], virtual[1], *(g.profile_shift for g in gears), dedendum=dedendum, helix_angle_rad=helix
        )
        of_mesh = mesh_stiffness(ours, pair.contact_ratio)
        checks += [
            Check(f"c' (ISO 6336-1, B), {name}", "N/(mm µm)", single, ours, source, digits / single),
            Check(f"c_γα (ISO 6336-1, B), {name}", "N/(mm µm)", mesh, of_mesh, source, mesh_digits / mesh),
        ]
    program = "another program"
    for name, torque, *stresses in ROOT:
        ours_of: Any = nominal_root_stress(drawn(name), torque)
        checks += [
            Check(f"σ_F0 (ISO 6336-3, B), {gear}, {name}", "MPa", theirs, float(ours), program, 0.06 / theirs)
            for gear, theirs, ours in zip(("pinion", "wheel"), stresses, ours_of, strict=True)
        ]
    for name, form, correction in FACTORS:
        factors = root_factors(drawn(name).pinion, drawn(name))
        checks += [
            Check(f"Y_F (ISO 6336-3, B), {name}", "1", form, factors.form, program, 5e-5),
            Check(f"Y_S (ISO 6336-3, B), {name}", "1", correction, factors.stress_correction, program, 5e-5),
        ]
    steel = disc(75.0, 0.0, 20.0, 7810.0)
    return [
        *checks,
        Check("mass, steel disc 150 x 20 mm", "kg", 2.760, steel.mass_kg, "closed form", 2e-4),
        Check("polar inertia, steel disc 150 x 20 mm", "kg m²", 0.007763, steel.polar_kg_m2, "closed form", 2e-4),
    ]


def _roll(point: ProfilePoint | None) -> float:
    return math.nan if point is None else point.roll_deg
