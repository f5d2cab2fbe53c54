"""Run times, measured in one phase of one process: warm code, cells taken in turn, medians of repeats."""

from __future__ import annotations

import os
import platform
import statistics
import sys
import time
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from pmor_online.model import ReducedPair, online_angles, reduced_pair
from pmor_online.sweep import sweep_reduced_pair

from pmor.arrays import FloatArray
from pmor.case import Case
from pmor.contact.condition import Condition
from pmor.lab.study.cells import ModelStore
from pmor.lab.study.settings import Cell, TimingSettings
from pmor.pair.conditions import nominal_condition
from pmor.pair.model import ElasticModel
from pmor.pair.sweep import sweep_ste
from pmor.storage.basis_file import read_basis
from pmor.threads import linear_algebra_threads


def time_cells(
    cells: Mapping[Cell, tuple[Case, Path]], settings: TimingSettings, store: ModelStore
) -> dict[str, dict[str, Any]]:
    """Time condensed and reduced model of all cells, in rounds over the cells.

    One position is one angle at the nominal torque. The condensed model solves each from the undeformed pair, the
    reduced one starts from the position before, on one thread and on all.

    Parameters
    ----------
    cells : mapping of Cell to (Case, Path)
        Case and basis file.
    settings : TimingSettings
    store : ModelStore

    Returns
    -------
    dict
        By label of the cell: milliseconds per position of each model.
    """
    threads = os.cpu_count() or 1
    work: dict[tuple[str, str], Callable[[], int]] = {}
    for cell, (case, basis_path) in cells.items():
        model, _ = store.model(case)
        reduced, conditions = reduced_pair(read_basis(basis_path)), [nominal_condition(case)]
        pitch = model.mesh.meshed.pair.pitch
        few, many = (online_angles(pitch, n) for n in (settings.condensed_angles, settings.reduced_angles))
        work |= {
            (cell.label, "condensed"): partial(_condensed, model, few, conditions),
            (cell.label, "reduced"): partial(_reduced, reduced, many, conditions, 1),
            (cell.label, "reduced_all_threads"): partial(_reduced, reduced, many, conditions, threads),
        }
    for run in work.values():
        run()
    samples: dict[tuple[str, str], list[float]] = {key: [] for key in work}
    for _ in range(settings.repeats):
        for key, run in work.items():
            started = time.perf_counter()
            positions = run()
            samples[key].append(1e3 * (time.perf_counter() - started) / positions)
    result: dict[str, dict[str, Any]] = {}
    for (label, model_name), values in samples.items():
        result.setdefault(label, {})[f"ms_{model_name}"] = statistics.median(values)
    return result


def _condensed(model: ElasticModel, phi: FloatArray, conditions: list[Condition]) -> int:
    return int(sweep_ste(model.mesh.meshed, model.elasticity_at, phi, conditions).ste_um.size)


def _reduced(reduced: ReducedPair, phi: FloatArray, conditions: list[Condition], threads: int) -> int:
    return int(sweep_reduced_pair(reduced, phi, conditions, threads).ste_um.size)


def machine() -> dict[str, Any]:
    """Name the machine, its software, and how many threads were used."""
    import h5py
    import numba
    import scipy

    import pmor

    return {
        "cpu": _cpu_model(),
        "cores": os.cpu_count(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": sys.version.split()[0],
        "linear_algebra_threads": linear_algebra_threads(),
        "pmor": pmor.__version__,
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "numba": numba.__version__,
        "h5py": h5py.__version__,
    }


def _cpu_model() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()
