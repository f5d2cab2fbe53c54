"""A set as a command and in Python: the same files; loads of other members, and the other sense, are the same set."""

import json
import re
import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor
from pmor.app.cli import main
from pmor.body import elastic_gear
from pmor.machine.loader import load as load_gearbox
from pmor.machine.model import speeds_rpm
from pmor.pair.model import gear_pair
from pmor.sets import run
from pmor.sets.kinematics import member_speeds
from pmor.sets.loader import load
from pmor.sets.output import BEARING_FILES, FILES, PIN_FILES, SAMPLE_FILES
from pmor.sets.results_data import set_results
from pmor.storage.gear_store import entries
from pmor.storage.results_file import write_results_file
from pmor.storage.results_layout import SET_LAYOUT
from tests.support.broken_files import flip_bit_of
from tests.support.small_sets import NO_STRESS, SMALL_CHAIN, SMALL_SET, written_set

CASES = Path(__file__).parents[2] / "cases"
# Solutions by Newton's method, to its tolerance.
SOLVED = 1e-8
LOADS = "".join(f'[[loads]]\nname = "{name}"\ntorque_Nm = {torque}\nhours = {hours}\n'
                for name, torque, hours in (("low", 100.0, 30.0), ("high", 300.0, 10.0)))  # fmt: skip
TIMED = SMALL_SET.replace("[load]", f"{LOADS}[load]\nspeed_rpm = 1200.0")


def has_rim(path):
    with h5py.File(path) as file:
        return "rim" in file


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    folder = tmp_path_factory.mktemp("set")
    path = written_set(folder, TIMED)
    assert main(["run", str(path), "--out", str(folder / "out")]) == 0
    return path, folder / "out"


def test_the_command_leaves_its_files(job):
    _, out = job
    assert set(FILES) <= {path.name for path in out.iterdir()}
    data = json.loads((out / "set.json").read_text())
    assert [row["torque_Nm"] for row in data["torques"]] == [100.0, 300.0]
    assert data["torque_Nm"] == 300.0
    assert data["ste_mean_um"] == data["torques"][1]["ste_mean_um"] > data["torques"][0]["ste_mean_um"]
    assert len(data["ste_harmonics_um"]) == 2
    assert [planet["name"] for planet in data["planets"]] == ["planet 1", "planet 2", "planet 3"]
    assert_allclose(sum(planet["share_mean"] for planet in data["planets"]), 1.0, rtol=SOLVED)
    assert data["k_gamma"] == pytest.approx(3.0 * max(planet["share_mean"] for planet in data["planets"]))
    # The pin that stands ahead in the sense of the torque carries less.
    assert data["planets"][0]["share_mean"] < data["planets"][1]["share_mean"]
    assert len(data["meshes"]) == 6
    assert [gear["name"] for gear in data["root_stress"]] == ["sun", "ring", "planet 1", "planet 2", "planet 3"]
    assert data["root_stress"][3]["range_MPa"] > data["root_stress"][0]["range_MPa"] > 0.0
    assert data["failures"] == []


def test_python_finds_what_the_command_wrote(job):
    path, out = job
    found = pmor.run(path)
    assert json.loads(json.dumps(found.data)) == json.loads((out / "set.json").read_text())
    assert found.ste_um.shape == (2, 6)
    assert "K_γ" in str(found)
    assert repr(found) == "<SetResult of 'small': 6 meshes, 2 torques>"
    for draw in (found.plot_set, found.plot_ste, found.plot_shares, found.plot_root_stress):
        assert draw().axes


def test_the_results_file_and_its_tables_are_in_balance(job, tmp_path):
    """Line loads make the force of their mesh, forces the torque; moments of all others are those on the housing."""
    path, out = job
    found = pmor.load_results(out / "results.h5")
    assert set(found) == {name for name in SET_LAYOUT if not name.startswith("bearings/")}  # its planets are on none
    values = {name: array.values for name, array in found.items()}
    found_in_python = pmor.run(path, out)
    assert_allclose(values["ste/ste"], found_in_python.ste_um, rtol=SOLVED)
    force = np.nansum(values["lines/load"] * values["lines/width"][:, None], axis=(3, 4))
    assert_allclose(force, values["meshes/force"], rtol=1e-12)
    assert_allclose(values["gears/moment"][..., 0, 2], -np.repeat([[100.0], [300.0]], 6, axis=1), rtol=SOLVED)
    assert_allclose(values["planets/share"].sum(axis=2), 1.0, rtol=1e-12)
    text = pmor.info(out / "results.h5")
    assert "planet 3 - ring" in text
    assert main(["export", str(out / "results.h5"), "--to", "csv", "-o", str(tmp_path)]) == 0
    columns = np.genfromtxt(out / "ste.csv", delimiter=",", names=True)
    exported = np.loadtxt(tmp_path / "ste_per_torque_per_angle.csv", delimiter=",", skiprows=6)
    assert_allclose(exported[:, 2], columns["ste_um"], rtol=0.0)
    assert_allclose(values["meshes/force"][..., 3].ravel(), columns["force_planet_2_ring_N"], rtol=0.0)
    assert_allclose(values["planets/share"][..., 2].ravel(), columns["share_planet_3"], rtol=0.0)
    assert list(found_in_python.columns()) == list(columns.dtype.names)
    assert "<table>" in found_in_python._repr_html_()
    solution, data = found_in_python.solution, found_in_python.data
    mesh, planet = solution.mesh("planet 2 - ring"), solution.support("planet 2")
    assert_allclose(mesh.force_N, values["meshes/force"][..., 3], rtol=1e-12)
    expected = [row["meshes"][3]["flank_pressure_max_MPa"] for row in data["torques"]]
    assert mesh.figures["flank_pressure_max_MPa"].tolist() == values["meshes/flank_pressure_max_MPa"][:, 3].tolist()
    assert mesh.figures["flank_pressure_max_MPa"].tolist() == expected
    # Nothing turns the planet but its meshes: they balance about its axis; across it the pin carries them.
    assert_allclose(planet.wrench[..., 5], 0.0, atol=1e-6 * np.abs(planet.wrench[..., 1]).max())
    assert_allclose(np.linalg.norm(planet.wrench[..., :2], axis=2), values["planets/pin_force"][..., 1], rtol=1e-12)
    with pytest.raises(KeyError, match="planet 3 - ring"):
        solution.mesh("planet 4 - ring")


def test_a_duty_cycle_of_a_set_is_the_mean_of_its_loads_and_meshes_lose_what_slides(job):
    """Losses by friction, loss factor and power of each mesh; all meshes of the sun hand on its power by Willis."""
    data = json.loads((job[1] / "set.json").read_text())
    low, high = data["torques"]
    for row in (low, high):
        assert_allclose(row["losses_W"], sum(mesh["losses_W"] for mesh in row["meshes"]), rtol=1e-12)
        for mesh in row["meshes"]:
            lost = 0.0 if mesh["friction"] is None else mesh["power_W"] * mesh["friction"] * mesh["loss_factor"]
            assert_allclose(mesh["losses_W"], lost, rtol=1e-12)
    assert [mesh["losses_W"] for mesh in low["meshes"][:2]] == [0.0, 0.0]  # of the planet that is 10 um ahead
    speed = (1200.0 - data["speeds_rpm"]["carrier"]) * np.pi / 30.0
    power = [mesh["power_W"] for mesh in high["meshes"] if mesh["name"].startswith("sun")]
    assert_allclose(sum(power), 300.0 * speed, rtol=SOLVED)
    duty = data["duty"]
    assert_allclose(duty["losses_W"], 0.75 * low["losses_W"] + 0.25 * high["losses_W"], rtol=1e-12)
    assert_allclose(duty["power_W"], (0.75 * 100.0 + 0.25 * 300.0) * 1200.0 * np.pi / 30.0, rtol=1e-12)
    assert duty["hours"] == 40.0
    first = duty["spectrum"][0]
    assert (first["load"], first["mesh"]) == ("high", "sun - planet 1")
    assert_allclose(first["pinion_cycles"], 600.0 * speed * 30.0 / np.pi, rtol=1e-12)
    assert first["root_stress_max_MPa"] == [high["root_stress"][n]["max_principal_MPa"] for n in (0, 2)]
    assert "Load spectrum" in (job[1] / "set.md").read_text()


@pytest.mark.parametrize(("arguments", "words"), [
    (("export", "results.h5", "--to", "vtkhdf"), "pmor run leaves set.vtkhdf of a set"),
    (("export", "results.h5", "--to", "rexs"), "pmor run leaves set.rexs"),
    (("export", ".", "--to", "csv"), "pmor run leaves results.h5"),
    (("export", "set.json", "--to", "fmu"), "takes a basis, or the file of a gearbox in motion, not of a set"),
    (("info", "set.json"), "name an HDF5 file, as results.h5 beside it"),
], ids=["animation", "rexs", "folder", "unit", "numbers"])  # fmt: skip
def test_files_of_a_set_that_are_no_basis_are_refused_with_what_to_take(arguments, words, job, monkeypatch, capsys):
    monkeypatch.chdir(job[1])
    assert main(list(arguments)) == 2
    assert words in capsys.readouterr().err


@pytest.mark.slow
def test_tooth_pairs_of_a_results_file_go_on_from_pitch_to_pitch(job, undrawn, tmp_path):
    """Pinions turn uniformly: each pair stays one pitch before the next one."""
    folder = shutil.copytree(job[1], tmp_path / "out")
    found = pmor.run(written_set(tmp_path, SMALL_SET.replace("[sweep]", "[sweep]\npitches = 3")), folder)
    content = set_results(found.file, found.solution, found.solution.torque_Nm, found.data)
    write_results_file(tmp_path / "results.h5", content)
    arrays = {name: array.values for name, array in pmor.load_results(tmp_path / "results.h5").items()}
    pair = arrays["lines/first_pair"][..., None] + np.arange(arrays["lines/roll"].shape[2])
    for number, mesh in enumerate(found.solution.train.meshes):
        roll, load = arrays["lines/roll"][:, number, :, 0, 0], arrays["lines/load"][1, :, number, :, 0]
        start = roll - mesh.rate * arrays["ste/phi"][:, None] - mesh.pair.meshed.pair.pitch * pair[:, number]
        carry = load > 0.5 * np.nanmax(load)  # pairs at the ends of the path touch at corners
        assert all(carry[first : first + 6].any() for first in (0, 6, 12))
        assert np.ptp(start[carry]) < 1e-9


@pytest.fixture
def counted(monkeypatch):
    """Sectors whose finite elements are solved."""
    sectors, solve = [], elastic_gear.elastic_gear
    monkeypatch.setattr(elastic_gear, "elastic_gear", lambda *a, **k: sectors.append(a[0].teeth) or solve(*a, **k))
    return sectors


@pytest.mark.slow
def test_another_torque_support_pin_error_or_modification_takes_no_finite_elements(job, counted, undrawn, tmp_path):
    folder = shutil.copytree(job[1], tmp_path / "out")
    shutil.copytree(job[1].parent / "compliances", tmp_path / "compliances")
    text = SMALL_SET.replace("torque_Nm = 300.0", "torque_Nm = 250.0").replace("[10.0, 0.0", "[0.0, 7.0")
    text += '[supports]\nsun_radial_N_per_mm = "free"\n[sun.modification]\nprofile_crowning_um = 4.0\n'
    path = written_set(tmp_path, text)
    again = pmor.run(path, folder)
    assert not counted
    anew = pmor.run(path)
    assert len(counted) == 3
    assert json.dumps(again.data) == json.dumps(anew.data)


@pytest.mark.slow
def test_another_body_and_a_damaged_file_are_solved_anew_and_no_other(job, counted, undrawn, tmp_path):
    folder = shutil.copytree(job[1], tmp_path / "out")
    store = shutil.copytree(job[1].parent / "compliances", tmp_path / "compliances")
    (ring,) = (path for path in entries(store) if has_rim(path))
    flip_bit_of("compliance")(ring)
    path = written_set(tmp_path, SMALL_SET.replace("18.0\n[ring]", "17.0\n[ring]"))
    again = pmor.run(path, folder)
    assert sorted(counted) == [18, 54]
    assert json.dumps(again.data) == json.dumps(pmor.run(path).data)


@pytest.mark.slow
def test_tolerances_leave_their_files_and_differ_no_other(tmp_path, job, undrawn):
    text = f"{TIMED}[tolerances]\npins_radial_um = 5.0\nsun_eccentricity_um = 5.0\nsamples = 8\n"
    path = written_set(tmp_path, text)
    assert "Tolerances: 8 sets x 108 angles x 2 torques" in pmor.plan(path)
    assert main(["run", str(path), "--out", str(tmp_path / "out")]) == 0
    assert set(SAMPLE_FILES) <= {path.name for path in (tmp_path / "out").iterdir()}
    data, plain = (json.loads((out / "set.json").read_text()) for out in (tmp_path / "out", job[1]))
    drawn = data.pop("tolerances")
    assert plain.pop("tolerances") is None
    (light,) = plain.pop("bounds")
    assert light.startswith("100 N m, planet 1: carries 0 % of the load on average"), "its pin is 10 um ahead"
    own, *of_samples = data.pop("bounds")
    assert own == light
    for torque in (100, 300):
        words = (
            rf"{torque} N m, \d of 8 sets within tolerances: coast flanks would overlap; the worst is sample \d, mesh"
        )
        assert any(re.match(words, text) for text in of_samples)
    assert data == plain
    assert (drawn["samples"], drawn["pitches"]) == (8, 18)
    for row in drawn["torques"]:
        values = row["k_gamma"]
        assert 1.0 < values["percentile_5"] < values["percentile_50"] <= values["percentile_95"] <= 3.0 + SOLVED
    found = pmor.run(path, tmp_path / "out")
    assert len(found.plot_tolerances().axes) == 4
    assert "Tolerances" in str(found)
    with pytest.raises(pmor.PmorError, match="add \\[tolerances\\]"):
        pmor.run(job[0], shutil.copytree(job[1], tmp_path / "plain")).plot_tolerances()


@pytest.mark.slow
def test_pins_leave_their_picture_and_the_forces_of_their_bearings(tmp_path, job, undrawn):
    rollers = "roller = { rollers = 12, roller_diameter_mm = 4.0, effective_length_mm = 7.0, pitch_diameter_mm = 24.0 }"
    bearings = ", ".join(f"{{at_mm = {place}, {rollers}}}" for place in (-6.0, 6.0))
    pins = f"[pins]\ndiameter_mm = 20.0\nlength_mm = 30.0\nbearings = [{bearings}]\n"
    carrier = '[carrier]\nwindup_Nmm_per_rad = 1e10\ntorque_at = "-z"\n'
    path = written_set(tmp_path, SMALL_SET + NO_STRESS + pins + carrier)
    text = pmor.plan(path)
    assert "d 20 x 30 mm, clamped in both cheeks" in text
    assert "1e+10 N mm/rad, torque out at -z" in text
    found = pmor.run(path)
    found.write(tmp_path / "out")
    assert {*PIN_FILES, *BEARING_FILES} <= {path.name for path in (tmp_path / "out").iterdir()}
    data = json.loads((tmp_path / "out" / "set.json").read_text())
    assert data["carrier_windup_mrad"] > 0.0
    for planet in data["planets"]:
        assert [bearing["at_mm"] for bearing in planet["bearings"]] == [-6.0, 6.0]
        total = sum(bearing["force_mean_N"] for bearing in planet["bearings"])
        assert total == pytest.approx(planet["pin_force_mean_N"], rel=1e-3)
        assert planet["around_tilt_mrad"] > 0.0
        for bearing in planet["bearings"]:
            assert bearing["rows"][0]["radial_force_N"] == pytest.approx(bearing["force_mean_N"], rel=1e-3)
            assert bearing["reference_life_1e6"] > 0.0
    arrays = pmor.load_results(tmp_path / "out" / "results.h5")
    assert_allclose(arrays["bearings/force"].values[-1, 0, 0, 0], data["planets"][0]["bearings"][0]["element_force_N"])
    assert len(found.plot_pins().axes) == 2
    assert "Planets on their pins" in str(found)
    with pytest.raises(pmor.PmorError, match="add \\[pins\\]"):
        pmor.run(job[0], shutil.copytree(job[1], tmp_path / "plain")).plot_pins()


def test_the_other_sense_is_the_image(job, tmp_path):
    """Flanks are plain: the coast flanks carry as the drive flanks do, and what is ahead is so in that sense."""
    text = SMALL_SET.replace("torque_Nm = 300.0", "torque_Nm = -300.0").replace("torques_Nm = [100.0]", "")
    found = pmor.run(written_set(tmp_path, text))
    assert found.file.plan.clockwise
    expected = json.loads((job[1] / "set.json").read_text())
    assert_allclose(found.data["ste_um"], expected["ste_um"], rtol=SOLVED)


def test_a_planet_that_is_missing_leaves_its_load_to_the_others(tmp_path):
    text = SMALL_SET.replace("count = 3", "count = 3\nmissing = [2]").replace("torques_Nm = [100.0]", "")
    found = pmor.run(written_set(tmp_path, text.replace("[10.0, 0.0, 0.0]", "[0.0, 0.0, 0.0]")))
    assert [planet["name"] for planet in found.data["planets"]] == ["planet 1", "planet 3"]
    assert_allclose(found.planet_share.mean(axis=1), 0.5, rtol=1e-6)


def test_springs_below_the_sun_lie_between_rigid_and_free(tmp_path):
    gammas = []
    for stiffness in ('"rigid"', "1e5", '"free"'):
        text = f"{SMALL_SET}{NO_STRESS}[supports]\nsun_radial_N_per_mm = {stiffness}\n"
        gammas.append(pmor.run(written_set(tmp_path, text)).k_gamma[1])
    assert gammas == sorted(gammas, reverse=True)
    assert gammas[0] > 1.05
    assert_allclose(gammas[2], 1.0, atol=0.005)


def test_soft_supports_are_free_ones_in_the_limit(tmp_path):
    """A compliance in the flexibility of the sections, and a movement of its own, are two ways to say the same."""
    found = [
        pmor.run(written_set(tmp_path, f"{SMALL_SET}{NO_STRESS}[supports]\nsun_radial_N_per_mm = {stiffness}\n"))
        for stiffness in ("1.0", '"free"')
    ]
    assert_allclose(found[0].ste_um, found[1].ste_um, rtol=1e-4)
    assert_allclose(found[0].planet_share, found[1].planet_share, rtol=1e-3)


def test_a_chain_sums_up_its_meshes(tmp_path):
    found = pmor.run(written_set(tmp_path, SMALL_CHAIN))
    torques = [mesh["pinion_torque_Nm"] for mesh in found.data["meshes"]]
    assert_allclose(torques, [100.0, 100.0 * 25 / 21], rtol=1e-3)
    assert np.isnan(found.k_gamma).all()
    assert found.data["k_gamma"] is None
    assert found.data["planets"] == []


def test_the_shipped_wind_turbine_turns_as_willis_says():
    """The rotor drives the carrier; contact ratios are published to what rounded profile shifts leave."""
    file = load(CASES / "nrel_5mw_first_stage.toml")
    speeds = member_speeds((19, 56), "carrier", "ring", 12.1)
    assert_allclose(list(speeds.values()), [12.1 * 75 / 19, 0.0, 12.1], rtol=1e-12)
    assert file.plan.torque_Nm == pytest.approx(4.18e6 * 19 / 75)
    assert file.plan.clockwise
    ratios = [gear_pair(case).contact_ratio for case in file.cases.values()]
    assert_allclose(ratios, [1.1147, 1.2786], rtol=2e-3)


def test_the_rig_of_750_kw_turns_and_carries_as_its_drawings_say():
    """Mesh frequencies at 1,800 rpm, and by 360 kN m on the rotor the force and the overturning couple of a planet."""
    file = load_gearbox(CASES / "nrel_750kw.toml")
    (one,), (rated, *_) = file.model.sets.values(), file.sections.loads
    speeds = speeds_rpm(file.model, rated)
    found = [teeth * speeds[shaft] / 60.0 for shaft, teeth in (("carrier", 99), ("low speed", 82), ("high speed", 22))]
    assert_allclose(found, [36.45, 172.5, 660.0], rtol=2e-4)
    sun, ring, planet, *_ = 1e3 * one.plan.torque_Nm * one.plan.wrench.reshape(-1, 6)
    assert_allclose(np.abs([sun[5], ring[5]]), [63.0e6, 297.0e6], rtol=1e-6)
    assert_allclose(np.hypot(*planet[:2]), 389.6e3, rtol=1e-4)
    assert_allclose(np.hypot(*planet[3:5]), 10.45e6, rtol=5e-4)


@pytest.mark.parametrize("name", ["planetary_stage", "idler_chain", "stepped_planets", "power_split"])
def test_the_shipped_sets_can_be_built(name):
    assert load(CASES / f"{name}.toml").plan.meshes


def test_each_mesh_has_the_flanks_that_carry_in_it(tmp_path):
    """The planet drives the ring with its other flanks; against the sense of the drawing all of them change sides."""
    flanks = "[planet.modification]\nprofile_slope_um = 5.0\n[planet.coast_modification]\nprofile_slope_um = 0.0\n"
    flanks += "profile_crowning_um = 3.0\n[ring.coast_modification]\nprofile_crowning_um = 2.0\n"
    for sign in ("", "-"):
        text = SMALL_SET.replace("torque_Nm = 300.0", f"torque_Nm = {sign}300.0").replace(
            "[planets]", f"{flanks}[planets]"
        )
        cases = load(written_set(tmp_path, text)).cases
        planet = cases["sun-planet"].wheel_modification, cases["planet-ring"].pinion_modification
        relieved, crowned = planet if not sign else planet[::-1]
        assert (relieved.profile_slope_um, relieved.profile_crowning_um) == (5.0, 0.0)
        assert (crowned.profile_slope_um, crowned.profile_crowning_um) == (0.0, 3.0)
        assert cases["planet-ring"].wheel_modification.profile_crowning_um == (0.0 if sign else 2.0)


@pytest.mark.slow
def test_an_interrupted_run_leaves_the_page_of_what_was_solved(tmp_path, monkeypatch, capsys):
    def interrupted(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr(run, "with_mesh_error", interrupted)
    path = written_set(tmp_path, SMALL_SET + NO_STRESS)
    assert main(["run", str(path), "--out", str(tmp_path / "out")]) == 130
    data = json.loads((tmp_path / "out" / "set.json").read_text())
    assert data["failures"] == ["interrupted before the error bar of the mesh and the tolerances were solved"]
    assert (tmp_path / "out" / "report.html").exists()
    assert "page of what is solved" in capsys.readouterr().err
