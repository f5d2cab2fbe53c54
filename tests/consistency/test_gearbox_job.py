"""A gearbox as a command and in Python: the same files, bases taken over, failed loads beside those that hold."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor
from pmor.app.cli import main
from pmor.case import basis_key
from pmor.gear.condition import Assembly
from pmor.gear.modification import Modification, Wave
from pmor.machine import run
from pmor.machine.bounds import named_bounds
from pmor.machine.coupled import solve_load
from pmor.machine.iso import arrangement
from pmor.machine.loader import load
from pmor.machine.output import FILES
from pmor.machine.run import with_rigid_supports
from pmor.pair.losses import LISTED
from pmor.results.quantities import OF_MESHES, TABLE
from pmor_online.model import with_flanks
from tests.support.gearboxes import INLINE, SMALL, written
from tests.support.stored_files import rows_of

PAGE = Path(__file__).parents[2] / "cases" / "manual" / "machines.md"
# Newton's method ends so close, from whichever start.
SOLVED = 1e-9
# Work of a mesh, with corners in contact: as far as mesh forces settle.
HANDED_ON = 1e-8
# Force of a mesh that is swept at a few angles, at tip corners off its mean.
FEW_ANGLES = 1e-3
# A torque that lifts the input off its bearing's clearance has no equilibrium without thrust: see below.
LOOSE = SMALL.replace('name = "drive"', 'name = "light"').split("[[loads]]")[1].replace("60.0", "20.0")
# Of the file, what it becomes, and why the standard's formula does not know it; empty where it does.
ARRANGEMENTS = {
    "torque through one bearing": ("at_mm = 0.0", "at_mm = 5.0", ""),
    "torque between the bearings": ("at_mm = 0.0", "at_mm = 20.0", "does not enter through one of its bearings"),
    "overhung by more than its bearings are apart": ("at_mm = 70.0", "at_mm = 20.0", "1.5 of the bearings' span off"),
    "overhung": (
        'at_mm = 10.0\naxial_N_per_mm = 1e5\nradial_N_per_mm = 2e5\n[[bearings]]\nname = "B"\n'
        'shaft = "input"\nat_mm = 70.0',
        "at_mm = 2.0\naxial_N_per_mm = 1e5\nradial_N_per_mm = 2e5\n"
        '[[bearings]]\nname = "B"\nshaft = "input"\nat_mm = 30.0',
        "",
    ),
    "overhung on the side of its torque": ("at_mm = 10.0", "at_mm = 40.0", "does not come to its overhung gear"),
    "off the middle": ("at_mm = 10.0", "at_mm = 30.0", "of the bearings' span off their middle"),
    "bored": ("outer_mm = 20.0", "outer_mm = 20.0, inner_mm = 12.0", "bored by more than half"),
    "three bearings": (
        '[[bearings]]\nname = "C"',
        '[[bearings]]\nname = "E"\nshaft = "input"\nat_mm = 60.0\n[[bearings]]\nname = "C"',
        "has 3 radial bearings",
    ),
}


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    folder = tmp_path_factory.mktemp("gearbox")
    path = written(folder, f"{SMALL}[[loads]]{LOOSE}")
    assert main(["run", str(path), "--out", str(folder / "out")]) == 0
    return path, folder / "out"


def test_the_command_leaves_its_files(job):
    _, out = job
    assert set(FILES) <= {path.name for path in out.iterdir()}
    data = json.loads((out / "gearbox.json").read_text())
    assert [load["name"] for load in data["loads"]] == ["drive", "light"]
    mesh = data["loads"][0]["meshes"][0]
    assert mesh["torque_Nm"] == pytest.approx(60.0, rel=HANDED_ON)
    (held,) = data["loads"][0]["held_torques_Nm"]
    assert held["torque_Nm"] == pytest.approx(60.0 * 29.0 / 19.0, rel=HANDED_ON)
    assert mesh["k_h_beta"] > mesh["rigid_k_h_beta"]
    assert all(np.isfinite(value).all() for key, value in mesh.items() if key.endswith(("um", "MPa")))
    bearings = {bearing["name"]: bearing for bearing in data["loads"][0]["bearings"]}
    assert 1 <= bearings["C"]["loaded_elements"] < 9
    assert len(bearings["D"]["element_force_N"]) == 12
    assert_allclose(bearings["D"]["rows"][0]["force_N"], bearings["D"]["force_N"], atol=1e-6)
    arrays = pmor.load_results(out / "results.h5")
    assert_allclose(arrays["bearings/C/drive/element/force"].values[0], bearings["C"]["element_force_N"])


def test_each_mesh_stands_beside_rigid_supports_and_the_standard(job):
    path, out = job
    mesh = json.loads((out / "gearbox.json").read_text())["loads"][0]["meshes"][0]
    model = pmor.train(load(path).cases["mesh"])
    stress = model.root_stress([mesh["torque_Nm"]], angles=12)
    assert_allclose(mesh["rigid_root_stress_max_MPa"], [stress.largest(0, i).max_principal_MPa for i in range(2)])
    assert mesh["root_stress_max_MPa"][0] > mesh["rigid_root_stress_max_MPa"][0]
    assert mesh["iso_f_beta_um"] == pytest.approx(1.33 * mesh["iso_f_sh_um"])
    assert mesh["iso_k_h_beta"] > 1.0
    page = (out / "report.html").read_text()
    assert all(title in page for title in ("Root stress", "Beside ISO 6336-1", "Rows of rolling bearings"))


@pytest.mark.parametrize("name", ARRANGEMENTS)
def test_an_arrangement_that_the_standard_does_not_know_is_said(name, job, tmp_path):
    """The pair is not solved anew: the arrangement follows from the file."""
    old, new, words = ARRANGEMENTS[name]
    text = job[0].read_text()
    assert old in text
    file = load(written(tmp_path, text.replace(old, new, 1)))
    why = arrangement(file.model, file.model.sections.meshes[0], file.model.sections.loads[0])
    assert words in why if words else not isinstance(why, str)


def test_bounds_are_named_with_load_part_and_value(job):
    """The solved box with entries made up: a bearing without load, one overloaded, a face half of which carries."""
    path, _ = job
    found = pmor.run(path)
    solved, entry = found.loads[0], found.data["loads"][0]
    cases = found.file.cases
    assert named_bounds(cases, solved, entry) == found.data["bounds"] == []
    entry["bearings"][2] |= {"loaded_elements": 0}
    entry["bearings"][3] |= {"static_safety": 0.8, "contact_pressure_max_MPa": 4472.0}
    mesh, moved = solved.meshes[0], solved.meshes[0].displacement.copy()
    moved[1, 1] -= 1.0
    moved[0, 3] = 0.01
    bent = replace(solved, meshes=(mesh._replace(displacement=moved),))
    entry["meshes"][0]["carrying_face_percent"] = 50.0
    entry["meshes"][0]["flank_pressure_max_MPa"] = 2500.0
    texts = named_bounds(cases, bent, entry)
    for words in (
        "load drive, bearing C: carries nothing", "bearing D: overloaded, contact pressure 4472 MPa, static safety 0.8",
        "mesh mesh: flanks lift off, 50 % of the face", "coast flanks would overlap", "a hub tilts by 10 mrad",
        "the contact ratio by 0.", "flank pressure 2500 MPa is 2.2 % of the modulus",
    ):  # fmt: skip
        assert sum(words in text for text in texts) == 1, words
    assert len(texts) == 7


def test_teeth_that_differ_are_swept_until_they_stand_as_before(job):
    """Each pitch of the turn is that of the pair with the deviations, and the wave, so many teeth further."""
    path, out = job
    file, model = load(path), pmor.train(load(path).cases["mesh"])
    deviations = [12.0 * np.sin(2.0 * np.pi * tooth / 19) for tooth in range(19)]
    wave = Wave(count=37, amplitude_um=2.0, helix_phase_deg=90.0)
    uneven = Assembly(pinion=Modification(pitch_deviations_um=tuple(deviations), waves=(wave,)))
    pairs = {"mesh": with_flanks(model.reduced, uneven)}
    loads = with_rigid_supports([solve_load(file.model, file.model.sections.loads[0], pairs, 6)], pairs, {}, 6)
    (mesh,), (rigid,) = loads[0].meshes, loads[0].rigid
    turn = np.ptp(mesh.sweep.ste_um)
    assert (mesh.sweep.pitches, rigid.sweep.pitches) == (19, 19)
    assert turn > 2.0 * np.ptp(mesh.sweep.ste_um[0, :6])
    alone = model.sweep([1e-3 * mesh.torque], angles=6, pinion=uneven.pinion)
    assert_allclose(rigid.sweep.ste_um, alone.ste_um, rtol=SOLVED)


def test_a_mesh_with_the_sections_of_its_case_is_that_of_the_case_file(tmp_path):
    by_name, inside = (load(written(tmp_path, text)) for text in (SMALL, INLINE))
    assert basis_key(by_name.cases["mesh"]) == basis_key(inside.cases["mesh"])
    assert inside.cases["mesh"].torque_Nm == by_name.cases["mesh"].torque_Nm == 60.0
    assert inside.inputs == (tmp_path / "box.toml",)
    flanks = "topography = 'grid.csv'\nwaves = [{ count = 37, amplitude_um = 2.0 }]\n"
    relieved = INLINE.replace("[meshes.wheel]", f"[meshes.pinion.modification]\n{flanks}[meshes.wheel]")
    (tmp_path / "grid.csv").write_text(",-8,0,8\n5,1,0,1\n20,1,0,1\n40,2,1,2\n")
    found = load(written(tmp_path, relieved)).cases["mesh"]
    assert found.pinion_modification.topography is not None
    assert found.repeats_after == found.pair.pinion.teeth == 19
    wider = 'wheel = { shaft = "output", at_mm = 35.0, profile_shift = -0.1 }'
    changed = load(written(tmp_path, SMALL.replace('wheel = { shaft = "output", at_mm = 35.0 }', wider)))
    assert changed.cases["mesh"].pair.wheel.profile_shift == -0.1
    assert changed.cases["mesh"].pair.wheel.teeth == 29


def test_a_duty_cycle_is_the_mean_over_its_time(job, undrawn, tmp_path):
    path, out = job
    timed = path.read_text().replace("[[loads]]", "[[loads]]\nspeed_rpm = 1000.0\nhours = 300.0", 1)
    timed = timed.replace('name = "light"', 'name = "light"\nspeed_rpm = -2000.0\nhours = 700.0')
    path = written(tmp_path, timed.replace("torque_Nm = 20.0", "torque_Nm = -20.0"))
    assert main(["run", str(path), "--out", str(tmp_path / "out")]) == 0
    data = json.loads((tmp_path / "out" / "gearbox.json").read_text())
    drive, light = data["loads"]
    duty = data["duty"]
    turns = 2.0 * np.pi / 60.0
    assert drive["power_W"] == pytest.approx(60.0 * 1000.0 * turns)
    assert light["power_W"] == pytest.approx(20.0 * 2000.0 * turns)
    assert drive["losses_W"] == pytest.approx((1.0 - drive["efficiency"]) * drive["power_W"])
    assert duty["hours"] == 1000.0
    assert duty["losses_W"] == pytest.approx(0.3 * drive["losses_W"] + 0.7 * light["losses_W"])
    work = 0.3 * drive["power_W"] + 0.7 * light["power_W"]
    assert duty["efficiency"] == pytest.approx(1.0 - duty["losses_W"] / work)
    assert duty["meshes"][0]["efficiency"] == pytest.approx(duty["efficiency"], rel=1e-6)
    first, second = duty["spectrum"]
    assert (first["load"], second["load"]) == ("drive", "light")
    assert first["pinion_cycles"] == pytest.approx(300.0 * 60.0 * 1000.0)
    assert second["wheel_cycles"] == pytest.approx(700.0 * 60.0 * 2000.0 * 19 / 29)
    assert "Load spectrum" in (tmp_path / "out" / "report.html").read_text()


def test_the_plan_says_what_is_solved_and_left_out(job, capsys):
    path, out = job
    assert main(["plan", str(path)]) == 0
    text = capsys.readouterr().out
    assert text == f"{pmor.plan(path)}\n" == f"{pmor.plan(load(path))}\n"
    for words in (
        "shaft output", "12 rollers, ISO/TS 16281", "19/29 teeth, m 2.5 mm, 15 deg", "drive",
        "finite elements, mesh", "2 loads, mesh", "the flank that fits, mesh", "in all",
    ):  # fmt: skip
        assert words in text
    left = json.loads((out / "gearbox.json").read_text())["left_out"]
    assert any(text.startswith("losses, drive: the load has no speed") for text in left)
    assert all(one.split(": ")[0] in text for one in left)


def test_the_plan_names_a_load_without_an_equilibrium(tmp_path, monkeypatch):
    monkeypatch.setattr("pmor.machine.loaded.LoadedGearbox.solve", lambda self: _fail())
    assert "! no equilibrium" in pmor.plan(written(tmp_path))


def test_all_that_gearbox_json_has_is_documented(job):
    data = json.loads((job[1] / "gearbox.json").read_text())
    told = PAGE.read_text(encoding="utf-8").split("## Gears in their machine")[1].split("\n## ")[0]
    duty = {"duty": {"hours": None, "spectrum": [dict.fromkeys(_spectrum_keys())], "meshes": []}}
    for entry in data["loads"]:
        entry["speeds_rpm"] = {}  # by the names of shafts
    for advice in filter(None, (data["verdict"]["advice"], data["verdict"]["then_advice"])):
        for change in advice["changes"]:
            change |= {"values": {}, "filed": {}}  # by the keys of a file
    keys = {key.removeprefix("rigid_") for key in _keys(data | duty)}
    assert sorted(key for key in keys if key not in TABLE and f"`{key}`" not in told) == []


def _keys(data):
    inside = data.values() if isinstance(data, dict) else data if isinstance(data, list) else ()
    return set(data if isinstance(data, dict) else ()).union(*map(_keys, inside))


def _spectrum_keys():
    speeds = (f"{gear}_{what}" for gear in ("pinion", "wheel") for what in ("rpm", "cycles"))
    return ("mesh", "load", "fraction", "hours", *speeds, *LISTED)


def test_arrays_and_tables_of_a_gearbox_are_those_of_its_meshes_under_each_load(job, tmp_path):
    out = job[1]
    found, data = pmor.load_results(out / "results.h5"), json.loads((out / "gearbox.json").read_text())
    rows = rows_of(out / "meshes.csv")
    for entry, row in zip(data["loads"], rows, strict=True):
        (mesh,) = entry["meshes"]
        place = f"meshes/mesh/{entry['name']}"
        assert np.ptp(found[f"{place}/ste/ste"].values) == mesh["ste_peak_to_peak_um"]
        lines = found[f"{place}/lines/load"].values, found[f"{place}/lines/width"].values
        assert_allclose((lines[0] * lines[1]).sum(axis=(2, 3)).mean(), mesh["force_N"], rtol=FEW_ANGLES)
        for key in OF_MESHES:
            assert found[f"{place}/face/{key}"].values.tolist() == [mesh[key]]
            assert float(row[key]) == mesh[key]
    text = pmor.info(out / "results.h5")
    assert "meshes/mesh/drive/lines/load" in text
    assert main(["export", str(out / "results.h5"), "--to", "csv", "-o", str(tmp_path)]) == 0
    ste = np.loadtxt(tmp_path / "meshes_mesh_drive_ste_per_torque_per_angle.csv", delimiter=",", skiprows=7)
    of_load = [row for row in rows_of(out / "ste.csv") if row["load"] == "drive"]
    assert_allclose(ste[:, 2], [float(row["ste_um"]) for row in of_load], rtol=0.0)


def test_python_finds_what_the_command_found(job):
    path, out = job
    found = pmor.run(path)
    assert not found.failures
    assert "drive" in str(found)
    assert "1 meshes, 2 loads" in repr(found)
    assert json.loads(json.dumps(found.data)) == json.loads((out / "gearbox.json").read_text())
    assert list(found.columns()) == ["load", "part", "phi_rad", "torque_Nm", "ste_um", "converged"]
    expected = [one["meshes"][0]["k_h_beta"] for one in found.data["loads"]]
    assert_allclose(found.mesh("mesh").figures["k_h_beta"], expected, rtol=1e-12)
    # What the shaft of a gear feels, its bearings carry.
    pushed = found.gear("mesh.pinion").wrench[:, 0, :3]
    carried = sum(found.support(name).wrench[:, 0, :3] for name in "AB")
    assert_allclose(carried, pushed, atol=1e-6 * np.abs(pushed).max())
    for figure in (found.plot_deflection(), found.plot_machine(), found.plot_ste(), found.plot_face_load()):
        assert figure.axes


def test_a_second_run_solves_no_finite_elements(job, undrawn, capsys, monkeypatch):
    path, out = job
    path.write_text(path.read_text().replace("torque_Nm = 60.0", "torque_Nm = 50.0"))
    monkeypatch.setattr("pmor_offline.gears.solved_gear", lambda *_, **__: pytest.fail("finite elements"))
    assert main(["run", str(path), "--out", str(out)]) == 0
    assert json.loads((out / "gearbox.json").read_text())["loads"][0]["meshes"][0]["torque_Nm"] == pytest.approx(
        50.0, rel=1e-3
    )


def test_forces_in_bearings_balance_the_mesh(job):
    """Without other loads: the mesh pushes both shafts apart, and bearings hold each of them."""
    path, _ = job
    found = pmor.run(path)
    for entry in found.data["loads"]:
        force = {name: np.zeros(3) for name in ("input", "output")}
        for bearing in entry["bearings"]:
            force[bearing["shaft"]] += bearing["force_N"]
        assert_allclose(force["input"], -force["output"], atol=1e-4 * np.abs(force["input"]).max())
        assert np.linalg.norm(force["input"]) > entry["meshes"][0]["force_N"]


def test_a_load_without_an_equilibrium_is_named_and_the_others_are_written(job, undrawn, tmp_path, monkeypatch, capsys):
    import pmor.machine.coupled as coupled

    path, solve = job[0], coupled.LoadedGearbox.solve
    monkeypatch.setattr(
        coupled.LoadedGearbox,
        "solve",
        lambda self: solve(self) if np.abs(self.load).max() > 3e4 else _fail(),
    )
    assert main(["run", str(path), "--out", str(tmp_path / "out")]) == 3
    data = json.loads((tmp_path / "out" / "gearbox.json").read_text())
    assert [load["name"] for load in data["loads"]] == ["drive"]
    assert "load light: no equilibrium" in data["failures"][0]
    assert "load light: no equilibrium" in capsys.readouterr().out


def _fail():
    raise pmor.ConvergenceError("no equilibrium", [])


@pytest.mark.slow
def test_an_interrupted_run_leaves_the_page_of_the_loads_that_were_solved(tmp_path, monkeypatch, capsys):
    solve = run.solve_load

    def interrupted(model, load, *arguments, **options):
        if load.name == "light":
            raise KeyboardInterrupt
        return solve(model, load, *arguments, **options)

    monkeypatch.setattr(run, "solve_load", interrupted)
    path = written(tmp_path, f"{SMALL}[[loads]]{LOOSE}")
    assert main(["run", str(path), "--out", str(tmp_path / "out")]) == 130
    data = json.loads((tmp_path / "out" / "gearbox.json").read_text())
    assert [load["name"] for load in data["loads"]] == ["drive"]
    assert data["failures"] == ["load light: interrupted before it was solved"]
    assert (tmp_path / "out" / "report.html").exists()
    assert "interrupted" in capsys.readouterr().err
