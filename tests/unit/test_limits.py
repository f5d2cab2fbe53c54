"""Loads beyond what the mechanics covers: refused, or named with their number."""

import math
from dataclasses import replace

import pytest
from numpy.testing import assert_allclose

from pmor.case import make_case, parse_case
from pmor.core.errors import CaseError
from pmor.pair.limits import LARGEST_APPROACH, hertz_pressure, range_warnings, refuse_impossible_load
from pmor.pair.model import approach_estimate, gear_pair, mesh_model
from tests.support.small_case import case_text

QUICK = {"teeth": 21, "bore_radius_mm": 20.0, "module_mm": 4.0, "face_width_mm": 20.0}


def case(torque):
    load = {"torques_Nm": [torque]}
    return parse_case(case_text(load={"torque_Nm": torque}, offline=load, online=load, compare=load), "c", "c")


def warnings(torque):
    loaded = case(torque)
    pair = gear_pair(loaded)
    return range_warnings(loaded, pair, approach_estimate(loaded, pair))


def test_hertz_pressure_is_that_of_two_equal_cylinders():
    loaded = case(100.0)
    pressure, modulus = hertz_pressure(loaded, gear_pair(loaded))
    assert_allclose(modulus, 210e3 / (2.0 * (1.0 - 0.3**2)))
    base, radius = 42.0 * math.cos(math.radians(20.0)), 42.0 * math.sin(math.radians(20.0))
    load = 100e3 / base / 20.0
    half = math.sqrt(4.0 * load * (0.5 * radius) / (math.pi * modulus))
    assert_allclose(pressure, 2.0 * load / (math.pi * half), rtol=1e-12)


def test_an_ordinary_load_is_not_worth_a_word():
    assert warnings(100.0) == ()


def test_heavy_loads_are_named_with_pressure_then_deflection():
    pressure = warnings(1e3)
    assert len(pressure) == 1
    assert "Hertz pressure 2545 N/mm2" in pressure[0]
    both = warnings(1e4)
    assert len(both) == 2
    assert "0.9 mm, 0.23 modules" in both[1]


def test_a_load_that_bends_teeth_through_their_neighbours_is_refused_with_what_is_allowed():
    with pytest.raises(CaseError, match=r"100000 N m .* 2\.25 modules, .* stay below 2\.22e\+04 N m"):
        mesh_model(case(1e5))
    mesh_model(case(2.2e4))


def test_the_heaviest_trained_load_counts_and_its_key_is_named():
    loaded = parse_case(case_text(offline={"torques_Nm": [100.0, 1e5]}), "c", "c")
    with pytest.raises(CaseError, match=r"torque of 100000 N m \(\[offline\] torques_Nm\)"):
        refuse_impossible_load(loaded, 0.01 * LARGEST_APPROACH * 4.0)


def test_line_loads_are_held_against_no_torque_that_nobody_wrote():
    loaded = make_case(**QUICK, torque_Nm=180000.0)
    assert max(map(max, loaded.asked_torques_Nm.values())) == 180000.0
    with pytest.raises(CaseError, match=r"180000 N m \(\[load\] torque_Nm\): .* = 180 N m, write 180\.0"):
        mesh_model(loaded)


@pytest.mark.parametrize(
    ("settings", "hint"),
    [
        ({"helix_angle_deg": 0.2618},
         "[pair] helix_angle_deg = 0.2618: is below 0.8 deg: looks like radians: 0.2618 rad = 15 deg, write 15.0"),
        ({"pinion": {"modification": {"helix_crowning_um": 0.008}}},
         "[pinion.modification] helix_crowning_um = 0.008: is below 0.05 um: looks like millimetres: 0.008 mm = 8 um, "
         "write 8.0"),
        ({"wheel": {"modification": {"pitch_deviations_um": [0.004] + [0.0] * 20}}}, "[wheel.modification] pitch_dev"),
        ({"misalignment": {"in_plane_um": -0.01}}, "[misalignment] in_plane_um = -0.01: is below 0.05 um"),
    ],
)  # fmt: skip
def test_values_that_are_likely_ones_in_another_unit_are_named(settings, hint):
    slip = make_case(**QUICK, torque_Nm=100.0, **settings)
    (named,) = (text for text in range_warnings(slip, gear_pair(slip), 0.01) if "looks like" in text)
    assert named.startswith(hint)


@pytest.mark.parametrize(("scheme", "allowed"), [("direct", "4.1e-07"), ("paper", "4.1e-07"), ("line", "2.1e-09")])
def test_a_torque_whose_approach_is_lost_in_round_off_is_refused_with_what_is_allowed(scheme, allowed):
    def loaded(torque):
        text = case_text(contact=None) + f'[contact]\nscheme = "{scheme}"\n'
        return replace(parse_case(text, "c", "c"), online=replace(case(100.0).online, torques_Nm=(torque, 100.0)))

    with pytest.raises(CaseError, match=f"torque of 1e-09 N m .* round-off .* stay above {allowed} N m"):
        mesh_model(loaded(1e-9))
    mesh_model(loaded(1.1 * float(allowed)))


def test_plain_hexahedra_that_lock_are_named_with_the_remedy():
    rubber = parse_case(case_text(pinion={"poisson_ratio": 0.499}, mesh={"element": "hex8"}), "c", "c")
    pair = gear_pair(rubber)
    (warning,) = range_warnings(rubber, pair, 0.0)
    assert "poisson_ratio = 0.499" in warning
    assert 'element = "hex8i"' in warning
    better = parse_case(case_text(pinion={"poisson_ratio": 0.499}), "c", "c")
    assert range_warnings(better, pair, 0.0) == ()


def helical(width_mm, torque=100.0, elements=4):
    load = {"torques_Nm": [torque]}
    pair, mesh = {"helix_angle_deg": 20.0, "face_width_mm": width_mm}, {"width_elements": elements}
    text = case_text(pair=pair, mesh=mesh, load={"torque_Nm": torque}, offline=load, online=load, compare=load)
    return parse_case(text, "c", "c")


def test_axial_forces_that_would_fold_a_thin_blank_are_refused_with_the_force():
    with pytest.raises(CaseError, match=r"axial force .* 16\.\d N, would bend the pinion's blank, 0\.4 mm .* widen"):
        mesh_model(helical(0.4, 2.0))
    mesh_model(helical(4.0, 20.0))
    mesh_model(helical(0.4, 0.02))
    flat = replace(helical(0.4, 2.0), pair=replace(case(2.0).pair, face_width_mm=0.4))
    mesh_model(flat)


def test_lines_of_contact_that_end_between_sections_are_warned_of():
    coarse, fine = helical(80.0), helical(80.0, elements=16)
    texts = [" ".join(range_warnings(c, gear_pair(c), approach_estimate(c, gear_pair(c)))) for c in (coarse, fine)]
    assert "1.8 columns of elements to an axial pitch, fewer than 4" in texts[0]
    assert "axial pitch" not in texts[1]


def test_by_default_helical_pairs_have_the_columns_that_their_lines_of_contact_need():
    def made(width_mm, **more):
        gears = {"teeth": 21, "bore_radius_mm": 20.0, "module_mm": 4.0, "face_width_mm": width_mm}
        return make_case(**gears, helix_angle_deg=20.0, torque_Nm=100.0, **more)

    assert [made(width_mm).mesh.width_elements for width_mm in (5.0, 20.0, 40.0, 400.0)] == [4, 4, 8, 16]
    assert range_warnings(made(40.0), gear_pair(made(40.0)), 0.01) == ()
    assert made(40.0, scheme="direct").mesh.width_elements == 4
    assert made(40.0, mesh={"width_elements": 6}).mesh.width_elements == 6


def test_exact_line_loads_are_held_against_full_fe_at_few_angles_unless_more_are_asked_for():
    gears = {"teeth": 21, "bore_radius_mm": 20.0, "module_mm": 4.0, "face_width_mm": 20.0, "torque_Nm": 100.0}
    line = {"models": ["line"]}, {"models": ["line", "direct"]}, {"angles": 12}
    assert [make_case(**gears, compare=keys).compare.angles for keys in ({}, *line)] == [3, 3, 40, 12]
    assert make_case(**gears, scheme="direct").compare.angles == 40
