"""Designs and campaigns of pairs whose coast flanks carry, and of internal pairs."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor
from pmor.app.cli import main
from pmor.campaigns.relations import with_relations
from pmor.campaigns.settings import Relations
from pmor.case import load_case, parse_case
from pmor.design import fine, readings
from pmor.pair.model import gear_pair
from tests.support.small_case import case_text
from tests.support.small_design import DESIGN, written

RING = {"internal": True, "teeth": 61, "addendum": 0.8, "root_fillet_mm": 0.6, "rim_thickness_mm": 12.0}
PLAIN = {"contact": {"scheme": "line"}, "reduction": None, "offline": None, "compare": None}
BACKWARDS = {"load": {"torque_Nm": -100.0}, "online": {"torques_Nm": [-100.0, -60.0]}}
INTERNAL = case_text(pinion={"teeth": 22, "bore_radius_mm": 20.0}, wheel=RING, mesh={"profile_elements": 5}, **PLAIN,
                     **BACKWARDS)  # fmt: skip
COAST = case_text(mesh={"profile_elements": 5, "width_elements": 2}, results={"root_stress": False}, **PLAIN,
                  **BACKWARDS)  # fmt: skip


def test_shifts_of_an_internal_pair_leave_no_backlash_at_its_distance():
    found = with_relations(INTERNAL, {}, Relations(centre_distance_mm=78.6, solve="wheel"))
    shifted = f"internal = true\nprofile_shift = {found['wheel.profile_shift']}"
    pair = gear_pair(parse_case(INTERNAL.replace("internal = true", shifted), "ring", "ring"))
    assert_allclose(pair.centre_distance, -78.6, rtol=1e-9)  # a ring counts negative
    assert_allclose(pair.backlash, 0.0, atol=1e-9)


@pytest.mark.slow
def test_rows_of_internal_pairs_whose_coast_flanks_carry_are_those_of_their_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "ring.toml").write_text(INTERNAL)
    text = 'case = "ring.toml"\n[designs]\nmethod = "list"\nwheel.rim_thickness_mm = [12.0, 15.0]\n'
    (tmp_path / "campaign.toml").write_text(f"{text}[store]\nlimit_GiB = 0.0\n")
    found = pmor.run("campaign.toml")
    assert found.status.tolist() == ["ok", "ok"], found.reasons
    for number in (1, 2):
        case = load_case(pmor.write_campaign_case("campaign.toml", tmp_path, number))
        assert (case.flank, case.pair.wheel.internal) == ("coast", True)
        swept, place = pmor.train(case).sweep(), case.online.torques_Nm.index(case.torque_Nm)
        assert_allclose(found.results["ste_peak_to_peak_um"][number - 1], swept.peak_to_peak_um[place], rtol=1e-9)
        assert_allclose(found.results["k_h_beta"][number - 1], swept.k_h_beta[place], rtol=1e-9)


@pytest.mark.slow
def test_a_variant_of_coast_flanks_is_a_case_of_coast_flanks(tmp_path, monkeypatch, undrawn):
    monkeypatch.setattr(readings, "CONTOUR", 3)
    monkeypatch.setattr(fine, "SETTLED", 0.1)
    quick = DESIGN.replace("samples = 32", "samples = 8").replace("descents = 2", "descents = 1")
    path = written(tmp_path, quick.replace("points = 2", "points = 0"))
    path.write_text(path.read_text().replace('key = "tip_relief_um"', 'key = "tip_relief_um"\nflank = "coast"'))
    (tmp_path / "small.toml").write_text(COAST)
    assert main(["design", str(path), "--out", str(tmp_path / "out")]) == 0
    data = json.loads((tmp_path / "out" / "design.json").read_text())
    best = data["best"]
    assert main(["design", str(path), "--out", str(tmp_path / "out"), "--case", str(best["variant"])]) == 0
    case = load_case(tmp_path / "out" / f"variant_{best['variant']}.toml")
    assert case.flank == "coast"
    assert case.pinion_modification.tip_relief_um == best["parameters"]["coast.tip_relief_um"]
    swept = pmor.train(case).sweep()
    torques = [case.online.torques_Nm.index(torque) for torque in data["torques_Nm"]]
    assert_allclose(np.asarray(swept.peak_to_peak_um)[torques], best["peak_to_peak_um"], rtol=1e-9)
