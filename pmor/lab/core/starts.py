"""Run times at the command line: installation, first run, which compiles the kernels, and later runs."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from functools import partial
from pathlib import Path

from pmor.case import Case, text_of
from pmor.lab.core.measures import times_in_turn

# What later runs are held against: nobody starts faster than the libraries.
LIBRARIES = "Python with its libraries"
_IMPORTS = "import numpy, scipy, numba, h5py, matplotlib"
_TWELVE_LINES = """[load]
torque_Nm = 100.0
[pair]
module_mm = 4.0
face_width_mm = 20.0
[pinion]
teeth = 21
bore_radius_mm = 20.0
"""
_SOURCES = Path(__file__).parents[3]
REPEATS = 5


def start_times(case: Case) -> dict[str, list[float]]:
    """Return times in ms, by what was started; of an installation where the sources stand beside the package.

    Raises
    ------
    OSError, subprocess.SubprocessError
        When a process cannot be started, or fails.
    """
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        small, own = folder / "pair.toml", folder / f"{case.name}.toml"
        small.write_text(_TWELVE_LINES, encoding="utf-8")
        own.write_text(text_of(case), encoding="utf-8")
        works = {
            LIBRARIES: partial(_ms, "-c", _IMPORTS),
            "pmor --help": partial(_ms, "-m", "pmor", "--help"),
            "a pair of twelve lines": partial(_run_ms, small, folder / "out"),
        }
        times = times_in_turn(works, REPEATS)
        began = time.time()
        whole = _run_ms(own, folder / "first", NUMBA_CACHE_DIR=str(folder / "kernels"))
        # Written and said with all that is read off the sweep; proof, further models and pages follow.
        answer = 1e3 * ((folder / "first" / "ste.csv").stat().st_mtime - began)
        times |= {"first results of the case, kernels compiled": [answer]}
        times |= {"first run of the case, kernels compiled": [whole]}
        if (_SOURCES / "pyproject.toml").is_file():
            alone = folder / "venv"
            made = _ms("-m", "venv", str(alone))
            python = next(path for path in alone.glob("*/python*") if path.stem == "python")
            made += _ms("-m", "pip", "install", "-q", str(_SOURCES), python=str(python))
            times |= {"venv and installation": [made], "bare machine to first results": [made + answer]}
            times |= {"bare machine to the end of the first run": [made + whole]}
    return times


def _run_ms(path: Path, folder: Path, **environment: str) -> float:
    return _ms("-m", "pmor", "run", str(path), "--out", str(folder), "--overwrite", **environment)


def _ms(*arguments: str, python: str = sys.executable, **environment: str) -> float:
    began = time.perf_counter()
    subprocess.run([python, *arguments], check=True, capture_output=True, env=os.environ | environment)
    return 1e3 * (time.perf_counter() - began)
