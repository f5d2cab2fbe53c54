"""What becomes of a basis file that was damaged or edited: refused in one line with a remedy, or read as it was."""

import pickle
import signal
from contextlib import contextmanager

import h5py
import pytest

from pmor.core.errors import FileFormatError
from pmor.storage.basis_file import read_basis
from pmor.storage.describe import file_text

HANG = 20  # s


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
