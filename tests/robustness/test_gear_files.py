"""Files of single solved gears that are damaged, or that somebody made on purpose: refused, or read as they were."""

import pickle

import numpy as np
import pytest

from pmor.body.far_compliance import FarCompliance
from pmor.body.flank_compliance import SolvedFlank, SolvedGear
from pmor.body.root_stress import RootStressShapes
from pmor.body.support import Support
from pmor.core.errors import FileFormatError
from pmor.storage.compliance_file import read_compliance, write_compliance
from tests.support.broken_files import edit, flip_bit, is_a_folder, is_empty, is_missing, is_text, is_truncated
from tests.support.broken_hdf5 import reseal, with_data
from tests.support.refusals import time_limit

FLIPS = 30
TEETH, UNKNOWNS = 7, 12


def stress(rng):
    return RootStressShapes(
        rng.normal(size=(5, 2)), np.arange(3.0), rng.normal(size=(4, UNKNOWNS)), rng.normal(size=(3, 2, 5, 3, 3, 4)),
        rng.normal(size=(2, 5, 3, 3, 2)), rng.normal(size=(6, UNKNOWNS)), rng.normal(size=(2, 5, 2, 6)),
    )  # fmt: skip


def gear(rng):
    """A gear with all that a file may hold, of made-up numbers."""
    far = FarCompliance(rng.normal(size=(UNKNOWNS, 3)), *rng.normal(size=(3, TEETH, 3, 3)))
    far.flanks[2:] = np.nan
    rows, backs = rng.normal(size=(2, UNKNOWNS, 2))
    flank, other = (SolvedFlank(rng.normal(size=(2, UNKNOWNS, UNKNOWNS)), stress(rng)) for _ in range(2))
    holes = Support(rows, rng.normal(size=(3, TEETH, 2, 2)), backs)
    return SolvedGear(flank.compliance, flank.root_stress, holes, far, other)


@pytest.fixture
def kept(tmp_path, rng):
    """A file, and what it holds."""
    path, solved = tmp_path / "gear.h5", gear(rng)
    write_compliance(path, "key", solved)
    found = pickle.dumps(read_compliance(path, "key"))
    assert found == pickle.dumps(solved)
    return path, found


@pytest.mark.slow
def test_random_damage_is_refused_or_changes_nothing(kept, rng):
    path, expected = kept
    data, refused = path.read_bytes(), 0
    for _ in range(FLIPS):
        path.write_bytes(data)
        flip_bit(path, rng.integers(len(data)), rng.integers(8))
        try:
            with time_limit():
                assert pickle.dumps(read_compliance(path, "key")) == expected
        except FileFormatError:
            refused += 1
    assert refused > FLIPS // 4


@pytest.mark.parametrize("damage", [is_missing, is_empty, is_truncated, is_text, is_a_folder])
def test_what_is_no_file_of_a_gear_is_refused(damage, kept):
    damage(kept[0])
    with pytest.raises(FileFormatError, match="the gear is solved again"):
        read_compliance(kept[0], "key")


def test_the_file_of_another_gear_is_refused(kept):
    with pytest.raises(FileFormatError, match="is of another gear"):
        read_compliance(kept[0], "another key")


def other(name, change):
    return lambda file: with_data(file, name, change)


LIES = {
    "a compliance that is larger": (other("compliance", lambda data: 1.01 * data), "does not answer as it did"),
    "other flanks that give more": (other("other/compliance", lambda data: 1.01 * data), "does not answer as it did"),
    "unknowns in another order": (other("compliance", lambda data: data[:, ::-1, ::-1]), "does not answer as it did"),
    "far teeth in another order": (other("far/backs", lambda data: data[::-1]), "does not answer as it did"),
    "holes that are turned": (other("holes/compliance", lambda data: data[::-1]), "does not answer as it did"),
    "holes on other backs": (other("other/holes", lambda data: data[::-1]), "does not answer as it did"),
    "stress by other flanks": (
        other("other/root_stress/rim_moved", lambda data: data[::-1]),
        "does not answer as it did",
    ),
    "stress of the other side": (other("root_stress/stress", lambda data: data[:, ::-1]), "does not answer as it did"),
    "fewer unknowns": (other("compliance", lambda data: data[:, :-1, :-1]), "has the shape"),
    "fewer far unknowns": (other("far/shapes", lambda data: data[:-1]), "has the shape"),
    "endless numbers": (other("far/backs", lambda data: np.full_like(data, np.inf)), "holds values beyond"),
    "no numbers": (other("holes/rows", lambda data: np.full_like(data, np.nan)), "not finite"),
    "a part of the holes": (lambda file: file.__delitem__("holes/rows"), "incomplete or outdated"),
}


@pytest.mark.parametrize(("change", "words"), LIES.values(), ids=LIES.keys())
def test_what_cannot_be_true_of_a_gear_is_refused_even_with_valid_checksums(change, words, kept):
    edit(kept[0], change)
    edit(kept[0], reseal)
    with pytest.raises(FileFormatError, match=words):
        read_compliance(kept[0], "key")
