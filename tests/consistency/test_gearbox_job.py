"""A gearbox as a command and in Python: the same files, bases taken over, failed loads beside those that hold."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor
from pmor.app.cli import main
from pmor.machine.output import FILES
from pmor.machine.run import basis_name
from tests.support.gearboxes import SMALL, written

# A torque that lifts the input off its bearing's clearance has no equilibrium without thrust: see below.
LOOSE = SMALL.replace('name = "drive"', 'name = "light"').split("[[loads]]")[1].replace("60.0", "20.0")


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    folder = tmp_path_factory.mktemp("gearbox")
    path = written(folder, f"{SMALL}[[loads]]{LOOSE}")
    assert main(["gearbox", str(path), "--out", str(folder / "out")]) == 0
    return path, folder / "out"


def test_the_command_leaves_its_files(job):
    _, out = job
    assert {*FILES, basis_name("mesh")} <= {path.name for path in out.iterdir()}
    data = json.loads((out / "gearbox.json").read_text())
    assert [load["name"] for load in data["loads"]] == ["drive", "light"]
    mesh = data["loads"][0]["meshes"][0]
    assert mesh["torque_Nm"] == pytest.approx(60.0, rel=1e-3)
    assert mesh["k_h_beta"] > mesh["rigid_k_h_beta"]
    assert all(np.isfinite(value).all() for key, value in mesh.items() if key.endswith(("um", "MPa")))
    bearings = {bearing["name"]: bearing for bearing in data["loads"][0]["bearings"]}
    assert 1 <= bearings["C"]["loaded_elements"] < 9
    assert len(bearings["D"]["element_force_N"]) == 12


def test_python_finds_what_the_command_found(job):
    path, out = job
    found = pmor.gearbox(path)
    assert not found.failures
    assert "drive" in str(found)
    assert "1 meshes, 2 loads" in repr(found)
    assert json.loads(json.dumps(found.data)) == json.loads((out / "gearbox.json").read_text())
    for figure in (found.plot_deflection(), found.plot_machine(), found.plot_ste(), found.plot_face_load()):
        assert figure.axes


def test_a_second_run_solves_no_finite_elements(job, capsys, monkeypatch):
    path, out = job
    before = (out / basis_name("mesh")).stat().st_mtime_ns
    path.write_text(path.read_text().replace("torque_Nm = 60.0", "torque_Nm = 50.0"))
    monkeypatch.setattr("pmor.machine.run.elastic_model", lambda *_: pytest.fail("finite elements"))
    assert main(["gearbox", str(path), "--out", str(out)]) == 0
    assert (out / basis_name("mesh")).stat().st_mtime_ns == before
    assert json.loads((out / "gearbox.json").read_text())["loads"][0]["meshes"][0]["torque_Nm"] == pytest.approx(
        50.0, rel=1e-3
    )


def test_forces_in_bearings_balance_the_mesh(job):
    """Without other loads: the mesh pushes both shafts apart, and bearings hold each of them."""
    path, _ = job
    found = pmor.gearbox(path)
    for load in found.data["loads"]:
        force = {name: np.zeros(3) for name in ("input", "output")}
        for bearing in load["bearings"]:
            force[bearing["shaft"]] += bearing["force_N"]
        assert_allclose(force["input"], -force["output"], atol=1e-4 * np.abs(force["input"]).max())
        assert np.linalg.norm(force["input"]) > load["meshes"][0]["force_N"]


def test_a_load_without_an_equilibrium_is_named_and_the_others_are_written(job, tmp_path, monkeypatch, capsys):
    import pmor.machine.coupled as coupled

    path, solve = job[0], coupled.LoadedGearbox.solve
    monkeypatch.setattr(
        coupled.LoadedGearbox,
        "solve",
        lambda self: solve(self) if np.abs(self.load).max() > 3e4 else _fail(),
    )
    assert main(["gearbox", str(path), "--out", str(tmp_path / "out")]) == 3
    data = json.loads((tmp_path / "out" / "gearbox.json").read_text())
    assert [load["name"] for load in data["loads"]] == ["drive"]
    assert "load light: no equilibrium" in data["failures"][0]
    assert "load light: no equilibrium" in capsys.readouterr().out


def _fail():
    raise pmor.ConvergenceError("no equilibrium", [])
