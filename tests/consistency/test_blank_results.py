"""What a run says of light blanks: the factors of ISO 6336 beside finite elements."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor
from pmor.case import change_case, make_case
from pmor.gear.condition import ALIGNED
from pmor.pair.conditions import conditions_of
from pmor.pair.model import elastic_model, mesh_model
from pmor.report.summary import summary, summary_rows
from pmor.work.online import run_online
from pmor_offline.train import train
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.model import reduced_pair
from pmor_online.root_cycle import across_the_root
from pmor_online.root_stress import (
    amplitudes_of_patterns,
    nodal_forces,
    patterns_of_stress,
    place_on_fillet,
    under_contact,
)

WEB = {"rim_thickness_mm": 4.0, "web_thickness_mm": 4.0, "hub_radius_mm": 11.0}
CASE = make_case(
    teeth=17, bore_radius_mm=9.0, module_mm=2.5, face_width_mm=12.0, torque_Nm=50.0, scheme="line", profile_elements=4,
    width_elements=2, element="hex8i", error_bar=False, wheel={"teeth": 20, "bore_radius_mm": 9.0, "blank": WEB},
    online={"angles_per_pitch": 12},
)  # fmt: skip


def run_of(case, folder):
    path = folder / "basis.h5"
    path.write_bytes(b"its size is told")
    return run_online(reduced_pair(train(case, elastic_model(case, mesh_model(case))).basis), path)


@pytest.fixture(scope="module")
def light(tmp_path_factory):
    return run_of(CASE, tmp_path_factory.mktemp("light"))


def test_factors_of_the_standard_stand_beside_finite_elements_and_large_differences_are_named(light):
    figures, rows = summary(light), {label: (value, note) for label, value, _, note in summary_rows(light)}
    # b_s/b = 1/3, s_R/m_n = 1.6; s_R/h_t = 4 / (2.25 2.5).
    assert_allclose(figures["web_factor_iso6336"], [1.0, 0.840449], rtol=1e-5)
    assert_allclose(figures["rim_factor_iso6336"], [1.0, 1.837272], rtol=1e-5)
    value, note = rows["C_R of ISO 6336-1:2006, wheel"]
    assert value == figures["web_factor_iso6336"][1]
    assert "another quantity" in note, "web and hub twist in that of finite elements alone"
    assert "apart" not in note
    value, note = rows["Y_B of ISO 6336-3:2019, wheel"]
    apart = figures["root_stress_max_MPa"][1] / figures["root_stress_iso6336_MPa"][1] - 1.0
    assert f"{100.0 * apart:+.0f} %" in note
    assert ("more than 20 % apart" in note) == (abs(apart) > 0.2)
    assert "C_R of ISO 6336-1:2006, pinion" not in rows, "it is solid"


def test_solid_gears_have_no_factors(light):
    reduced = light.reduced
    solid = change_case(CASE, **{"wheel.blank": {"web_thickness_mm": 12.0}})
    reduced = replace(reduced, basis=replace(reduced.basis, case=solid))
    found = replace(light, reduced=reduced)
    assert summary(found)["web_factor_iso6336"] is None
    assert not [label for label, *_ in summary_rows(found) if "ISO" in label]


# --- range of the root stress ---------------------------------------------------------------------------------------


def holed(first_deg, angles_per_pitch=4):
    """Model of a pinion and a wheel of 12 teeth with 5 holes, and its root stress over a turn of the wheel."""
    holes = {"count": 5, "radius_mm": 0.9, "on_radius_mm": 9.75, "first_deg": first_deg}
    blank = {"rim_thickness_mm": 1.6, "web_thickness_mm": 4.0, "hub_radius_mm": 8.3, "holes": holes}
    wheel = {"teeth": 12, "bore_radius_mm": 7.0, "profile_shift": 0.3, "blank": blank}
    case = make_case(
        teeth=13, bore_radius_mm=8.0, module_mm=2.5, face_width_mm=12.0, torque_Nm=50.0, scheme="line",
        profile_elements=3, width_elements=2, element="hex8i", error_bar=False, wheel=wheel,
        online={"angles_per_pitch": angles_per_pitch, "pitches": 12},
    )  # fmt: skip
    model = pmor.train(case)
    return model, model.root_stress()


@pytest.fixture(scope="module")
def with_holes():
    return holed(11.0)


def test_without_a_whole_period_there_is_no_range(with_holes):
    model, stress = with_holes
    assert model.root_stress(angles=stress.phi_rad[:24]).cycle is None
    assert model.root_stress(angles=np.append(stress.phi_rad[:-1], stress.phi_rad[-1] + 1e-3)).cycle is None


def test_a_range_is_that_of_all_teeth_at_all_angles(with_holes):
    """Slow twin: stress of tooth t at each angle as a sum over the loaded teeth, across the root of spur teeth."""
    model, stress = with_holes
    reduced, phi = model.reduced, stress.phi_rad
    conditions = conditions_of(model.case, [50.0])
    loads = sweep_line_loads(reduced, phi, conditions, recorded=True).states.loads
    pairs = np.unique(loads.pair)
    shapes, teeth = reduced.basis.root_stress[1], 12
    history = []
    for angle in range(len(phi)):
        forces = nodal_forces(reduced.lines, phi, ALIGNED, loads, slice(angle, angle + 1), pairs)[1][0, 0]
        hidden = under_contact(reduced.lines, shapes, loads, slice(angle, angle + 1), pairs, 1)[0, 0]
        found = np.zeros((teeth, 2, *shapes.stress.shape[2:4]))
        for pair, force in zip(pairs, forces, strict=True):
            for tooth in range(teeth):
                ahead = (tooth + pair + 6) % teeth - 6  # teeth of the wheel count against tooth pairs
                if abs(ahead) <= 1:
                    found[tooth] += shapes.stress[1 + ahead, :, :, :, 0] @ (shapes.pattern @ force)
                amplitude = shapes.rim_moved[-pair % teeth, shapes.rim_moved.shape[1] // 2 + ahead]
                found[tooth] += shapes.rim_stress[:, :, :, 0] @ (amplitude @ (shapes.rim_pattern @ force))
        for pair, under in zip(pairs, hidden, strict=True):
            found[-pair % teeth, :, under] = 0.0
        history.append(found)
    cycle = stress.cycle[1]
    weights, *_ = place_on_fillet(shapes, np.max(history, axis=0) - np.min(history, axis=0))
    there = np.sum(weights * history, axis=(3, 4))
    assert_allclose(cycle.most_MPa[0], there.max(axis=0), rtol=1e-9)
    assert_allclose(cycle.least_MPa[0], there.min(axis=0), rtol=1e-9)
    assert_allclose(cycle.range_MPa[0], np.ptp(there, axis=0), rtol=1e-9)


def test_ranges_are_in_the_summary(light):
    figures, stress = summary(light), light.root_stress
    for s, side in enumerate(("tension", "compression")):
        expected = [cycle.range_MPa[0, 0, s] for cycle in stress.cycle]
        assert_allclose(figures[f"root_stress_range_{side}_MPa"], expected)
    notes = {label: note for label, *_, note in summary_rows(light)}
    assert "over a load cycle" in notes["root stress range, wheel"]


@pytest.mark.parametrize("helix", [pytest.param(-20.0, marks=pytest.mark.slow), 20.0])
def test_across_the_root_is_where_helical_teeth_are_stressed_most(helix):
    """Across the root it is 0.9998 of the principal stress, as measured, and 0.967 in the transverse section."""
    case = change_case(CASE, helix_angle_deg=helix)
    model = pmor.train(change_case(case, **{"wheel.blank": {"web_thickness_mm": 12.0}}))
    shapes, pair = model.reduced.basis.root_stress[0], model.reduced.layered.pair
    conditions, phi = conditions_of(model.case, [50.0]), np.array([0.05])
    loads = sweep_line_loads(model.reduced, phi, conditions, recorded=True).states.loads
    pairs = np.unique(loads.pair)
    force = nodal_forces(model.reduced.lines, phi, ALIGNED, loads, slice(0, 1), pairs)[0]
    found = amplitudes_of_patterns(shapes, force, pairs, pairs, pair.pinion.teeth)[0, 0]
    along, across, shear = np.moveaxis(patterns_of_stress(shapes) @ found[0], -1, 0)
    principal = 0.5 * (along + across) + np.hypot(0.5 * (along - across), shear)
    place = np.unravel_index(principal.argmax(), principal.shape)
    normal = (across_the_root(shapes, pair.pinion) @ found[0])[place]
    assert 0.999 * principal[place] < normal <= principal[place]
