"""K_v after ISO 6336-1, method B: by hand, where its ranges meet, and what of it the load takes away."""

import math
from dataclasses import replace

import numpy as np
import pytest

from pmor.dynamics.rating import iso_factor
from pmor.gear.classical.iso6336 import DynamicFactor, single_from_mesh_stiffness, tolerances_um
from pmor.pair.model import gear_pair
from tests.support.small_case import case_with

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


def test_tolerances_grow_by_the_root_of_two_from_class_to_class():
    pitch, form = tolerances_um(3.0, 150.0, 5)
    np.testing.assert_allclose([pitch, form], [0.15 + 1.2 + 5.0, 1.65 + 5.0], rtol=1e-12)
    np.testing.assert_allclose(tolerances_um(3.0, 150.0, 7), [2.0 * pitch, 2.0 * form], rtol=1e-12)


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
    pitch, form = tolerances_um(4.0, 57 * 4.0 / math.cos(math.radians(20.0)), 5)
    transverse = math.atan(math.tan(math.radians(20.0)) / math.cos(math.radians(20.0)))
    np.testing.assert_allclose(factor.pitch_um, pitch * math.cos(transverse), rtol=1e-12)
    np.testing.assert_allclose(factor.form_um, form, rtol=1e-12)
    assert factor.relief_um == 20.0
    radius = 0.5 * 21 * 4.0 / math.cos(math.radians(20.0))
    np.testing.assert_allclose(factor.line_load, 1e5 / (radius * 20.0), rtol=1e-12)
