"""The data sheet against published ones, to the digits that they print, and against another program.

Sheets: KHK, Gear Technical Reference (also SDP/SI, Elements of Metric Gear Technology), pairs with profile shift and
tip shortening, and spans; hanslhansl/din3990, test of a pair 19/104 after ISO 21771; MESYS, gear geometry calculators;
gearcalc's pair h20. That of ISO/TR 6336-30, example 1, was computed from its data by others.
"""

import math

import pytest
from numpy.testing import assert_allclose

from pmor.gear.data_sheet import data_sheet, span
from pmor.gear.pair import GearPair, zero_backlash_centre_distance
from pmor.gear.tooth import Tooth
from tests.support.gear_models import gear_pair, helical_pair, tooth

LAST_DIGIT = 0.51  # of a printed number: it is rounded, and so may its inputs be
PY_GEARWORKS = 1e-9  # relative, of its closed forms
ITS_ROOT = 1e-8  # relative: it seeks the working pressure angle to seven digits


def published(printed):
    """A printed number and its rounding: `2.50` is 2.5 +- 0.0051."""
    return pytest.approx(float(printed), abs=LAST_DIGIT * 10.0 ** -len(printed.partition(".")[2]))


def rack_gear(teeth, module, helix_deg=0.0, shift=0.0, addendum=1.0, **others):
    return Tooth(teeth, module, math.radians(20.0), math.radians(helix_deg), shift, addendum, **others)


# Inputs, data of the pair, data of pinion and wheel.
SHEETS = {
    "KHK spur 12/24": (
        (rack_gear(12, 3.0, 0.0, 0.6, 4.42 / 3.0 - 0.6), rack_gear(24, 3.0, 0.0, 0.36, 3.7 / 3.0 - 0.36)), None,
        {"working_transverse_pressure_angle_deg": "26.0886", "reference_centre_distance_mm": "54.000",
         "sum_of_profile_shifts": "0.960", "transverse_contact_ratio": "1.202", "centre_distance_mm": "56.500"},
        {"reference_diameter_mm": ("36.000", "72.000"), "base_diameter_mm": ("33.8289", "67.6579"),
         "working_pitch_diameter_mm": ("37.667", "75.333"), "tip_diameter_mm": ("44.840", "79.400"),
         "root_diameter_mm": ("32.100", "66.660")},
    ),
    "KHK helical 12/60": (
        (rack_gear(12, 3.0, 30.0, 0.09809, 0.99935), rack_gear(60, 3.0, -30.0, 0.0, 0.99935)), None,
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
}  # fmt: skip
WIDTHS = {"ISO/TR 6336-30 helical 17/103": 100.0, "gearcalc helical 17/43": 10.0}


@pytest.mark.parametrize("name", SHEETS)
def test_data_sheets_are_the_published_ones_to_their_last_digit(name):
    gears, distance, of_pair, of_gears = SHEETS[name]
    pair = GearPair(*gears, WIDTHS.get(name, 20.0), distance or zero_backlash_centre_distance(*gears))
    sheet = data_sheet(pair)
    for key, printed in of_pair.items():
        assert getattr(sheet, key) == published(printed), key
    for key, both in of_gears.items():
        for gear, printed in zip((sheet.pinion, sheet.wheel), both, strict=True):
            assert getattr(gear, key) == published(printed), key


@pytest.mark.parametrize(
    ("gear", "teeth", "printed"),
    [(rack_gear(24, 3.0, 0.0, 0.4), 4, "32.8266"), (rack_gear(24, 3.0, 25.0, 0.4), 5, "42.0085"),
     (rack_gear(20, 1.0), 2, "4.7083")],
)  # fmt: skip
def test_spans_are_the_published_ones(gear, teeth, printed):
    assert span(gear, teeth) == published(printed)


def test_points_of_the_profile_are_those_of_a_public_pair():
    # Kahraman and Blankenship's pair: roll angles that their relief starts at, and those computed for it, deg.
    sheet = data_sheet(GearPair(rack_gear(50, 3.0), rack_gear(50, 3.0), 20.0, 150.0))
    points = (
        sheet.pinion.start_of_active_profile, sheet.pinion.lowest_single_contact, sheet.pinion.pitch_point,
        sheet.pinion.highest_single_contact, sheet.pinion.tip,
    )  # fmt: skip
    assert_allclose([p.roll_deg for p in points], [14.540, 19.970, 20.854, 21.740, 27.170], rtol=0.0, atol=4e-3)
    assert_allclose(points[3].roll_length_mm - points[0].roll_length_mm, sheet.base_pitch_mm, rtol=1e-12)


# Computed by py_gearworks 0.0.24 (tip_truncation 0, dedendum_coefficient 1.25): distances without backlash, and with
# 0.1 mm of it on the line of action; base radius, base half angle, tip and root radius of each gear. Its contact ratios
# of shifted pairs are left out: for 19/104 it has 1.389 where 1.536 is published.
RECORDED = {
    "helical": (
        helical_pair(4.5, (27, 51), 21.0, 0.231415, 50.0), 189.99999916255172,
        (60.627451961067116, 0.08254286045138068, 70.61342586344948, 60.4884258634495),
        (114.51852037090455, 0.052229088419653937, 128.45525551984903, 118.33025551984886),
    ),
    "spur": (
        gear_pair(tooth(19, 0.5), tooth(104, 0.15)), 248.50684335517116,
        (35.70831958986452, 0.11673420287055244, 43.999999999999666, 34.999999999999986),
        (195.45606512346896, 0.031058108839209418, 212.60000000204403, 203.59999999999968),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", RECORDED)
def test_data_sheets_are_those_of_py_gearworks(name):
    pair, distance, *gears = RECORDED[name]
    sheet = data_sheet(pair)
    assert_allclose(sheet.zero_backlash_centre_distance_mm, distance, rtol=ITS_ROOT)
    for found, (base, half_angle, tip, root) in zip((sheet.pinion, sheet.wheel), gears, strict=True):
        theirs = 2.0 * base, 2.0 * base * half_angle, 2.0 * tip, 2.0 * root
        ours = found.base_diameter_mm, found.base_tooth_thickness_mm, found.tip_diameter_mm, found.root_diameter_mm
        assert_allclose(ours, theirs, rtol=PY_GEARWORKS)


def test_backlash_is_what_a_gear_turns_in_its_mate():
    pair = helical_pair(4.5, (27, 51), 21.0, 0.231415, 50.0, 190.4)
    sheet = data_sheet(pair)
    # Tooth and space on the working pitch circles, whose arcs are the same on both gears.
    angle = pair.working_pressure_angle
    arcs = [2.0 * t.base_radius / math.cos(angle) * t.half_thickness_angle(math.tan(angle))
            for t in (pair.pinion, pair.wheel)]  # fmt: skip
    pitch = pair.pinion.angular_pitch * 0.5 * sheet.pinion.working_pitch_diameter_mm
    assert_allclose(sheet.circumferential_backlash_mm, pitch - sum(arcs), rtol=1e-11)
    helix = math.radians(sheet.base_helix_angle_deg)
    assert_allclose(sheet.normal_backlash_mm, sheet.transverse_backlash_mm * math.cos(helix), rtol=1e-14)
    turned = math.radians(sheet.pinion.angular_backlash_deg) * 0.5 * sheet.pinion.working_pitch_diameter_mm
    assert_allclose(turned, sheet.circumferential_backlash_mm, rtol=1e-12)
