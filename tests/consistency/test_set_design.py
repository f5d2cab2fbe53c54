"""Designs of sets: what the command leaves, the best beside the set solved anew, flanks of members on both sides."""

import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor
from pmor.app.cli import main
from pmor.design import fine, readings
from pmor.design.files import of_case
from pmor.design.loader import load
from pmor.design.output import FILES
from pmor.design.settings import Variable
from pmor.design.variables import assembly_at
from pmor.design.variant_case import members_at
from pmor.pair.conditions import assembly_of
from pmor.sets.loader import load as load_set
from pmor.sets.loader import with_sections
from tests.support.small_sets import NO_STRESS, SMALL_CHAIN, SMALL_SET, written_design, written_set

# The same equations on the same numbers, but for the order in which gaps are added up.
SAME = 1e-9


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    folder = tmp_path_factory.mktemp("set_design")
    path, out = written_design(folder, base=SMALL_SET + NO_STRESS), folder / "out"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(readings, "CONTOUR", 3)
        patch.setattr("pmor.report.page.picture_bytes", lambda figure, picture_format: b"")
        patch.setattr(fine, "FEWEST", 16)
        patch.setattr(readings, "FEWEST", 16)
        patch.setattr(fine, "SETTLED", 0.1)
        assert main(["design", str(path), "--out", str(out)]) == 0
    return path, out


@pytest.mark.slow
def test_the_best_of_a_design_is_what_pmor_set_finds_of_its_file(job):
    path, out = job
    data = json.loads((out / "design.json").read_text())
    best = data["best"]
    assert main(["design", str(path), "--out", str(out), "--case", str(best["variant"])]) == 0
    found = pmor.run(out / f"variant_{best['variant']}.toml").data
    assert found["angles_per_pitch"] == best["angles_per_pitch"] >= 32
    assert_allclose(best["peak_to_peak_um"], found["ste_peak_to_peak_um"], rtol=SAME)
    assert_allclose(best["order_2_um"], found["ste_harmonics_um"][1], rtol=SAME)
    assert_allclose(best["k_gamma"], found["k_gamma"], rtol=SAME)
    assert_allclose(best["k_h_beta"], max(mesh["k_h_beta"] for mesh in found["meshes"]), rtol=SAME)
    assert best["objective_um"] == best["objective"] == best["peak_to_peak_um"][0]


@pytest.mark.slow
def test_the_design_beats_the_flanks_as_filed(job):
    """Measured 3.46 against 4.09 um, with two pins of three in place."""
    data = json.loads((job[1] / "design.json").read_text())
    assert data["best"]["objective"] < 0.9 * data["base"]["peak_to_peak_um"][0]
    assert data["failed"] == 0


@pytest.mark.slow
def test_the_command_leaves_what_scripts_rely_on(job):
    path, out = job
    left_out = {"scatter.svg", "harris.svg", "face_load.svg"}
    assert {f.name for f in out.iterdir() if not f.name.startswith((".", "variant"))} == set(FILES) - left_out
    data = json.loads((out / "design.json").read_text())
    assert (data["case"], data["set"], data["torques_Nm"]) == (None, "small", [300.0])
    names = ["sun.tip_relief_um", "sun.tip_relief_start_percent", "planet.coast.profile_crowning_um",
             "planet.helix_crowning_um"]  # fmt: skip
    assert sorted(data["best"]["parameters"]) == sorted(names)
    assert "6, all solved at once" in pmor.plan(path)


@pytest.mark.parametrize("torque", [300.0, -300.0])
def test_variables_are_the_sections_of_members_that_carry(tmp_path, torque):
    """With the torque turned round it is the other flanks; a section that a file leaves out is as its other one."""
    flanks = "[planet.modification]\nhelix_crowning_um = 1.5\npitch_deviations_um = ["
    text = SMALL_SET.replace("torque_Nm = 300.0", f"torque_Nm = {torque}")
    text += f"{flanks}{', '.join(str(n) for n in range(18))}]\n[ring.coast_modification]\ntip_relief_um = 2.0\n"
    file = load_set(written_set(tmp_path, f"{text}tip_relief_start_percent = 80.0\n"))
    design = load(written_design(tmp_path, base=f"{text}tip_relief_start_percent = 80.0\n"))
    variables = (
        *design.design.variables, Variable(key="profile_slope_um", gear="ring", flank="coast", range=(0.0, 9.0)),
        Variable(key="twist_um", gear="planet", flank="drive", range=(0.0, 9.0)),
    )  # fmt: skip
    x = [12.0, 75.0, 3.0, 2.0, 4.0, 5.0]
    built = {}
    for case, base in design.base.items():
        own = of_case(variables, design.flanks, case)
        built[case] = assembly_at(base, list(own.values()), [x[number] for number in own])
    changed = with_sections(file, replace(file.sections, members=members_at(file, variables, x)))
    assert built == {name: assembly_of(case) for name, case in changed.cases.items()}
    towards_the_sun, towards_the_ring = changed.cases["sun-planet"], changed.cases["planet-ring"]
    drive, coast = towards_the_sun.wheel_modification, towards_the_ring.pinion_modification
    drive, coast = (drive, coast) if torque > 0.0 else (coast, drive)
    assert (drive.twist_um, coast.twist_um, drive.profile_crowning_um, coast.profile_crowning_um) == (
        5.0,
        0.0,
        0.0,
        3.0,
    )
    assert drive.helix_crowning_um == coast.helix_crowning_um == 2.0


def test_a_train_on_fixed_axes_is_designed_too(tmp_path, monkeypatch):
    monkeypatch.setattr(readings, "CONTOUR", 2)
    monkeypatch.setattr(fine, "FEWEST", 8)
    monkeypatch.setattr(fine, "SETTLED", 1.0)
    text = """
    set = "small.toml"
    [[variables]]
    key = "profile_crowning_um"
    gear = "idler"
    range = [0.0, 12.0]
    [objective]
    minimise = "order_1_um"
    [search]
    samples = 2
    descents = 1
    angles = 8
    [pareto]
    points = 0
    """
    found = pmor.run_design(written_design(tmp_path, text, SMALL_CHAIN))
    assert found.failures == ()
    assert found.objective[found.best] < found.read.base.objective
    assert np.isnan(found.result("k_gamma")).all()
