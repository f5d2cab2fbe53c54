"""A unit test solves no FE and starts no process: what does so is stopped here, and belongs into another folder."""

import multiprocessing.process
import subprocess

import h5py  # noqa: F401  # what it asks of the machine, it asks before processes are refused
import pytest

import pmor.fe.hexahedron


@pytest.fixture(scope="module", autouse=True)
def alone():
    """Refuse element stiffnesses, which every FE model begins with, and processes."""

    def refuse(*_arguments, **_options):
        pytest.fail("a unit test solves no FE and starts no process: see tests/README.md")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pmor.fe.hexahedron, "_stiffness", refuse)
        patch.setattr(subprocess.Popen, "__init__", refuse)
        patch.setattr(multiprocessing.process.BaseProcess, "start", refuse)
        yield


@pytest.fixture(scope="session")
def small_models():
    """Not here: see `alone`."""
    pytest.fail("a unit test uses no FE model: see tests/README.md")
