"""Nominal root stress after ISO 6336-3; its figures beside those of another program are in `pmor.validation`."""

from pmor.gear.classical.iso6336_root import nominal_root_stress, root_factors
from pmor.gear.pair import GearPair, zero_backlash_centre_distance
from pmor.gear.tooth import Tooth
from tests.support.gear_models import ALPHA


def test_a_sharp_corner_has_no_nominal_stress():
    sharp = Tooth(40, 4.0, ALPHA, rack_tip_radius=0.0, dedendum=1.0, profile_shift=0.8)
    pair = GearPair(sharp, sharp, 20.0, zero_backlash_centre_distance(sharp, sharp))
    assert not root_factors(sharp, pair).in_range
    assert nominal_root_stress(pair, 100.0) == (None, None)
