"""Stress of webs over a load cycle: what passes from the basis to the sweep, the summary, the tables and the file."""

import csv
import json

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import pmor
from pmor.case import make_case
from pmor.gear.condition import ALIGNED
from pmor.pair.conditions import conditions_of
from pmor.report.summary import result_files, summary_rows, write_results
from pmor.storage.basis_file import read_basis, write_basis
from pmor.work.online import run_online
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.model import sweep_angles
from pmor_online.root_stress import SENSE, nodal_forces
from pmor_online.web_stress import amplitudes_in_cells, web_stress

BLANK = {"rim_thickness_mm": 3.0, "web_thickness_mm": 1.0, "hub_radius_mm": 11.0, "stress": True}
CASE = make_case(
    teeth=17, bore_radius_mm=9.0, module_mm=2.5, face_width_mm=12.0, torque_Nm=50.0, scheme="line", profile_elements=4,
    width_elements=2, error_bar=False, wheel={"teeth": 20, "bore_radius_mm": 9.0, "blank": BLANK},
    online={"angles_per_pitch": 12}, results={"root_stress": False},
)  # fmt: skip
# Of the stress by parabolas in the web, beside their load.
PARABOLAS = 5e-3


@pytest.fixture(scope="module")
def plain():
    return pmor.train(CASE)


@pytest.fixture(scope="module")
def result(plain, tmp_path_factory):
    path = tmp_path_factory.mktemp("web") / "basis.h5"
    path.write_bytes(b"its size is told")
    return run_online(plain.reduced, path)


def test_the_web_carries_the_torque_at_each_angle(plain):
    reduced, phi = plain.reduced, sweep_angles(CASE)
    loads = sweep_line_loads(reduced, phi, conditions_of(CASE, [50.0]), recorded=True).states.loads
    pairs, web = np.unique(loads.pair), reduced.basis.web_stress[1]
    force = nodal_forces(reduced.lines, phi, ALIGNED, loads, slice(0, len(phi)), pairs)[1]
    amplitude = amplitudes_in_cells(web, force, pairs * SENSE[1], 20)[0]
    radius = np.unique(web.places[:, 0].round(9))
    radius = radius[np.abs(radius - 0.5 * (11.0 + 18.75)) < 2.0]
    assert len(radius) > 2
    for r in radius:
        shear = (amplitude @ web.stress[np.abs(web.places[:, 0] - r) < 1e-6, 2].T).mean(axis=(1, 2))
        assert_allclose(np.abs(shear), 50e3 * 20 / 17 / (2.0 * np.pi * r**2), rtol=PARABOLAS)


def test_a_load_on_another_tooth_turns_the_stress_by_its_pitches(plain):
    web = plain.reduced.basis.web_stress[1]
    force = np.random.default_rng(2).standard_normal((1, 1, 1, web.pattern.shape[1]))
    of_first = amplitudes_in_cells(web, force, np.array([0]), 20)
    for tooth in (3, -2, 24):
        found = amplitudes_in_cells(web, force, np.array([tooth]), 20)
        assert_array_equal(found, np.roll(of_first, tooth, axis=2))


def test_a_pitch_tells_what_a_revolution_does_where_teeth_are_alike(plain):
    reduced, conditions = plain.reduced, conditions_of(CASE, [30.0, 50.0])
    phi = sweep_angles(CASE)
    pitch = 2.0 * np.pi / 17
    over_many = (phi + pitch * np.arange(3)[:, None]).ravel()
    (none, one), (_, many) = (web_stress(reduced, angles, conditions) for angles in (phi, over_many))
    assert none == {}
    assert list(one) == ["web"]
    for name in ("von_mises_MPa", "range_MPa", "most_MPa", "least_MPa"):
        assert_allclose(getattr(one["web"], name), getattr(many["web"], name), rtol=1e-9)
    part = web_stress(reduced, phi[:5], conditions)[1]["web"]
    assert np.isnan(part.range_MPa).all()
    assert np.isfinite(part.von_mises_MPa).all()


def test_stress_of_a_web_is_told_in_the_summary_and_in_tables(result, tmp_path):
    write_results(result, tmp_path)
    told = json.loads((tmp_path / "summary.json").read_text())["web_stress"]
    assert told[0] is None
    rows = list(csv.DictReader((tmp_path / "web_stress.csv").read_text().splitlines()))
    assert "web_stress.csv" in result_files(CASE)
    assert [(row["gear"], row["part"]) for row in rows] == [("wheel", "web")]
    cycle = result.web_stress[1]["web"]
    for found in (told[1]["web"], rows[0]):
        assert_allclose(float(found["von_mises_max_MPa"]), cycle.von_mises_MPa[0])
        assert_allclose(float(found["range_MPa"]), cycle.range_MPa[0])
        assert_allclose([float(found[key]) for key in ("radius_mm", "angle_deg", "z_mm")], cycle.place[0])
    words = {label: (value, note) for label, value, _, note in summary_rows(result)}["stress of web, wheel"]
    assert words[0] == cycle.von_mises_MPa[0]
    assert "range over a load cycle" in words[1]


def test_a_file_of_the_basis_keeps_the_stress_of_webs(plain, tmp_path):
    path = tmp_path / "basis.h5"
    write_basis(path, plain.basis, plain.force)
    again = read_basis(path)
    assert again.web_stress[0] is None
    for name, array in vars(plain.basis.web_stress[1]).items():
        assert_array_equal(getattr(again.web_stress[1], name), array)
