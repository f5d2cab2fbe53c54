"""Nominal root stress after ISO 6336-3: stresses and factors of another program, to the digits that it gave."""

import pytest
from numpy.testing import assert_allclose

from pmor.case import load_case
from pmor.gear.classical.iso6336_root import nominal_root_stress, root_factors
from pmor.gear.pair import GearPair, zero_backlash_centre_distance
from pmor.gear.tooth import Tooth
from pmor.pair.model import gear_pair
from tests.support.gear_models import ALPHA, helical_pair

PAIRS = [
    (gear_pair(load_case("cases/paper_spur.toml")), 100.0, (89.1, 89.1)),
    (gear_pair(load_case("cases/osu_spur.toml")), 340.0, (190.2, 190.2)),
    (gear_pair(load_case("cases/fva_high_speed.toml")), 500.0, (70.0, 72.1)),
    (gear_pair(load_case("cases/fva_low_speed.toml")), 1000.0, (66.8, 66.4)),
    (helical_pair(1.0, (17, 43), 0.0, 0.0, 10.0, 30.0), 20.0, (710.4, 648.9)),
]


@pytest.mark.parametrize(("pair", "torque", "expected"), PAIRS)
def test_nominal_root_stress(pair, torque, expected):
    assert_allclose(nominal_root_stress(pair, torque), expected, rtol=0.0, atol=0.06)


@pytest.mark.parametrize(("pair", "form", "correction"), [(PAIRS[0][0], 1.6686, 1.7940), (PAIRS[1][0], 1.1916, 2.1132)])
def test_factors_of_the_papers_and_the_ohio_pair(pair, form, correction):
    factors = root_factors(pair.pinion, pair)
    assert_allclose([factors.form, factors.stress_correction, factors.helix], [form, correction, 1.0], atol=5e-5)
    assert factors.in_range


def test_a_sharp_corner_has_no_nominal_stress():
    sharp = Tooth(40, 4.0, ALPHA, rack_tip_radius=0.0, dedendum=1.0, profile_shift=0.8)
    pair = GearPair(sharp, sharp, 20.0, zero_backlash_centre_distance(sharp, sharp))
    assert not root_factors(sharp, pair).in_range
    assert nominal_root_stress(pair, 100.0) == (None, None)
