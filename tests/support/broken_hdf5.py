"""Ways to break one of our HDF5 files with the library itself, checksums made anew: as somebody would on purpose."""

import hashlib
from contextlib import suppress

import h5py
import numpy as np

from pmor.storage.hdf5 import set_attributes
from pmor.storage.seal import CONTENTS, DESCRIPTIONS, checksums
from pmor.storage.structure import Damaged

ODD_TYPES = ["f4", "f2", ">f8", "i8", "i4", "u1", "?", "c16", "S8"]
ODD_NUMBERS = [0.0, -1.0, 1.0, np.nan, np.inf, -np.inf, 1e308, -1e308, 5e-324, 1e-9, 1e9]
ODD_INTEGERS = [0, -1, 1, 2, 7, 10**6, 2**31, 2**62, -(2**63)]
ODD_TEXTS = ["", "x", "../../..", "/etc", "\x1b[31mred\x1b[0m", "\r\n\n", "a\0b", "\udcff", "ä" * 40, "x" * 60_000,
             "1e3", "nan"]  # fmt: skip


def datasets_of(file):
    """Those that can be read: a virtual one may be made of itself, which the library follows until it dies.

    Neither are terabytes that were declared and never written.
    """
    return _names(
        file, lambda item: isinstance(item, h5py.Dataset) and not item.is_virtual and (item.size or 0) < 10**7
    )


def groups_of(file):
    return _names(file, lambda item: isinstance(item, h5py.Group))


def _names(file, wanted):
    found = []
    file.visititems(lambda name, item: found.append(name) if wanted(item) else None)
    return sorted(found)


def replace(file, name, make):
    """Put another dataset in the place of one, with its attributes."""
    attributes = dict(file[name].attrs)
    del file[name]
    make(name)
    if isinstance(file.get(name), h5py.Dataset):
        for key, value in attributes.items():
            file[name].attrs[key] = value


def put(file, name, **how):
    """Put a dataset of other contents or of another layout in the place of one."""
    replace(file, name, lambda place: file.create_dataset(place, **how))


def with_data(file, name, change):
    put(file, name, data=change(file[name][()]))


def swap(file, first, second):
    file.move(first, "aside")
    file.move(second, first)
    file.move("aside", second)


# --- datasets --------------------------------------------------------------------------------------------------------


def other_type(file, rng, folder):
    kind = some(rng, ODD_TYPES)
    with np.errstate(all="ignore"):
        with_data(file, some(rng, datasets_of(file)), lambda data: data.astype(kind))


def odd_contents(file, rng, folder):
    reference = h5py.ref_dtype if rng.random() < 0.5 else h5py.regionref_dtype
    ways = [
        {"data": "text of any length"}, {"shape": (3,), "dtype": reference},
        {"data": np.zeros(3, [("a", "f8"), ("b", "i4")])}, {"data": h5py.Empty("f8")},
    ]  # fmt: skip
    put(file, some(rng, datasets_of(file)), **some(rng, ways))


def other_shape(file, rng, folder):
    def change(data):
        axis = int(rng.integers(max(data.ndim, 1)))
        ways = [
            lambda: data[()] if data.ndim == 0 else np.take(data, range(data.shape[axis] - 1), axis),
            lambda: np.concatenate([data, data], axis),
            lambda: data.T,
            lambda: data.ravel(),
            lambda: data[None],
            lambda: data.reshape(-1)[:1].reshape(()) if data.size else data,
            lambda: np.take(data, range(0), axis),
            lambda: np.take(data, range(1), axis) if data.size else data,
        ]
        return some(rng, ways)()

    with_data(file, some(rng, datasets_of(file)), change)


def other_order(file, rng, folder):
    def change(data):
        if data.ndim == 0 or data.size == 0:
            return data
        axis = int(rng.integers(data.ndim))
        kind = rng.integers(3)
        if kind == 0:
            return np.flip(data, axis)
        return np.sort(data, axis) if kind == 1 else rng.permutation(data, axis)

    with_data(file, some(rng, datasets_of(file)), change)


def swapped(file, rng, folder):
    names = datasets_of(file)
    first = some(rng, names)
    alike = [name for name in names if name != first and file[name].shape == file[first].shape]
    second = some(rng, alike or names)
    if first != second:
        swap(file, first, second)


def odd_numbers(file, rng, folder):
    """One number, a row or all of them are other than they should be."""

    def change(data):
        odd = some(rng, {"b": [False, True], "i": ODD_INTEGERS}.get(data.dtype.kind, ODD_NUMBERS))
        kind = rng.integers(3)
        if kind == 0 or data.ndim == 0:
            return np.full_like(data, odd)
        if data.size:
            place = tuple(int(rng.integers(n)) for n in data.shape)
            data[place if kind == 1 else place[0]] = odd
        return data

    with_data(file, some(rng, datasets_of(file)), change)


def scaled(file, rng, folder):
    factor = some(rng, [-1.0, 2.0, 1e-3, 1e6, 1.01])
    one = rng.random() < 0.3

    def change(data):
        if data.dtype.kind != "f" or not data.size:
            return data
        if one:
            largest = np.unravel_index(np.nanargmax(np.abs(np.nan_to_num(data))), data.shape)
            data[largest] *= factor
            return data
        return data * factor

    with_data(file, some(rng, datasets_of(file)), change)


def stored_otherwise(file, rng, folder):
    """The same numbers, or none that need no room: packed, in pieces, elsewhere, made up."""
    name = some(rng, datasets_of(file))
    data = file[name][()]
    if data.ndim == 0 or data.size == 0:
        return
    kind = rng.integers(6)
    if kind == 0:
        put(file, name, data=data, compression="gzip")
    elif kind == 1:
        put(file, name, data=data, chunks=True, maxshape=(None,) * data.ndim)
    elif kind == 2:  # gigabytes of nothing
        shape, chunks = (int(rng.integers(10**6, 4 * 10**8)), *data.shape[1:]), (1000, *data.shape[1:])
        put(file, name, shape=shape, dtype=data.dtype, chunks=chunks, fillvalue=1, compression="gzip")
    elif kind == 3:  # declared, never written
        shape = (int(rng.integers(1, 10**8)), *data.shape[1:]) if rng.random() < 0.7 else data.shape
        put(file, name, shape=shape, dtype=data.dtype)
    elif kind == 4:
        elsewhere = folder / "elsewhere.raw"
        elsewhere.write_bytes(data.tobytes())
        external = [(str(elsewhere), 0, h5py.h5f.UNLIMITED)]
        put(file, name, shape=data.shape, dtype=data.dtype, external=external)
    else:
        source = h5py.VirtualSource(str(folder / "basis.h5"), name, data.shape, data.dtype)
        made_up = h5py.VirtualLayout(data.shape, data.dtype)
        made_up[...] = source
        replace(file, name, lambda place: file.create_virtual_dataset(place, made_up))


# --- the table of contents -------------------------------------------------------------------------------------------


def linked(file, rng, folder):
    name = some(rng, [*datasets_of(file), *groups_of(file)])
    kind = rng.integers(6)
    if kind == 0:
        file.move(name, "elsewhere")
        file[name] = h5py.SoftLink("/elsewhere")
    elif kind == 1:
        del file[name]
        file[name] = h5py.ExternalLink(str(folder / "other.h5"), f"/{name}")
    elif kind == 2:
        file[f"{name.rpartition('/')[0]}/again"] = file[name]
    elif kind == 3:  # a loop
        back = file["/"] if rng.random() < 0.5 else file[some(rng, groups_of(file))]
        file[some(rng, groups_of(file)) + "/loop"] = back
    elif kind == 4:
        file["dangling"] = h5py.SoftLink("/nowhere")
    else:
        del file[name]
        file[name] = h5py.SoftLink(f"/{name}")


def rearranged(file, rng, folder):
    names = [*datasets_of(file), *groups_of(file)]
    name = some(rng, names)
    kind = rng.integers(6)
    if kind == 0:
        del file[name]
    elif kind == 1:
        file.move(name, f"{name}_old")
    elif kind == 2:
        del file[name]
        file.create_group(name)
    elif kind == 3:
        file.create_dataset("more/data", data=np.zeros(int(rng.integers(5))))
    elif kind == 4:
        file["kind"] = np.dtype("f8")
    else:
        deep = "/".join(["down"] * int(rng.integers(2, 400)))
        file.create_group(deep)


# --- attributes ------------------------------------------------------------------------------------------------------


def attributes(file, rng, folder):
    places = ["/", *datasets_of(file), *groups_of(file)]
    item = file["/" if rng.random() < 0.5 else some(rng, places)]
    names = [name for name in item.attrs if name not in (CONTENTS, DESCRIPTIONS, "sha256")] or ["extra"]
    name = some(rng, names) if rng.random() < 0.9 else "extra"
    old = item.attrs.get(name)
    kind = rng.integers(8)
    if name in item.attrs:
        del item.attrs[name]
    if kind == 0:
        return
    text = some(rng, ODD_TEXTS)
    if kind == 1:
        item.attrs[name] = some(rng, ODD_NUMBERS)
    elif kind == 2:
        item.attrs[name] = some(rng, ODD_INTEGERS)
    elif kind == 3:
        item.attrs.create(name, np.bytes_(text.encode(errors="surrogateescape") or b"\0"))
    elif kind == 4:
        item.attrs[name] = text.encode(errors="replace").decode().replace("\0", "0")
    elif kind == 5:
        item.attrs[name] = np.arange(int(rng.integers(1, 5000)), dtype=float)
    elif kind == 6:
        item.attrs[name] = h5py.Empty("f8") if rng.random() < 0.5 else file.ref
    elif isinstance(old, np.number | np.bool_) and not isinstance(old, np.bool_):
        item.attrs[name] = type(old)(old + 1)
    else:
        item.attrs[name] = not old if isinstance(old, np.bool_) else np.bool_(True)


def case_text(file, rng, folder):
    """Another case text, with its own checksum: the rest of the file does not belong to it."""
    if "case_text" not in file.attrs:
        return
    text = file.attrs["case_text"].decode()
    lines = text.splitlines()
    at = int(rng.integers(len(lines)))
    ways = [
        lambda: lines[:at] + lines[at + 1 :],
        lambda: [line.replace("4.0", "5.0") for line in lines],
        lambda: [line.replace("21", "22") for line in lines],
        lambda: [line.replace("direct", "line") for line in lines],
        lambda: [*lines, "[friction]"],
        lambda: [*lines[:at], "\x1b[31m = 1", *lines[at:]],
        lambda: lines[:at],
    ]
    text = "\n".join(some(rng, ways)()) + "\n"
    set_attributes(file, case_text=text, case_sha256=hashlib.sha256(text.encode()).hexdigest())


BREAKS = (
    other_type, odd_contents, other_shape, other_order, swapped, odd_numbers, odd_numbers, scaled, stored_otherwise,
    linked, rearranged, attributes, attributes, case_text,
)  # fmt: skip


def break_file(path, rng):
    """Break a file in one to three ways and make its checksums anew: the names of the ways."""
    done = []
    with h5py.File(path, "r+") as file:
        for _ in range(1 + int(rng.random() < 0.2) + int(rng.random() < 0.1)):
            way = some(rng, BREAKS)
            try:
                way(file, rng, path.parent)
            except (KeyError, ValueError, TypeError, AttributeError, OSError, RuntimeError, OverflowError) as error:
                done.append(f"{way.__name__}, not done ({type(error).__name__})")
                continue  # what the first way left does not allow the second
            done.append(way.__name__)
        reseal(file)
    return done


def reseal(file):
    """Make all checksums anew, as far as what is there has any."""

    def checksum(name, item):
        plain = isinstance(item, h5py.Dataset) and item.dtype.kind in "fiub?cSV" and item.shape is not None
        if plain and not item.is_virtual and item.size < 10**6 and "sha256" in item.attrs:
            data = np.ascontiguousarray(item[()])
            set_attributes(item, sha256=hashlib.sha256(data.tobytes()).hexdigest())

    file.visititems(checksum)
    for name in (CONTENTS, DESCRIPTIONS):
        if name in file.attrs:
            del file.attrs[name]
    with suppress(Damaged):  # of links and loops, which are refused before any seal is read
        set_attributes(file, **checksums(file))


def some(rng, choices):
    return choices[rng.integers(len(choices))]
