"""Disks that are full, read-only or missing: a clear message, exit code 2, nothing lost; and kills while writing."""

import os
import shutil
import signal
import subprocess
import sys

import numpy as np
import pytest

from pmor.core.errors import OutputError
from pmor.storage.basis_file import read_basis, write_basis
from tests.support.processes import small_disk
from tests.support.refusals import command, refused
from tests.support.small_case import case_text

FORCE, MUCH_FORCE = np.zeros((2, 2, 2, 36)), np.zeros((2000, 2, 2, 36))


NO_MOUNT = "this account may not mount file systems"


@pytest.fixture
def tiny_disk(tmp_path):
    """A file system of 48 KiB: less than a basis."""
    with small_disk(tmp_path / "disk", "48k") as (folder, small):
        if not small:
            pytest.skip(NO_MOUNT)
        yield folder


@pytest.fixture
def read_only(tmp_path):
    """A read-only file system with a basis and a part of an interrupted run in it."""
    folder = tmp_path / "disk"
    (folder / "basis.h5.parts").mkdir(parents=True)
    (folder / "basis.h5.parts" / "angle_00000.h5").write_text("work of an hour")
    if shutil.which("mount") is None or subprocess.run(["mount", "--bind", folder, folder]).returncode != 0:
        pytest.skip(NO_MOUNT)
    subprocess.run(["mount", "-o", "remount,ro,bind", str(folder)], check=True)
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


@pytest.fixture
def case_file(tmp_path):
    path = tmp_path / "tiny.toml"
    path.write_text(case_text())
    return str(path)


@pytest.mark.parametrize("there", [{}, {"basis.h5": "precious"}], ids=["new", "replaced"])
def test_a_full_disk_leaves_what_was_there_and_no_rubbish(there, tiny_disk, small_basis):
    for name, content in there.items():
        (tiny_disk / name).write_text(content)
    with pytest.raises(OutputError, match=r"cannot write .*basis\.h5: no space is left on the disk: free some"):
        write_basis(tiny_disk / "basis.h5", small_basis, MUCH_FORCE, overwrite=True)
    assert {path.name: path.read_text() for path in tiny_disk.iterdir()} == there


def test_the_command_keeps_the_angles_that_are_done_when_the_disk_is_full(tiny_disk, case_file, tmp_path):
    words = f"cannot write {tiny_disk}", "no space is left"
    refused("offline", case_file, "-o", tiny_disk / "basis.h5", words=words)
    assert [path.name for path in tiny_disk.iterdir()] == ["basis.h5.parts"]
    done = len(list((tiny_disk / "basis.h5.parts").glob("angle_*.h5")))
    assert done > 0
    shutil.copytree(tiny_disk / "basis.h5.parts", tmp_path / "basis.h5.parts")
    code, text, _ = command("offline", case_file, "-o", tmp_path / "basis.h5", "--resume")
    assert code == 0
    assert f"{4 - done} angles solved, {done} taken over" in text


@pytest.mark.parametrize("name", ["run", "compare", "offline", "online", "lab study", "lab bench"])
def test_a_read_only_folder_is_named_before_the_work(name, read_only, case_file, small_basis_path, monkeypatch):
    monkeypatch.setattr("pmor.pair.model.elastic_model", lambda *_a, **_k: pytest.fail("the folder is not known"))
    arguments = {
        "offline": [case_file, "-o", read_only / "basis.h5", "--resume"],
        "online": [small_basis_path, "-o", read_only],
        "lab study": ["cases/paper_study.toml", "--quick", "--out", read_only],
        "lab bench": [case_file, "--json", read_only / "bench.json"],
    }.get(name, [case_file, "--out", read_only])
    refused(*name.split(), *arguments, words=(str(read_only), "the disk is read-only: choose another folder"))
    assert (read_only / "basis.h5.parts" / "angle_00000.h5").read_text() == "work of an hour"


@pytest.mark.slow
def test_a_limit_on_the_size_of_files_is_named(tmp_path, small_basis_path):
    code = """
import resource, sys
from pathlib import Path
from pmor.core.errors import OutputError
from pmor.storage.basis_file import read_basis, write_basis
import numpy as np
basis = read_basis(Path(sys.argv[1]))
resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000))
try:
    write_basis(Path(sys.argv[2]), basis, np.zeros((2, 2, 2, 36)))
except OutputError as error:
    print(error)
"""
    command = [sys.executable, "-c", code, str(small_basis_path), str(tmp_path / "basis.h5")]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "larger than the disk or your limit (ulimit -f) allows" in done.stdout
    assert list(tmp_path.iterdir()) == []


# --- killed while writing ---------------------------------------------------------------------------------------------


TOUCHING = {("hdf5.py", "create"), ("pathlib.py", "open"), ("pathlib.py", "write_bytes")}


def write_and_die(path, basis, lines):
    """In a child process: write a basis, and be killed at the line of that number of the code that touches the disk."""

    def count(frame, event, _argument):
        nonlocal lines
        file, name = os.path.basename(frame.f_code.co_filename), frame.f_code.co_name
        if not (file == "atomic.py" or (file, name) in TOUCHING):
            return None
        if event == "line":
            lines -= 1
            if lines == 0:
                os.kill(os.getpid(), signal.SIGKILL)
        return count

    sys.settrace(count)
    write_basis(path, basis, FORCE, overwrite=True)
    os._exit(0)


@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
@pytest.mark.parametrize(
    ("there", "every"),
    [
        pytest.param(True, 8, id="replaced, every eighth line"),
        pytest.param(True, 1, id="replaced", marks=pytest.mark.slow),
        pytest.param(False, 1, id="new", marks=pytest.mark.slow),
    ],
)
def test_a_kill_at_any_line_leaves_the_old_basis_or_the_whole_new_one(
    there, every, tmp_path, small_basis, small_basis_path
):
    path = tmp_path / "basis.h5"
    old = small_basis_path.read_bytes()
    ends = {"old": 0, "new": 0}
    for lines in range(1, 1000, every):
        path.unlink(missing_ok=True)
        if there:
            path.write_bytes(old)
        child = os.fork()
        if child == 0:
            try:
                write_and_die(path, small_basis, lines)
            finally:
                os._exit(1)
        status = os.waitpid(child, 0)[1]
        untouched = path.read_bytes() == old if path.exists() else not there
        if not untouched:
            assert read_basis(path).training.seconds == small_basis.training.seconds
        ends["old" if untouched else "new"] += 1
        if status == 0:
            break
        assert os.WTERMSIG(status) == signal.SIGKILL
    assert min(ends.values()) > 0
    print(f"\nkilled at {sum(ends.values()) - 1} lines of writing a basis: {ends}")
