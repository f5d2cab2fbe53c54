"""Two folders of results beside each other, made up: figures, curves, keys, what cannot be compared."""

import json

import h5py
import numpy as np
import pytest

import pmor
from pmor.app.cli import main
from pmor.app.diff_sides import documents
from pmor.case.document import joined_files
from pmor.report.data_files import write_columns_csv

TOML = '[load]\ntorque_Nm = {torque}\n[pair]\nmodule_mm = 2.5\n[[bearings]]\nname = "left"\nat_mm = 1.0\n'
# Of a swing of 3 um over 40 points, interpolated on a straight line: 1.5 um (1 - cos(pi / 40)) is 0.005.
LINEAR_UM = 0.01


@pytest.fixture(autouse=True)
def _undrawn(undrawn):
    """No test here looks at pictures."""


@pytest.fixture
def pair(tmp_path):
    """Give a function that leaves a folder with results of a pair."""

    def made(name, swing=3.0, angles=40, torque=100.0, loads=(), version="1", span=1.0, **changed):
        folder = tmp_path / name
        folder.mkdir()
        rows = [{"torque_Nm": load, "ste_mean_um": 10.0, "ste_peak_to_peak_um": swing} for load in (*loads, torque)]
        data = {**rows[-1], "k_h_beta": 1.2, "root_stress_max_MPa": [300.0, 250.0], "torques": rows,
                "n_positions_failed": 0, **changed}  # fmt: skip
        (folder / "summary.json").write_text(json.dumps(data))
        phi = span * 0.3 * np.arange(angles) / angles
        columns = [{"phi_rad": phi, "torque_Nm": np.full(angles, row["torque_Nm"]),
                    "ste_um": 10.0 + 0.5 * swing * np.cos(2 * np.pi * phi / (0.3 * span))} for row in rows]  # fmt: skip
        joined = {key: np.concatenate([one[key] for one in columns]) for key in columns[0]}
        write_columns_csv(folder / "ste.csv", joined)
        with h5py.File(folder / "results.h5", "w") as file:
            file.attrs.update(case_text=TOML.format(torque=torque), pmor_version=version)
        return folder

    return made


def test_what_changed_most_comes_first_and_what_did_not_is_apart(pair):
    found = pmor.diff(pair("a"), pair("b", swing=1.5, k_h_beta=1.212))
    assert [one.key for one in found.changed] == ["ste_peak_to_peak_um", "k_h_beta"]
    assert found.changed[0].percent == pytest.approx(-50.0)
    assert {(one.key, one.of) for one in found.same} == {
        ("torque_Nm", ""), ("ste_mean_um", ""), ("root_stress_max_MPa", "pinion"), ("root_stress_max_MPa", "wheel"),
        ("n_positions_failed", ""),
    }  # fmt: skip
    assert found.data["quantities"][0] == {
        "load": "100 N m", "of": "", "key": "ste_peak_to_peak_um", "a": 3.0, "b": 1.5, "unit": "um",
        "difference": -1.5, "percent": -50.0, "same": False,
    }  # fmt: skip
    assert "STE p-p [µm], 100 N m" in str(found)
    assert found.keys == ()


def test_other_grids_of_one_curve_are_the_same_curve(pair):
    found = pmor.diff(pair("a"), pair("b", angles=64))
    assert [one.largest for one in found.curves] == [pytest.approx(0.0, abs=LINEAR_UM)]
    apart = pmor.diff(pair("c"), pair("d", swing=1.0, angles=64))
    assert apart.curves[0].largest == pytest.approx(1.0, abs=LINEAR_UM), "half the difference of the swings"


def test_angles_of_other_teeth_are_compared_over_fractions_and_it_is_said(pair):
    found = pmor.diff(pair("a"), pair("b", span=1.5))
    assert found.curves[0].largest == pytest.approx(0.0, abs=LINEAR_UM)
    assert found.curves[0].a[0][-1] == found.curves[0].b[0][-1] == 1.0
    assert any("different parts of a turn" in note for note in found.notes)


def test_other_loads_are_the_nominal_ones_and_it_is_said(pair):
    found = pmor.diff(pair("a", loads=(50.0,)), pair("b", torque=120.0))
    assert {one.load for one in found.changed} == {"100 N m / 120 N m"}
    assert "Loads differ: 100 N m of a beside 120 N m of b." in found.notes
    assert "Loads of a alone are left out: 50 N m." in found.notes
    common = pmor.diff(pair("c", loads=(50.0,)), pair("d", loads=(50.0,), swing=2.0))
    assert {one.load for one in common.changed} == {"50 N m", "100 N m"}


def test_keys_that_differ_are_told_with_both_values(pair):
    found = pmor.diff(pair("a"), pair("b", torque=120.0, version="2"))
    assert [(key.key, key.a, key.b) for key in found.keys] == [("load.torque_Nm", "100.0", "120.0")]
    assert "Versions of the program differ: a is of 1, b of 2." in found.notes


def test_documents_one_after_the_other_are_read_and_other_text_is_none():
    assert documents("a = 1\n[b]\nc = 2\na = 3\n") == {"": {"a": "1", "b.c": "2", "b.a": "3"}}
    pinion = "[pinion]\nteeth = 21\n"
    text = joined_files(pinion, {"case of first": pinion.replace("21", "22"), "housing": "[[1.0, 2.0"})
    assert documents(text) == {
        "": {"pinion.teeth": "21"}, "case of first": {"pinion.teeth": "22"}, "housing": {"content": "[[1.0, 2.0"}
    }  # fmt: skip
    assert documents("<?xml version='1.0'?>\n<model/>") is None


def folder_with(tmp_path, name, file, data, table="", columns=None):
    folder = tmp_path / name
    folder.mkdir()
    (folder / file).write_text(json.dumps(data))
    if columns:
        write_columns_csv(folder / table, columns)
    return folder


def test_what_one_side_alone_knows_stands_last_and_orders_once(pair):
    orders = {"ste_harmonics_um": [1.0], "ste_order_1_um": 1.0}
    rows = [{"torque_Nm": 100.0, "ste_peak_to_peak_um": 3.0, "ste_order_1_um": 1.0}]
    found = pmor.diff(pair("a", torques=rows, first_touch_um=None, **orders),
                      pair("b", torques=[{**rows[0], "ste_peak_to_peak_um": 2.9}], first_touch_um=0.0, **orders))
    assert [one.key for one in found.changed] == ["ste_peak_to_peak_um", "first_touch_um"]
    assert not any(one.key == "ste_harmonics_um" for one in found.same)


def test_a_design_is_told_under_its_loads_in_the_words_of_the_table(tmp_path):
    def made(name, least):
        best = {"parameters": {"tip_relief_um": 8.0}, "peak_to_peak_um": [least, 1.0], "objective_um": least,
                "objective_searched_um": 7.0 * least}  # fmt: skip
        return folder_with(tmp_path, name, "design.json", {"loads": ["60 N m", "full"], "best": best})

    found = pmor.diff(made("a", 2.0), made("b", 3.0))
    assert [(one.load, one.key) for one in found.changed] == [("60 N m", "peak_to_peak_um"), ("", "objective_um")]
    assert "STE p-p [µm], 60 N m" in str(found)


def test_a_pair_in_motion_is_told_by_its_largest_figures_over_the_speeds(tmp_path):
    def made(name, most):
        columns = {key: [1.0, most] for key in (
            "dte_rms_um", "dte_peak_to_peak_um", "dynamic_factor", "largest_force_N", "separation_um")}  # fmt: skip
        columns |= {"torque_Nm": [50.0, 50.0], "mesh_frequency_Hz": [1.0, 2.0], "curve": ["run_up", "run_up"]}
        data = {"responses": [{"torque_Nm": 50.0, "period_doublings_Hz": [], "natural_frequency_Hz": 9.0}]}
        return folder_with(tmp_path, name, "dynamics.json", data, "response.csv", columns)

    found = pmor.diff(made("a", 2.0), made("b", 3.0))
    assert {(one.load, one.a, one.b) for one in found.changed} == {("50 N m", 2.0, 3.0)}
    assert "DTE, rms [µm], largest over the speeds, 50 N m" in str(found)
    assert "a and b do not hold the text" in found.notes[-1]


def test_an_item_of_a_list_that_one_side_alone_has_is_one_row(pair):
    a, b = pair("a"), pair("b")
    with h5py.File(b / "results.h5", "a") as file:
        more = '[[bearings]]\nname = "right"\nat_mm = 2.0\n'
        file.attrs["case_text"] = joined_files(TOML.format(torque=100.0) + more, {"case of one": "[load]\nx = 1"})
    assert [(key.file, key.key, key.a, key.b) for key in pmor.diff(a, b).keys] == [
        ("case of one", "load.x", None, "1"), ("", "bearings[right]", None, "2 keys")
    ]  # fmt: skip


def test_a_pair_beside_a_gearbox_with_one_mesh_is_compared_with_that_mesh(pair, tmp_path):
    box = tmp_path / "box"
    box.mkdir()
    mesh = {"name": "only", "ste_mean_um": 12.0, "ste_peak_to_peak_um": 3.0, "f_beta_um": 20.0}
    (box / "gearbox.json").write_text(json.dumps({"loads": [{"name": "full", "meshes": [mesh], "bearings": []}]}))
    found = pmor.diff(pair("a"), box)
    assert [(one.load, one.of, one.key, one.a, one.b) for one in found.changed] == [
        ("100 N m / full", "only", "ste_mean_um", 10.0, 12.0)
    ]
    assert any("Machines of two kinds" in note for note in found.notes)


def test_the_command_leaves_a_page_and_says_what_differs(pair, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["diff", str(pair("a")), str(pair("b", swing=1.5))]) == 0
    out = tmp_path / "out" / "a_b_diff"
    assert {path.name for path in out.iterdir()} >= {"diff.json", "diff.md", "report.html", "curves.svg"}
    assert "-50" in capsys.readouterr().out
    assert "STE p-p" in (out / "report.html").read_text()
    assert json.loads((out / "diff.json").read_text())["quantities"][0]["key"] == "ste_peak_to_peak_um"
    assert main(["diff", str(tmp_path / "a"), str(tmp_path / "a"), "--out", "same"]) == 0
    assert "No quantity differs." in capsys.readouterr().out


def test_results_with_positions_that_failed_are_named_and_end_with_3(pair, tmp_path, capsys):
    folders = [str(pair("a")), str(pair("b", n_positions_failed=2))]
    assert main(["diff", *folders, "--out", str(tmp_path / "out")]) == 3
    assert "b: 2 positions failed" in capsys.readouterr().err


@pytest.mark.parametrize(("content", "words"), [
    (None, "there is no such folder"), ({}, "holds no results"), ({"summary.json": "{"}, "is damaged"),
    ({"set.json": "[1]"}, "is damaged"),
])  # fmt: skip
def test_what_is_no_folder_of_results_is_refused_in_one_line(content, words, pair, tmp_path, capsys):
    other = tmp_path / "other"
    if content is not None:
        other.mkdir()
        for name, text in content.items():
            (other / name).write_text(text)
    assert main(["diff", str(pair("a")), str(other)]) == 2
    said = capsys.readouterr().err
    assert words in said
    assert str(other) in said
    assert said.count("\n") == 1


def test_a_file_is_refused_with_its_folder(pair):
    with pytest.raises(pmor.FileFormatError, match="name the folder"):
        pmor.diff(pair("a") / "summary.json", pair("b"))
