"""Snapshots on disk: bit for bit, or as if there were none."""

from dataclasses import replace

import numpy as np
import pytest

from pmor.core.errors import FileFormatError
from pmor.reduction.basis import Snapshots
from pmor.storage.basis_file import read_basis
from pmor.storage.describe import file_text
from pmor.storage.snapshot_file import read_snapshots, write_snapshots
from tests.support.broken_files import flip_bit_of, is_empty, is_missing, is_text, is_truncated, lacks, set_attribute
from tests.support.stored_files import some_conditions


@pytest.fixture
def snapshots(rng):
    ste_um = np.array([2.5, np.nan])
    force = rng.normal(size=(2, 2, 2, 6))
    return Snapshots(0.25, some_conditions(rng, 2), np.array([-1, 0]), force, ste_um, np.isfinite(ste_um), 0.5)


@pytest.fixture
def path(tmp_path, snapshots):
    write_snapshots(tmp_path / "angle.h5", snapshots, "key")
    return tmp_path / "angle.h5"


def test_snapshots_come_back_bit_for_bit(path, snapshots):
    found = read_snapshots(path, "key")
    assert (found.phi, found.conditions) == (snapshots.phi, snapshots.conditions)
    for name in ("pair_index", "force", "ste_um", "converged"):
        found_array, expected = getattr(found, name), getattr(snapshots, name)
        assert found_array.dtype == expected.dtype
        np.testing.assert_array_equal(found_array, expected)


def test_snapshots_are_replaced(path, snapshots):
    write_snapshots(path, replace(snapshots, phi=0.5), "key")
    assert read_snapshots(path, "key").phi == 0.5


def test_snapshots_of_another_case_do_not_count(path):
    assert read_snapshots(path, "key of another case") is None


@pytest.mark.parametrize(
    "damage",
    [is_missing, is_truncated, is_empty, is_text, set_attribute("schema_version", np.int64(99)), lacks("phi"),
     lacks("force"), flip_bit_of("force")],
    ids=["missing", "truncated", "empty", "text", "newer", "no angle", "no dataset", "flipped"],
)  # fmt: skip
def test_missing_and_damaged_snapshots_count_as_absent(damage, path):
    damage(path)
    assert read_snapshots(path, "key") is None


def test_a_file_that_is_not_ours_is_named(path):
    with pytest.raises(FileFormatError, match="not a pmor-basis file .*pmor-snapshots"):
        read_basis(path)


def test_file_text_knows_snapshots_and_says_that_they_are_damaged(path):
    text = file_text(path)
    assert text.startswith(f"{path}: pmor-snapshots")
    assert "2 x 2 x 2 x 6" in text
    flip_bit_of("force")(path)
    with pytest.raises(FileFormatError, match="damaged"):
        file_text(path)
