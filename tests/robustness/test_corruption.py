"""Files that are damaged, foreign, of another version or of another case: refused, each in its own words."""

import pickle
import zipfile

import h5py
import numpy as np
import pytest

from pmor.gear.condition import at_torques
from pmor.reduction.basis import Snapshots
from pmor.storage.snapshot_file import read_snapshots, write_snapshots
from tests.support.broken_files import edit, flip_bit
from tests.support.refusals import end_of, refused, time_limit
from tests.support.small_case import case_text

FLIPS, SECTORS, LENGTHS = 16, 5, 8


def some_snapshots(rng):
    force = rng.normal(size=(2, 2, 2, 6))
    return Snapshots(0.25, at_torques([1e4, 2e4]), np.array([-1, 0]), force, np.array([2.5, 1.0]), np.ones(2, bool))


# --- damage ----------------------------------------------------------------------------------------------------------


def test_random_damage_is_refused_or_changes_nothing(basis, original, rng):
    data = basis.read_bytes()
    # Headers are small beside the data: as many flips in the first kilobytes.
    refusals = {len(data): 0, 8192: 0}
    for within in refusals:
        for _ in range(FLIPS):
            basis.write_bytes(data)
            flip_bit(basis, rng.integers(min(len(data), within)), rng.integers(8))
            refusals[within] += end_of(basis, original) == "refused"
    for _ in range(SECTORS):
        start = int(rng.integers(len(data) // 512)) * 512
        sector = rng.bytes(512) if rng.random() < 0.5 else bytes(512)
        basis.write_bytes(data[:start] + sector + data[start + 512 :])
        end_of(basis, original)
    assert refusals[len(data)] > FLIPS // 4
    assert refusals[8192] > FLIPS // 2


def test_truncated_files_are_refused(basis, original, rng):
    data = basis.read_bytes()
    fixed = [1, 4, 7, 8, 9, 47, 48, 95, 96, 512, 2048, len(data) // 2, len(data) - 512, len(data) - 1]
    for length in [*fixed, *(int(n) for n in rng.integers(1, len(data), LENGTHS))]:
        basis.write_bytes(data[:length])
        end_of(basis, original, f"is truncated: only {length} bytes")
    basis.write_bytes(b"")
    end_of(basis, original, "is empty")
    basis.write_bytes(data + b"more")
    end_of(basis, original)


def test_damaged_snapshots_are_computed_again_or_unchanged(tmp_path, rng):
    path = tmp_path / "angle.h5"
    write_snapshots(path, some_snapshots(rng), "key")
    data = path.read_bytes()
    expected = pickle.dumps(read_snapshots(path, "key"))
    for _ in range(FLIPS):
        path.write_bytes(data)
        flip_bit(path, rng.integers(len(data)), rng.integers(8))
        with time_limit():
            found = read_snapshots(path, "key")
        assert found is None or pickle.dumps(found) == expected


# --- foreign files ---------------------------------------------------------------------------------------------------


def foreign_files(folder):
    """Path and what the message says of files that are no basis."""
    for name, data in {
        "text": b"phi_rad,ste_um\n0.0,1.0\n",
        "picture": b"\x89PNG\r\n\x1a\n" + bytes(500),
        "zeros": bytes(5000),
        "pickle": pickle.dumps({"a": 1}),
        "almost": b"\x89HDG\r\n\x1a\n" + bytes(500),
    }.items():
        (folder / name).write_bytes(data)
        yield folder / name, "is not an HDF5 file"
    with zipfile.ZipFile(folder / "archive", "w") as archive:
        archive.writestr("a", "b")
    yield folder / "archive", "is not an HDF5 file"
    with h5py.File(folder / "other.h5", "w") as file:
        file["x"] = np.arange(5)
    yield folder / "other.h5", "is an HDF5 file of another program, not a pmor-basis file"
    with h5py.File(folder / "netcdf.h5", "w") as file:
        file.attrs["schema"], file.attrs["schema_version"] = "netcdf", 4
    yield folder / "netcdf.h5", "is not a pmor-basis file but one of the kind 'netcdf'"
    (folder / "folder").mkdir()
    yield folder / "folder", "is a folder, not a file"
    yield folder / "absent", "no such file"
    yield folder / "text" / "below", "no such file"
    yield folder / ("x" * 300), "cannot be read (File name too long)"


def test_foreign_files_are_refused(tmp_path, original):
    for path, words in foreign_files(tmp_path):
        end_of(path, original, words)


# --- versions and cases ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("version", "words"),
    [
        (1, "is pmor-basis version 1, written by an older pmor; this one reads version 15; make it anew"),
        (4, "is pmor-basis version 4, written by an older pmor"),
        (16, "is pmor-basis version 16, written by a newer pmor"),
        (2**40, "newer"),
        (-1, "older"),
        ("5", "'5' is no version"),
        (5.0, "is no version"),
        (np.array([5, 5]), "is no version"),
    ],
)
def test_other_versions_are_refused(version, words, basis, original):
    edit(basis, lambda file: file.attrs.modify("schema_version", version) if isinstance(version, int)
         else file.attrs.create("schema_version", version))  # fmt: skip
    end_of(basis, original, words)


def test_the_basis_of_another_case_is_refused(basis, tmp_path):
    """Whoever asks for a case gets that case; what no basis depends on may differ."""
    case = tmp_path / "other.toml"
    same = {"mesh": {"profile_elements": 5, "width_elements": 2}, "offline": {"angles_per_pitch": 6}}
    for change, words in {
        "pair": ({"face_width_mm": 19.0}, "[pair] face_width_mm is 20.0 in it, 19.0 in the case"),
        "pinion": ({"teeth": 22}, "[pinion] teeth is 21 in it, 22 in the case"),
        "contact": ({"slave": "both"}, "[contact] slave is tip in it, both in the case"),
        "reduction": ({"shapes": "positions"}, "[reduction] shapes is flank_lines in it, positions in the case"),
    }.items():
        case.write_text(case_text(**{**same, change: words[0]}))
        assert refused("online", basis, "--case", case, "-o", tmp_path / "out") == (
            f"pmor: error: {basis}: is the basis of another case: {words[1]}; make it anew with 'pmor offline'\n"
        )
    assert not (tmp_path / "out").exists()
