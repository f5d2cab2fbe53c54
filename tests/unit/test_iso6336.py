"""ISO 6336: dynamic factor, face load factor, root stress, light blanks."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.body.beam import Beam, CircularSection, ShaftMaterial
from pmor.case import change_case, parse_case
from pmor.dynamics.rating import iso_factor
from pmor.gear.classical.iso6336 import (
    DynamicFactor,
    face_load_factor,
    rim_factor,
    running_in,
    shaft_misalignment,
    single_from_mesh_stiffness,
    sliced_face_load_factor,
    web_factor,
)
from pmor.gear.classical.iso6336_root import nominal_root_stress, root_factors
from pmor.gear.made_flanks import flank_tolerances
from pmor.gear.pair import GearPair, zero_backlash_centre_distance
from pmor.gear.tooth import Tooth
from pmor.machine.iso import sliced_k_h_beta
from pmor.machine.mesh_force import f_beta_um
from pmor.pair.model import gear_pair
from tests.support.gear_models import ALPHA
from tests.support.gearboxes import SMALL_CASE
from tests.support.small_case import case_with


def test_a_sharp_corner_has_no_nominal_stress():
    sharp = Tooth(40, 4.0, ALPHA, rack_tip_radius=0.0, dedendum=1.0, profile_shift=0.8)
    pair = GearPair(sharp, sharp, 20.0, zero_backlash_centre_distance(sharp, sharp))
    assert not root_factors(sharp, pair).in_range
    assert nominal_root_stress(pair, 100.0) == (None, None)


# Half of the fourth digit.
DIGITS = 5.001e-5
WEBS, RIMS = (0.2, 0.4, 0.6, 0.8), (1.0, 2.0, 4.0, 7.0)
C_R = [
    [0.7365, 0.7842, 0.8554, 0.9206],
    [0.8500, 0.8772, 0.9177, 0.9548],
    [0.9164, 0.9315, 0.9541, 0.9748],
    [0.9635, 0.9701, 0.9799, 0.9890],
]
Y_B = {0.5: 2.4008, 0.6: 2.1091, 0.8: 1.6488, 1.0: 1.2918, 1.2: 1.0}


def test_webs_soften_teeth_as_tabulated():
    assert_allclose([[web_factor(web, rim) for rim in RIMS] for web in WEBS], C_R, rtol=0.0, atol=DIGITS)


def test_beyond_its_range_the_nearest_web_and_rim_count():
    assert web_factor(0.05, 0.3) == web_factor(0.2, 1.0)
    assert web_factor(2.0, 4.0) == web_factor(1.2, 4.0) > 1.0
    assert web_factor(1.0, 4.0) == 1.0


@pytest.mark.parametrize("rim", Y_B)
def test_thin_rims_raise_root_stress_as_tabulated(rim):
    assert_allclose(rim_factor(rim), Y_B[rim], rtol=0.0, atol=DIGITS)


def test_thick_rims_do_not_raise_root_stress_and_thinner_ones_than_half_a_tooth_are_not_rated():
    assert rim_factor(3.0) == 1.0
    assert_allclose(rim_factor(1.2 - 1e-9), 1.0, atol=3e-3)  # the standard's two branches nearly meet
    assert rim_factor(0.49) is None


def test_thinner_rims_are_never_better():
    assert (np.diff([rim_factor(rim) for rim in np.linspace(0.5, 2.0, 40)]) <= 1e-3).all()


FACTOR = DynamicFactor(
    line_load=200.0, stiffness=14.0, contact_ratio=1.7, pitch_um=8.0, form_um=7.0, relief_um=None
)  # fmt: skip


@pytest.mark.parametrize(
    ("ratio", "by_hand"),
    [
        # B_p = 14 8 / 200 = 0.56, B_f = 14 7 / 200 = 0.49, B_k = 1
        (0.5, 1.0 + 0.5 * (0.32 * 0.56 + 0.34 * 0.49 + 0.23)),
        (1.0, 1.0 + 0.32 * 0.56 + 0.34 * 0.49 + 0.90),
        (2.0, 0.47 * 0.56 + 0.47 * 0.49 + 0.125 * math.sin(-0.3 * math.pi) + 0.875),
    ],
)
def test_each_range_is_what_it_is_by_hand(ratio, by_hand):
    np.testing.assert_allclose(FACTOR.at(np.array([ratio])), by_hand, rtol=1e-12)


def test_ranges_meet_but_for_the_step_into_the_main_resonance():
    _, end, far = FACTOR.limits
    for limit in (end, far):
        around = FACTOR.at(limit * np.array([1.0 - 1e-9, 1.0 + 1e-9]))
        np.testing.assert_allclose(around[0], around[1], rtol=1e-8)
    below, amid = FACTOR.at(0.85 * np.array([1.0 - 1e-9, 1.0 + 1e-9]))
    assert amid > below + 0.5


def test_the_main_resonance_begins_earlier_under_a_light_load():
    assert FACTOR.main_begin == pytest.approx(0.85)
    assert replace(FACTOR, line_load=25.0).main_begin == pytest.approx(0.675)


def test_weights_of_both_ranges_of_the_contact_ratio_meet_at_two():
    """The table gives numbers up to a contact ratio of 2 and formulas beyond: they differ by 7 % at most there."""
    ratio = np.array([0.5, 1.0, 1.3, 2.0])
    short, long = (replace(FACTOR, contact_ratio=2.0 + by).at(ratio) for by in (0.0, 1e-9))
    np.testing.assert_allclose(long, short, rtol=0.07)
    assert not np.allclose(long, short, rtol=1e-3)
    assert replace(FACTOR, contact_ratio=3.0).at(np.array([1.0]))[0] < FACTOR.at(np.array([1.0]))[0]


def test_relief_made_for_the_load_takes_the_stiffness_cycle_away():
    relieved = replace(FACTOR, pitch_um=0.0, form_um=0.0, relief_um=200.0 / 14.0)
    np.testing.assert_allclose(relieved.at(np.array([0.5, 1.0])), 1.0, rtol=1e-12)
    assert replace(relieved, line_load=400.0).at(np.array([1.0]))[0] > 1.4


def test_the_stiffness_of_one_pair_is_that_whose_mesh_stiffness_was_given():
    assert single_from_mesh_stiffness(20.0, 1.6) == pytest.approx(20.0 / 1.45)


def test_the_inputs_of_a_pair_are_those_of_the_standard():
    """Deviations of the gear that may have the larger ones, the pitch along the line of action, both reliefs' mean."""
    relief = {"tip_relief_start_roll_deg": 25.0}
    case = case_with(
        wheel={"teeth": 57, "bore_radius_mm": 40.0}, pair={"helix_angle_deg": 20.0}, mesh={"width": "whole"},
        **{"pinion.modification": relief | {"tip_relief_um": 10.0}, "dynamics": {"accuracy_grade": 5},
           "wheel.modification": relief | {"tip_relief_um": 30.0}},
    )  # fmt: skip
    pair = gear_pair(case)
    factor = iso_factor(case, pair, {"torque_Nm": 100.0, "mesh_stiffness_mean_N_per_um": 300.0})
    allowed = flank_tolerances(4.0, 57 * 4.0 / math.cos(math.radians(20.0)), 20.0, 5)
    transverse = math.atan(math.tan(math.radians(20.0)) / math.cos(math.radians(20.0)))
    np.testing.assert_allclose(factor.pitch_um, allowed.single_pitch * math.cos(transverse), rtol=1e-12)
    np.testing.assert_allclose(factor.form_um, allowed.profile_form, rtol=1e-12)
    assert factor.relief_um == 20.0
    radius = 0.5 * 21 * 4.0 / math.cos(math.radians(20.0))
    np.testing.assert_allclose(factor.line_load, 1e5 / (radius * 20.0), rtol=1e-12)


EXACT = [(4 / 3, 1.66667), (2.0, 2.0), (8 / 3, 2.30940), (16 / 3, 3.26599), (32 / 3, 4.61880)]


@pytest.mark.parametrize(("size", "factor"), EXACT)
def test_face_load_factor_is_that_of_slices_that_are_not_coupled(size, factor):
    """Thin slices of stiffness c under F_by c / w, exactly: partly lifted off from 2 on."""
    assert_allclose(face_load_factor(size * 150.0 / 20.0, 20.0, 150.0), factor, rtol=1e-5)


@pytest.mark.parametrize(("size", "factor"), EXACT)
@pytest.mark.parametrize("turned", [1.0, -1.0])
def test_slices_over_any_gap_have_the_exact_factor_of_a_tilt(size, factor, turned):
    """The largest is half a slice from the end."""
    z = (np.arange(4000) + 0.5) / 4000
    overlap = 7.0 + turned * size * 150.0 / 20.0 * z
    assert_allclose(sliced_face_load_factor(overlap, 150.0), factor, rtol=2e-3)
    assert_allclose(sliced_face_load_factor(np.full(7, -3.0), 150.0), 1.0, rtol=1e-12)


def test_slices_of_a_mesh_see_its_shafts_its_axes_and_its_flanks():
    """A tilt of the hubs alone; levelled by a helix slope of either gear, or by the axes of the case."""
    case = parse_case(SMALL_CASE, "small", "small")
    pair, moved = gear_pair(case), np.zeros((2, 6))
    moved[:, 3:5] = [[1.5e-4, -4e-4], [-2e-4, 3e-4]]
    mesh = SimpleNamespace(meshing=SimpleNamespace(pair=pair), displacement=moved, force=4000.0)
    tilt, line_load = f_beta_um(pair, moved), 4000.0 / pair.common_width
    expected = face_load_factor(abs(tilt), 20.0, line_load)
    assert expected > 1.2
    assert_allclose(sliced_k_h_beta(mesh, case), expected, rtol=3e-3)
    relative = 1e3 * pair.face_width * (moved[1] - moved[0])
    axes = {"in_plane_um": relative[3], "out_of_plane_um": -relative[4]}
    flanks = ({f"{gear}.modification": {"helix_slope_um": tilt}} for gear in ("pinion", "wheel"))
    for change in ({"misalignment": axes}, *flanks):
        assert_allclose(sliced_k_h_beta(mesh, change_case(case, **change)), 1.0, atol=1e-6)


def test_f_sh_worked_by_hand():
    """27 teeth, m 4.5, 21 deg, b 50, on 60 mm between bearings 110 apart, 3 mm off towards the torque; 567 N m."""
    diameter = 27 * 4.5 / np.cos(np.radians(21.0))
    line_load = 567e3 / (0.5 * diameter) / 50.0
    bent = 0.48 * 110.0 * 3.0 / diameter**2 * (diameter / 60.0) ** 4
    expected = line_load * 0.023 * (abs(0.7 + bent) + 0.3) * (50.0 / diameter) ** 2
    assert_allclose(shaft_misalignment(line_load, 50.0, diameter, 60.0, 110.0, 3.0), expected, rtol=1e-12)
    assert_allclose(expected, 0.714, atol=1e-3)


def test_bending_in_f_sh_is_that_of_a_beam():
    """Without stiffening, K' = 0.8: slope of a simply supported shaft under F_t / cos 20 deg, times the face width.

    Rounded constants, a small offset: within 10 %.
    """
    diameter, span, offset, force, width = 40.0, 400.0, 40.0, 1000.0, 20.0
    place = 0.5 * span + offset
    beam = Beam(np.array([0.0, place, span]), [CircularSection(diameter)] * 2, ShaftMaterial(206e3, 0.3))
    free = [i for i in range(18) if i not in (0, 1, 2, 3, 13, 14)]
    load = np.zeros(18)
    load[7] = force / np.cos(np.radians(20.0))
    moved = np.zeros(18)
    moved[free] = np.linalg.solve(beam.stiffness()[np.ix_(free, free)], load[free])
    by_beam = 1e3 * width * abs(moved[11])
    with_offset, without = (
        shaft_misalignment(force / width, width, diameter, diameter, span, s) for s in (offset, 0.0)
    )
    assert_allclose(with_offset - without, by_beam, rtol=0.1)


def test_torsion_and_bending_load_the_same_end_or_take_each_other_away():
    values = [shaft_misalignment(100.0, 40.0, 60.0, 55.0, 200.0, s) for s in (30.0, 0.0, -30.0)]
    assert values[0] > values[1]
    assert values[1] == pytest.approx(100.0 * 0.023 * (40.0 / 60.0) ** 2)
    assert shaft_misalignment(100.0, 40.0, 60.0, 55.0, 200.0, 10.0) > shaft_misalignment(
        100.0, 40.0, 60.0, 52.0, 200.0, 10.0
    )  # stiffened by the body of the pinion


def test_running_in_ends_at_six_micrometres():
    assert running_in(10.0) == pytest.approx(1.5)
    assert running_in(100.0) == 6.0
