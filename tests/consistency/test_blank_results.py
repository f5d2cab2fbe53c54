"""What a run says of light blanks: the factors of ISO 6336 beside finite elements."""

from dataclasses import replace

import pytest
from numpy.testing import assert_allclose

from pmor.case import change_case, make_case
from pmor.pair.model import elastic_model, mesh_model
from pmor.report.summary import summary, summary_rows
from pmor.work.online import run_online
from pmor_offline.train import train
from pmor_online.model import reduced_pair

WEB = {"rim_thickness_mm": 4.0, "web_thickness_mm": 4.0, "hub_radius_mm": 11.0}
CASE = make_case(
    teeth=17, bore_radius_mm=9.0, module_mm=2.5, face_width_mm=12.0, torque_Nm=50.0, scheme="line", profile_elements=4,
    width_elements=2, error_bar=False, wheel={"teeth": 20, "bore_radius_mm": 9.0, "blank": WEB},
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
    value, note = rows["C_R of ISO 6336-1, wheel"]
    assert value == figures["web_factor_iso6336"][1]
    apart = figures["mesh_stiffness_tangent_mean_N_per_mm_um"] / figures["mesh_stiffness_iso6336_N_per_mm_um"] - 1.0
    assert f"{100.0 * apart:+.0f} %" in note
    assert ("more than 20 % apart" in note) == (abs(apart) > 0.2)
    value, note = rows["Y_B of ISO 6336-3, wheel"]
    apart = figures["root_stress_max_MPa"][1] / figures["root_stress_iso6336_MPa"][1] - 1.0
    assert f"{100.0 * apart:+.0f} %" in note
    assert ("more than 20 % apart" in note) == (abs(apart) > 0.2)
    assert "C_R of ISO 6336-1, pinion" not in rows, "it is solid"


def test_solid_gears_have_no_factors(light):
    reduced = light.reduced
    solid = change_case(CASE, **{"wheel.blank": {"web_thickness_mm": 12.0}})
    reduced = replace(reduced, basis=replace(reduced.basis, case=solid))
    found = replace(light, reduced=reduced)
    assert summary(found)["web_factor_iso6336"] is None
    assert not [label for label, *_ in summary_rows(found) if "ISO" in label]
