"""Where reliefs start and end: five measures of one place, there and back, and the same flank by each of them."""

import math
from dataclasses import fields, replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor
from pmor.case import parse_case, text_of
from pmor.core.errors import CaseError
from pmor.gear.flank_deviation import kernel_deviation
from pmor.gear.modification import RELIEF_PLACES, UNMODIFIED, Modification
from pmor.gear.profile import ProfilePoint, profiles
from tests.support.gear_models import gear_pair, helical_pair, tooth
from tests.support.small_case import case_text

THERE_AND_BACK = 1e-9  # relative, and deg of roll near the base circle
PAIRS = {
    "spur": gear_pair(tooth(21), tooth(33), extra_distance=0.3),
    "shifted": gear_pair(tooth(17, 0.4), tooth(31, 0.1)),
    "undercut": gear_pair(tooth(10), tooth(30)),
    "helical": helical_pair(4.5, (27, 51), 21.0, 0.231415, 50.0, 190.0),
}
MEASURES = [item.name for item in fields(ProfilePoint)]


@pytest.mark.parametrize("name", PAIRS)
@pytest.mark.parametrize("measure", MEASURES)
def test_a_place_on_the_profile_is_found_again_from_each_measure(name, measure):
    for profile in profiles(PAIRS[name]):
        for share in (0.02, 0.4, 0.6, 0.999):
            roll = profile.start + share * (profile.tip - profile.start)
            value = getattr(profile.point(roll), measure)
            back = profile.roll_at(measure, value)
            assert_allclose(math.degrees(back), math.degrees(roll), rtol=THERE_AND_BACK, atol=THERE_AND_BACK)
            assert_allclose(getattr(profile.point(back), measure), value, rtol=THERE_AND_BACK)
            step = 1e-5 * abs(value)
            quotient = (profile.roll_at(measure, value + step) - profile.roll_at(measure, value - step)) / (2.0 * step)
            assert_allclose(profile.roll_rate(measure, value), quotient, rtol=1e-6)


def test_measures_are_those_of_the_drawing():
    pair = PAIRS["helical"]
    pinion, wheel = pair.pinion, pair.wheel
    for number, (gear, profile) in enumerate(zip((pinion, wheel), profiles(pair), strict=True)):
        start, end, tip = (profile.point(roll) for roll in (profile.start, profile.end, profile.tip))
        assert_allclose((start.percent, end.percent), (0.0, 100.0), atol=1e-12)
        assert_allclose((start.from_start_mm, tip.to_tip_mm), 0.0, atol=1e-12)
        assert_allclose(tip.diameter_mm, 2.0 * gear.tip_radius, rtol=1e-14)
        # Along the path of contact the pinion's way up is the wheel's way down.
        assert_allclose(end.roll_length_mm - start.roll_length_mm, pair.contact_ratio * pinion.base_pitch, rtol=1e-12)
        facing = profiles(pair)[1 - number]
        mate = facing.point(facing.end).roll_length_mm
        assert_allclose(start.roll_length_mm + mate, pair.action_length, rtol=1e-12)


@pytest.mark.parametrize("way", range(5))
def test_a_flank_is_the_same_whichever_measure_says_where_its_relief_starts(way):
    pair = PAIRS["spur"]
    profile, face = profiles(pair)[1], (-10.0, 10.0)
    tip, root = (profile.start + share * (profile.end - profile.start) for share in (0.6, 0.2))
    values = {"tip_relief_um": 20.0, "root_relief_um": 8.0}
    for amount, roll in (("tip_relief_um", tip), ("root_relief_um", root)):
        key, measure = list(RELIEF_PLACES[amount].items())[way]
        values[key] = getattr(profile.point(roll), measure)
    found = kernel_deviation(Modification(**values), pair.wheel, pair.active_rolls[1], face)
    assert_allclose(found.tip_relief_start, tip, rtol=THERE_AND_BACK)
    assert_allclose(found.root_relief_end, root, rtol=THERE_AND_BACK)
    by_roll = profile.in_roll_angles(Modification(**values))
    assert_allclose((by_roll.tip_relief_start_roll_deg, by_roll.root_relief_end_roll_deg), np.degrees([tip, root]))
    assert [by_roll.place_of(amount) for amount in RELIEF_PLACES] == [next(iter(p)) for p in RELIEF_PLACES.values()]


def case_of(wheel, text=""):
    return parse_case(case_text(**{"wheel.modification": {"tip_relief_um": 20.0} | wheel}) + text, "small", "case")


def test_the_sheet_has_a_relief_in_all_measures():
    start = pmor.geometry(case_of({"tip_relief_start_percent": "60 %"})).wheel.tip_relief_start
    assert_allclose(start.percent, 60.0, rtol=THERE_AND_BACK)
    for key, measure in RELIEF_PLACES["tip_relief_um"].items():
        again = pmor.geometry(case_of({key: getattr(start, measure)}))
        assert_allclose(again.wheel.tip_relief_start.roll_deg, start.roll_deg, rtol=THERE_AND_BACK)
        assert again.pinion.tip_relief_start is None
        assert f"{start.diameter_mm:.4f}" in str(again)
        assert f"{start.diameter_mm:.4f}" in again._repr_html_()


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({}, "tip_relief_um = 20.0: needs the place at which it starts: add tip_relief_start_roll_deg or"),
        ({"tip_relief_start_roll_deg": 25.0, "tip_relief_length_mm": 3.0}, "tip_relief_start_roll_deg and "
         "tip_relief_length_mm: both say the place at which it starts: leave out all but one"),
        ({"tip_relief_start_percent": 0.6}, "looks like a share: 0.6 of 1 = 60 %, write 60.0"),
        ({"tip_relief_start_diameter_mm": 45.0}, "looks like a radius: write 90"),
        ({"tip_relief_length_mm": 300.0}, "between 0 and 20.9594 mm: lower it"),
        ({"tip_relief_start_percent": "sixty"}, "must be a number: remove the quotes"),
    ],
)  # fmt: skip
def test_a_place_that_is_missing_double_or_off_the_flank_is_refused_in_words(keys, words):
    with pytest.raises(CaseError) as refused:
        pmor.geometry(case_of(keys))
    assert words in str(refused.value)


def test_a_place_said_otherwise_replaces_that_of_the_case():
    case = case_of({"tip_relief_start_roll_deg": 25.0})
    changed = pmor.change_case(case, **{"wheel.modification": {"tip_relief_start_percent": 60.0}})
    assert changed.wheel_modification == replace(
        case.wheel_modification, tip_relief_start_roll_deg=None, tip_relief_start_percent=60.0
    )
    text = '[[condition]]\nname = "short"\n[condition.wheel]\ntip_relief_length_mm = 3.0\n'
    listed = case_of({"tip_relief_start_roll_deg": 25.0}, text)
    (condition,) = listed.conditions
    assert condition.wheel == replace(case.wheel_modification, tip_relief_start_roll_deg=None, tip_relief_length_mm=3.0)
    again = parse_case(text_of(replace(listed, title="again")), "small", "case")
    assert again.conditions == listed.conditions
    assert UNMODIFIED.changed({"tip_relief_start_percent": 50.0}).tip_relief_start_percent == 50.0
