"""The ladder of meshes: what it leaves, what it takes over, and that errors fall along it."""

import json

import pytest

from pmor.app.cli import main
from pmor.case import parse_case
from pmor.core.errors import CaseError
from pmor.lab.convergence import run
from pmor.lab.convergence.result import ELEMENTS, FILES
from tests.support.small_case import case_text

LADDER = (2, 4, 8)


@pytest.fixture(scope="module")
def case():
    return parse_case(case_text(contact={"scheme": "line"}, reduction=None), "small", "small case")


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


def test_a_ladder_without_a_limit_has_no_picture(case, tmp_path):
    run.run(case, profile_elements=LADDER[:2]).write(tmp_path)
    assert (tmp_path / "convergence.json").exists()
    assert not (tmp_path / "convergence.png").exists()


def test_other_schemes_have_no_limit(case, tmp_path, capsys):
    other = parse_case(case_text(), "small", "small case")
    with pytest.raises(CaseError, match='scheme = "direct".*write "line"'):
        run.run(other)
    path = tmp_path / "small.toml"
    path.write_text(case_text())
    assert main(["convergence", str(path), "--out", str(tmp_path / "out")]) == 2
    assert "no limit on finer meshes" in capsys.readouterr().err
