"""A whole campaign of sets: its rows are those of `pmor run` of the files that it writes."""

import csv
import json
import math

import pytest

import pmor
from pmor.app.cli import main
from pmor.campaigns.loader import load
from pmor.campaigns.run import task_of
from pmor.campaigns.solve import row_of
from pmor.campaigns.table import designs_of
from pmor.storage.gear_store import Store, open_store
from tests.support.matrix import SPLIT
from tests.support.small_set_campaign import written

# `test_capabilities` runs a campaign of a set always.
pytestmark = pytest.mark.slow

ROUND_OFF = 1e-12


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The campaign's folder, solved: out."""
    folder = tmp_path_factory.mktemp("sets")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        assert main(["campaign", str(written(folder)), "--out", "out"]) == 0
    return folder


@pytest.fixture
def rows(folder):
    with (folder / "out" / "campaign.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def of_mates(data, key):
    """Largest value of the meshes of the sun, and of the ring."""
    return [max(row[key] for row in data["meshes"] if member in row["name"]) for member in ("sun", "ring")]


@pytest.mark.parametrize("number", [1, 4])
def test_the_row_of_a_set_is_what_its_file_gives(number, folder, rows):
    row = rows[number - 1]
    path = pmor.write_campaign_case(folder / "sets.toml", folder, number, overwrite=True)
    solved = pmor.run(path)
    data = solved.data
    stress = {body["name"].split()[0]: body for body in data["root_stress"]}
    expected = {
        "ste_mean_um": data["ste_mean_um"],
        "ste_peak_to_peak_um": data["ste_peak_to_peak_um"],
        "ste_peak_to_peak_worst_um": max(at["ste_peak_to_peak_um"] for at in data["torques"]),
        "ste_order_1_um": data["ste_harmonics_um"][0],
        "k_gamma": data["k_gamma"],
        "pin_force_max_N": max(planet["pin_force_max_N"] for planet in data["planets"]),
        **dict(zip(("k_h_beta_sun_planet", "k_h_beta_planet_ring"), of_mates(data, "k_h_beta"), strict=True)),
        **dict(zip(("contact_ratio_sun_planet", "contact_ratio_planet_ring"), of_mates(data, "contact_ratio"),
                   strict=True)),
        "root_stress_sun_MPa": stress["sun"]["max_principal_MPa"],
        "root_stress_ring_MPa": stress["ring"]["max_principal_MPa"],
    }  # fmt: skip
    assert {key: float(row[key]) for key in expected} == pytest.approx(expected, rel=ROUND_OFF, abs=ROUND_OFF)
    teeth = {member: int(row[f"{member}.teeth"]) for member in ("sun", "planet", "ring")}
    assert teeth["planet"] == (teeth["ring"] - teeth["sun"]) // 2
    assert float(row["speed_ratio"]) == pytest.approx(1.0 + teeth["ring"] / teeth["sun"], rel=ROUND_OFF)
    assert float(row["mesh_phase_pitches"]) == pytest.approx(teeth["sun"] / 3 % 1.0, abs=1e-9)
    tips = 4.0 * (teeth["planet"] + 2.0)  # module 4, no shift of the planet
    apart = 2.0 * float(row["centre_distance_mm"]) * math.sin(math.pi / 3.0)
    assert float(row["planets_gap_mm"]) == pytest.approx(apart - tips, rel=ROUND_OFF)
    masses = [float(row[f"mass_{member}_kg"]) for member in ("sun", "planet", "planet", "planet", "ring")]
    assert float(row["mass_kg"]) == pytest.approx(sum(masses), rel=ROUND_OFF)


def test_sets_that_cannot_be_assembled_are_rows_with_the_reason(folder, rows):
    assert [row["status"] for row in rows] == ["ok", "infeasible", "infeasible", "ok"]
    assert "sun and ring add up to 74" in rows[2]["reason"]
    assert "([relations] set planet.teeth = 17, sun.profile_shift = " in rows[2]["reason"]
    assert {path.name for path in (folder / "out" / "cases").glob("*.toml")} == {
        f"design_{number:06d}.toml" for number in range(1, 5)
    }


def test_the_peak_to_peak_error_on_fine_angles_is_that_of_as_many_angles_in_the_file(folder):
    (entry, *_) = json.loads((folder / "out" / "campaign.json").read_text())["fine_angles"]
    path = pmor.write_campaign_case(folder / "sets.toml", folder, entry["design"], overwrite=True)
    text = path.read_text().replace("angles_per_pitch = 6", f"angles_per_pitch = {entry['angles_per_pitch']}")
    path.write_text(text.replace("[mesh]", "[results]\nroot_stress = false\n[mesh]"))
    assert pmor.run(path).data["ste_peak_to_peak_um"] == pytest.approx(entry["ste_peak_to_peak_um"], rel=1e-9)


def test_members_come_from_the_store_and_give_the_same_row(folder, rows, monkeypatch):
    def solved_before(*arguments, **options):
        raise AssertionError("is in the store")

    monkeypatch.setattr("pmor_offline.gears.solved_gear", solved_before)
    campaign, store = load(folder / "sets.toml"), open_store(folder / "out" / "compliances", 1.0)
    row = row_of(task_of(campaign, store), 4, designs_of(campaign)(3), store)
    assert row["results"]["ste_mean_um"] == float(rows[3]["ste_mean_um"])
    assert row["results"]["root_stress_planet_MPa"] == float(rows[3]["root_stress_planet_MPa"])


def test_the_row_of_a_train_is_what_its_file_gives(tmp_path):
    """Keys of a gear, of its place in the list, and of the sweep; results of the whole, of meshes and of gears."""
    (tmp_path / "set.toml").write_text(SPLIT)
    path = tmp_path / "split.toml"
    path.write_text(
        'set = "set.toml"\n[designs]\nmethod = "list"\ninput.bore_radius_mm = [16.0, 18.0]\n'
        "gears.left_pinion.timing_mrad = [0.1, 0.2]\ngears.right_pinion.x_mm = 84.0\nsweep.angles_per_pitch = 5\n"
    )
    campaign, store = load(path), Store(tmp_path, 0.0)
    row = row_of(task_of(campaign, store), 2, designs_of(campaign)(1), store)["results"]
    assert set(row) == set(campaign.results)
    file = pmor.write_campaign_case(path, tmp_path / "out", 2)
    written, found = file.read_text(), pmor.run(file)
    assert written.count("\ntiming_mrad = 0.2\n") == written.count("\nbore_radius_mm = 18.0\n") - 2 == 1
    data, shares = found.data, [mesh["share_max"] for mesh in found.data["meshes"]]
    assert data["angles_per_pitch"] == 5
    expected = {
        "ste_peak_to_peak_um": data["ste_peak_to_peak_um"], "share_max": max(shares),
        "k_h_beta": max(mesh["k_h_beta"] for mesh in data["meshes"]),
        "left_pinion-output.share_max": shares[2],
        "output.max_principal_MPa": {row["name"]: row for row in data["root_stress"]}["output"]["max_principal_MPa"],
    }  # fmt: skip
    assert {key: row[key] for key in expected} == pytest.approx(expected, rel=ROUND_OFF, abs=ROUND_OFF)
    assert shares[2] > 0.51
