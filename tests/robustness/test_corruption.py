"""Files that are damaged, foreign, edited, of another version or of another case: refused, each in its own words.

    pytest -s tests/robustness/test_corruption.py          # hundreds of damages, half a minute
    pytest -s -m slow tests/robustness/test_corruption.py  # thousands of random ones
"""

import pickle
import shutil
import signal
import zipfile
from collections import Counter
from contextlib import contextmanager

import h5py
import numpy as np
import pytest

from pmor.app.cli import main
from pmor.errors import FileFormatError
from pmor.reduction.snapshots import Snapshots
from pmor.storage.basis_file import read_basis
from pmor.storage.describe import file_text
from pmor.storage.hdf5 import Field, attribute, set_attributes, write
from pmor.storage.seal import checksums
from pmor.storage.snapshot_file import read_snapshots, write_snapshots
from tests.small_case import case_text

HANG = 20  # s
FLIPS, SECTORS, LENGTHS = 125, 50, 60
OF_DATA = "is damaged, or was edited by hand: the checksum of"
OF_NAMES = "is damaged, or was edited by hand: contents_sha256 does not fit"


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


def contents(path):
    """All that a command reads of a basis, as bytes."""
    return pickle.dumps(read_basis(path)), file_text(path).partition(":")[2]


@contextmanager
def no_hang():
    def too_long(*_arguments):
        pytest.fail(f"reading takes more than {HANG} s")

    signal.signal(signal.SIGALRM, too_long)
    signal.alarm(HANG)
    try:
        yield
    finally:
        signal.alarm(0)


def check(path, original, tally, kind, words=None):
    """A file is refused in one line with a remedy, and with `words`; without them it may also read as the original."""
    ends = []
    for read, expected in zip((read_basis, file_text), original, strict=True):
        try:
            with no_hang():
                found = read(path)
        except FileFormatError as error:
            message = str(error)
            assert message.startswith(f"{path}: ")
            assert "pmor offline" in message
            assert len(message) < 600
            assert words is None or words in message, message
            ends.append("refused")
        else:
            assert words is None, f"{kind}: not refused"
            found = pickle.dumps(found) if read is read_basis else found.partition(":")[2]
            assert found == expected, f"{kind}: other data"
            ends.append("reads as the original")
    reduced, info = ends
    tally[kind, reduced if reduced == info else f"{reduced} where online reads, refused by info"] += 1


def edit(path, change):
    with h5py.File(path, "r+") as file:
        change(file)


def names_of(path, kind):
    """Names of all datasets, or of all root attributes."""
    with h5py.File(path) as file:
        if kind == "attribute":
            return sorted(file.attrs)
        found = []
        file.visititems(lambda name, item: found.append(name) if isinstance(item, h5py.Dataset) else None)
        return found


def some_snapshots(rng):
    conditions, force = (rng.normal(size=2), rng.normal(size=(2, 3))), rng.normal(size=(2, 2, 2, 6))
    return Snapshots(0.25, *conditions, np.array([-1, 0]), force, np.array([2.5, 1.0]), np.ones(2, bool))


# --- damage ----------------------------------------------------------------------------------------------------------


def damage_at_random(basis, original, tally, rng, flips, sectors):
    data = basis.read_bytes()
    for _ in range(flips):
        spoilt = bytearray(data)
        spoilt[rng.integers(len(data))] ^= 1 << int(rng.integers(8))
        basis.write_bytes(spoilt)
        check(basis, original, tally, "one bit flipped")
    # Headers are small beside the data: as many flips in the first kilobytes and around every dataset's header.
    for _ in range(flips):
        spoilt = bytearray(data)
        spoilt[rng.integers(min(len(data), 8192))] ^= 1 << int(rng.integers(8))
        basis.write_bytes(spoilt)
        check(basis, original, tally, "one bit flipped in the first 8 KiB")
    for _ in range(sectors):
        spoilt = bytearray(data)
        start = int(rng.integers(len(data) // 512)) * 512
        spoilt[start : start + 512] = rng.bytes(512) if rng.random() < 0.5 else bytes(512)
        basis.write_bytes(spoilt)
        check(basis, original, tally, "a sector of 512 bytes lost")


def truncate_at_random(basis, original, tally, rng, count):
    data = basis.read_bytes()
    fixed = [1, 4, 7, 8, 9, 47, 48, 95, 96, 512, 2048, len(data) // 2, len(data) - 512, len(data) - 1]
    for length in [*fixed, *(int(n) for n in rng.integers(1, len(data), count))]:
        basis.write_bytes(data[:length])
        check(basis, original, tally, "truncated", f"is truncated: only {length} bytes")
    basis.write_bytes(b"")
    check(basis, original, tally, "empty", "is empty")
    basis.write_bytes(data + b"more")
    check(basis, original, tally, "something appended")


def test_random_damage_is_refused_or_changes_nothing(basis, original, tally, rng):
    damage_at_random(basis, original, tally, rng, FLIPS, SECTORS)
    assert tally["one bit flipped", "refused"] > FLIPS // 4
    assert tally["one bit flipped in the first 8 KiB", "refused"] > FLIPS // 2


def test_truncated_files_are_refused(basis, original, tally, rng):
    truncate_at_random(basis, original, tally, rng, LENGTHS)


@pytest.mark.slow
def test_thousands_of_random_damages(basis, original, tally, rng):
    damage_at_random(basis, original, tally, rng, 2000, 500)
    truncate_at_random(basis, original, tally, rng, 500)


def test_damaged_snapshots_are_computed_again_or_unchanged(tmp_path, tally, rng):
    path = tmp_path / "angle.h5"
    write_snapshots(path, some_snapshots(rng), "key")
    data = path.read_bytes()
    expected = pickle.dumps(read_snapshots(path, "key"))
    for _ in range(FLIPS):
        spoilt = bytearray(data)
        spoilt[rng.integers(len(data))] ^= 1 << int(rng.integers(8))
        path.write_bytes(spoilt)
        with no_hang():
            found = read_snapshots(path, "key")
        assert found is None or pickle.dumps(found) == expected
        tally["one bit flipped in snapshots", "counts as absent" if found is None else "reads as the original"] += 1


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


def test_foreign_files_are_refused(tmp_path, original, tally):
    for path, words in foreign_files(tmp_path):
        check(path, original, tally, "foreign", words)


def test_a_snapshot_file_is_no_basis(tmp_path, rng, tally):
    path = tmp_path / "angle.h5"
    write_snapshots(path, some_snapshots(rng), "key")
    with pytest.raises(FileFormatError, match="is not a pmor-basis file but one of the kind 'pmor-snapshots'"):
        read_basis(path)
    tally["foreign", "refused"] += 1


# --- versions and cases ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("version", "words"),
    [
        (1, "is pmor-basis version 1, written by an older pmor; this one reads version 4; make it anew"),
        (3, "is pmor-basis version 3, written by an older pmor"),
        (5, "is pmor-basis version 5, written by a newer pmor"),
        (2**40, "newer"),
        (-1, "older"),
        ("4", "'4' is no version"),
        (4.0, "is no version"),
        (np.array([4, 4]), "is no version"),
    ],
)
def test_other_versions_are_refused(version, words, basis, original, tally):
    edit(basis, lambda file: file.attrs.modify("schema_version", version) if isinstance(version, int)
         else file.attrs.create("schema_version", version))  # fmt: skip
    check(basis, original, tally, "other version", words)


def test_the_basis_of_another_case_is_refused(basis, tmp_path, tally, capsys):
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
        assert main(["online", str(basis), "--case", str(case), "-o", str(tmp_path / "out")]) == 2
        error = capsys.readouterr().err
        assert error == (
            f"pmor: error: {basis}: is the basis of another case: {words[1]}; make it anew with 'pmor offline'\n"
        )
        tally["other case", "refused"] += 1
    assert not (tmp_path / "out").exists()


def test_another_sweep_with_the_same_basis_is_welcome(basis, tmp_path):
    case = tmp_path / "same.toml"
    quiet = {"plots": False, "report": False}
    case.write_text(case_text(mesh={"profile_elements": 5, "width_elements": 2}, offline={"angles_per_pitch": 6},
                              online={"angles_per_pitch": 7}, output=quiet))  # fmt: skip
    assert main(["online", str(basis), "--case", str(case), "-o", str(tmp_path / "out")]) == 0
    assert len((tmp_path / "out" / "ste.csv").read_text().splitlines()) == 8


# --- edited by hand --------------------------------------------------------------------------------------------------


def test_a_changed_number_in_any_dataset_is_refused(small_basis_path, basis, original, tally):
    for name in names_of(basis, "dataset"):
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
            check(basis, original, tally, "a number edited", words)


def test_a_changed_or_removed_attribute_is_refused(small_basis_path, basis, original, tally):
    own = {"schema": "is", "schema_version": "is"}
    for name in names_of(basis, "attribute"):
        for new in ("edited", None):
            shutil.copy(small_basis_path, basis)

            def change(file, name=name, new=new):
                del file.attrs[name]
                if new is not None:
                    file.attrs[name] = new

            edit(basis, change)
            if name == "descriptions_sha256":  # guards what only `pmor info` shows
                with pytest.raises(FileFormatError, match="descriptions_sha256 does not fit"):
                    file_text(basis)
            else:
                check(basis, original, tally, "an attribute edited", own.get(name, OF_NAMES))


def removed(name):
    def change(file):
        del file[name]

    return change


def renamed(name):
    def change(file):
        file.move(name, name + "_old")

    return change


def replaced(name, make):
    """Replace a dataset by another one with the same attributes."""

    def change(file):
        data, attributes = file[name][()], dict(file[name].attrs)
        del file[name]
        file[name] = make(data)
        file[name].attrs.update(attributes)

    return change


def linked(name):
    def change(file):
        file.move(name, "elsewhere")
        file[name] = h5py.SoftLink("/elsewhere")

    return change


def swapped(name, other):
    def change(file):
        file.move(name, "aside")
        file.move(other, name)
        file.move("aside", other)

    return change


EDITS = {
    "dataset removed": removed("flank/wheel/nodes"),
    "group removed": removed("training"),
    "dataset renamed": renamed("training/phi"),
    "dataset reshaped": replaced("shapes/pinion/force", lambda data: data.T),
    "dataset in single precision": replaced("training/phi", lambda data: data.astype(np.float32)),
    "same bytes of another type": replaced("training/phi", lambda data: data.view(np.int64)),
    "dataset emptied": replaced("training/phi", lambda data: data[:0]),
    "dataset as text": replaced("training/phi", lambda data: "phi"),
    "dataset behind a link": linked("training/phi"),
    "two datasets swapped": swapped("shapes/pinion/displacement", "shapes/wheel/displacement"),
    "dataset added": lambda file: file.create_dataset("more", data=np.zeros(3)),
    "group added": lambda file: file.create_group("more"),
    "attribute added": lambda file: file.attrs.create("note", "checked by me"),
}


@pytest.mark.parametrize("change", EDITS.values(), ids=EDITS.keys())
def test_a_changed_table_of_contents_is_refused(change, basis, original, tally):
    edit(basis, change)
    check(basis, original, tally, "contents edited", OF_NAMES)


def test_an_edited_unit_is_refused_where_units_are_shown(basis, tally):
    edit(basis, lambda file: file["training/torque"].attrs.modify("unit", "N m"))
    with pytest.raises(FileFormatError, match="descriptions_sha256 does not fit"):
        file_text(basis)
    tally["a unit edited", "refused by info"] += 1


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_values_that_are_not_finite_are_refused_even_with_valid_checksums(value, small_basis_path, basis, tally):
    allowed = {"training/ste", "training/force"}  # where full FE did not converge; what online does not read
    for name in names_of(basis, "dataset"):
        shutil.copy(small_basis_path, basis)

        def change(file, name=name):
            data = file[name][()]
            data[(0,) * data.ndim] = value
            field = Field(*(attribute(file[name], word) for word in ("unit", "dims", "description")))
            group, _, last = name.rpartition("/")
            del file[name]
            write(file[group], last, data, field)
            set_attributes(file, **checksums(file))

        with h5py.File(basis) as file:
            if file[name].dtype != float or name in allowed:
                continue
        edit(basis, change)
        with pytest.raises(FileFormatError, match=f"is of no use: /{name} holds values that are not finite"):
            read_basis(basis)
        tally["not finite", "refused"] += 1


def test_numbers_where_training_did_not_converge_are_refused(basis, tally):
    def change(file):
        data = file["training/converged"][()]
        data[0, 0] = False
        del file["training/converged"]
        write(file["training"], "converged", data, Field("1", "torque, angle", "whether full FE converged"))
        set_attributes(file, **checksums(file))

    edit(basis, change)
    with pytest.raises(FileFormatError, match="numbers where it did not converge"):
        read_basis(basis)
    tally["numbers that contradict each other", "refused"] += 1
