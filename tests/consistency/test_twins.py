"""What a command leaves, its Python call leaves too: the same files, the same numbers."""

from __future__ import annotations

import json
import re
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import pmor
from pmor.app.cli import main
from pmor.design import readings
from pmor.dynamics import law
from pmor.lab import bench
from pmor.lab.comparison import run as comparison
from pmor.lab.convergence import run as convergence
from pmor.results.quantities import TABLE
from tests.support.small_case import case_text, write_case
from tests.support.small_design import DESIGN, written
from tests.support.stored_files import results_in, untimed

LINES = {"contact": {"scheme": "line", "lodm_profile": 1}, "reduction": {"shapes": "line_loads"}}
ALL_TIMES = ("times.json", "times.csv")


def assert_alike(one: Path, other: Path):
    """Two folders of results: the same files, and the same figures in those for machines."""
    assert results_in(one) == results_in(other) != set()
    for name in results_in(one):
        if name.endswith(".json") and name not in ALL_TIMES:
            found, expected = (untimed(json.loads((folder / name).read_text())) for folder in (one, other))
            assert_same(found, expected, name)
        elif name.endswith(".csv") and name not in ALL_TIMES:
            assert (one / name).read_text() == (other / name).read_text(), name


def assert_same(found: object, expected: object, place: str):
    """Values of two JSON files; numbers but for the round-off of differences, which depends on where arrays lie."""
    if isinstance(found, dict) and isinstance(expected, dict):
        assert found.keys() == expected.keys(), place
        for key in found:
            assert_same(found[key], expected[key], f"{place}: {key}")
    elif isinstance(found, list) and isinstance(expected, list):
        assert len(found) == len(expected), place
        for number, pair in enumerate(zip(found, expected, strict=True)):
            assert_same(*pair, f"{place}[{number}]")
    elif isinstance(found, float) and isinstance(expected, float):
        assert found == pytest.approx(expected, rel=0.0, abs=1e-14, nan_ok=True), place
    else:
        assert found == expected, place


pytestmark = pytest.mark.usefixtures("undrawn")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A case of line loads with all that a page can show, its file, and what `pmor run` leaves of it."""
    folder = tmp_path_factory.mktemp("run")
    more = {
        "mesh": {"profile_elements": 8, "error_bar": True},
        "results": {"root_stress": True},
        "compare": {"models": ["line", "direct"]},
    }
    path = write_case(folder, **LINES, **more)
    with path.open("a") as file:
        file.write('[[condition]]\nname = "more torque"\ntorque_Nm = 120.0\n')
    assert main(["run", str(path), "--out", str(folder / "command")]) == 0
    return path, folder / "command"


@pytest.fixture(scope="module")
def model(run):
    return pmor.load_model(run[1] / "basis.h5")


def test_run(run, tmp_path):
    path, folder = run
    result = pmor.run_case(pmor.load_case(path), tmp_path / "python")
    assert_alike(folder, tmp_path / "python")
    assert result.failures == ()
    assert untimed(result.summary).keys() == untimed(json.loads((folder / "summary.json").read_text())).keys()


def test_every_column_and_key_that_a_run_leaves_is_documented(run):
    documented = (Path(__file__).parents[2] / "cases" / "manual" / "results.md").read_text(encoding="utf-8")
    found = json.loads((run[1] / "summary.json").read_text())
    names = {*found, *(key for part in ("models", "conditions") for entry in found[part] for key in entry)}
    for path in run[1].glob("*.csv"):
        names |= set(path.read_text().splitlines()[0].split(","))
    names = {re.sub(r"^share_pair_-?\d+$", "share_pair_<j>", name) for name in names}
    names = {re.sub(r"^ste_order_\d+", "ste_order_<k>", name) for name in names}
    assert {"k_h_beta", "share_pair_<j>", "ste_order_<k>_um"} < names
    assert {name for name in names if name not in TABLE and f"`{name}`" not in documented} == set()


@pytest.mark.slow
def test_a_report_of_a_model_is_that_of_a_run(run, tmp_path):
    """With K_Hβ, pressure, root stress, all models and the live page."""
    path, folder = run
    model = pmor.train(pmor.load_case(path))
    result = model.report(tmp_path / "python", full=pmor.full_model(model.case))
    assert_alike(folder, tmp_path / "python")
    assert result.summary["k_h_beta"] > 1.0
    assert result.root_stress is not None
    page = (tmp_path / "python" / "report.html").read_text()
    assert "Change the pair" in page
    assert "too long" not in page


@pytest.mark.slow
def test_compare(run, tmp_path):
    path, _ = run
    assert main(["compare", str(path), "--out", str(tmp_path / "command")]) == 0
    pmor.run_case(pmor.load_case(path), tmp_path / "python", pages=False)
    assert_alike(tmp_path / "command", tmp_path / "python")


def test_offline(run, tmp_path):
    path, _ = run
    assert main(["offline", str(path), "-o", str(tmp_path / "command" / "basis.h5")]) == 0
    model = pmor.train(pmor.load_case(path), file=tmp_path / "python" / "basis.h5", resume=True)
    assert model.source == tmp_path / "python" / "basis.h5"
    assert_alike(tmp_path / "command", tmp_path / "python")
    command = pmor.load_model(tmp_path / "command" / "basis.h5")
    np.testing.assert_array_equal(command.sweep().ste_um, model.sweep().ste_um)


def test_plan(run, capsys):
    path, _ = run
    assert main(["plan", str(path)]) == 0
    assert capsys.readouterr().out == pmor.plan(pmor.load_case(path)) + "\n"


def test_info_and_verify(run, capsys):
    _, folder = run
    assert main(["info", "--verify", str(folder / "basis.h5")]) == 0
    found = pmor.verify(folder / "basis.h5")
    assert capsys.readouterr().out == f"{pmor.info(folder / 'basis.h5')}\n{found}\n"
    assert found.failures == ()


@pytest.mark.parametrize("to", ["csv", "rexs", "vtkhdf"])
def test_export(run, tmp_path, to):
    _, folder = run
    assert main(["export", str(folder / "basis.h5"), "--to", to, "-o", str(tmp_path / "command")]) == 0
    assert pmor.export_file(folder / "basis.h5", to, tmp_path / "python") == tmp_path / "python"
    if to == "csv":
        assert_alike(tmp_path / "command", tmp_path / "python")
    else:
        assert (tmp_path / "command").stat().st_size == (tmp_path / "python").stat().st_size > 1000


@pytest.mark.slow
def test_online(run, model, undrawn, tmp_path):
    path, folder = run
    assert main(["online", str(folder / "basis.h5"), "-o", str(tmp_path / "command")]) == 0
    result = model.report(tmp_path / "python", compare=False)
    assert_alike(tmp_path / "command", tmp_path / "python")
    assert result.comparison is None
    model.sweep().to_csv(tmp_path / "ste.csv")
    assert (tmp_path / "ste.csv").read_text() == (tmp_path / "python" / "ste.csv").read_text()

    other = tmp_path / "small.toml"
    other.write_text(path.read_text().replace("angles_per_pitch = 4\ntorques_Nm = [100.0]", "angles_per_pitch = 6"))
    assert main(["online", str(folder / "basis.h5"), "--case", str(other), "-o", str(tmp_path / "six")]) == 0
    pmor.load_model(folder / "basis.h5", case=pmor.load_case(other)).report(tmp_path / "also", compare=False)
    assert_alike(tmp_path / "six", tmp_path / "also")


def test_results_files_are_read_by_name(run, model):
    _, folder = run
    found = pmor.load_results(folder / "results.h5")
    ste = found["ste/ste"]
    assert (ste.unit, ste.dims) == ("um", ("torque", "angle"))
    np.testing.assert_array_equal(ste.values, model.sweep().ste_um)
    assert {"lines/pressure", "face/k_h_beta", "root_stress/max_principal"} < set(found)


def test_a_model_without_a_file_is_left_beside_its_sweep(model, tmp_path):
    pmor.ReducedModel(model.basis, model.force).report(tmp_path / "out", compare=False)
    assert "basis.h5" in results_in(tmp_path / "out")


def test_to_resume_takes_a_file(model):
    with pytest.raises(pmor.CaseError, match="resume = True: takes a file"):
        pmor.train(model.case, resume=True)


# --- capabilities and experiments ------------------------------------------------------------------------------------

DYNAMICS = {"torques_Nm": [100.0], "mesh_frequency_ratio": [0.9, 1.1], "run_cycles": 100, "damping_ratio": 0.1}
TRAINING = {"sampling": "greedy", "solves": 16, "tolerance_percent": 0.3, "out_of_plane_um": [-10.0, 10.0]}
STUDY = """
base = "tiny.toml"
[grid]
cells = ["6@2"]
angles_per_pitch = 8
[reference]
meshes = [[6, 1, 4], [8, 1, 2]]
"""


def both(command, call, path, **options):
    """What the Python call finds, beside the command: both leave the same files."""
    one, other = path.parent / "command", path.parent / "python"
    flags = [word for name, value in options.items() for word in (f"--{name}", value)]
    assert main([*command.split(), str(path), "--out", str(one), *flags]) == 0
    asked = path if call is pmor.study else pmor.load(path)
    found = call(asked, other, **options)
    assert_alike(one, other)
    return found


def test_stability(tmp_path):
    both("lab stability", pmor.stability, write_case(tmp_path), only="torque zero")


@pytest.mark.slow
def test_convergence(tmp_path, monkeypatch, capsys):
    """A ladder of three coarse meshes."""
    monkeypatch.setitem(convergence.run.__kwdefaults__, "profile_elements", (2, 4, 8))
    found = both("lab convergence", pmor.convergence, write_case(tmp_path, **LINES))
    assert len(capsys.readouterr().out.splitlines()) == len(str(found).splitlines()) + 1


@pytest.mark.slow
def test_study(tmp_path):
    write_case(tmp_path)
    (tmp_path / "study.toml").write_text(STUDY)
    found = both("lab study", pmor.study, tmp_path / "study.toml")
    assert found.failures == ()


@pytest.mark.slow
@pytest.mark.jit
def test_reductions(tmp_path, monkeypatch, few_candidates):
    """Fewer states and solves than an engineer would ask for."""
    monkeypatch.setattr(comparison, "run", partial(comparison.run, states=3, repeats=1, most_solves=16))
    found = both("lab reductions", pmor.reductions, write_case(tmp_path, offline=TRAINING, mesh={"width_elements": 2}))
    assert found.failures == ()


@pytest.mark.slow
def test_dynamics(tmp_path, monkeypatch):
    monkeypatch.setattr(law, "TOLERANCE", 1e-3)
    monkeypatch.setattr(law, "STATIC_TOLERANCE", 1e-3)
    monkeypatch.setattr(law, "CHECKED", 10)
    both("dynamics", pmor.run_dynamics, write_case(tmp_path, **LINES, dynamics=DYNAMICS))


@pytest.mark.slow
def test_design(tmp_path, monkeypatch):
    monkeypatch.setattr(readings, "FRESH", 64)
    monkeypatch.setattr(readings, "CONTOUR", 4)
    path = written(tmp_path, DESIGN.replace("descents = 2", "descents = 1").replace("points = 2", "points = 1"))
    assert both("design", pmor.run_design, path).failures == ()
    assert main(["design", str(path), "--out", str(tmp_path / "command"), "--case", "0"]) == 0
    case = pmor.write_design_case(path, tmp_path / "python", 0)
    assert (tmp_path / "command" / case.name).read_text() == case.read_text()


@pytest.mark.slow
def test_campaign(tmp_path):
    (tmp_path / "base.toml").write_text(case_text(**LINES, results={"root_stress": False, "maps": False}))
    path = tmp_path / "campaign.toml"
    path.write_text('case = "base.toml"\n[designs]\nmethod = "grid"\n'
                    "pair.face_width_mm = { from = 15.0, to = 20.0, steps = 2 }\n"
                    f'[store]\nfolder = "{tmp_path / "store"}"\n')  # fmt: skip
    assert both("campaign", pmor.campaign, path).count("ok") == 2
    assert main(["campaign", str(path), "--out", str(tmp_path / "case"), "--case", "2"]) == 0
    case = pmor.write_campaign_case(path, tmp_path / "again", 2)
    assert (tmp_path / "case" / case.name).read_text() == case.read_text()


@pytest.mark.slow
@pytest.mark.jit
def test_bench(tmp_path, monkeypatch):
    """The case and one with line loads, without the neighbours of the case."""
    path = write_case(tmp_path)
    case = pmor.load_case(path)
    listed = [bench.variants(case)[0], bench.line_load_variants(case)[0]]
    monkeypatch.setattr(bench, "variants", lambda case: listed)
    for name, value in {"SWEEP_SIDE": 30, "REPEATS": 1, "RELIEFS": 2}.items():
        monkeypatch.setattr(bench, name, value)
    measure, measured, asked = bench.run, [], []

    def once(*arguments, **options):
        """Times are never the same twice: the second call gets those of the first."""
        asked.append((arguments, options))
        measured.extend([] if measured else [measure(*arguments, **options)])
        return measured[0]

    monkeypatch.setattr(bench, "run", once)
    assert main(["lab", "bench", str(path), "--json", str(tmp_path / "command" / "bench.json")]) == 0
    found = pmor.bench(case, tmp_path / "python" / "bench.json")
    assert asked[0] == asked[1]
    assert_alike(tmp_path / "command", tmp_path / "python")
    assert {row["phase"].partition(":")[0] for row in found.rows} == {
        "offline", "position", "sweep", "start", "run", "conditions", "results"
    }  # fmt: skip
    assert set(found.machine) >= {"cpu", "cores", "system", "python"}
    assert all(row["basis_mib"] > 0.0 for row in found.rows if row["phase"].startswith("position"))
