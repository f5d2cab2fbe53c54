"""The pair of a case in motion: what the command leaves, what it takes over, and what the Python API gives."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

import pmor
from pmor.app.cli import main
from pmor.case import change_case, parse_case
from pmor.core.errors import ConvergenceError
from pmor.core.threads import processes
from pmor.dynamics import law, run, solution
from pmor.dynamics.force_law import static_displacement
from pmor.dynamics.force_table import tabulate
from pmor.dynamics.measure import BRANCHES, RUNS, at_rest, joined, needed_harmonics, solve, speeds_of
from pmor.dynamics.output import FILES
from pmor.lab.slices import run as slices
from pmor.lab.slices.page import Slices
from pmor.pair.model import gear_pair
from pmor.work.pieces import PARTS
from pmor_online.mesh_force import mesh_force_of
from tests.support.small_case import case_text, case_with

MESH = {"profile_elements": 5, "width_elements": 2}
DYNAMICS = {"torques_Nm": [60.0, 100.0], "mesh_frequency_ratio": [0.8, 1.2], "run_cycles": 100}


def text(**dynamics):
    results = {"root_stress": False}
    return case_text(
        mesh=MESH, contact={"scheme": "line"}, reduction=None, results=results, dynamics=DYNAMICS | dynamics
    )


@pytest.fixture(autouse=True)
def _coarse_table(monkeypatch):
    monkeypatch.setattr(law, "TOLERANCE", 1e-3)
    monkeypatch.setattr(law, "STATIC_TOLERANCE", 1e-3)
    monkeypatch.setattr(law, "CHECKED", 10)


@pytest.fixture(scope="module")
def model():
    return pmor.train(parse_case(text(), "small", "small"))


def test_the_command_leaves_what_scripts_rely_on(tmp_path, capsys):
    path, out = tmp_path / "small.toml", tmp_path / "out"
    path.write_text(text())
    assert main(["dynamics", str(path), "--out", str(out)]) == 0
    assert {file.name for file in out.iterdir() if not file.name.startswith(".")} == set(FILES)
    data = json.loads((out / "dynamics.json").read_text())
    assert data["backlash_um"] is None
    page = (out / "dynamics.md").read_text()
    assert "Contact of the back flanks is neglected: the nominal pair has no backlash." in page
    assert [response["torque_Nm"] for response in data["responses"]] == [60.0, 100.0]
    for response in data["responses"]:
        assert response["lost"] == []
        for point in (point for branch in response["branches"] for point in branch):
            assert {"mesh_frequency_Hz", "dte_rms_um", "stable"} <= set(point)
            assert point["dynamic_factor"] > 1.0
        for fold in response["folds"]:
            assert set(fold) == {"mesh_frequency_Hz", "speed_rpm", "dte_rms_um", "kind"}
        assert "run_up" in {fold["kind"] for fold in response["folds"]}, "a spur pair without relief jumps"
        low, high = (ratio * response["natural_frequency_Hz"] for ratio in (0.8, 1.2))
        np.testing.assert_allclose([response["run_up"][0]["mesh_frequency_Hz"],
                                    response["run_down"][0]["mesh_frequency_Hz"]], [low, high], rtol=5e-3)  # fmt: skip
    with (out / "response.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    points = [point | {"torque_Nm": r["torque_Nm"]} for r in data["responses"]
              for curve in (*r["branches"], r["run_up"], r["run_down"]) for point in curve]  # fmt: skip
    for key in ("torque_Nm", "mesh_frequency_Hz", "speed_rpm", "dte_rms_um", "contact_loss"):
        assert [float(row[key]) for row in rows] == [point[key] for point in points], key
    assert {row["curve"] for row in rows} >= {"branch_1", "run_up", "run_down"}
    assert "Jump frequencies" in capsys.readouterr().out


@pytest.mark.slow
def test_motion_that_overloads_a_section_is_named_with_its_speeds(model):
    """The torque at rest is within the law of line contact, its resonance is not."""
    found = model.dynamics(torques_Nm=[4000.0, 6000.0], run_cycles=200)
    said = [failure.partition(" Hz motion overloads a section")[0] for failure in found.failures]
    assert [words.partition(": from ")[0] for words in said] == [
        f"6000 N m: {part}" for part in ("branch 0", "run_up", "run_down")
    ]
    for words in said:
        low, high = map(float, words.rpartition(": from ")[2].split(" to "))
        assert 0.7 < low / found.natural_frequency_Hz[1] < high / found.natural_frequency_Hz[1] < 1.0


@pytest.mark.slow
def test_finished_torques_are_taken_over(tmp_path, model, monkeypatch):
    case = replace(model.case, dynamics=replace(model.case.dynamics, run_cycles=0, damping_ratio=0.1))
    first = run.run(case, reduced=model.reduced, folder=tmp_path)
    monkeypatch.setattr(solution, "solve", lambda task, part: pytest.fail("solved again"))
    assert run.run(case, reduced=model.reduced, folder=tmp_path).data == first.data


@pytest.mark.slow
def test_an_interrupted_torque_goes_on_where_it_stopped(tmp_path, model, monkeypatch):
    case = replace(model.case, dynamics=replace(model.case.dynamics, damping_ratio=0.1, torques_Nm=(80.0,)))
    solved = []

    def until_run_down(task, part):
        solved.append(part)
        if part == "run_down" and len(solved) == 3:
            raise KeyboardInterrupt
        return solve(task, part)

    monkeypatch.setattr(solution, "solve", until_run_down)
    with pytest.raises(KeyboardInterrupt):
        run.run(case, reduced=model.reduced, folder=tmp_path)
    found = run.run(case, reduced=model.reduced, folder=tmp_path).found.responses[0]
    assert solved == ["branches", "run_up", "run_down", "run_down"]
    assert found["branches"]
    assert len(found["run_up"]) == len(found["run_down"])
    assert found["waterfall"] is not None


@pytest.mark.parametrize(
    ("changes", "backlash_um"),
    [
        ({}, None),  # a basic rack at the standard distance leaves none
        ({"pair": {"centre_distance_mm": 84.1}}, 0.2 * np.sin(np.arccos(84.0 / 84.1 * np.cos(np.radians(20.0)))) * 1e3),
        ({"pair": {"centre_distance_mm": 84.1}, "dynamics": {"backlash_um": 12.0}}, 12.0),
        ({"pair": {"centre_distance_mm": 84.1}, "misalignment": {"in_plane_um": 5.0}}, None),
        ({"pair": {"centre_distance_mm": 84.1}, "pinion.modification": {"helix_slope_um": 5.0}}, None),
    ],
)
def test_backs_of_teeth_are_those_of_the_drawing_unless_the_case_has_its_own(changes, backlash_um):
    case = case_with(mesh=MESH, contact={"scheme": "line"}, reduction=None, **changes)
    found = solution.backlash_of(case, gear_pair(case))
    if backlash_um is None:
        assert found is None
    else:
        # 2 da sin(a) is the first order in 0.1 mm of centre distance: the angle itself opens by 0.2 deg.
        np.testing.assert_allclose(1e3 * found, backlash_um, rtol=0.01)


@pytest.mark.slow
def test_teeth_alone_are_as_stiff_where_one_pair_carries_and_stiffer_where_two_do(model, monkeypatch, tmp_path):
    monkeypatch.setattr(slices, "DAMPING_RATIOS", (0.2,))
    case = change_case(model.case, dynamics={"torques_Nm": [60.0]})
    (found,) = slices.run_slices(case, reduced=model.reduced)
    coupled, alone = found["coupled"], found["slices"]
    assert alone["mesh_stiffness_max_N_per_um"] > 1.1 * coupled["mesh_stiffness_max_N_per_um"]
    # The load is not quite even over the width; measured 1 %.
    np.testing.assert_allclose(alone["mesh_stiffness_min_N_per_um"], coupled["mesh_stiffness_min_N_per_um"], rtol=0.05)
    Slices(case, [found]).write(tmp_path)
    assert (tmp_path / "slices.png").exists()
    assert "| 60 | thin slices |" in (tmp_path / "slices.md").read_text()


@pytest.mark.slow
def test_the_page_says_whether_backs_of_teeth_are_struck(model, tmp_path):
    result = model.dynamics(torques_Nm=[80.0], run_cycles=0, mesh_frequency_ratio=[0.8, 0.95], backlash_um=4.0)
    assert {"branch_1"} <= set(result.columns()["curve"]) <= {"branch_1", "branch_2"}
    assert ">80<" in result._repr_html_()
    result.write(tmp_path)
    page = (tmp_path / "dynamics.md").read_text()
    assert "touch 4 µm beyond, the backlash of the case. Stable motion touches them under 80 N m." in page
    assert result.data["backlash_um"] == 4.0


def test_k_v_stands_over_the_speeds_of_the_response(model):
    found = model.dynamics(torques_Nm=[80.0], run_cycles=0, damping_ratio=0.2, accuracy_grade=4).data["responses"][0]
    iso = found["iso_6336"]
    assert iso["accuracy_grade"] == 4
    np.testing.assert_allclose(iso["resonance_Hz"], found["natural_frequency_Hz"], rtol=1e-9)  # rigid bearings
    np.testing.assert_allclose([iso["mesh_frequency_Hz"][0], iso["mesh_frequency_Hz"][-1]],
                               found["mesh_frequencies_Hz"], rtol=1e-12)  # fmt: skip
    # c' of a pair of steel gears: 14 N/(mm um) after the standard, this mesh is coarse.
    assert 8.0 < iso["single_stiffness_N_per_mm_um"] < 16.0
    assert min(iso["k_v"]) > 1.0


def test_the_api_asks_for_what_the_case_does_not(model):
    speeds = {"mesh_frequency_ratio": [0.25, 1.4], "speed_range_rpm": [13000.0, 22000.0]}
    result = model.dynamics(torques_Nm=[80.0], run_cycles=0, damping_ratio=0.2, **speeds)
    assert result.torque_Nm.tolist() == [80.0]
    (response,) = result.data["responses"]
    np.testing.assert_allclose(response["mesh_frequencies_Hz"], [13000.0 * 21 / 60, 22000.0 * 21 / 60], rtol=1e-12)
    np.testing.assert_allclose(response["speeds_rpm"], [13000.0, 22000.0], rtol=1e-12)
    ((peak,),) = result.peaks
    assert (peak["order"], peak["mode"]) == (1.0, 1), "the main resonance alone, within these speeds"
    assert 0.8 < peak["over_natural"] < 1.0, "flanks part, which bends the peak to lower speeds"
    assert peak["dte_rms_um"] == max(p["dte_rms_um"] for b in response["branches"] for p in b if p["stable"])
    np.testing.assert_allclose(result.natural_speed_rpm, result.natural_frequency_Hz * 60 / 21, rtol=1e-12)
    assert result.folds == ((),), "strong damping leaves no jump"
    assert result.plot_waterfall() is None
    assert len(result.plot_response().axes) == 2
    assert "80 N m" in repr(result)
    with pytest.raises(pmor.CaseError, match="'degrees_of_freedom': 2.*must be 1, 6 or 12"):
        model.dynamics(degrees_of_freedom=2)


@pytest.mark.slow
def test_a_torque_without_a_response_is_named_and_leaves_the_others(model, monkeypatch, tmp_path):
    def borne(task, part):
        if task.torque_Nm == 100.0:
            raise ConvergenceError("made to fail")
        return solve(task, part)

    monkeypatch.setattr(solution, "solve", borne)
    result = model.dynamics(run_cycles=0, damping_ratio=0.2, folder=tmp_path)
    assert result.torque_Nm.tolist() == [60.0]
    assert result.failures == ("100 N m, branches: made to fail",)
    result.write(tmp_path)
    assert "100 N m, branches: made to fail" in (tmp_path / "dynamics.md").read_text()
    assert (tmp_path / PARTS).exists(), "the next run takes over what there is"


@pytest.mark.slow
def test_what_is_lost_of_a_response_is_a_failure_and_exit_code_3(tmp_path, undrawn, monkeypatch, capsys):
    def without_a_fold(task, part):
        return {**solve(task, part), "lost": ["jump near mesh frequency 2000 Hz: made to fail"]}

    monkeypatch.setattr(solution, "solve", without_a_fold)
    path, out = tmp_path / "small.toml", tmp_path / "out"
    path.write_text(text(torques_Nm=[60.0], run_cycles=0, damping_ratio=0.2))
    assert main(["dynamics", str(path), "--out", str(out)]) == 3
    assert "first: 60 N m: jump near mesh frequency 2000 Hz" in capsys.readouterr().err
    assert "60 N m: jump near mesh frequency 2000 Hz" in (out / "dynamics.md").read_text()


def test_a_speed_at_which_motion_is_static_is_refused_in_words(model):
    rest = at_rest(solution.task_of(model.case, solution.gear_model(model.case, model.reduced.meshed.pair),
                                    law.force_law(model.case, model.reduced)[0], 80.0))  # fmt: skip
    with pytest.raises(ConvergenceError, match=r"below \d+\.\d+ Hz .*: raise the lowest mesh frequency"):
        needed_harmonics(rest, (1e-3 * rest.natural, rest.natural))


@pytest.mark.slow
def test_processes_find_the_same_motion(model, tmp_path):
    asked, steps = {"torques_Nm": [60.0, 80.0], "run_cycles": 0, "damping_ratio": 0.1}, []
    with processes(2) as executor:
        shared = model.dynamics(executor=executor, progress=steps.append, **asked)
    assert shared.data == model.dynamics(**asked).data
    assert steps == [1, 1]


@pytest.mark.slow
def test_branches_on_line_loads_are_those_on_their_table(model, monkeypatch):
    monkeypatch.setattr(law, "TOLERANCE", 5e-5)
    asked = {"torques_Nm": [80.0], "run_cycles": 0, "mesh_frequency_ratio": [0.8, 1.2]}
    table, exact = (model.dynamics(law=kind, **asked).data["responses"][0] for kind in ("table", "exact"))
    for one, two in zip(table["folds"], exact["folds"], strict=True):
        assert one["kind"] == two["kind"]
        np.testing.assert_allclose(one["mesh_frequency_Hz"], two["mesh_frequency_Hz"], rtol=1e-4)
        np.testing.assert_allclose(one["dte_rms_um"], two["dte_rms_um"], rtol=1e-3)


def test_motion_beyond_the_table_is_named_and_gives_no_points(model):
    table = law.force_law(model.case, model.reduced)[0]
    task = solution.task_of(model.case, solution.gear_model(model.case, model.reduced.meshed.pair), table, 100.0)
    with pytest.raises(ConvergenceError, match="is not borne"):
        at_rest(replace(task, torque_Nm=1e5))
    load = float(task.model.oscillator(task.torque_Nm, 0.0).load[0])
    static = static_displacement(table, load, np.linspace(0.0, 6.3, 50), (table.low, table.high))
    short = tabulate(mesh_force_of(model.reduced), table.low, 1.1 * static.max(), tolerance=1e-3)
    short_of = replace(task, law=short, damping_ratio=1e-3, run_cycles=100)
    found = joined(solve(short_of, part) for part in (BRANCHES, *RUNS))
    assert any("leaves" in lost for lost in found["lost"])
    rest = at_rest(replace(task, law=short))
    assert speeds_of(task, rest)[0] < rest.natural < speeds_of(task, rest)[1]
    for point in (point for branch in found["branches"] for point in branch):
        assert np.isfinite(point["dte_rms_um"])
