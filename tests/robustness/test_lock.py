"""One process at a time in a folder; processes where they are of use."""

import errno
import fcntl
import os
import signal
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor

import pytest

import pmor
from pmor.case import parse_case
from pmor.core.errors import OutputError
from pmor.storage.lock import only_writer_in_folder, only_writer_of_file
from tests.support.line_pairs import small_pair
from tests.support.processes import ROOT
from tests.support.refusals import refused
from tests.support.small_case import case_text
from tests.support.small_design import CASE, DESIGN

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


def test_a_script_without_a_guard_is_told_that_its_processes_need_one(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(
        "import math\nfrom pmor.core.threads import in_order, processes\n"
        "with processes(2) as executor:\n    list(in_order(math.sqrt, [4.0], executor))\n"
    )
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=120, cwd=ROOT)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].startswith("pmor.core.errors.ExternalProgramError: the executor does no more")
    assert '__name__ == "__main__"' in done.stderr.splitlines()[-1]


def small(**sections):
    return parse_case(case_text(**sections), "small", "small")


def by_design(folder, executor):
    (folder / "small.toml").write_text(CASE)
    (folder / "relief.toml").write_text(DESIGN)
    pmor.run_design(folder / "relief.toml", folder / "out", executor=executor)


def by_study(folder, executor):
    pmor.study(ROOT / "cases" / "paper_study.toml", folder / "out", quick=True, executor=executor)


def by_page(folder, executor):
    pmor.ReducedModel(small_pair().basis).report(folder / "out", executor=executor)


def by_comparison(folder, executor):
    pmor.compare(pmor.ReducedModel(small_pair().basis), executor=executor)


FOR_THREADS = {
    "run_case": lambda folder, executor: pmor.run_case(small(), folder / "out", executor=executor),
    "train": lambda folder, executor: pmor.train(small(), executor=executor),
    "train, file": lambda folder, executor: pmor.train(small(), file=folder / "out" / "a.h5", executor=executor),
    "report": by_page,
    "compare": by_comparison,
    "run_design": by_design,
    "study": by_study,
    "reductions": lambda folder, executor: pmor.reductions(small(), folder / "out", executor=executor),
}


@pytest.mark.parametrize("ask", FOR_THREADS.values(), ids=FOR_THREADS)
def test_processes_are_refused_before_anything_is_solved_where_work_is_for_threads(ask, tmp_path, monkeypatch):
    small_pair()
    monkeypatch.setattr("pmor.body.elastic_gear.elastic_gear", lambda *arguments: pytest.fail("solved"))
    with pytest.raises(pmor.CaseError, match="pass a ThreadPoolExecutor"):
        ask(tmp_path, ProcessPoolExecutor(1))
    assert not (tmp_path / "out").exists()
