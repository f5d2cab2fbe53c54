"""Structure of our HDF5 files: groups, datasets and attributes of the plainest kinds, and nothing else.

The format knows links to other files, numbers that are made up where none are stored, data that unpack to thousands of
times their size, and loops. Nothing of that is needed, and all of it is refused before a byte of a dataset is read: a
file takes no more memory than its length.
"""

from __future__ import annotations

import math

import h5py
from h5py import h5a, h5d, h5o, h5s

Items = dict[str, h5py.Group | h5py.Dataset]
# Attributes by which HDF5 refers from an array to the coordinates of its axes, for other programs. They are never read
# here: the library follows damaged references without end.
AXES = ("DIMENSION_LIST", "REFERENCE_LIST")


class Damaged(Exception):
    """A defect of the open file; `pmor.storage.hdf5.open_checked` adds its name and the remedy."""


def items_of(file: h5py.File) -> Items:
    """Return all groups and datasets of a file by their names, in their order; the file itself is ``/``.

    Raises
    ------
    Damaged
        When there is a link, a loop, a second name of something, or something that is neither group nor dataset.
    """
    items: Items = {"/": file}
    places = {h5o.get_info(file.id).addr}

    def visit(group: h5py.Group, prefix: str) -> None:
        for name in sorted(group):
            path = f"{prefix}{name}"
            if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                raise Damaged(f"is of no use: {path} is a link to somewhere else")
            item = group[name]
            place = h5o.get_info(item.id).addr
            if place in places:
                raise Damaged(f"is of no use: {path} is a second name of something else in it")
            places.add(place)
            if not isinstance(item, h5py.Group | h5py.Dataset):
                raise Damaged(f"is of no use: {path} is neither a group nor a dataset")
            items[path] = item
            if isinstance(item, h5py.Group):
                visit(item, f"{path}/")

    visit(file, "")
    return items


def check_plain(items: Items, file_size: int) -> None:
    """Raise Damaged for attributes and datasets that are not stored byte by byte.

    Parameters
    ----------
    items : dict
        As `items_of` gives them.
    file_size : int
        Bytes.
    """
    total = 0
    for path, item in items.items():
        for name in set(item.attrs) - set(AXES):
            _check_attribute(h5a.open(item.id, name.encode()), f"the attribute {name} of {path}")
        if isinstance(item, h5py.Dataset):
            total += _checked_size(item, path)
    if total > file_size:
        raise Damaged(f"is of no use: its datasets would need {total} bytes, and the file has {file_size}")


def _check_attribute(attribute: h5a.AttrID, place: str) -> None:
    scalar = attribute.get_space().get_simple_extent_type() == h5s.SCALAR
    if not scalar or attribute.dtype.kind not in "iufbS":
        raise Damaged(f"is of no use: {place} is neither a number nor text of a fixed length")


def _checked_size(dataset: h5py.Dataset, path: str) -> int:
    """Bytes of a dataset, all stored in the file."""
    properties = dataset.id.get_create_plist()
    plain = (
        dataset.id.get_space().get_simple_extent_type() in (h5s.SIMPLE, h5s.SCALAR)
        and dataset.dtype.kind in "iufb"
        and properties.get_layout() in (h5d.CONTIGUOUS, h5d.COMPACT)
        and properties.get_external_count() == 0
        and properties.get_nfilters() == 0
    )
    size = math.prod(dataset.shape or ()) * dataset.dtype.itemsize
    if not plain or dataset.id.get_storage_size() != size:
        raise Damaged(f"is of no use: {path} is not stored number by number")
    return size
