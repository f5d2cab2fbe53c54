"""A tiny study from end to end: outputs, resume, repeatability, and positions that fail."""

import json
import math
import re

import pytest
from numpy.testing import assert_allclose

import pmor.lab.study.run
from pmor.app.cli import main
from pmor.lab.core.models import ModelStore
from pmor.lab.study.result import FILES
from pmor.lab.study.settings import load
from pmor.lab.study.solve import grid_cell
from tests.support.small_case import case_text, case_with, fail_where
from tests.support.stored_files import results_in

STUDY = """
base = "base.toml"
[grid]
cells = ["6@1", "6@2", "12@1"]
angles_per_pitch = 8
[[variant]]
name = "facets"
cell = "6@2"
contact = { scheme = "facet" }
[reference]
meshes = [[6, 1, 4], [8, 1, 2], [13, 1, 1]]
[conventional]
solved = ["6@2"]
[peer]
cell = "6@2"
"""
# What fails is looked for in a smaller one.
ONE_CELL = """
base = "base.toml"
[grid]
cells = ["6@2"]
angles_per_pitch = 8
[reference]
meshes = [[6, 1, 4], [8, 1, 2]]
[conventional]
solved = ["6@2"]
"""
PICTURES = {"figure5.png", "error_run_time.png"}
# DESIGN.md, section 5: scripts rely on these.
ROW_KEYS = {
    "model", "surface", "quadrature", "n_profile", "lodm", "ste_mean_um", "ste_peak_to_peak_um", "shape_error_um",
    "ripple_um", "ms_per_position", "offline_s", "n_angles_trained", "n_torques_trained", "rom_vs_full_ste_max_rel",
}  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    (folder / "base.toml").write_text(case_text())
    (folder / "tiny.toml").write_text(STUDY)
    (folder / "one_cell.toml").write_text(ONE_CELL)
    return folder


def run(folder, out, *more, study="tiny.toml"):
    with pytest.MonkeyPatch.context() as patch:
        # Whether the independent solver is installed must not change what is tested.
        patch.setattr(pmor.lab.study.run, "calculix_available", lambda: False)
        patch.setattr("pmor.report.page.picture_bytes", lambda figure, picture_format: b"")
        return main(["lab", "study", str(folder / study), "--out", str(folder / out), *more])


@pytest.fixture(scope="module")
def finished(folder):
    assert run(folder, "out", "--jobs", "2") == 0
    return folder / "out"


def table_of(out):
    return json.loads((out / "study.json").read_text())


@pytest.mark.slow
def test_everything_is_there(finished):
    names = results_in(finished)
    assert {"study.json", "study.md", "report.html", "parts"} | PICTURES == names <= {*FILES, "parts"}
    table = table_of(finished)
    assert {(row["cell"], row["model"]) for row in table["rows"]} == {
        ("6@1", "condensed"), ("6@1", "reduced"),
        ("6@2", "conventional"), ("6@2", "condensed"), ("6@2", "reduced"),
        ("12@1", "condensed"), ("12@1", "reduced"),
        ("6@2 facets", "condensed"),
    }  # fmt: skip
    for row in table["rows"]:
        assert set(row) >= ROW_KEYS
        assert (row["rom_vs_full_ste_max_rel"] is not None) == (row["model"] == "reduced")
        timed = row["variant"] is None
        assert (row["ms_per_position"] is not None) == timed
        assert row["shape_error_um"] > 0.0
    assert table["machine"]["cores"] >= 1
    assert table["peer"] is None
    assert table["failures"] == []
    assert [claim["name"] for claim in table["time_claims"]] == [
        "refinement_is_cheaper_condensed", "refinement_is_cheaper_reduced",
    ]  # fmt: skip


@pytest.mark.slow
def test_break_even_and_ratio_come_from_the_times(finished):
    rows = {(r["cell"], r["model"]): r for r in table_of(finished)["rows"]}
    fast = rows["6@2", "reduced"]
    for name in ("conventional", "condensed"):
        slow = rows["6@2", name]["ms_per_position"]
        saved = slow - fast["ms_per_position"]
        assert_allclose(fast[f"time_ratio_{name}_to_reduced"], slow / fast["ms_per_position"], rtol=1e-12)
        expected = math.ceil(1e3 * fast["offline_s"] / saved) if saved > 0.0 else None
        assert fast[f"time_break_even_positions_{name}"] == expected


@pytest.mark.slow
def test_the_page_and_the_markdown_show_all_pictures(finished):
    html = (finished / "report.html").read_text()
    assert html.count("data:image/png;base64,") == len(PICTURES)
    assert "CalculiX is not installed here" in html
    assert set(re.findall(r"\]\((.+?)\)", (finished / "study.md").read_text())) == PICTURES


@pytest.mark.slow
@pytest.mark.jit
def test_failed_positions_are_named_and_empty(folder, tmp_path, monkeypatch, capsys, undrawn):
    angle = {}

    def third(phi, torque):
        angle.setdefault(round(phi, 12), len(angle))
        return torque == 1e5 and angle[round(phi, 12)] == 2

    fail_where(third, monkeypatch)
    assert run(folder, str(tmp_path / "failing"), study="one_cell.toml") == 3
    captured = capsys.readouterr()
    assert re.search(r"pmor: error: \d+ did not converge, first: .*phi = \S+ rad, torque = 100 N m", captured.err)
    table = table_of(tmp_path / "failing")
    assert table["failures"]
    assert all(row["ste_mean_um"] is not None for row in table["rows"])


@pytest.mark.jit
@pytest.mark.parametrize(
    ("offline", "shapes", "trained"),
    [
        ({}, "flank_lines", (4, 2)),
        ({}, "static_modes", (0, 0)),
        ({"sampling": "sobol", "solves": 6}, "flank_lines", (6, 1)),
        ({"sampling": "greedy", "solves": 5, "tolerance_percent": 1e-9}, "flank_lines", (5, 1)),
    ],
    ids=["grid", "static modes", "sobol", "greedy"],
)
def test_a_cell_counts_the_trained_angles_that_are_in_its_basis(
    offline, shapes, trained, folder, tmp_path, few_candidates
):
    """Greedy and Sobol states are angles of one torque each; static modes are not trained."""
    case = case_with(offline=offline, reduction={"shapes": shapes})
    part = grid_cell(case, load(folder / "tiny.toml"), ModelStore(), tmp_path / "b.h5", None)
    assert (part["n_angles_trained"], part["n_torques_trained"]) == trained


def test_variants_are_compared_with_each_other(folder, tmp_path):
    variants = [
        f'[[variant]]\nname = "{helix} deg"\ncell = "4@1"\npair = {{ helix_angle_deg = {helix} }}\n'
        'contact = { scheme = "line" }\nmesh = { width_elements = 2, width = "whole" }\n'
        for helix in (0.0, 20.0)
    ]
    (folder / "helix.toml").write_text('base = "base.toml"\n[grid]\nangles_per_pitch = 8\n' + "".join(variants))
    assert main(["lab", "study", str(folder / "helix.toml"), "--out", str(tmp_path / "out")]) == 0
    assert {path.name for path in (tmp_path / "out").glob("*.png")} == {"curves.png"}
    found = json.loads((tmp_path / "out" / "study.json").read_text())
    spur, helical = found["rows"]
    assert found["reference"] == {}
    assert spur["overlap_ratio"] == 0.0
    assert_allclose(helical["overlap_ratio"], 20.0 * math.sin(math.radians(20.0)) / (4.0 * math.pi))
    assert helical["ste_mean_um"] > spur["ste_mean_um"] > helical["ste_peak_to_peak_um"] > 0.0
    page = (tmp_path / "out" / "study.md").read_text()
    assert "| 20.0 deg | 4 x 2 |" in page
    assert "reference" not in page
