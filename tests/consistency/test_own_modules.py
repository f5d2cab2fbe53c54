"""An engineer's own online.py and offline.py: neither do they get into the package, nor does it hide them."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.processes import complaints
from tests.support.small_case import case_text
from tests.support.stored_files import results_in

ROOT = Path(__file__).parents[2]


@pytest.fixture
def folder(tmp_path):
    """A folder with modules of the names of our folders, and a case."""
    for name in ("offline", "online"):
        (tmp_path / f"{name}.py").write_text('whose = "my own"\n')
    (tmp_path / "tiny.toml").write_text(case_text(output={"plots": False, "report": False}))
    return tmp_path


def python(folder, *arguments):
    path = os.pathsep.join(str(ROOT / name) for name in (".", "offline", "online"))
    return subprocess.run(
        [sys.executable, *arguments], cwd=folder, env=os.environ | {"PYTHONPATH": path}, capture_output=True, text=True,
        timeout=600, check=False,
    )  # fmt: skip


def test_both_stages_run_beside_them(folder):
    done = python(folder, "-m", "pmor", "run", "tiny.toml", "--out", "out")
    assert (done.returncode, complaints(done.stderr)) == (0, "")
    assert results_in(folder / "out") == {"basis.h5", "ste.csv", "summary.json", "results.h5"}


def test_they_are_found_beside_the_package(folder):
    words = "import pmor_offline.train, pmor_online.run, offline, online; print(offline.whose, online.whose, sep=', ')"
    assert python(folder, "-c", words).stdout == "my own, my own\n"
