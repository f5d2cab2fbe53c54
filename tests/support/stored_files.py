"""What the tests of stored files share: names in a folder, conditions to store, whether two bases are the same."""

import csv
import json
import re

import h5py
import numpy as np
from numpy.testing import assert_allclose

from pmor.gear.condition import Condition, Misalignment
from pmor.storage.manifest import MANIFEST


def results_in(folder):
    """Names of what a command left in a folder; the manifest goes without saying."""
    return {path.name for path in folder.iterdir()} - {MANIFEST}


# Keys of what differs from run to run: wall times, and the machine's load.
TIMED = re.compile(r"(_ms|_s|seconds|machine)$|(^|_)(ms|time)_")


def untimed(value):
    """Plain data without wall times."""
    if isinstance(value, dict):
        return {key: untimed(entry) for key, entry in value.items() if not TIMED.search(key)}
    return [untimed(entry) for entry in value] if isinstance(value, list) else value


def summary_of(folder):
    return json.loads((folder / "summary.json").read_text())


def rows_of(path):
    """Rows of a table, by their columns; lines that begin with # are comments."""
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def some_conditions(rng, count):
    return tuple(Condition(torque=rng.random(), misalignment=Misalignment(*rng.normal(size=3))) for _ in range(count))


def assert_same_basis(path, expected, same=1e-12):
    """All arrays are the same, to a share of the largest value of each, and so is the key."""
    with h5py.File(path) as found, h5py.File(expected) as file:

        def compare(name, item):
            if isinstance(item, h5py.Dataset):
                array = item[()].astype(float)
                scale = np.nanmax(np.abs(array), initial=0.0)
                assert_allclose(found[name][()].astype(float), array, rtol=0.0, atol=same * scale, err_msg=name)

        file.visititems(compare)
        assert found.attrs["basis_key"] == file.attrs["basis_key"]
