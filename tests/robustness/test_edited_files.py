"""Files that were edited by hand are refused, each edit in its own words, even where the checksums were made anew."""

import shutil

import h5py
import numpy as np
import pytest

from pmor.core.errors import FileFormatError
from pmor.storage.basis_file import read_basis
from pmor.storage.describe import file_text
from pmor.storage.hdf5 import Field, attribute, set_attributes, write
from pmor.storage.seal import checksums
from tests.support.refusals import check, edit, names_of

OF_DATA = "is damaged, or was edited by hand: the checksum of"
OF_NAMES = "is damaged, or was edited by hand: contents_sha256 does not fit"


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
                    set_attributes(file, **{name: new})

            edit(basis, change)
            if name == "descriptions_sha256":  # guards what only `pmor info` shows
                with pytest.raises(FileFormatError, match="descriptions_sha256 does not fit"):
                    file_text(basis)
            else:
                check(basis, original, tally, "an attribute edited", own.get(name, OF_NAMES))


def swapped(name, other):
    def change(file):
        file.move(name, "aside")
        file.move(other, name)
        file.move("aside", other)

    return change


# Of many more kinds at random: test_fuzz.
EDITS = {
    "dataset removed": lambda file: file.__delitem__("flank/wheel/nodes"),
    "dataset renamed": lambda file: file.move("training/phi", "training/phi_old"),
    "two datasets swapped": swapped("shapes/pinion/displacement", "shapes/wheel/displacement"),
    "dataset added": lambda file: file.create_dataset("more", data=np.zeros(3)),
    "attribute added": lambda file: set_attributes(file, note="checked by me"),
}


@pytest.mark.parametrize("change", EDITS.values(), ids=EDITS.keys())
def test_a_changed_table_of_contents_is_refused(change, basis, original, tally):
    edit(basis, change)
    check(basis, original, tally, "contents edited", OF_NAMES)


def test_an_edited_unit_is_refused_where_units_are_shown(basis, tally):
    edit(basis, lambda file: file["training/ste"].attrs.modify("unit", "mm"))
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
