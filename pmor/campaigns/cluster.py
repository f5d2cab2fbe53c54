"""The one place that knows Dask: its scheduler as an executor."""

from __future__ import annotations

import json
import logging
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path

from pmor.core.errors import ExternalProgramError

# For a scheduler to answer.
PATIENCE_S = 20


def _address_in(file: Path) -> str:
    """Return the address in a scheduler file: Dask itself would wait for one that is missing, however long."""
    if not file.is_file():
        raise ExternalProgramError(f"--dask {file}: there is no such scheduler file: start 'dask scheduler' first")
    try:
        return str(json.loads(file.read_text(encoding="utf-8"))["address"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ExternalProgramError(
            f"--dask {file}: is no scheduler file ({type(error).__name__}): start 'dask scheduler' first"
        ) from None


@contextmanager
def dask_executor(address: str) -> Iterator[Executor]:
    """Give an executor of the workers of a Dask cluster, by its scheduler or the path of a scheduler file.

    Raises
    ------
    ExternalProgramError
        When Dask is not installed, or no scheduler answers.
    """
    try:
        from distributed import Client, Security
        from distributed.comm import get_address_host_port
    except ImportError:
        raise ExternalProgramError(
            f"--dask {address}: the package distributed is not installed: pip install 'pmor-gear[cluster]', or leave "
            "--dask out for processes on this machine"
        ) from None
    # An error of one line tells of a lost cluster: Dask's own log is silenced.
    for name in ("distributed", "distributed.client"):  # the second has a level of its own
        logging.getLogger(name).setLevel(logging.CRITICAL)
    scheduler = _address_in(Path(address)) if address.endswith(".json") else address
    # Without certificates a client fails only after its own thread has waited for half a minute.
    if scheduler.startswith("tls:") and not Security().get_connection_args("client").get("ssl_context"):
        raise ExternalProgramError(
            f"--dask {address}: an address of tls takes certificates: name them in Dask's configuration, "
            "distributed.comm.tls, or take an address of tcp"
        )
    try:
        get_address_host_port(scheduler)  # a client of a malformed address would never end
        client = Client(scheduler, timeout=PATIENCE_S, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        said = " ".join(str(error).split()) or type(error).__name__
        raise ExternalProgramError(
            f"--dask {address}: no scheduler answers ({said}): start one with 'dask scheduler', and name its address"
        ) from None
    with client:
        yield client.get_executor(pure=False)
