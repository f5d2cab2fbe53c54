"""A campaign on a Dask cluster ends with the bytes of one on local processes, also where the scheduler is killed.

Slow: ``pytest -n 0 -m slow tests/robustness/test_campaign_cluster.py``, with the package ``distributed``.
"""

import shutil
import subprocess
import sys
import time

import pytest

from pmor.campaigns.output import RESULTS
from tests.support.processes import ROOT, finish, start
from tests.support.small_campaign import written

pytestmark = [pytest.mark.slow, pytest.mark.jit]


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


def test_a_cluster_gives_the_bytes_of_local_processes_also_after_its_scheduler_was_killed(cluster, tmp_path):
    path = written(tmp_path, "[store]\nlimit_GiB = 0.0\n")
    local, dask = tmp_path / "local", tmp_path / "dask_out"
    code, _, errors = finish(start("campaign", path, "--out", local, "--jobs", "2"), 1200)
    assert code == 0, errors
    scheduler, file = cluster()
    process = start("campaign", path, "--out", dask, "--dask", file)
    while process.poll() is None and not list(dask.glob("parts/*/chunk_*.json")):
        time.sleep(0.05)
    scheduler.kill()
    code, _, errors = finish(process, 1200)
    assert code in (0, 2)
    assert "Traceback" not in errors
    if code == 0:
        shutil.rmtree(dask)
    code, _, errors = finish(start("campaign", path, "--out", dask, "--dask", cluster()[1]), 1200)
    assert code == 0, errors
    assert [(dask / name).read_bytes() for name in RESULTS] == [(local / name).read_bytes() for name in RESULTS]
