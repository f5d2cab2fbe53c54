"""The offline stage, killed, interrupted and out of disk space at random moments, resumes and loses nothing.

    pytest -m slow -s tests/robustness/test_kills.py

The files are in a file system of 4 MiB in memory, where this may be mounted; elsewhere a limit on the size of files
stands for the full disk.
"""

import shutil
import signal
import subprocess
import time
from collections import Counter

import numpy as np
import pytest

from pmor.case import basis_key, parse_case
from pmor.storage.basis_file import read_basis
from pmor.storage.snapshot_file import read_snapshots
from tests.support.processes import finish, full_disk, small_disk, start
from tests.support.small_case import case_text
from tests.support.stored_files import assert_same_basis

KILLS = 50
EVENTS = ["SIGKILL", "SIGKILL", "SIGINT", "full disk"]
DISK = 4 << 20
ANGLES = 24
CASE = case_text(offline={"angles_per_pitch": ANGLES})


@pytest.fixture(scope="module")
def case_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("case") / "tiny.toml"
    path.write_text(CASE)
    return path


@pytest.fixture
def disk(tmp_path):
    with small_disk(tmp_path / "disk", DISK) as found:
        yield found


def offline(case_file, basis, **more):
    return start("offline", case_file, "-o", basis, "--resume", **more)


def kill(process, number, moment):
    """Send a signal after so many seconds, unless the process is done by then: how it ended."""
    try:
        process.wait(moment)
        return process.returncode, process.communicate()[1], False
    except subprocess.TimeoutExpired:
        process.send_signal(number)
        code, _, errors = finish(process)
        return code, errors, True


def check_files(basis, key):
    """What is there under its final name is whole: number of parts."""
    if basis.exists():
        read_basis(basis)
    parts = list(basis.with_name(basis.name + ".parts").glob("angle_*.h5"))
    for part in parts:
        assert read_snapshots(part, key) is not None, part
    return len(parts)


@pytest.mark.slow
@pytest.mark.jit
def test_offline_killed_fifty_times_ends_with_the_same_basis(case_file, disk, tmp_path):
    rng = np.random.default_rng(20160919)
    folder, small = disk
    key = basis_key(parse_case(CASE, "tiny", "tiny"))
    expected = tmp_path / "expected.h5"
    finish(offline(case_file, expected))  # compiles what is not compiled yet
    expected.unlink()
    began = time.perf_counter()
    assert finish(offline(case_file, expected))[0] == 0
    whole = time.perf_counter() - began
    needed = expected.stat().st_size

    tally = Counter()
    killed, basis = 0, folder / "basis.h5"
    while killed < KILLS:
        event = EVENTS[rng.integers(len(EVENTS))]
        before = check_files(basis, key)
        if event == "full disk":
            with full_disk(folder, small, int(rng.integers(3 * needed)), ANGLES) as more:
                code, _, errors = finish(offline(case_file, basis, **more))
            if code == 2:
                assert "cannot write" in errors
                assert len(errors.splitlines()) == 1, errors
                assert not list(folder.glob(".*")), "no temporary file, no lock stays"
                assert check_files(basis, key) >= before, "finished angles stay"
                tally["full disk"] += 1
                killed += 1
            else:
                assert code == 0, errors
        else:
            # Importing takes about half of the time and is no risk: more moments where there is something to lose.
            moment = whole * (rng.random() if rng.random() < 0.2 else 0.4 + 0.7 * rng.random())
            number = signal.Signals[event]
            code, errors, hit = kill(offline(case_file, basis), number, moment)
            if hit and code != 0:
                assert code in (-number, 130), errors
                tally[event] += 1
                killed += 1
            else:
                assert code == 0, errors
        parts = check_files(basis, key)
        assert parts >= before or basis.exists()
        if basis.exists():
            assert_same_basis(basis, expected)
            basis.unlink()
            shutil.rmtree(basis.with_name(basis.name + ".parts"), ignore_errors=True)
            tally["basis finished"] += 1
    code, _, errors = finish(offline(case_file, basis))
    assert code == 0, errors
    assert_same_basis(basis, expected)
    assert {path.name for path in folder.iterdir()} == {"basis.h5"}, "nothing is left of all those runs"
    print(f"\nkilled {killed} times: {dict(tally)}; small disk: {small}")
