"""Files that were edited by hand are refused, each edit in its own words, even where the checksums were made anew."""

import shutil

import h5py
import numpy as np
import pytest

from pmor.core.errors import FileFormatError
from pmor.storage.describe import file_text
from pmor.storage.hdf5 import set_attributes
from tests.support.broken_files import edit
from tests.support.broken_hdf5 import datasets_of, swap
from tests.support.refusals import end_of

OF_DATA = "is damaged, or was edited by hand: the checksum of"
OF_NAMES = "is damaged, or was edited by hand: contents_sha256 does not fit"


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
