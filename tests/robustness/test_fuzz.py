"""Basis, snapshot and case files broken by somebody who knows how they are made: refused in words, or harmless.

    pytest -n 0 tests/robustness/test_fuzz.py             # eight files
    pytest -n 0 -s -m slow tests/robustness/test_fuzz.py  # five thousand, some twenty minutes on two cores

Harmless is what ends with the numbers of the sound file. Nothing else is allowed: no traceback, no crash, no hang, no
memory beyond fifty times the file, no file beside the folder for results.
"""

import json
import os
import subprocess
import sys
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress

import pytest

from tests.support.fuzz_trials import load_sound, prepare, trial, warm_up
from tests.support.processes import ROOT

FEW, MANY = 8, 5000
PATIENCE = 120.0  # until a process says something, s: the computer may have other work
MOST = 50  # times the file
NOISE = 16 << 20  # by which the resident memory of a process moves whatever it does, bytes


def fault(found):
    """What must not be about the end of a trial."""
    if found["end"].startswith("!"):
        return found["end"]
    too_much = found["grown"] > max(MOST * found["size"], NOISE)
    return f"took {found['grown'] / 2**20:.0f} MiB of memory" if too_much else ""


def check(outcomes):
    tally = Counter((found["kind"], found["end"].partition("\n")[0]) for found in outcomes)
    print(f"\n{len(outcomes)} broken files, and how they ended (info or plan; then online or --resume):")
    for (kind, end), count in sorted(tally.items()):
        print(f"  {count:6d}  {kind}: {end}")
    print(f"  at most {max(found['seconds'] for found in outcomes):.1f} s and "
          f"{max(found['grown'] for found in outcomes) / 2**20:.0f} MiB for one")  # fmt: skip
    faults = [(found["number"], found["done"], fault(found)) for found in outcomes if fault(found)]
    assert not faults, f"{len(faults)} faults, first: {faults[:3]}"


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # of numbers that are absurd on purpose
def test_eight_broken_files_are_refused_or_harmless(tmp_path):
    prepare(tmp_path, ("flank_lines", "positions"))
    sound = load_sound(tmp_path)
    warm_up(tmp_path, sound)
    check([trial(number, tmp_path, sound) for number in range(FEW)])


@pytest.mark.slow
@pytest.mark.jit
def test_five_thousand_broken_files_are_refused_or_harmless(tmp_path):
    jobs = os.cpu_count() or 1
    with ThreadPoolExecutor(jobs) as pool:
        work = [(tmp_path / str(i), range(i, MANY, jobs)) for i in range(jobs)]
        found = [outcome for outcomes in pool.map(lambda both: run_trials(*both), work) for outcome in outcomes]
    check([outcome for outcome in found if "number" in outcome])


def run_trials(folder, numbers):
    """Do trials in a process of their own, and in another one where it dies or hangs: outcome of each."""
    prepare(folder)
    said, outcomes = folder / "trials.txt", []
    while numbers:
        said.write_text("")
        trials = map(str, (numbers.start, numbers.stop, numbers.step))
        command = [sys.executable, "-m", "tests.support.fuzz_trials", folder, said, *trials]
        process = subprocess.Popen(command, cwd=ROOT, stderr=subprocess.DEVNULL)
        length = -1
        while process.poll() is None:
            with suppress(subprocess.TimeoutExpired):
                process.wait(PATIENCE)
            if process.poll() is None and said.stat().st_size == length:
                process.kill()  # it hangs
            length = said.stat().st_size
        lines = [line for line in said.read_text().splitlines() if line.endswith("}")]
        outcomes += [json.loads(line) for line in lines]
        if process.returncode == 0:
            break
        died = outcomes[-1].get("begin", numbers.start) if outcomes else numbers.start
        end = f"!ended with exit code {process.returncode}"
        outcomes.append({"number": died, "kind": "?", "done": [], "end": end, "grown": 0, "size": 0, "seconds": 0.0})
        numbers = range(died + numbers.step, numbers.stop, numbers.step)
    return outcomes
