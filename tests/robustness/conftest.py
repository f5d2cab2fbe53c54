"""A basis file to damage, what it holds, and the counts of how damages ended."""

import shutil
from collections import Counter

import pytest

from tests.support.refusals import contents


@pytest.fixture(scope="module")
def tally():
    """Counts by kind of damage and by how it ended, printed at the end."""
    counts = Counter()
    yield counts
    print("\ncorruptions and how they ended:")
    for (kind, end), count in sorted(counts.items()):
        print(f"  {count:6d}  {kind}: {end}")


@pytest.fixture
def basis(small_basis_path, tmp_path):
    """A copy to damage."""
    return shutil.copy(small_basis_path, tmp_path / "basis.h5")


@pytest.fixture
def original(small_basis_path):
    return contents(small_basis_path)
