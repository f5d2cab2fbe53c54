"""A whole campaign: its rows are those of runs, and the same bytes whatever befalls its processes and executors."""

import csv
import errno
import io
import json
import os
import re
import signal
import sys
import threading
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import pmor
import pmor.campaigns.chunks as chunks_module
import pmor.campaigns.supervise as supervise_module
from pmor.app.cli import main
from pmor.campaigns.describe import folder_text
from pmor.campaigns.loader import load
from pmor.campaigns.output import RESULTS
from pmor.campaigns.pairs import basis_of, results_of
from pmor.campaigns.relations import case_of
from pmor.campaigns.run import task_of
from pmor.campaigns.settings import Workers
from pmor.campaigns.solve import row_of
from pmor.core.errors import OutputError
from pmor.core.memory import MemoryLimit
from pmor.report.data_files import write_summary_json
from pmor.report.summary import figures
from pmor.storage.campaign_file import CAMPAIGN_SCHEMA, STATUS
from pmor.storage.gear_store import entries, open_store
from pmor.storage.hdf5 import attribute, open_checked, read
from pmor.storage.results_folder import working_folder
from pmor_online.readings import read_off
from pmor_online.run import OnlineResult, sweep_case
from tests.support.small_case import case_text

BASE = case_text(
    contact={"scheme": "line"}, reduction=None, results={"root_stress": False, "maps": False},
    online={"angles_per_pitch": 12, "torques_Nm": [50.0, 100.0]},
)  # fmt: skip
DESIGNS = 24
FAULTY = (sys.executable, "-P", str(Path(__file__).parents[1] / "support" / "faulty_solver.py"))
# Of the summary of a run.
ALIKE = (
    "ste_mean_um", "ste_peak_to_peak_um", "mesh_stiffness_mean_N_per_mm_um", "mesh_stiffness_tangent_mean_N_per_mm_um",
    "k_h_beta", "flank_pressure_max_MPa", "effective_contact_ratio",
)  # fmt: skip
TEXT = f"""
case = "base.toml"
[designs]
method = "grid"
pair.face_width_mm = {{ from = 15.0, to = 38.0, steps = {DESIGNS} }}
[workers]
time_limit_s = 2.0
[store]
folder = "store"
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "base.toml").write_text(BASE)
    (tmp_path / "campaign.toml").write_text(TEXT)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def faulty(folder, monkeypatch):
    """Function that gives designs their faults; solving processes make up their results."""
    (folder / "faults").mkdir()
    monkeypatch.setenv("FAULTS", str(folder / "faults"))
    monkeypatch.setattr(supervise_module, "COMMAND", FAULTY)
    four_to_a_chunk = chunks_module.Expected(seconds=1.0, finely=0.0, share=1.0)
    monkeypatch.setattr("pmor.campaigns.run.expected_cost", lambda *_: four_to_a_chunk)

    def faults(**kinds):
        for number, (kind, times) in kinds.items():
            (folder / "faults" / number.removeprefix("d")).write_text(json.dumps([kind, times]))

    return faults


def results(folder):
    return {name: (folder / name).read_bytes() for name in RESULTS}


def statuses(folder):
    with open_checked(folder / "campaign.h5", CAMPAIGN_SCHEMA) as file:
        names = attribute(file, "statuses", str).split(", ")
        return [names[code] for code in read(file, STATUS)]


def test_the_row_of_a_design_is_what_a_run_of_its_case_gives(tmp_path):
    case = case_of(BASE, {"pair.helix_angle_deg": 12.0, "wheel.teeth": 24}, "design 1")
    store = open_store(tmp_path / "store", 1.0)
    row, failure = results_of(case, store)
    reduced = pmor.train(case).reduced
    sweep = sweep_case(reduced)
    summary = figures(OnlineResult(reduced, sweep, None, 0.0, readings=read_off(reduced, sweep)))
    assert failure == ""
    for key in ALIKE:
        assert row[key] == summary[key], key
    assert [row[f"ste_order_{k}_um"] for k in (1, 2, 3)] == summary["ste_harmonics_um"][:3]
    assert row["root_stress_pinion_MPa"] is None
    assert row["ste_peak_to_peak_worst_um"] == max(np.ptp(sweep.ste_um, axis=1))


def test_the_relief_that_suits_a_design_is_worth_what_its_row_says(tmp_path):
    case = case_of(BASE, {"pinion.teeth": 20}, "design 1")
    row, _ = results_of(case, open_store(tmp_path / "store", 1.0), relief=True)
    pinion, wheel = (
        pmor.Modification(
            tip_relief_um=row["best_tip_relief_um"],
            tip_relief_start_roll_deg=row[f"best_tip_relief_start_{gear}_roll_deg"],
        )
        for gear in ("pinion", "wheel")
    )
    assemblies = [pmor.Assembly(), pmor.Assembly(pinion=pinion, wheel=wheel)]
    found = pmor.train(case).sweep_conditions(assemblies, torques_Nm=case.online.torques_Nm, angles=3200)
    plain, best = found.peak_to_peak_um.mean(axis=1)
    assert row["best_ste_peak_to_peak_um"] == pytest.approx(best, rel=1e-2)
    assert best < 0.6 * plain


@pytest.mark.slow
def test_the_best_design_is_worth_on_3200_angles_what_is_printed(folder, capsys):
    (folder / "campaign.toml").write_text(
        'case = "base.toml"\n[designs]\nmethod = "grid"\npinion.teeth = [20, 21]\n'
        'pinion.bore_radius_mm = 18.0\n[store]\nfolder = "store"\n'
    )
    assert main(["campaign", "campaign.toml", "--out", "out"]) == 0
    assert "on the angles of its case)" in capsys.readouterr().out
    data = json.loads((folder / "out" / "campaign.json").read_text())
    assert [entry["design"] for entry in data["fine_angles"]] == [1, 2]
    for entry in data["fine_angles"]:
        case = case_of(BASE, {"pinion.teeth": 19 + entry["design"], "pinion.bore_radius_mm": 18.0}, "design")
        exact = pmor.train(case).sweep(angles=3200)
        spans = dict(zip(exact.torque_Nm.tolist(), exact.peak_to_peak_um.tolist(), strict=True))
        assert entry["ste_peak_to_peak_um"] == pytest.approx(spans[case.torque_Nm], rel=1e-2)
        assert entry["of_the_case"]["ste_peak_to_peak_um"] < entry["ste_peak_to_peak_um"]
    least = min(entry["ste_peak_to_peak_um"] for entry in data["fine_angles"])
    assert data["results"]["ste_peak_to_peak_um"]["least"] == least


def test_the_same_gear_is_solved_once_and_a_row_from_the_store_is_the_same(tmp_path, monkeypatch):
    store = open_store(tmp_path / "store", 1.0)
    wide = case_of(BASE, {"wheel.bore_radius_mm": 22.0}, "one")
    first = results_of(wide, store)
    assert len(entries(store.folder)) == 2

    def solved_before(*arguments):
        raise AssertionError("is in the store")

    monkeypatch.setattr("pmor_offline.gears.solved_gear", solved_before)
    assert results_of(wide, store) == first
    alike = basis_of(case_of(BASE, {"load.torque_Nm": 100.0}, "two"), store)
    assert alike.compliance.gears[0] is alike.compliance.gears[1]


@pytest.mark.slow
def test_two_identical_campaigns_differ_in_no_byte_whatever_befell_their_processes(folder, faulty, capsys):
    assert main(["campaign", "campaign.toml", "--out", "plain", "--jobs", "2"]) == 0
    faulty(d2=("die", 1), d5=("hang", 1), d8=("leave", 1), d13=("memory", 1), d14=("die", 1), d24=("defect", 1))
    assert main(["campaign", "campaign.toml", "--out", "struck"]) == 0
    assert results(folder / "struck") == results(folder / "plain")
    assert "16 ok, 8 infeasible" in capsys.readouterr().out
    rows = (folder / "plain" / "campaign.csv").read_text().splitlines()[1:]
    assert [int(row.split(",")[0]) for row in rows] == list(range(1, DESIGNS + 1))
    assert {path.name for path in (folder / "plain").iterdir()} == {
        *RESULTS, "report.html", "times.json", "times.csv", "cases", ".pmor-manifest.jsonl",
    }  # fmt: skip
    assert len(list((folder / "plain" / "cases").glob("*.toml"))) == DESIGNS


@pytest.mark.slow
def test_a_design_that_fails_twice_has_a_row_that_says_so_and_costs_no_other(folder, faulty, capsys):
    faulty(d4=("hang", 2), d5=("die", 9), d10=("memory", 9), d11=("defect", 9))
    assert main(["campaign", "campaign.toml", "--out", "out", "--jobs", "2"]) == 3
    errors = capsys.readouterr().err
    assert "4 designs have no results, first: design 4: no answer within 2 s, 2 times" in errors
    found = statuses(folder / "out")
    assert [i + 1 for i, status in enumerate(found) if status == "lost"] == [4, 5, 10, 11]
    text = (folder / "out" / "campaign.csv").read_text()
    for reason in ("signal SIGKILL, 2 times", "its memory did not suffice, 2 times", "ZeroDivisionError: division"):
        assert reason in text


@pytest.mark.slow
def test_an_order_that_broke_off_leaves_no_answers_to_the_next_one(folder, faulty, monkeypatch):
    """A thread to watch over a process may be refused at any answer: ulimit -v, or a limit on threads."""
    assert main(["campaign", "campaign.toml", "--out", "plain"]) == 0
    genuine, count = threading.Timer.start, iter(range(10**6))

    def refused(timer):
        if next(count) in (7, 12):
            raise RuntimeError("can't start new thread")
        genuine(timer)

    monkeypatch.setattr(threading.Timer, "start", refused)
    assert main(["campaign", "campaign.toml", "--out", "struck"]) == 0
    assert next(count) > 12
    assert results(folder / "struck") == results(folder / "plain")


def test_without_threads_or_processes_designs_are_lost_with_the_reason(folder, faulty, monkeypatch, capsys):
    def refused(*arguments, **options):
        raise OSError(errno.ENOMEM, "Cannot allocate memory")

    monkeypatch.setattr(supervise_module.subprocess, "Popen", refused)
    assert main(["campaign", "campaign.toml", "--out", "out"]) == 3
    reason = "its process did not start (Cannot allocate memory), 2 times"
    assert f"{DESIGNS} designs have no results, first: design 1: {reason}" in capsys.readouterr().err


def test_too_little_memory_is_no_property_of_a_design(folder, tmp_path, monkeypatch):
    task = task_of(load(folder / "campaign.toml"), open_store(tmp_path / "store", 1.0))
    limit = MemoryLimit(2**28, "ulimit -d allows", "raise ulimit -d")
    monkeypatch.setattr("pmor.work.cost.memory_limits", lambda: (limit,))
    for workers, word in ((Workers(), "raise ulimit -d"), (Workers(memory_GiB=0.25), r"raise \[workers\] memory_GiB")):
        row = row_of(replace(task, workers=workers), 1, {"pair.face_width_mm": 20.0}, open_store(tmp_path / "s", 1.0))
        assert row["status"] == "lost"
        assert re.search(f"takes about .* allows 256 MiB: {word}", row["reason"])


def test_processes_may_end_while_all_of_them_are_ended(monkeypatch):
    """One thread closes, those beside the processes see them end."""
    solvers, ended = supervise_module.Solvers(), []

    class Process:
        stdin = stdout = io.StringIO()

        def wait(self, limit=None):
            return 0

        def kill(self):
            if self not in ended:
                ended.append(self)
                thread = threading.Thread(target=solvers.end, args=(self,))
                thread.start()
                thread.join(0.2)

    solvers._running = {Process() for _ in range(5)}
    solvers.close()
    assert len(ended) == 5


@pytest.mark.parametrize("kind", [pytest.param(ThreadPoolExecutor, marks=pytest.mark.slow), ProcessPoolExecutor])
def test_any_executor_gives_the_same_bytes(folder, faulty, kind):
    plain = pmor.campaign("campaign.toml", "plain")
    assert list(plain.columns()["design"]) == list(range(1, len(plain.codes) + 1))
    assert set(plain.columns()) == {"design", "status", *plain.inputs, *plain.results, "reason"}
    if kind is ProcessPoolExecutor:  # its processes do not know what was replaced here
        starting = {"initializer": partial(_be_faulty, FAULTY)}
    else:
        starting = {}
    with kind(2, **starting) as executor:
        found = pmor.campaign("campaign.toml", "other", executor=executor)
    assert results(folder / "other") == results(folder / "plain")
    assert found.status.tolist() == plain.status.tolist() == ["ok", "ok", "infeasible"] * (DESIGNS // 3)
    assert found.inputs["pair.face_width_mm"][:2].tolist() == [15.0, 16.0]
    assert np.isnan(found.results["k_h_beta"][2])


def _be_faulty(command):
    supervise_module.COMMAND = command


def test_a_disk_that_is_full_ends_it_and_the_same_command_goes_on(folder, faulty, monkeypatch, capsys):
    assert main(["campaign", "campaign.toml", "--out", "plain"]) == 0
    write, count = chunks_module.write_summary_json, [0]

    def full(path, data, overwrite=False):
        if path.name.startswith("chunk_"):
            count[0] += 1
            if count[0] == 3:
                raise OutputError(f"cannot write {path}: no space is left on the disk")
        write(path, data, overwrite)

    monkeypatch.setattr(chunks_module, "write_summary_json", full)
    assert main(["campaign", "campaign.toml", "--out", "out"]) == 2
    assert "no space is left" in capsys.readouterr().err
    assert not any((folder / "out" / name).exists() for name in RESULTS)
    assert "2 of 6 chunks, 8 of 24 designs: 2 infeasible, 6 ok" in folder_text(folder / "out")
    assert main(["info", "out"]) == 0
    capsys.readouterr()
    assert main(["campaign", "campaign.toml", "--out", "out"]) == 0
    assert "designs: 8 of 24 are finished and taken over" in capsys.readouterr().err
    assert results(folder / "out") == results(folder / "plain")


@pytest.mark.slow
def test_chunks_of_another_campaign_or_another_hand_are_solved_again(folder, faulty, monkeypatch, capsys):
    keep, kept = chunks_module.ChunkFiles.write, []

    def once(self, chunk, answer):
        if kept:
            raise KeyboardInterrupt
        kept.append(chunk)
        keep(self, chunk, answer)

    monkeypatch.setattr(chunks_module.ChunkFiles, "write", once)
    assert main(["campaign", "campaign.toml", "--out", "out"]) == 130
    assert "the same command goes on where it stopped" in capsys.readouterr().err
    part = next((folder / "out" / "parts").rglob("chunk_*.json"))
    assert main(["info", "out"]) == 0
    edited = part.read_text().replace('"ok"', '"lost"')
    monkeypatch.setattr(chunks_module.ChunkFiles, "write", keep)
    part.write_text(edited)
    (folder / "base.toml").write_text(BASE.replace("bore_radius_mm = 20.0", "bore_radius_mm = 21.0"))
    assert main(["campaign", "campaign.toml", "--out", "out", "--overwrite"]) == 0
    assert "taken over" not in capsys.readouterr().err
    assert set(statuses(folder / "out")) == {"ok", "infeasible"}


@pytest.mark.slow
def test_a_design_that_stands_in_the_table_twice_is_solved_once(folder, faulty, capsys):
    widths = [15.0, 16.0, 15.0, 17.0, 16.0, 15.0, 18.0]
    (folder / "designs.csv").write_text("\n".join(["pair.face_width_mm", *map(str, widths)]))
    (folder / "campaign.toml").write_text('case = "base.toml"\n[designs]\nmethod = "csv"\nfile = "designs.csv"\n')
    assert main(["campaign", "campaign.toml", "--out", "out"]) == 0
    said = capsys.readouterr()
    assert "7 designs: 6 ok, 1 infeasible" in said.out  # the third of those that differ is none
    assert "infeasible, 1 of them such as design 4: a third of them, 3, are none" in said.out
    assert "3 designs stand in the table before: each is solved once" in said.err
    rows = list(csv.DictReader((folder / "out" / "campaign.csv").read_text().splitlines()))
    assert [row["design"] for row in rows] == list("1234567")
    assert [float(row["pair.face_width_mm"]) for row in rows] == widths
    found = [row["k_h_beta"] and round(7.0 * float(row["k_h_beta"])) for row in rows]
    assert found == [1, 2, 1, "", 2, 1, 4]
    times = (folder / "out" / "times.csv").read_text().splitlines()
    assert [times[i].partition(",")[2] for i in (3, 5, 6)] == ["0.000000"] * 3


def malformed_chunks(first, rows, key):
    """What a chunk may hold that no solver wrote."""
    numbered = [row | {"design": first + 1 + k} for k, row in enumerate(rows)]
    whole = {"key": key, "first": first, "rows": numbered, "seconds": [0.1] * len(rows)}

    def changed(**fields):
        return whole | {"rows": [numbered[0] | fields, *numbered[1:]]}

    return [
        {name: value for name, value in whole.items() if name != "key"},
        whole | {"rows": {}},
        whole | {"rows": [1, 2, 3, 4]},
        whole | {"rows": [{"design": row["design"]} for row in numbered]},
        whole | {"seconds": [0.1]},
        whole | {"seconds": ["long"] * len(rows)},
        changed(design=first + 2),
        changed(status="fine"),
        changed(reason=None),
        changed(results=numbered[0]["results"] | {"ste_mean_um": "much"}),
        changed(results={"no_such_result": 1.0}),
        changed(inputs=[]),
    ]


@pytest.mark.slow
@pytest.mark.parametrize("half", [pytest.param(slice(6), marks=pytest.mark.slow), slice(6, 12)])
def test_malformed_chunks_are_solved_again_and_malformed_plans_written_anew(half, folder, faulty, monkeypatch, capsys):
    assert main(["campaign", "campaign.toml", "--out", "plain"]) == 0
    keep = chunks_module.ChunkFiles.write

    def once(self, chunk, answer):
        keep(self, chunk, answer)
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(chunks_module.ChunkFiles, "write", once)
        assert main(["campaign", "campaign.toml", "--out", "out"]) == 130
    plan = folder / "out" / "parts" / "plan.json"
    (one,) = plan.parent.rglob("chunk_*.json")
    made = json.loads(one.read_text())
    for number in range(DESIGNS // 4):
        content = malformed_chunks(4 * number, made["rows"], made["key"])[half][number]
        write_summary_json(one.with_name(f"chunk_{number:06d}.json"), content, overwrite=True)
    capsys.readouterr()
    assert main(["info", "out"]) == 0
    write_summary_json(plan, {"campaign": "campaign", "key": made["key"], "chunks": [["a", 4]]}, overwrite=True)
    assert main(["campaign", "campaign.toml", "--out", "out"]) == 0
    assert "taken over" not in capsys.readouterr().err
    assert results(folder / "out") == results(folder / "plain")


PLANS = [
    {"campaign": "old", "chunks": 3, "designs": 12},
    {"campaign": "old", "key": "k", "chunks": [["a", 4]]},
    {"campaign": "old", "key": "k", "chunks": [[0, -4]]},
    {"campaign": ["old"], "key": "k", "chunks": [[0, 4]]},
    {"campaign": "old", "key": "k", "chunks": [[0, 4, 4]]},
]


@pytest.mark.parametrize("plan", PLANS, ids=repr)
def test_plans_of_another_version_are_told_of_in_words(plan, tmp_path, capsys):
    parts = working_folder(tmp_path / "parts")
    write_summary_json(parts / "plan.json", plan)
    assert main(["info", str(tmp_path)]) == 2
    assert "plan.json: is of another version: remove the folder" in capsys.readouterr().err


class Processes(list):
    """All solving processes of a test; `when_two` is called after the second has started."""

    def when_two(self):
        pass


@pytest.fixture
def processes(monkeypatch):
    start, started = supervise_module.Solvers.start, Processes()

    def recorded(self):
        started.append(start(self))
        if len(started) == 2:
            started.when_two()
        return started[-1]

    monkeypatch.setattr(supervise_module.Solvers, "start", recorded)
    return started


def test_an_interruption_leaves_no_process_behind(folder, faulty, processes, request):
    faulty(**{f"d{number}": ("hang", 9) for number in range(1, DESIGNS)})
    # A process that a shell starts in the background is told to let interruptions pass, and so are its tests.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    request.addfinalizer(partial(signal.signal, signal.SIGINT, before))
    processes.when_two = lambda: threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT)).start()
    assert main(["campaign", "campaign.toml", "--out", "out", "--jobs", "2"]) == 130
    assert len(processes) == 2
    assert [process.poll() for process in processes] == [-signal.SIGKILL] * 2


@pytest.mark.slow
def test_the_end_of_a_campaign_ends_no_process_of_another_one(folder, faulty, processes):
    with supervise_module.LocalProcesses(1) as going_on:
        assert pmor.campaign("campaign.toml", "first", executor=going_on).count("ok") == 16
        pmor.campaign("campaign.toml", "second")
        assert [process.poll() is None for process in processes] == [True, False]
    assert all(process.poll() is not None for process in processes)


@pytest.mark.slow
def test_case_files_edited_by_hand_and_folders_of_others_stay(folder, faulty, capsys):
    assert main(["campaign", "campaign.toml", "--out", "out"]) == 0
    edited = folder / "out" / "cases" / "design_000012.toml"
    edited.write_text(edited.read_text() + "# checked\n")
    kept = folder / "out" / "cases" / "thesis" / "chapter.txt"
    kept.parent.mkdir()
    kept.write_text("mine")
    assert main(["campaign", "campaign.toml", "--out", "out"]) == 2
    assert "design_000012.toml" in capsys.readouterr().err
    assert edited.read_text().endswith("# checked\n")
    assert main(["campaign", "campaign.toml", "--out", "out", "--overwrite"]) == 0
    assert not edited.read_text().endswith("# checked\n")
    assert kept.read_text() == "mine"


def test_the_case_file_of_a_design_reads_back_as_what_was_solved(folder, capsys):
    (folder / "campaign.toml").write_text(TEXT + "[relations]\ncentre_distance_mm = 84.3\n")
    assert main(["campaign", "campaign.toml", "--case", "3"]) == 0
    case = pmor.load_case("campaign_design_3.toml")
    assert case.pair.face_width_mm == 17.0
    assert case.pair.pinion.profile_shift == case.pair.wheel.profile_shift != 0.0
    assert main(["campaign", "campaign.toml", "--case", "3"]) == 2
    assert "exists already" in capsys.readouterr().err
