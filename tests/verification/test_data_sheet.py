"""The data sheet against published ones, to the digits that they print, and against another program.

Sheets: KHK, Gear Technical Reference (also SDP/SI, Elements of Metric Gear Technology), pairs with profile shift and
tip shortening, and spans; hanslhansl/din3990, test of a pair 19/104 after ISO 21771; MESYS, gear geometry calculators;
gearcalc's pair h20. That of ISO/TR 6336-30, example 1, was computed from its data by others.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor
from pmor.case import parse_case
from pmor.gear.data_sheet import OneGear, data_sheet, span
from pmor.gear.pair import GearPair, zero_backlash_centre_distance
from pmor.gear.tooth import Tooth
from tests.support.gear_models import gear_pair, helical_pair, tooth
from tests.support.small_case import case_text

LAST_DIGIT = 0.51  # of a printed number: it is rounded, and so may its inputs be
PY_GEARWORKS = 1e-9  # relative, of its closed forms
ITS_ROOT = 1e-8  # relative: it seeks the working pressure angle to seven digits


def published(printed):
    """A printed number and its rounding: `2.50` is 2.5 +- 0.0051."""
    return pytest.approx(float(printed), abs=LAST_DIGIT * 10.0 ** -len(printed.partition(".")[2]))


def rack_gear(teeth, module, helix_deg=0.0, shift=0.0, addendum=1.0, **others):
    return Tooth(teeth, module, math.radians(20.0), math.radians(helix_deg), shift, addendum, **others)


TAN = math.tan(math.radians(20.0))
# Inputs, data of the pair, data of pinion and wheel.
SHEETS = {
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


@pytest.mark.parametrize(("distance", "allowance"), [(190.4, 0.0), (190.0, -0.1)])
def test_backlash_is_what_a_gear_turns_in_its_mate(distance, allowance):
    pair = helical_pair(4.5, (27, 51), 21.0, 0.231415, 50.0, distance)
    pair = replace(pair, pinion=replace(pair.pinion, thickness_allowance=allowance))
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


def test_limits_of_backlash_and_span_are_those_of_teeth_with_the_limits_of_their_thickness():
    gears = tooth(21, 0.2, 15.0), tooth(33, 0.1, -15.0)
    distance = zero_backlash_centre_distance(*gears)
    limits = (-0.11, -0.07), (-0.13, -0.08)

    def sheet_of(allowances, *said):
        made = [replace(g, thickness_allowance=a) for g, a in zip(gears, allowances, strict=True)]
        return data_sheet(GearPair(*made, 30.0, distance), None, *said)

    mean = sheet_of([0.5 * sum(pair) for pair in limits], tuple(OneGear(allowances=pair) for pair in limits))
    thick, thin = (sheet_of([pair[end] for pair in limits]) for end in (1, 0))
    assert_allclose(mean.least_normal_backlash_mm, thick.normal_backlash_mm, rtol=1e-9)
    assert_allclose(mean.largest_normal_backlash_mm, thin.normal_backlash_mm, rtol=1e-9)
    # What is taken off all teeth along the normal is the backlash: no factor of the helix.
    assert_allclose(thick.normal_backlash_mm, (0.07 + 0.08) * math.cos(math.radians(20.0)), rtol=1e-9)
    for gear in ("pinion", "wheel"):
        found = getattr(mean, gear)
        assert_allclose(found.least_span_mm, getattr(thin, gear).span_mm, rtol=1e-12)
        assert_allclose(found.largest_span_mm, getattr(thick, gear).span_mm, rtol=1e-12)


def test_thinner_teeth_are_those_that_the_rack_cuts_deeper_under_the_same_tip():
    thin = tooth(21, 0.2, 15.0, thickness_allowance=-0.1, tip_shortening=0.3)
    shift = 0.2 - 0.1 / (2.0 * thin.module * TAN)
    deeper = tooth(21, shift, 15.0, addendum=1.0 + 0.2 - shift - 0.3 / thin.module)
    roll = np.linspace(thin.form_roll_angle, thin.tip_roll_angle, 7)
    assert_allclose(roll, np.linspace(deeper.form_roll_angle, deeper.tip_roll_angle, 7), rtol=1e-12)
    assert_allclose(thin.flank_section(roll), deeper.flank_section(roll), rtol=1e-12)
    share = np.linspace(0.0, 1.0, 9)
    assert_allclose(thin.root_section(share), deeper.root_section(share), rtol=1e-11)


def test_a_case_with_allowances_keeps_its_distance_and_gets_backlash():
    keys = {"tooth_thickness_allowance_um": [-70.0, -110.0], "tip_shortening_mm": 0.1}
    case, plain = (parse_case(case_text(pinion=more), "small", "case") for more in (keys, {}))
    sheet, without = pmor.geometry(case), pmor.geometry(plain)
    assert sheet.centre_distance_mm == without.centre_distance_mm
    assert_allclose(sheet.normal_backlash_mm, 2.0 * 0.09 * math.cos(math.radians(20.0)), rtol=1e-9)
    assert_allclose(sheet.least_normal_backlash_mm, 2.0 * 0.07 * math.cos(math.radians(20.0)), rtol=1e-9)
    assert_allclose(sheet.pinion.tip_diameter_mm, without.pinion.tip_diameter_mm - 0.2, rtol=1e-12)
    assert sheet.transverse_contact_ratio < without.transverse_contact_ratio
    assert pmor.change_case(case, title="again").pair == case.pair


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (90.0, "looks like what is taken off: 90 um = -90 um, write -90.0"),
        ([-1.0, -2.0, -3.0], "one value or two, the lower"),
    ],
)
def test_an_allowance_with_the_wrong_sign_or_too_many_values_is_refused(value, words):
    with pytest.raises(pmor.CaseError, match="tooth_thickness_allowance_um") as refused:
        parse_case(case_text(pinion={"tooth_thickness_allowance_um": value}), "small", "case")
    assert words in str(refused.value)
