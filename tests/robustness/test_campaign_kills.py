"""A campaign on processes, struck at random moments, ends with the same bytes.

    pytest -n 0 -m slow -s tests/robustness/test_campaign_kills.py

Schedulers of a cluster are killed in test_campaign_cluster. The disk that fills up is a file system of a MiB in memory,
where this may be mounted; elsewhere a limit on the size of files stands for it.
"""

import os
import shutil
import signal
import time
from pathlib import Path

import numpy as np
import pytest

from pmor.campaigns.describe import folder_text
from pmor.campaigns.output import RESULTS
from tests.support.processes import finish, full_disk, small_disk, start
from tests.support.small_campaign import written

STRIKES = 20
# Exit codes after each; 0 where the campaign was finished before.
ALLOWED = {"worker killed": (0,), "worker hangs": (0,), "main killed": (0, -9), "main interrupted": (0, 130),
           "full disk": (0, 2)}  # fmt: skip
SECTIONS = """
[workers]
time_limit_s = 20.0
[store]
folder = "{}"
"""


def results(folder):
    return {name: (folder / name).read_bytes() for name in RESULTS}


def solvers_of(command):
    """Numbers of the processes that solve designs for a running command."""
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            parent = int((path.parent / "stat").read_text().rpartition(")")[2].split()[1])
            if parent == command.pid and b"pmor.campaigns.solver" in path.read_bytes():
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


def strike(event, process, rng):
    if event.startswith("worker"):
        found = solvers_of(process)
        if found:
            os.kill(found[rng.integers(len(found))], signal.SIGKILL if event == "worker killed" else signal.SIGSTOP)
    elif event.startswith("main"):
        process.send_signal(signal.SIGKILL if event == "main killed" else signal.SIGINT)


@pytest.mark.slow
@pytest.mark.jit
def test_a_campaign_struck_twenty_times_ends_with_the_same_bytes(tmp_path):
    rng, path = np.random.default_rng(20160919), written(tmp_path, SECTIONS.format(tmp_path / "store"))
    code, _, errors = finish(start("campaign", path, "--out", tmp_path / "plain", "--jobs", "2"), 1200)
    assert code == 0, errors
    expected = results(tmp_path / "plain")
    strikes = [list(ALLOWED)[i % len(ALLOWED)] for i in range(STRIKES)]
    rng.shuffle(strikes)
    with small_disk(tmp_path / "disk", 1 << 20) as (folder, small):
        out = folder / "out"
        for event in strikes:
            free = int(rng.integers(2000, 30_000)) if event == "full disk" else None
            before = chunks_in(out)
            with full_disk(folder, small, free, files=10) as more:
                process = start("campaign", path, "--out", out, "--jobs", "2", **more)
                if free is not None or wait_for_chunk(process, out, int(rng.integers(0, 3))):
                    time.sleep(0.3 * rng.random())
                    strike(event, process, rng)
                code, _, errors = finish(process, 1200)
            assert code in ALLOWED[event], (event, code, errors)
            if code == 2:
                assert "Traceback" not in errors
                assert len([line for line in errors.splitlines() if line.startswith("pmor: error: ")]) == 1, errors
            if code == 0:
                assert results(out) == expected, event
                shutil.rmtree(out)
            else:
                assert chunks_in(out) >= before, "finished chunks stay"
                if (out / "parts" / "plan.json").exists():
                    assert "not finished" in folder_text(out)
        code, _, errors = finish(start("campaign", path, "--out", out), 1200)
        assert code == 0, errors
        assert results(out) == expected
        assert not (out / "parts").exists()
