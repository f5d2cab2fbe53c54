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
