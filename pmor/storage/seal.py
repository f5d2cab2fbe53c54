"""Checksums over everything in an HDF5 file but the bytes of its datasets, which carry their own.

So a file can be trusted after reading only its few kilobytes of attributes, and each dataset when it is read. The words
that explain a dataset to people have a checksum apart: they are most of the attributes, and no computation needs them.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable

import h5py
import numpy as np

from pmor.storage.structure import AXES, items_of

CONTENTS, DESCRIPTIONS = "contents_sha256", "descriptions_sha256"
EXPLANATIONS = ("unit", "dims", "description")


def checksums(file: h5py.File) -> dict[str, str]:
    """Return the root attributes that seal a file that is complete."""
    return {CONTENTS: contents_checksum(file), DESCRIPTIONS: descriptions_checksum(file)}


def contents_checksum(file: h5py.File) -> str:
    """Return the SHA-256, in hex, of names, shapes, types and attributes of all groups and datasets.

    The datasets' own checksums are among their attributes, so no dataset can be exchanged, added or left out. The seal
    itself, the explanations, and the references between axes do not count.
    """
    return _checksum(file, lambda key: key not in (CONTENTS, DESCRIPTIONS, *EXPLANATIONS))


def descriptions_checksum(file: h5py.File) -> str:
    """Return the SHA-256, in hex, of the explanations of all datasets."""
    return _checksum(file, lambda key: key in EXPLANATIONS)


def _checksum(file: h5py.File, counts: Callable[[str], bool]) -> str:
    digest = hashlib.sha256()

    def add(*words: str | bytes) -> None:
        for word in words:
            data = word.encode() if isinstance(word, str) else word
            # With its length in front, no word can pass for the end of another.
            digest.update(f"{len(data)}:".encode() + data)

    for name, item in items_of(file).items():
        add(name)
        if isinstance(item, h5py.Dataset):
            add(item.dtype.str, str(item.shape))
        for key in sorted(item.attrs):
            if key not in AXES and counts(key):
                add(key, *_words(item.attrs[key]))
    return digest.hexdigest()


def _words(value: object) -> tuple[str | bytes, ...]:
    if isinstance(value, str):
        return "text", value
    array = np.asarray(value)
    return array.dtype.str, str(array.shape), array.tobytes()
