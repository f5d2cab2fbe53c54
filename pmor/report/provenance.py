"""What somebody needs to repeat a run."""

from __future__ import annotations

import hashlib
import os
import platform
import sys
from datetime import UTC, datetime

import numpy as np

from pmor.case import Case
from pmor.core.version import __version__


def provenance(case: Case) -> list[tuple[str, str]]:
    """Return what somebody needs to repeat a run."""
    import h5py
    import numba
    import scipy

    return [
        ("date", datetime.now(UTC).isoformat(timespec="seconds")),
        ("pmor", __version__),
        ("Python", sys.version.split()[0]),
        ("numpy, scipy, numba, h5py", ", ".join(m.__version__ for m in (np, scipy, numba, h5py))),
        ("machine", f"{platform.machine()}, {os.cpu_count()} cores, {platform.system()}"),
        ("case file, SHA-256", hashlib.sha256(case.text.encode()).hexdigest()),
    ]
