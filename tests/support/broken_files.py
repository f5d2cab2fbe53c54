"""Ways to damage a stored file as disks and people do: the only place that flips bits, cuts off or edits by hand."""

import h5py


def flip_bit(path, place, bit=0):
    """Flip a bit of the byte at a place, as a failing disk would."""
    content = bytearray(path.read_bytes())
    content[place] ^= 1 << int(bit)
    path.write_bytes(content)


def flip_bit_of(dataset):
    """Flip a bit of the stored numbers of a dataset."""

    def damage(path):
        with h5py.File(path) as file:
            offset = file[dataset].id.get_offset()
        flip_bit(path, offset)

    return damage


def is_missing(path):
    path.unlink()


def is_truncated(path):
    path.write_bytes(path.read_bytes()[:-200])


def is_empty(path):
    path.write_bytes(b"")


def is_text(path):
    path.write_text("phi_rad, ste_um\n")


def is_a_folder(path):
    path.unlink()
    path.mkdir()


def edit(path, change):
    """Change an HDF5 file with the library itself, checksums left as they are."""
    with h5py.File(path, "r+") as file:
        change(file)


def set_attribute(name, value):
    return lambda path: edit(path, lambda file: file.attrs.__setitem__(name, value))


def lacks(name):
    return lambda path: edit(path, lambda file: (file.attrs if name in file.attrs else file).__delitem__(name))
