"""`pmor export` writes what the Python API writes, refuses what it cannot make, and harms nobody's files."""

import runpy
import sys
from pathlib import Path

import numpy as np
import pytest

import pmor
from pmor.app.cli import main
from pmor.case.capability import LIMITS, Limit
from pmor.dynamics.fmu import law
from pmor.dynamics.force_table import tabulate
from pmor.rexs.model import read_rexs
from pmor.rexs.read import read_stage
from tests.support.stored_files import rows_of

pytestmark = pytest.mark.jit  # sweeps and force laws of whole models
ROOT = Path(__file__).parents[2]
GEARBOX = ROOT / "cases" / "gearbox.rexs"


@pytest.fixture(scope="module")
def model():
    case = pmor.import_rexs(GEARBOX)
    mesh = {"profile_elements": 4, "width_elements": 2, "error_bar": False}
    return pmor.train(pmor.change_case(case, mesh=mesh, online={"angles_per_pitch": 8}))


@pytest.fixture(scope="module")
def basis(model, tmp_path_factory):
    path = tmp_path_factory.mktemp("basis") / "gears.h5"
    model.save(path)
    return path


def export(*arguments):
    return main(["export", *map(str, arguments)])


def test_a_gearbox_becomes_a_case_file_and_what_is_left_out_is_said(tmp_path, capsys):
    assert export(GEARBOX, "--to", "case", "-o", tmp_path / "new" / "gears.toml") == 0
    said = capsys.readouterr()
    assert said.out == f"{tmp_path / 'new' / 'gears.toml'}: written\n"
    assert said.err == "".join(f"pmor: {note}\n" for note in read_stage(GEARBOX).notes)
    assert "pmor: triangular_tip_relief 19: a case has no such modification: left out\n" in said.err
    assert pmor.load_case(tmp_path / "new" / "gears.toml").pair == pmor.import_rexs(GEARBOX).pair


def test_the_command_writes_the_force_law_and_the_results_of_the_api(tmp_path, basis, model, monkeypatch):
    monkeypatch.setattr(
        law, "tabulate", lambda forces, low, high, tolerance: tabulate(forces, low, high, tolerance=0.01)
    )
    assert export(basis, "--to", "fmu", "-o", tmp_path / "one.fmu", "--torque", 30) == 0
    assert export(basis, "--to", "rexs", "-o", tmp_path / "one.rexs") == 0
    model.export(tmp_path / "two.fmu", to="fmu", torque_Nm=30.0)
    assert (tmp_path / "one.fmu").read_bytes() == (tmp_path / "two.fmu").read_bytes()
    found = read_rexs(tmp_path / "one.rexs")
    loads = next(iter(found.load_cases)).values()
    said = next(c for c in loads if c.kind == "cylindrical_stage")
    expected = model.sweep(torques_Nm=[120.0]).ste_um[0]
    np.testing.assert_allclose(1e3 * np.array(said.numbers_of("custom_pmor_transmission_error")), expected, rtol=1e-9)


@pytest.mark.parametrize("source", ["basis", "results"])
def test_tables_hold_the_numbers_of_the_sweep(tmp_path, basis, model, source, undrawn):
    if source == "results":
        model.report(tmp_path / "out")
        basis = tmp_path / "out" / "results.h5"
    assert export(basis, "--to", "csv", "-o", tmp_path / "tables") == 0
    rows = rows_of(tmp_path / "tables" / "ste_per_torque_per_angle.csv")
    result = model.sweep()
    assert [float(row["ste"]) for row in rows] == result.ste_um.ravel().tolist()
    assert [float(row["phi"]) for row in rows] == np.tile(result.phi_rad, 2).tolist()
    first = rows_of(tmp_path / "tables" / "orders_per_torque_per_order.csv")[0]
    np.testing.assert_allclose(float(first["amplitude"]), result.orders_um(1)[0, 0], rtol=1e-12)


def test_a_report_replaces_no_page_of_others(tmp_path, model):
    (tmp_path / "report.html").write_text("mine")
    with pytest.raises(pmor.OutputError, match=r"report\.html: .*choose another place"):
        model.report(tmp_path)


def test_files_are_named_after_their_source_in_the_current_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert export(GEARBOX, "--to", "case") == 0
    assert [p.name for p in tmp_path.iterdir()] == ["gearbox.toml"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("{gearbox}", "--to", "fmu", "-o", "{new}"), "speed_range_rpm: no load has a speed"),
        (("{basis}", "--to", "case", "-o", "{new}"), "cannot be read as REXS"),
        (("{basis}", "--to", "rexs", "-o", "{basis}"), "exists already"),
        (("{basis}", "--to", "rexs", "-o", "{basis}", "--overwrite"), "is an input of the results"),
        (("{basis}", "--to", "rexs", "--stage", "4"), "stage = 4: is for the format case alone"),
        (("{gearbox}", "--to", "case", "--torque", "4"), "torque_Nm = 4: is for the format fmu alone"),
        (("{gearbox}", "--to", "case", "--stage", "9", "-o", "{new}"), "there is no such stage"),
        (("{basis}", "--to", "csv", "-o", "{taken}"), "is a file, and the tables go into a folder"),
        (("{missing}", "--to", "case", "-o", "{new}"), "there is no such file"),
    ],
)
def test_what_cannot_be_made_is_refused_in_one_line(arguments, message, tmp_path, basis, capsys):
    (tmp_path / "taken").write_text("mine")
    names = {"gearbox": GEARBOX, "basis": basis, "new": tmp_path / "new", "taken": tmp_path / "taken",
             "missing": tmp_path / "missing.rexs"}  # fmt: skip
    before = basis.read_bytes()
    assert export(*(a.format(**names) for a in arguments)) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith("pmor: error: ")
    assert said.err.count("\n") == 1
    assert message in said.err
    assert basis.read_bytes() == before
    assert (tmp_path / "taken").read_text() == "mine"
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize("to", ["fmu", "rexs", "vtkhdf"])
def test_formats_refuse_the_cases_that_the_table_of_capabilities_keeps_from_them(to, basis, tmp_path, monkeypatch):
    monkeypatch.setitem(LIMITS, "Case", (Limit(lambda case: True, (to,), "no such case"),))
    with pytest.raises(pmor.CaseError, match="takes no such case"):
        pmor.export_file(basis, to, tmp_path / "new")
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize("arguments", [["--to", "step"], ["--to", "fmu", "--torque", "-1"], []])
def test_wrong_usage_exits_with_2(arguments, capsys):
    with pytest.raises(SystemExit) as caught:
        export("basis.h5", *arguments)
    assert caught.value.code == 2
    assert "error:" in capsys.readouterr().err


def test_a_model_refuses_a_format_that_it_does_not_have(model, tmp_path):
    with pytest.raises(pmor.CaseError, match="to = 'step': must be csv, rexs, fmu or vtkhdf"):
        model.export(tmp_path / "x", to="step")


@pytest.mark.slow
def test_the_script_in_cases_walks_from_a_gearbox_to_the_page(tmp_path, monkeypatch, caplog, undrawn):
    caplog.set_level("INFO")
    monkeypatch.setattr(sys, "argv", ["rexs_to_page.py", str(tmp_path / "out")])
    runpy.run_path(str(ROOT / "cases" / "rexs_to_page.py"), run_name="__main__")
    assert "triangular_tip_relief" in caplog.text
    for name in ("report/report.html", "gearbox.fmu", "gearbox_results.rexs", "tables/ste_per_torque_per_angle.csv"):
        assert (tmp_path / "out" / name).stat().st_size > 0
