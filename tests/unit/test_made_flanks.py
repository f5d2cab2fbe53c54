"""Flanks that are made to a class of accuracy: what they are as large as, and where on a gear they are."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.gear.flank_deviation import kernel_deviation
from pmor.gear.kernels.deviation import flank_deviation
from pmor.gear.made_flanks import NominalFlank, draw_flank, flank_tolerances, form_um, nominal_flanks, with_made
from pmor.gear.modification import Modification
from pmor.gear.pair import GearPair
from pmor.gear.tooth import Tooth
from pmor.gear.topography import Topography

WIDTH = 20.0
# Rounds of a fixed point, to the last digits.
FOUND = 1e-9


def pair(teeth, mate, helix=0.0):
    keys = {"module": 4.0, "pressure_angle": math.radians(20.0)}
    tooth = Tooth(teeth=teeth, **keys, helix_angle=helix)
    other = {"addendum": 0.8, "root_fillet": 0.6} if mate < 0 else {}
    wheel = Tooth(teeth=mate, **keys, helix_angle=helix if mate < 0 else -helix, **other)
    return GearPair(tooth, wheel, WIDTH, tooth.reference_radius + wheel.reference_radius)


def test_tolerances_are_those_of_the_standard_and_grow_by_the_root_of_two_from_class_to_class():
    """ISO 1328-1:2013, equations (3) to (9) by hand: module 3 mm, diameter 144 mm, width 25 mm."""
    found = flank_tolerances(3.0, 144.0, 25.0, 5)
    expected = [6.344, 0.288 + 6.6 + 2.1 + 12.0, 5.344, 6.65, 0.6 + 1.75 + 4.0, 0.84 + 2.25 + 4.0]
    assert_allclose(found, expected, rtol=1e-12)
    assert_allclose(flank_tolerances(3.0, 144.0, 25.0, 8), np.array(found) * 2.0**1.5, rtol=1e-12)


@pytest.mark.parametrize(("gears", "number"), [((21, 33), 0), ((21, 33), 1), ((24, -60), 1), ((150, 31), 0)])
def test_all_that_is_drawn_is_as_large_as_its_class_allows(gears, number):
    """Pitch along the reference circle, single and in all; slopes of the worst tooth; form by profile or by helix."""
    flank, grade = nominal_flanks(pair(*gears))[number], 7
    allowed, rng = flank.tolerances(grade), np.random.default_rng(4)
    drawn = [draw_flank(flank, grade, (1.4, 2.3), rng) for _ in range(5)]
    for made in drawn:
        pitch = made.pitch_um / math.cos(flank.tooth.transverse_pressure_angle)
        assert np.abs(pitch - np.roll(pitch, 1)).max() == pytest.approx(allowed.single_pitch, rel=FOUND)
        assert np.ptp(pitch) == pytest.approx(allowed.total_pitch, rel=FOUND)
        assert np.abs(made.profile_slope_um).max() == pytest.approx(allowed.profile_slope, rel=FOUND)
        assert np.abs(made.helix_slope_um).max() == pytest.approx(allowed.helix_slope, rel=FOUND)
        form = np.array(form_um(flank, made.waves)) / (allowed.profile_form, allowed.helix_form)
        assert form.max() == pytest.approx(1.0, rel=FOUND)
        assert [wave.count for wave in made.waves] == [round(1.4 * flank.teeth), round(2.3 * flank.teeth)]
    assert np.ptp([made.waves[0].phase_deg for made in drawn]) > 90.0
    again = draw_flank(flank, grade, (1.4, 2.3), np.random.default_rng(4))
    assert again.errors() == drawn[0].errors()
    assert draw_flank(flank, grade, (), rng).waves == ()


def test_pitches_of_few_teeth_stay_within_their_class():
    """The wave around the gear alone takes up single pitches: sums of pitches are then below what is allowed."""
    keys = {"pressure_angle": math.radians(25.0), "profile_shift": 0.5, "rack_tip_radius": 0.3, "addendum": 0.7}
    few = NominalFlank(Tooth(teeth=7, module=4.0, **keys), (0.3, 0.9), WIDTH)
    for seed in range(5):
        pitch = draw_flank(few, 5, (), np.random.default_rng(seed)).pitch_um / math.cos(math.radians(25.0))
        allowed = few.tolerances(5)
        assert np.abs(pitch - np.roll(pitch, 1)).max() <= allowed.single_pitch * (1.0 + FOUND)
        assert np.ptp(pitch) <= allowed.total_pitch * (1.0 + FOUND)


GRID = Topography((0.0, 20.0, 60.0), (-10.0, 0.0, 10.0), ((1.0, 3.0, 2.0),) * 3)


@pytest.mark.parametrize("topography", [None, GRID])
def test_made_flanks_lie_on_top_of_those_of_the_case(topography):
    """Of each tooth, at both ends of its profile and of its face: place, half of both slopes, and waves."""
    one = pair(21, 33)
    flank = nominal_flanks(one)[0]
    own = Modification(tip_relief_um=9.0, tip_relief_length_mm=2.0, topography=topography)
    made = draw_flank(flank, 6, (2.3,), np.random.default_rng(1))
    face = -0.5 * WIDTH, 0.5 * WIDTH
    before, after, waves = (
        kernel_deviation(m, one.pinion, flank.active, face)
        for m in (own, with_made(own, made, flank), Modification(waves=made.waves))
    )
    middle = np.median(made.pitch_um)
    for tooth in (0, 3, 20):
        for side, u in zip((-0.5, 0.5), flank.active, strict=True):
            for end, z in zip((-0.5, 0.5), face, strict=True):
                added = 1e3 * (flank_deviation(after, u, z, tooth) - flank_deviation(before, u, z, tooth))
                expected = made.pitch_um[tooth] - middle + side * made.profile_slope_um[tooth]
                expected += end * made.helix_slope_um[tooth] + 1e3 * flank_deviation(waves, u, z, tooth)
                assert added == pytest.approx(expected, abs=1e-9)
