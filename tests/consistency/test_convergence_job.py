"""The ladder of meshes: what it leaves, what it takes over, and that errors fall along it."""

import json

import numpy as np
import pytest

from pmor.app.cli import main
from pmor.case import change_case
from pmor.core.errors import CaseError, ConvergenceError
from pmor.lab.convergence import run
from pmor.lab.convergence.result import ELEMENTS, FILES
from pmor_online.line_sweep import sweep_line_loads
from tests.support.small_case import case_text, case_with

LADDER = (2, 4, 8)


@pytest.fixture(scope="module")
def case():
    return case_with(contact={"scheme": "line"}, reduction=None)


def test_errors_fall_with_the_elements_and_everything_is_written(case, tmp_path, monkeypatch):
    found = run.run(case, folder=tmp_path, profile_elements=LADDER)
    assert len(found.levels) == 2 * len(ELEMENTS) * len(LADDER)
    monkeypatch.setattr(run, "_solve", lambda case: pytest.fail("solved again"))
    assert run.run(case, folder=tmp_path, profile_elements=LADDER) == found, "finished meshes are taken over"
    for width in ("plane_strain", "half"):
        for element in ELEMENTS:
            levels = [level for level in found.levels if (level.width, level.element) == (width, element)]
            errors = [abs(found.error_percent(level, "ste_mean_um")) for level in levels]
            assert errors == sorted(errors, reverse=True), (width, element)
    found.write(tmp_path)
    assert {path.name for path in tmp_path.iterdir() if not path.name.startswith(".")} == set(FILES)
    data = json.loads((tmp_path / "convergence.json").read_text())
    assert len(data["levels"]) == len(found.levels)
    assert data["levels"][0]["ste_mean_error_percent"] == found.error_percent(found.levels[0], "ste_mean_um")
    assert "Plane strain" in str(found)


def test_meshes_that_take_too_long_are_left_out_and_named(case, tmp_path, monkeypatch):
    monkeypatch.setattr(run, "LONGEST_S", 0.0)
    found = run.run(case, profile_elements=(4,))
    assert all("of finite elements" in level.reason for level in found.levels)
    assert not found.limits
    found.write(tmp_path)
    assert not (tmp_path / "convergence.png").exists()


@pytest.mark.slow
def test_a_mesh_that_does_not_converge_is_named_and_leaves_the_others(tmp_path, undrawn, monkeypatch, capsys):
    genuine = run._solve

    def sometimes(case):
        if case.mesh.profile_elements == 4 and case.mesh.element != "hex8":
            raise ConvergenceError("made to fail")
        return genuine(case)

    monkeypatch.setattr(run, "_solve", sometimes)
    monkeypatch.setattr(run.run, "__kwdefaults__", run.run.__kwdefaults__ | {"profile_elements": LADDER})
    path, out = tmp_path / "small.toml", tmp_path / "out"
    path.write_text(case_text(contact={"scheme": "line"}, reduction=None))
    assert main(["lab", "convergence", str(path), "--out", str(out)]) == 3
    assert "meshes did not converge, first: plane_strain hex20 4: made to fail" in capsys.readouterr().err
    data = json.loads((out / "convergence.json").read_text())
    assert {level["element"] for level in data["levels"] if level["skipped"] == "did not converge"} == {
        "hex20",
        "hex8i",
    }
    # The limit is that of the one element without a gap in its ladder.
    levels = [v for v in data["levels"] if (v["element"], v["width"]) == ("hex8", "plane_strain")]
    values = [level["ste_mean_um"] for level in levels]
    ratio = (values[2] - values[1]) / (values[1] - values[0])
    (limit,) = [v["limit_um"] for v in data["limits"] if (v["quantity"], v["width"]) == ("ste_mean_um", "plane_strain")]
    np.testing.assert_allclose(limit, values[2] + (values[2] - values[1]) * min(ratio, 0.5) / (1.0 - min(ratio, 0.5)))


def test_positions_without_equilibrium_are_no_mean(case, monkeypatch):
    def lost(reduced, phi, conditions):
        sweep = sweep_line_loads(reduced, phi, conditions)
        sweep.ste_um[0, 5] = np.nan
        return sweep

    monkeypatch.setattr(run, "sweep_line_loads", lost)
    with pytest.raises(ConvergenceError, match="1 of 50 positions did not converge"):
        run._solve(change_case(case, mesh={"error_bar": False}))


@pytest.mark.slow
def test_a_ladder_without_a_limit_has_no_picture(case, tmp_path):
    run.run(case, profile_elements=LADDER[:2]).write(tmp_path)
    assert (tmp_path / "convergence.json").exists()
    assert not (tmp_path / "convergence.png").exists()


def test_other_schemes_have_no_limit(case, tmp_path, capsys):
    other = case_with()
    with pytest.raises(CaseError, match='scheme = "direct".*write "line"'):
        run.run(other)
    path = tmp_path / "small.toml"
    path.write_text(case_text())
    assert main(["lab", "convergence", str(path), "--out", str(tmp_path / "out")]) == 2
    assert "no limit on finer meshes" in capsys.readouterr().err
