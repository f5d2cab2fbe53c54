"""Reductions of the small model, shared by the tests of this folder."""

import h5py
import numpy as np
import pytest

from pmor.storage.basis_file import read_basis
from pmor_online.model import reduced_pair

# The meshed width and the keys of [reduction]; the small model has two elements over the width, of which one is held.
REDUCTIONS = {
    "lines": {},
    "lines, whole width": {"width": "whole"},
    "lines, plane strain": {"width": "plane_strain"},
    "positions": {"shapes": "positions"},
    "positions, whole width": {"shapes": "positions", "width": "whole"},
    "cubic positions": {"shapes": "positions", "interpolation": "cubic"},
    "global modes": {"shapes": "global_pod", "pod_tolerance": 1e-4},
    "static modes": {"shapes": "static_modes"},
}


@pytest.fixture(scope="module", params=REDUCTIONS.values(), ids=REDUCTIONS.keys())
def reduced(request, small_basis_file):
    """Every way to reduce the small model."""
    return reduced_pair(read_basis(small_basis_file(**request.param)))


@pytest.fixture(scope="module")
def whole_model(small_models):
    """Full FE of the whole width of the small model."""
    return small_models("whole")


@pytest.fixture(scope="module")
def forces(small_basis_file):
    """Unit force fields at the trained roll positions over the whole width, shape (M, T, 2, f)."""
    with h5py.File(small_basis_file(**REDUCTIONS["positions, whole width"])) as file:
        force = file["training/force"][()]
    norm = np.linalg.norm(force, axis=(2, 3), keepdims=True)
    return force / np.where(norm > 0.0, norm, 1.0)


@pytest.fixture(scope="module")
def reduced_by(small_basis_file):
    """One way to reduce the small model, by its name."""
    return lambda name: reduced_pair(read_basis(small_basis_file(**REDUCTIONS[name])))
