"""`pmor stability` from end to end on a tiny case."""

import json

import pytest

import pmor.lab.stability.measure
import pmor.lab.stability.run
from pmor.app.cli import main
from pmor.lab.stability.result import FILES
from tests.support.small_case import case_text
from tests.support.stored_files import results_in

# DESIGN.md, section 5: scripts rely on these.
KEYS = {"name", "converged", "newton_steps", "condition", "difference_rel", "ok", "note"}
MORE = {"torque_balance_rel", "seconds"}

pytestmark = pytest.mark.jit


@pytest.fixture
def case_path(tmp_path):
    path = tmp_path / "tiny.toml"
    path.write_text(case_text())
    return path


def run(case_path, *more):
    out = case_path.parent / "out"
    code = main(["stability", str(case_path), "--out", str(out), *more])
    return code, out


def test_everything_is_there_and_holds(case_path, capsys):
    code, out = run(case_path, "--only", "torque", "--jobs", "2")
    text = capsys.readouterr().out
    assert code == 0, text
    assert results_in(out) == {"stability.json", "stability.md", "report.html"} < set(FILES)
    found = json.loads((out / "stability.json").read_text())
    entries = {entry["name"]: entry for entry in found["entries"]}
    assert len(entries) == found["n_entries"] == 14
    assert found["n_failed"] == 0
    for name, entry in entries.items():
        assert set(entry) >= KEYS | MORE
        assert entry["ok"] != entry["explained"]
        if name in ("torque zero", "torque reversed", "torque 100000 N m"):
            assert entry["explained"]
            assert entry["converged"] is entry["condition"] is entry["newton_steps"] is None
            assert entry["note"].startswith("refused: ")
        else:
            assert entry["converged"] is True
            assert entry["newton_steps"] <= 12
            assert entry["condition"] >= 1.0
            assert entry["difference_rel"] < 1e-6
    page = (out / "report.html").read_text()
    assert "torque 1000 N m: Hertz pressure" in page
    assert "14 variants: 11 ok, 3 explained limits, 0 failed" in text


def test_a_variant_that_crashes_is_named_and_stops_nothing(case_path, capsys, monkeypatch):
    genuine = pmor.lab.stability.measure.solve_variant

    def sometimes(meshed, elasticity_at, phi, condition, *rest):
        if condition.torque == 1e3:
            raise RuntimeError("made to crash")
        return genuine(meshed, elasticity_at, phi, condition, *rest)

    monkeypatch.setattr(pmor.lab.stability.measure, "solve_variant", sometimes)
    code, out = run(case_path, "--only", "torque 1")
    assert code == 3
    captured = capsys.readouterr()
    assert "! torque 1 N m: RuntimeError: made to crash" in captured.out
    error = "pmor: error: 1 variants failed, first: torque 1 N m: RuntimeError: made to crash"
    assert captured.err.splitlines()[-1] == error
    failed = [e["name"] for e in json.loads((out / "stability.json").read_text())["entries"] if not e["ok"]]
    assert failed == ["torque 1 N m", "torque 100000 N m"]
    assert '<p class="warning">' in (out / "report.html").read_text()


def test_a_text_that_no_variant_has_is_refused(case_path, capsys):
    code, out = run(case_path, "--only", "no such thing")
    assert code == 2
    assert "no variant has this in its name or group" in capsys.readouterr().err
    assert not out.exists()


@pytest.mark.jit
def test_reduced_bases_of_all_trainings_hold(case_path, capsys):
    code, out = run(case_path, "--only", "reduced basis")
    assert code == 0, capsys.readouterr().out
    entries = json.loads((out / "stability.json").read_text())["entries"]
    assert [e["name"] for e in entries if e["explained"]] == ["load beyond the training"]
    assert all(e["difference_rel"] < 0.05 for e in entries if e["ok"])
