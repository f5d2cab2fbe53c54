"""The one place that knows Dask: its scheduler as an executor."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path

from pmor.core.errors import ExternalProgramError

# For a scheduler to answer.
PATIENCE_S = 20


@contextmanager
def dask_executor(address: str) -> Iterator[Executor]:
    """Give an executor of the workers of a Dask cluster, by its scheduler or the path of a scheduler file.

    Raises
    ------
    ExternalProgramError
        When Dask is not installed, or no scheduler answers.
    """
    try:
        from distributed import Client
        from distributed.comm import get_address_host_port
    except ImportError:
        raise ExternalProgramError(
            f"--dask {address}: the package distributed is not installed: pip install 'pmor-gear[cluster]', or leave "
            "--dask out for processes on this machine"
        ) from None
    # An error of one line tells of a lost cluster: Dask's own log is silenced.
    for name in ("distributed", "distributed.client"):  # the second has a level of its own
        logging.getLogger(name).setLevel(logging.CRITICAL)
    is_file = address.endswith(".json")
    if is_file and not Path(address).is_file():  # Dask would wait for it, however long
        raise ExternalProgramError(f"--dask {address}: there is no such scheduler file: start 'dask scheduler' first")
    where = {"scheduler_file" if is_file else "address": address}
    try:
        if not is_file:
            get_address_host_port(address)  # a client of a malformed address would never end
        client = Client(**where, timeout=PATIENCE_S, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        said = " ".join(str(error).split()) or type(error).__name__
        raise ExternalProgramError(
            f"--dask {address}: no scheduler answers ({said}): start one with 'dask scheduler', and name its address"
        ) from None
    with client:
        yield client.get_executor(pure=False)
