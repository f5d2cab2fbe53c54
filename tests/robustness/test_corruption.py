"""Files that are damaged, edited, foreign, of another version or case: refused, each in its own words."""

import pickle
import shutil
import zipfile

import h5py
import numpy as np
import pytest

from pmor.core.errors import FileFormatError
from pmor.gear.condition import at_torques
from pmor.reduction.basis import Snapshots
from pmor.storage.describe import file_text
from pmor.storage.hdf5 import set_attributes
from pmor.storage.snapshot_file import read_snapshots, write_snapshots
from tests.support.broken_files import edit, flip_bit
from tests.support.broken_hdf5 import datasets_of, swap
from tests.support.refusals import end_of, refused, time_limit
from tests.support.small_case import case_text

OF_DATA = "is damaged, or was edited by hand: the checksum of"
OF_NAMES = "is damaged, or was edited by hand: contents_sha256 does not fit"


@pytest.mark.slow
def test_a_changed_number_in_any_dataset_is_refused(small_basis_path, basis, original):
    with h5py.File(basis) as file:
        names = datasets_of(file)
    for name in names:
        shutil.copy(small_basis_path, basis)

        def change(file, name=name):
            first = (0,) * file[name].ndim
            value = file[name][first]
            file[name][first] = not value if value.dtype == bool else value + 1

        edit(basis, change)
        words = f"{OF_DATA} /{name}"
        if name == "training/force":  # `pmor online` does not read it
            with pytest.raises(FileFormatError, match=words):
                file_text(basis)
        else:
            end_of(basis, original, words)


@pytest.mark.slow
def test_a_changed_or_removed_attribute_is_refused(small_basis_path, basis, original):
    own = {"schema": "is", "schema_version": "is"}
    with h5py.File(basis) as file:
        names = sorted(file.attrs)
    for name in names:
        for new in ("edited", None):
            shutil.copy(small_basis_path, basis)

            def change(file, name=name, new=new):
                del file.attrs[name]
                if new is not None:
                    set_attributes(file, **{name: new})

            edit(basis, change)
            if name == "descriptions_sha256":  # guards what only `pmor info` shows
                with pytest.raises(FileFormatError, match="descriptions_sha256 does not fit"):
                    file_text(basis)
            else:
                end_of(basis, original, own.get(name, OF_NAMES))


# Of many more kinds at random: test_fuzz.
EDITS = {
    "dataset removed": lambda file: file.__delitem__("flank/wheel/nodes"),
    "dataset renamed": lambda file: file.move("training/phi", "training/phi_old"),
    "two datasets swapped": lambda file: swap(file, "shapes/pinion/displacement", "shapes/wheel/displacement"),
    "dataset added": lambda file: file.create_dataset("more", data=np.zeros(3)),
    "attribute added": lambda file: set_attributes(file, note="checked by me"),
}


@pytest.mark.parametrize("change", EDITS.values(), ids=EDITS.keys())
def test_a_changed_table_of_contents_is_refused(change, basis, original):
    edit(basis, change)
    end_of(basis, original, OF_NAMES)


def test_an_edited_unit_is_refused_where_units_are_shown(basis):
    edit(basis, lambda file: file["training/ste"].attrs.modify("unit", "mm"))
    with pytest.raises(FileFormatError, match="descriptions_sha256 does not fit"):
        file_text(basis)


FLIPS, SECTORS, LENGTHS = 12, 3, 5


def some_snapshots(rng):
    force = rng.normal(size=(2, 2, 2, 6))
    return Snapshots(0.25, at_torques([1e4, 2e4]), np.array([-1, 0]), force, np.array([2.5, 1.0]), np.ones(2, bool))


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
