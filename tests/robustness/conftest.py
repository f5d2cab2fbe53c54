"""A basis file to damage, and what it holds."""

import shutil

import pytest

from tests.support.refusals import contents


@pytest.fixture
def basis(small_basis_path, tmp_path):
    """A copy to damage."""
    return shutil.copy(small_basis_path, tmp_path / "basis.h5")


@pytest.fixture
def original(small_basis_path):
    return contents(small_basis_path)
