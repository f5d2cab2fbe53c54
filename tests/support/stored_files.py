"""What the tests of stored files share: conditions to store, and damages."""

import h5py

from pmor.gear.condition import Condition, Misalignment
from pmor.storage.manifest import MANIFEST


def results_in(folder):
    """Names of what a command left in a folder; the manifest goes without saying."""
    return {path.name for path in folder.iterdir()} - {MANIFEST}


def some_conditions(rng, count):
    return tuple(Condition(torque=rng.random(), misalignment=Misalignment(*rng.normal(size=3))) for _ in range(count))


def is_missing(path):
    path.unlink()


def is_truncated(path):
    path.write_bytes(path.read_bytes()[:-200])


def is_half(path):
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def is_empty(path):
    path.write_bytes(b"")


def is_text(path):
    path.write_text("phi_rad, ste_um\n")


def is_a_folder(path):
    path.unlink()
    path.mkdir()


def set_attribute(name, value):
    def damage(path):
        with h5py.File(path, "r+") as file:
            file.attrs[name] = value

    return damage


def lacks(name):
    def damage(path):
        with h5py.File(path, "r+") as file:
            del (file.attrs if name in file.attrs else file)[name]

    return damage


def flip_a_byte(path, dataset):
    """Change one bit of a dataset's stored numbers, as a failing disk would."""
    with h5py.File(path) as file:
        offset = file[dataset].id.get_offset()
    content = bytearray(path.read_bytes())
    content[offset] ^= 1
    path.write_bytes(content)
