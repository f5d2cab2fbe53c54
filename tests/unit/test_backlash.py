"""Backlash of a drawing: what is told gives the least one that is recommended, and hardly more."""

import math
import re

import pytest

from pmor.case import change_case, parse_case
from pmor.pair.backlash import backlash_remarks, normal_backlash
from pmor.pair.model import gear_pair
from tests.support.small_case import case_text

SPUR = parse_case(case_text(contact={"scheme": "line"}, reduction=None), "spur", "spur.toml")
RING = {"pair": {"module_mm": 2.0}, "pinion": {"teeth": 22, "bore_radius_mm": 12.0}, "wheel": {
    "internal": True, "teeth": 61, "addendum": 0.85, "rim_thickness_mm": 8.0
}}  # fmt: skip
# Steps of 1 um of the thickness of each tooth, and of 0.01 mm between the axes, give at most so much more, mm.
MORE = 0.009


def least(case):
    """2/3 (0.06 + 0.0005 a + 0.03 m_n), ISO/TR 10064-2, for a pair that is drawn without backlash."""
    return 2.0 / 3.0 * (0.06 + 0.0005 * abs(gear_pair(case).centre_distance) + 0.03 * case.pair.module_mm)


@pytest.mark.parametrize("case", [
    SPUR, change_case(SPUR, pair={"helix_angle_deg": 15.0}), change_case(SPUR, **RING)
])  # fmt: skip
def test_what_is_told_gives_the_least_usual_backlash(case):
    (remark,) = backlash_remarks(case)
    assert not remark.bad
    assert remark.text.startswith("no backlash is drawn: ")
    (taken,) = set(map(float, re.findall(r"allowance_um = \[(-\d+)\]", remark.text)))
    (apart,) = map(float, re.findall(r"centre_distance_mm = ([\d.]+) in \[pair\]", remark.text))
    gears = dict.fromkeys(re.findall(r"\[(pinion|wheel)\]", remark.text), {"tooth_thickness_allowance_um": (taken,)})
    for keys in (gears, {"pair": {"centre_distance_mm": apart}}):
        changed = change_case(case, **keys)
        assert 0.0 <= normal_backlash(gear_pair(changed)) - least(case) < MORE
        assert backlash_remarks(changed) == []
    # Two flanks that stand off by half the allowance each, as seen along the normal.
    thin = normal_backlash(gear_pair(change_case(case, **gears)))
    assert thin == pytest.approx(-2e-3 * taken * math.cos(math.radians(case.pair.pressure_angle_deg)), rel=1e-9)


def test_too_little_that_is_drawn_is_not_good():
    """Half of a pair: its wheel is the pinion once more."""
    (remark,) = backlash_remarks(change_case(SPUR, pinion={"tooth_thickness_allowance_um": (-20.0,)}))
    assert remark.bad
    assert remark.text.startswith("normal backlash is 0.038 mm: ")
