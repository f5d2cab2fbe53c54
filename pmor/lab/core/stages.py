"""Time and peak memory of the stages of a run, measured in a process of their own.

    python -m pmor.lab.core.stages CASE

prints them as JSON. Kernels are expected to be compiled: compiling is no property of a case.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from pmor.case import Case, load_case, text_of
from pmor.core.errors import ExternalProgramError

Result = TypeVar("Result")
# The system's data on this process, on Linux.
SYSTEM = Path("/proc/self")


def measure_stages(case: Case) -> dict[str, dict[str, float]]:
    """Run a case in a process of its own and return seconds and peak memory (MiB) of each stage, by name.

    Peaks are left out where the system does not count them.

    Raises
    ------
    ExternalProgramError
        When the process fails.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{case.name}.toml"
        path.write_text(text_of(case), encoding="utf-8")
        command = [sys.executable, "-m", "pmor.lab.core.stages", str(path)]
        done = subprocess.run(command, check=False, capture_output=True, text=True, encoding="utf-8", errors="replace")
    if done.returncode:
        reason = (done.stderr.splitlines() or [f"exit code {done.returncode}"])[-1]
        raise ExternalProgramError(f"{case.name}: the process that measures the stages of a run failed: {reason}")
    stages: dict[str, dict[str, float]] = json.loads(done.stdout.splitlines()[-1])
    return stages


def run_stages(case: Case, folder: Path) -> dict[str, dict[str, float]]:
    """Do the stages of `pmor run` in this process, one by one; results as in `measure_stages`."""
    stages: dict[str, dict[str, float]] = {}

    def measured(name: str, work: Callable[[], Result]) -> Result:
        _forget_peak()
        start = time.perf_counter()
        result = work()
        stages[name] = {"seconds": time.perf_counter() - start} | _peak()
        return result

    def load() -> Any:
        import pmor.report.run_page
        import pmor.work.offline

        return pmor

    measured("start", load)
    from pmor.pair.model import elastic_model, mesh_model
    from pmor.report.run_page import drawn_pictures, write_drawn
    from pmor.report.summary import write_results
    from pmor.storage.basis_file import read_basis
    from pmor.work.live import live_pair
    from pmor.work.offline import run_offline
    from pmor.work.online import run_online
    from pmor_online.compare import compare_models
    from pmor_online.model import reduced_pair
    from pmor_online.run import OnlineResult

    path = folder / "basis.h5"
    model = measured("finite elements", lambda: elastic_model(case, mesh_model(case)))
    measured("training", lambda: run_offline(case, model, path))

    def sweep() -> OnlineResult:
        swept = run_online(reduced_pair(read_basis(path)), path)
        write_results(swept, folder)
        return swept

    swept = measured("sweep", sweep)
    result = replace(swept, comparison=measured("comparison", lambda: compare_models(swept.reduced, model)))
    pictures = measured("pictures", lambda: drawn_pictures(result, model.mesh.pinion))
    measured("report", lambda: write_drawn(result, pictures, folder, live_pair(result.reduced)))
    return stages


def _forget_peak() -> None:
    """Let the system count the peak of memory anew, where it can."""
    with suppress(OSError):
        (SYSTEM / "clear_refs").write_text("5", encoding="ascii")


def _peak() -> dict[str, float]:
    """Peak of memory, MiB; empty where the system does not tell, or does not count anew."""
    try:
        with (SYSTEM / "clear_refs").open("a", encoding="ascii"):
            lines = (SYSTEM / "status").read_text(encoding="ascii").splitlines()
    except OSError:
        return {}
    return {"peak_mib": next(float(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM"))}


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as scratch:
        sys.stdout.write(json.dumps(run_stages(load_case(sys.argv[1]), Path(scratch))) + "\n")
