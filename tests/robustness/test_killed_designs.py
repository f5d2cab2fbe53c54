"""A design killed or interrupted at random moments resumes, ends with the same variants, and can be read meanwhile.

pytest -n 0 -m slow -s tests/robustness/test_killed_designs.py
"""

import signal
import subprocess
import time

import numpy as np
import pytest

from pmor.design.variants import STORE
from pmor.storage.describe import file_text
from pmor.work.pieces import PARTS
from tests.support.processes import finish, start
from tests.support.small_design import DESIGN, written

KILLS = 6


@pytest.mark.slow
def test_killed_designs_end_with_the_same_variants(tmp_path):
    path = written(tmp_path, DESIGN.replace("samples = 32", "samples = 12000"))
    whole, out = tmp_path / "whole", tmp_path / "killed"
    began = time.perf_counter()
    code, _, errors = finish(start("design", path, "--out", whole))
    took = time.perf_counter() - began
    assert code == 0, errors
    rng, readable = np.random.default_rng(19), 0
    for number in range(KILLS):
        process = start("design", path, "--out", out)
        try:
            process.communicate(timeout=took * rng.uniform(0.1, 0.8))
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGKILL if number % 2 else signal.SIGINT)
            process.communicate()
            # Interrupted, or just done.
            assert process.returncode in (-signal.SIGKILL, 130, 0)
        if (out / PARTS / STORE).exists():
            assert "pmor-design" in file_text(out / PARTS / STORE)
            readable += 1
    code, _, errors = finish(start("design", path, "--out", out))
    assert code == 0, errors
    assert (out / "design.csv").read_bytes() == (whole / "design.csv").read_bytes()
    print(f"{KILLS} times stopped, {readable} times with a file of what was finished")
    assert readable > 0
