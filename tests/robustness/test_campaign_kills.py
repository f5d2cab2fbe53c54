"""Campaigns on processes and on a Dask cluster, struck at random moments, end with the same bytes.

    pytest -m slow -s tests/robustness/test_campaign_kills.py

The disk that fills up is a file system of a few MiB in memory, where this may be mounted; elsewhere a limit on the size
of files stands for it.
"""

import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from pmor.campaigns.describe import folder_text
from pmor.campaigns.output import RESULTS
from tests.support.processes import ROOT, finish, small_disk, start
from tests.support.small_case import case_text

STRIKES = 20
EVENTS = ["worker killed", "worker hangs", "main killed", "main interrupted", "scheduler killed", "full disk"]
LIMIT_S = 20.0
DISK = 1 << 20
BASE = case_text(contact={"scheme": "line"}, reduction=None, mesh={"width": "plane_strain"},
                 online={"angles_per_pitch": 60})  # fmt: skip
# Two different gears, as large a mesh as a large campaign would have at least.
WIDE = case_text(contact={"scheme": "line"}, reduction=None, mesh={"width_elements": 4},
                 wheel={"teeth": 21, "bore_radius_mm": 19.0}, online={"angles_per_pitch": 60})  # fmt: skip


def campaign_text(steps):
    """Three bores and so many modules around a centre distance: a third or so of the designs are infeasible."""
    return f"""
case = "base.toml"
[designs]
method = "grid"
pair.module_mm = {{ from = 3.86, to = 4.35, steps = {steps} }}
pinion.bore_radius_mm = [18.0, 20.0, 22.0]
[relations]
centre_distance_mm = 86.5
[workers]
time_limit_s = {LIMIT_S}
[store]
folder = "{{store}}"
"""


@pytest.fixture
def campaign_file(tmp_path):
    def write(steps, base=BASE):
        (tmp_path / "base.toml").write_text(base)
        path = tmp_path / "campaign.toml"
        path.write_text(campaign_text(steps).replace("{store}", str(tmp_path / "store")))
        return path

    return write


@pytest.fixture
def cluster(tmp_path):
    """Function that starts a scheduler with two workers and gives the scheduler's process and file."""
    pytest.importorskip("distributed")
    started = []

    def begin():
        file = tmp_path / f"scheduler{len(started)}.json"
        kinds = (("scheduler", ["--port", "0"]), ("worker", ["--nthreads", "1", "--nworkers", "2", "--death-timeout",
                  "20", "--local-directory", str(tmp_path / "dask")]))  # fmt: skip
        for kind, more in kinds:
            command = [sys.executable, "-m", f"distributed.cli.dask_{kind}", "--no-dashboard", "--scheduler-file", file]
            started.append(subprocess.Popen(
                [*map(str, command), *more], cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
            ))  # fmt: skip
            while not file.exists():
                time.sleep(0.05)
        return started[-2], file

    yield begin
    for process in started:
        process.terminate()
    for process in started:
        process.wait(60)


def results(folder):
    return {name: (folder / name).read_bytes() for name in RESULTS}


def solvers():
    """Processes that solve designs, of whichever command."""
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            if b"pmor.campaigns.solver" in path.read_bytes():
                found.append(int(path.parent.name))
        except OSError:
            pass  # has ended meanwhile
    return found


def chunks_in(folder):
    return len(list(folder.glob("parts/*/chunk_*.json")))


def wait_for_chunk(process, folder, more):
    """Wait until there are more chunks; whether the process still runs."""
    wanted = chunks_in(folder) + more
    while process.poll() is None and chunks_in(folder) < wanted:
        time.sleep(0.05)
    return process.poll() is None


@pytest.fixture
def disk(tmp_path):
    with small_disk(tmp_path / "disk", DISK) as found:
        yield found


@pytest.mark.slow
@pytest.mark.jit
def test_a_campaign_struck_twenty_times_ends_with_the_same_bytes(campaign_file, cluster, disk, tmp_path):
    rng, path = np.random.default_rng(20160919), campaign_file(12)
    folder, small = disk
    plain, out = tmp_path / "plain", folder / "out"
    code, _, errors = finish(start("campaign", path, "--out", plain, "--jobs", "2"), 1200)
    assert code == 0, errors
    expected, tally, ends = results(plain), Counter(), 0
    strikes = [EVENTS[i % len(EVENTS)] for i in range(STRIKES)]
    rng.shuffle(strikes)
    for event in strikes:
        arguments, scheduler, more = ["campaign", path, "--out", out], None, {}
        if event == "scheduler killed":
            scheduler, file = cluster()
            arguments += ["--dask", file]
        else:
            arguments += ["--jobs", "2"]
        if event == "full disk":
            fill(folder, small, more, int(rng.integers(2000, 30_000)))
        before = chunks_in(out)
        process = start(*arguments, **more)
        running = wait_for_chunk(process, out, int(rng.integers(0, 3))) if event != "full disk" else True
        time.sleep(0.3 * rng.random())
        if running:
            strike(event, process, scheduler, rng)
        code, _, errors = finish(process, 1200)
        (folder / "ballast").unlink(missing_ok=True)
        allowed = {"worker killed": (0,), "worker hangs": (0,), "main killed": (0, -9), "main interrupted": (0, 130),
                   "scheduler killed": (0, 2), "full disk": (0, 2)}[event]  # fmt: skip
        assert code in allowed, (event, code, errors)
        if code == 2:
            assert "Traceback" not in errors
            assert len([line for line in errors.splitlines() if line.startswith("pmor: error: ")]) == 1, errors
        tally[event, code] += 1
        print(event, code, chunks_in(out), flush=True)
        if code == 0:
            assert results(out) == expected, event
            ends += 1
            shutil.rmtree(out)
        else:
            assert chunks_in(out) >= before, "finished chunks stay"
            if (out / "parts" / "plan.json").exists():
                assert "not finished" in folder_text(out)
    code, text, errors = finish(start("campaign", path, "--out", out), 1200)
    assert code == 0, errors
    assert results(out) == expected
    assert not (out / "parts").exists()
    print(f"\n{STRIKES} strikes: {dict(tally)}; small disk: {small}; {ends + 1} campaigns finished, all bytes equal")


def strike(event, process, scheduler, rng):
    if event.startswith("worker"):
        found = solvers()
        if found:
            os.kill(found[rng.integers(len(found))], signal.SIGKILL if event == "worker killed" else signal.SIGSTOP)
    elif event == "scheduler killed":
        scheduler.kill()
    elif event.startswith("main"):
        process.send_signal(signal.SIGKILL if event == "main killed" else signal.SIGINT)


def fill(folder, small, more, free):
    """Leave so many bytes on the disk."""
    if small:
        workspace = shutil.disk_usage(folder).free - free
        (folder / "ballast").write_bytes(bytes(max(workspace, 0)))
    else:
        limit = (free // 10, free // 10)
        more["preexec_fn"] = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, limit)


@pytest.mark.slow
@pytest.mark.jit
def test_three_hundred_designs_on_processes_and_on_a_cluster_are_the_same_bytes(campaign_file, cluster, tmp_path):
    path = campaign_file(100, WIDE)
    local, dask = tmp_path / "local", tmp_path / "dask_out"
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    code, text, errors = finish(start("campaign", path, "--out", local, "--jobs", "2"), 3600)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert code == 0, errors
    shutil.rmtree(tmp_path / "store")  # else the second would have nothing to solve
    _, file = cluster()
    code, _, errors = finish(start("campaign", path, "--out", dask, "--dask", file), 3600)
    assert code == 0, errors
    assert results(dask) == results(local)
    summary = json.loads((local / "campaign.json").read_text())
    assert summary["n_designs"] == summary["n_ok"] + summary["n_infeasible"] == 300
    assert 80 <= summary["n_infeasible"] <= 120
    times = {name: json.loads((out / "times.json").read_text()) for name, out in (("local", local), ("dask", dask))}
    taken, solving = sum(after[:2]) - sum(before[:2]), times["local"]["solving_this_run_s"]
    print(f"\n{text}local: {taken:.1f} s of processor time, {100 * (taken / solving - 1):.1f} % beside the designs")
    for name, found in times.items():
        print(f"{name}: {found['solving_this_run_s']:.1f} s of processor time in {found['wall_s']:.1f} s, efficiency "
              f"on two cores {found['solving_this_run_s'] / (2 * found['wall_s']):.2f}")  # fmt: skip
