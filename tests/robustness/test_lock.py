"""One process at a time: who comes second is told, and a lock whose holder was killed is free."""

import errno
import fcntl
import os
import signal
import subprocess
import sys

import pytest

from pmor.core.errors import OutputError
from pmor.storage.lock import only_writer_in_folder, only_writer_of_file
from tests.support.processes import ROOT
from tests.support.refusals import refused
from tests.support.small_case import case_text

HOLD = """
import sys
from pathlib import Path
from pmor.storage.lock import only_writer_of_file
with only_writer_of_file(Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.read()
"""
# What is read is written back later: without mutual exclusion some counts are lost.
COUNT = """
import sys, time
from pathlib import Path
from pmor.core.errors import OutputError
from pmor.storage.lock import only_writer_of_file
counter = Path(sys.argv[1])
done = 0
while done < 100:
    try:
        with only_writer_of_file(counter):
            number = int(counter.read_text())
            time.sleep(0.0002)
            counter.write_text(str(number + 1))
            done += 1
    except OutputError:
        pass
"""


def python(code, *arguments):
    return subprocess.Popen(
        [sys.executable, "-c", code, *map(str, arguments)], cwd=ROOT,
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


@pytest.fixture
def holder(tmp_path):
    """Another process that holds the lock of a file; it is killed at the end."""
    process = python(HOLD, tmp_path / "basis.h5")
    assert process.stdout.readline() == "held\n"
    yield process
    process.kill()
    process.communicate()


def test_the_second_process_is_told_who_is_first(holder, tmp_path):
    with pytest.raises(OutputError, match=rf"basis\.h5: process {holder.pid} on .* is writing it .*another name"):
        with only_writer_of_file(tmp_path / "basis.h5"):
            pytest.fail("the lock is held")
    with only_writer_of_file(tmp_path / "other.h5"):
        pass


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_the_lock_of_a_killed_process_is_taken_over(number, holder, tmp_path):
    holder.send_signal(number)
    holder.wait()
    assert [path.name for path in tmp_path.iterdir()] == [".basis.h5.lock"], "it had no time to clear up"
    with only_writer_of_file(tmp_path / "basis.h5"):
        pass
    assert list(tmp_path.iterdir()) == []


def test_the_lock_is_free_again_afterwards_even_after_an_error(tmp_path):
    for _ in range(2):
        with pytest.raises(RuntimeError), only_writer_in_folder(tmp_path):
            assert [path.name for path in tmp_path.iterdir()] == [".pmor.lock"]
            raise RuntimeError
    assert list(tmp_path.iterdir()) == []


def test_two_locks_in_one_process_exclude_each_other_too(tmp_path):
    with only_writer_in_folder(tmp_path), pytest.raises(OutputError, match="another folder"):
        with only_writer_in_folder(tmp_path):
            pytest.fail("the lock is held")


@pytest.mark.parametrize(("command", "option"), [("offline", "-o"), ("run", "--out")])
def test_the_second_of_two_commands_into_the_same_place_is_told(command, option, tmp_path):
    place, case = tmp_path / "place", tmp_path / "tiny.toml"
    case.write_text(case_text())
    place.mkdir(exist_ok=True)
    lock = only_writer_of_file(place / "basis.h5") if command == "offline" else only_writer_in_folder(place)
    with lock:
        target = place / "basis.h5" if command == "offline" else place
        words = [f"{target}: process {os.getpid()} on ", "is writing it at present; wait for it"]
        refused(command, case, option, target, "--overwrite", words=words)
    assert list(place.iterdir()) == []


def test_only_one_of_many_processes_is_inside(tmp_path):
    counter = tmp_path / "counter"
    counter.write_text("0")
    processes = [python(COUNT, counter) for _ in range(4)]
    for process in processes:
        assert process.communicate(timeout=120)[1] == ""
    assert counter.read_text() == "400"
    assert list(tmp_path.iterdir()) == [counter]


def test_a_missing_folder_is_named(tmp_path):
    with pytest.raises(OutputError, match=r"cannot write .*basis\.h5: its folder does not exist"):
        with only_writer_of_file(tmp_path / "no" / "basis.h5"):
            pytest.fail("there is nothing to lock")


def test_a_file_system_without_locks_does_not_stop_the_work(tmp_path, monkeypatch):
    def refuse(*_arguments):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", refuse)
    with only_writer_in_folder(tmp_path):
        pass
