"""Campaigns of gearboxes: keys by the names of parts, designs as files, figures as `pmor run` finds them."""

import json

import pytest
from numpy.testing import assert_allclose

import pmor
from pmor.app.cli import main
from pmor.campaigns.gearboxes import figures_of
from pmor.campaigns.loader import load
from pmor.campaigns.run import task_of
from pmor.campaigns.solve import row_of
from pmor.campaigns.table import designs_of
from pmor.machine.loader import load as load_gearbox
from pmor.storage.gear_store import Store
from tests.support.gearboxes import INLINE, written
from tests.support.refusals import refused

DESIGNS = """
gearbox = "box.toml"
[designs]
method = "list"
mesh.wheel.teeth = [29, 28]
bearings.B.at_mm = [70.0, 60.0]
bearings.D.roller.clearance_mm = [0.0, 0.01]
shafts.input.sections.1.outer_mm = [20.0, 22.0]
shafts.output.y_mm = 62.3
places.mesh.shift_mm = 1.0
mesh.pinion.modification.helix_crowning_um = 3.0
[relations]
shifts = ["mesh"]
solve = "wheel"
[store]
limit_GiB = 0.0
"""


@pytest.fixture
def path(tmp_path):
    written(tmp_path, INLINE)
    (tmp_path / "boxes.toml").write_text(DESIGNS)
    return tmp_path / "boxes.toml"


def test_a_design_is_the_gearbox_with_its_keys_and_shifts_without_backlash(path):
    file = load_gearbox(pmor.write_campaign_case(path, path.parent, 2))
    sections, case = file.model.sections, file.cases["mesh"]
    assert (sections.shafts[1].at_mm, sections.bearings[1].at_mm) == ((62.3, 0.0), 60.0)
    assert (sections.meshes[0].pinion.at_mm, sections.meshes[0].wheel.at_mm) == (36.0, 36.0)
    assert (sections.bearings[3].roller.clearance_mm, sections.shafts[0].sections[0].outer_mm) == (0.01, 22.0)
    assert (case.pair.wheel.teeth, case.pinion_modification.helix_crowning_um) == (28, 3.0)
    assert case.pair.pinion.profile_shift == 0.0
    pair = file.model.pairs["mesh"]
    assert_allclose(pair.centre_distance, 62.3)
    assert_allclose(pair.backlash, 0.0, atol=1e-9)


MOTION = """[dynamics]
speed_range_rpm = [1000.0, 3000.0]
speeds = 20
harmonics = 2
"""


@pytest.mark.slow
def test_forces_in_motion_of_a_row_are_those_of_its_file(path, tmp_path):
    """`pmor dynamics` of what `--case` writes: the largest of the table; and none where they are not asked for."""
    (tmp_path / "box.toml").write_text(INLINE + MOTION)
    asked = '[results]\nkeys = ["bearing_force_N", "mesh_force_N"]\n'
    path.write_text(DESIGNS + asked)
    campaign, store = load(path), Store(path.parent, 0.0)
    row = row_of(task_of(campaign, store), 1, designs_of(campaign)(0), store)
    assert (row["status"], row["reason"]) == ("ok", "")
    (moving,) = pmor.run_dynamics(pmor.write_campaign_case(path, tmp_path, 1)).data["loads"]
    for key, rows in (("bearing_force_N", moving["bearings"]), ("mesh_force_N", moving["meshes"])):
        for part in rows:
            assert_allclose(row["results"][f"{part['name']}.{key}"], part["force_rms_max_N"], rtol=1e-9)


@pytest.mark.slow
def test_a_row_is_what_run_finds_of_the_file_of_the_design(path):
    path.write_text(DESIGNS + '[results]\nloads = ["drive"]\n')
    campaign, store = load(path), Store(path.parent, 0.0)
    row = row_of(task_of(campaign, store), 1, designs_of(campaign)(0), store)
    assert (row["status"], row["reason"]) == ("ok", "")
    assert row["results"]["drive.mesh.k_h_beta"] == row["results"]["mesh.k_h_beta"]
    found = pmor.run(pmor.write_campaign_case(path, path.parent, 1))
    (load_data,) = found.data["loads"]
    (mesh,) = load_data["meshes"]
    for key in ("ste_peak_to_peak_um", "k_h_beta", "flank_pressure_max_MPa"):
        assert row["results"][f"mesh.{key}"] == mesh[key]
    forces = {bearing["name"]: bearing["radial_force_N"] for bearing in load_data["bearings"]}
    assert {name: row["results"][f"{name}.radial_force_N"] for name in forces} == forces
    assert figures_of(found.file, found.loads)["mass_kg"] == row["results"]["mass_kg"] > 0.5


@pytest.mark.slow
def test_the_command_leaves_a_page_and_the_files_of_the_designs(path, monkeypatch):
    monkeypatch.chdir(path.parent)
    assert "2 of 2 designs can be made" in pmor.plan(path)
    assert main(["campaign", "boxes.toml", "--out", "out"]) == 0
    data = json.loads((path.parent / "out" / "campaign.json").read_text())
    assert data["n_ok"] == 2
    assert data["results"]["B.radial_force_N"]["most"] > data["results"]["B.radial_force_N"]["least"] > 0.0
    assert (path.parent / "out" / "cases" / "design_000001_mesh.toml").exists()
    assert "mesh: STE p-p" in (path.parent / "out" / "report.html").read_text()


@pytest.mark.parametrize(("old", "new", "words"), [
    ("mesh.wheel.teeth", "mush.wheel.teeth", ["[designs] mush: no section of a gearbox", "mesh.wheel"]),
    ("bearings.B.at_mm", "bearings.B.at", ["bearings.B.at: unknown key", "at_mm"]),
    ('["mesh"]', '["mush"]', ["mush", "is no mesh of box"]),
    ('solve = "wheel"', 'shift_sums = ["mesh"]', ["mesh", "is no set of box"]),
    ("[store]", '[results]\nloads = ["dive"]\n[store]', ["[results] loads", "drive"]),
    ("bearings.D.roller", "bearings.D.ball", ["bearings.D.ball"]),
    ("[29, 28]", "[29, 290]", []),
])  # fmt: skip
def test_keys_that_a_gearbox_lacks_are_refused(path, monkeypatch, old, new, words):
    path.write_text(DESIGNS.replace(old, new))
    monkeypatch.chdir(path.parent)
    if words:
        refused("campaign", "boxes.toml", words=words)
    else:  # a design that cannot be made is a row with the reason, and names no file of this machine
        plan = pmor.plan(path)
        assert "1 of 2 designs can be made" in plan
        assert "/tmp" not in plan
