"""Two runs into the same place at the same time: one works, the other is told; nothing is corrupted."""

import subprocess
import sys
import time

import pytest

from pmor.storage.basis_file import read_basis
from tests.support.processes import ROOT, finish, start
from tests.support.small_case import case_text
from tests.support.stored_files import results_in

pytestmark = pytest.mark.jit


@pytest.fixture
def case_file(tmp_path):
    """Training that lasts long enough for a second run to start and be refused."""
    path = tmp_path / "tiny.toml"
    path.write_text(case_text(offline={"angles_per_pitch": 150}, output={"plots": False, "report": False}))
    return path


def start_both(lock, *arguments):
    """Start a run, and the same once more when the first one has begun to work: first, second."""
    first = start(*arguments)
    while not lock.exists() and first.poll() is None:
        time.sleep(0.01)
    return first, start(*arguments)


def check_refused(second, first, place):
    code, text, errors = second
    assert (code, text) == (2, "")
    assert errors.startswith(f"pmor: error: {place}: process {first.pid} on "), errors
    assert "is writing it at present; wait for it" in errors
    assert len(errors.splitlines()) == 1


def test_two_offline_runs_of_one_basis(case_file, tmp_path):
    out = tmp_path / "out"
    basis = out / "basis.h5"
    first, second = start_both(out / ".basis.h5.lock", "offline", case_file, "-o", basis, "--overwrite")
    check_refused(finish(second), first, basis)
    code, _, errors = finish(first)
    assert (code, errors) == (0, "")
    assert read_basis(basis).training.converged.all()
    assert list(out.iterdir()) == [basis]


@pytest.mark.slow
def test_two_runs_into_one_folder(case_file, tmp_path):
    out = tmp_path / "out"
    first, second = start_both(out / ".pmor.lock", "run", case_file, "--out", out)
    check_refused(finish(second), first, out)
    code, _, errors = finish(first)
    assert (code, errors) == (0, "")
    assert results_in(out) == {"basis.h5", "ste.csv", "summary.json", "results.h5"}


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
