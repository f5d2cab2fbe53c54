"""Provenance: machine and software of a run, and the section of a page that allows to repeat it."""

from __future__ import annotations

import hashlib
import os
import platform
import sys
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from pmor.case import Case
from pmor.core.threads import linear_algebra_threads
from pmor.core.version import __version__
from pmor.report.page import Block, Heading
from pmor.report.table import Table


def machine() -> dict[str, Any]:
    """Return names of processor, system and software, and the number of threads of linear algebra."""
    import h5py
    import numba
    import scipy

    return {
        "cpu": _cpu_model(), "cores": os.cpu_count(), "system": f"{platform.system()} {platform.machine()}",
        "python": sys.version.split()[0], "linear_algebra_threads": linear_algebra_threads(), "pmor": __version__,
        "numpy": np.__version__, "scipy": scipy.__version__, "numba": numba.__version__, "h5py": h5py.__version__
    }  # fmt: skip


def provenance(case: Case | None = None, measured_on: Mapping[str, Any] | None = None) -> list[Block]:
    """Return the section of a page: date, machine, software and case.

    Parameters
    ----------
    measured_on : mapping, optional
        Result of `machine` on the machine that measured the run times; by default this machine.
    """
    rows: list[tuple[str, Any]] = [("date", datetime.now(UTC).isoformat(timespec="seconds"))]
    rows += (machine() if measured_on is None else measured_on).items()
    if case is not None:
        rows.append(("case file, SHA-256", hashlib.sha256(case.text.encode()).hexdigest()))
    return [Heading("Provenance"), Table("Machine and software", ("item", "value"), rows, folded=True)]


def _cpu_model() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()
