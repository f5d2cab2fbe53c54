"""The benchmark measures what it says; how long anything takes is not asserted."""

import subprocess
from pathlib import Path

import pytest

from pmor.case import load_case
from pmor.lab.bench import (
    Bench,
    Variant,
    line_load_variants,
    offline_rows,
    parallel_rows,
    read_rows,
    run,
    stage_rows,
    start_rows,
    sweep_rows,
    variants,
)
from pmor.lab.core import stages
from pmor.lab.core.starts import REPEATS
from pmor.machine.loader import load
from pmor.pair.model import mesh_model
from pmor.report.page import machine
from pmor.work.cost import Stage
from pmor_online.model import reduced_pair
from pmor_online.sweep import largest_size
from tests.support.gearboxes import SMALL, written
from tests.support.matrix import MOTION
from tests.support.small_case import case_with

KEYS = {"phase", "n_profile", "n_width", "lodm_profile", "lodm_width", "median_ms", "repeats"}


@pytest.fixture
def case():
    return case_with()


@pytest.fixture
def row():
    return {
        "phase": "position: case", "scheme": "direct", "n_profile": 16, "n_width": 8, "lodm_profile": 4,
        "lodm_width": 1, "median_ms": 0.1, "repeats": 3,
    }  # fmt: skip


def table_of(row, *before):
    return str(Bench([row], machine(), list(before)))


def test_a_later_run_is_a_ratio_to_the_earlier_one_and_only_like_is_compared_with_like(row):
    assert table_of(row | {"median_ms": 0.15}, row).splitlines()[1].endswith("1.50")
    assert table_of(row | {"lodm_profile": 8}, row).splitlines()[1].endswith("0.1")
    rows = [row | {"threads": 1, "median_ms": 0.4}, row | {"threads": 2, "median_ms": 0.2}]
    lines = str(Bench(rows, machine(), rows)).splitlines()
    assert "2 threads" in lines[2]
    assert [line.split()[-1] for line in lines[1:3]] == ["1.00", "1.00"]


def test_what_is_no_earlier_result_is_not_compared_with(tmp_path):
    (tmp_path / "text.json").write_text("no JSON")
    (tmp_path / "list.json").write_text("[]")
    assert [read_rows(tmp_path / f"{name}.json") for name in ("none", "text", "list")] == [[], [], []]


def test_offline_stage_is_split_without_overlap(case):
    rows = offline_rows(case)
    assert len(rows) == 5
    for row in rows:
        assert set(row) >= KEYS
        assert row["n_profile"] == case.mesh.profile_elements


@pytest.mark.jit
def test_reduced_model_is_timed_by_threads(small_basis, monkeypatch):
    monkeypatch.setattr("pmor.lab.bench.SWEEP_SIDE", 30)
    monkeypatch.setattr("pmor.lab.bench.REPEATS", 2)
    case, model = small_basis.case, reduced_pair(small_basis)
    serial, parallel = parallel_rows(case, model, 2)
    assert (serial["threads"], parallel["threads"]) == (1, 2)
    assert serial["equal_to_the_bit"]
    (swept,) = sweep_rows(variants(case)[:1], [model])
    assert swept["repeats"] == 2
    assert swept["unknowns"] == largest_size(model)


def test_starts_are_timed_with_the_commands_in_starts_of_the_libraries_and_what_fails_is_no_time(case, monkeypatch):
    called = []

    def answering(command, check, env, **more):
        assert check
        called.append((command[1:], "NUMBA_CACHE_DIR" in env and Path(env["NUMBA_CACHE_DIR"]).name == "kernels"))
        if command[1:3] == ["-m", "venv"]:
            (Path(command[3]) / "bin").mkdir(parents=True)
            (Path(command[3]) / "bin" / "python").touch()
        if command[1:4] == ["-m", "pmor", "run"]:
            folder = Path(command[command.index("--out") + 1])
            folder.mkdir(exist_ok=True)
            (folder / "ste.csv").touch()

    monkeypatch.setattr("pmor.lab.core.starts.subprocess.run", answering)
    libraries, answer, small, results, first, installed, bare, whole = start_rows(case)
    assert [row["repeats"] for row in (libraries, answer, small)] == [REPEATS] * 3
    assert sum(command == ["-m", "pmor", "--help"] for command, _ in called) == REPEATS + 1  # the first one warms up
    cold = [command for command, is_cold in called if is_cold]
    assert [Path(command[3]).name for command in cold] == [f"{case.name}.toml"]
    assert libraries["starts"] == 1.0
    assert bare["median_ms"] == pytest.approx(installed["median_ms"] + results["median_ms"])
    assert whole["median_ms"] == pytest.approx(installed["median_ms"] + first["median_ms"])
    assert small["starts"] == pytest.approx(small["median_ms"] / libraries["median_ms"])
    monkeypatch.undo()
    monkeypatch.setattr("pmor.lab.core.starts._ms.__kwdefaults__", {"python": "false"})
    with pytest.raises(subprocess.CalledProcessError):
        start_rows(case)


def test_what_a_system_does_not_measure_is_left_out_and_the_rest_kept(case, monkeypatch, tmp_path, caplog):
    """Without /proc, in a hardened container, where a process cannot be started."""
    monkeypatch.setattr("pmor.lab.core.stages.SYSTEM", tmp_path / "none")
    stages._forget_peak()
    assert stages._peak() == {}
    for name in ("offline_rows", "line_load_rows", "parallel_rows", "variants", "sweep_rows"):
        monkeypatch.setattr(f"pmor.lab.bench.{name}", lambda *_: [])
    monkeypatch.setattr("pmor.lab.bench.variants", lambda case: [Variant("line loads", case)])
    monkeypatch.setattr("pmor.lab.bench._basis", lambda case, path: path.write_bytes(b""))
    monkeypatch.setattr("pmor.lab.bench.sweep_rows", lambda *_: [{"phase": "position"}])
    monkeypatch.setattr("pmor.lab.core.starts._ms.__kwdefaults__", {"python": "false"})
    monkeypatch.setattr("pmor.lab.core.stages.sys.executable", "false")
    assert [row["phase"] for row in run(case).rows] == ["position"]
    assert [record.getMessage().partition(":")[0] for record in caplog.records if "left out" in record.message] == [
        "left out", "left out"
    ]  # fmt: skip
    monkeypatch.setattr("pmor.lab.bench.measure_stages", lambda case: {"sweep": {"seconds": 1.0}})
    monkeypatch.setattr("pmor.lab.bench.stages", lambda case: [Stage("sweep", 2**20, 1.0)])
    (row,) = stage_rows(case)
    assert "1 MiB" in str(Bench([row], machine(), []))
    assert "peak_mib" not in row


def test_line_loads_are_timed_on_the_pair_on_tilted_axes_and_with_sixteen_sections():
    case = load_case(Path(__file__).parents[2] / "cases" / "paper_spur.toml")
    plain, tilted, helical = (gears.case for gears in line_load_variants(case))
    assert {variant.reduction.shapes for variant in (plain, tilted, helical)} == {"line_loads"}
    assert plain.pair == case.pair
    assert tilted.misalignment.in_plane_um > 0.0
    meshed = mesh_model(helical).meshed
    assert len(meshed.sections.z) == 16
    assert meshed.pair.total_contact_ratio < 3.0


@pytest.mark.slow
def test_of_a_gearbox_its_motion_is_timed(tmp_path, monkeypatch, undrawn):
    monkeypatch.setattr("pmor.lab.core.motion.SPEEDS", 4)
    monkeypatch.setattr("pmor.lab.core.motion.SHARES", (0.9, 1.0))
    monkeypatch.setattr("pmor.lab.core.motion.CYCLES", 20)
    found = run(load(written(tmp_path, SMALL + MOTION)), jobs=1)
    at_rest, linear, page, table, curve, run_up = found.rows
    assert (at_rest["repeats"], linear["repeats"], page["repeats"]) == (1, 3, 1)
    assert "4 speeds, 6 harmonics, 2 torques, 1 threads" in linear["phase"]
    assert "points" in curve["phase"]
    assert "flanks apart" in curve["phase"]
    assert "20 mesh cycles" in run_up["phase"]
    assert table["median_ms"] > 0.0
    assert "motion" in str(found)
