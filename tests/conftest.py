"""Surroundings of every test: no display, loud floating-point errors, seeded randomness, a numba cache of its own."""

import os
import shutil
import tempfile

import matplotlib
import numpy as np
import pytest

matplotlib.use("Agg")

# Underflow to zero is harmless; the others hide mistakes.
np.seterr(divide="raise", over="raise", invalid="raise")

# A cache from an earlier version of the code would be tested instead of the code. Numba reads the variable on import;
# set it beforehand to keep a cache between runs.
_OWN_CACHE = None
if "NUMBA_CACHE_DIR" not in os.environ:
    _OWN_CACHE = tempfile.mkdtemp(prefix="pmor-numba-")
    os.environ["NUMBA_CACHE_DIR"] = _OWN_CACHE


def pytest_unconfigure():
    if _OWN_CACHE is not None:
        shutil.rmtree(_OWN_CACHE, ignore_errors=True)


@pytest.fixture
def rng():
    return np.random.default_rng(20160919)


@pytest.fixture(scope="session")
def small_model():
    """Full FE of a small spur pair: 5 x 2 elements per flank, so that rows and columns cannot be mixed up."""
    from pmor.case import parse_case
    from pmor.model import elastic_model, mesh_model
    from tests.small_case import case_text

    text = case_text(
        mesh={"profile_elements": 5, "width_elements": 2}, offline={"angles_per_pitch": 6}, compare={"angles": 4}
    )
    case = parse_case(text, "small", "small case")
    return case, elastic_model(case, mesh_model(case))


@pytest.fixture(scope="session")
def small_basis_path(small_model, tmp_path_factory):
    """The basis file of `small_model`; copy it before changing it."""
    from offline.jobs import run_offline

    path = tmp_path_factory.mktemp("basis") / "small.h5"
    assert run_offline(*small_model, path).failed == ()
    return path


@pytest.fixture(scope="session")
def small_basis(small_basis_path):
    from pmor.storage.basis_file import read_basis

    return read_basis(small_basis_path)


@pytest.fixture(scope="session")
def small_forces(small_basis_path):
    """Unit force fields of the shapes, shape (M, T, 2, f): what the basis was made from."""
    import h5py

    with h5py.File(small_basis_path) as file:
        force = file["shapes/force"][()]
    norm = np.linalg.norm(force, axis=(2, 3), keepdims=True)
    return force / np.where(norm > 0.0, norm, 1.0)
