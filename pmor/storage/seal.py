"""Checksums over everything in an HDF5 file but the bytes of its datasets, which carry their own.

So a file can be trusted after reading only its few kilobytes of attributes, and each dataset when it is read. The words
that explain a dataset to people have a checksum apart: they are most of the attributes, and no computation needs them.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable
from typing import Any

import h5py
import numpy as np

from pmor.storage.structure import AXES, items_of

CONTENTS, DESCRIPTIONS = "contents_sha256", "descriptions_sha256"
EXPLANATIONS = ("unit", "dims", "description")


def checksums(file: h5py.File) -> dict[str, str]:
    """Return the root attributes that seal a file that is complete."""
    contents, descriptions = _checksums(file, _is_content, _is_explanation)
    return {CONTENTS: contents, DESCRIPTIONS: descriptions}


def contents_checksum(file: h5py.File) -> str:
    """Return the SHA-256, in hex, of names, shapes, types and attributes of all groups and datasets.

    The datasets' own checksums are among their attributes, so no dataset can be exchanged, added or left out. The seal
    itself, the explanations, and the references between axes do not count.
    """
    return _checksums(file, _is_content)[0]


def descriptions_checksum(file: h5py.File) -> str:
    """Return the SHA-256, in hex, of the explanations of all datasets."""
    return _checksums(file, _is_explanation)[0]


def _is_content(key: str) -> bool:
    return key not in (CONTENTS, DESCRIPTIONS, *EXPLANATIONS)


def _is_explanation(key: str) -> bool:
    return key in EXPLANATIONS


def _checksums(file: h5py.File, *counts: Callable[[str], bool]) -> list[str]:
    """Of one walk through the file, a digest for each choice of attributes."""
    digests = [hashlib.sha256() for _ in counts]

    def add(to: Iterable[Any], *words: str | bytes) -> None:
        for word in words:
            data = word.encode() if isinstance(word, str) else word
            for digest in to:
                # With its length in front, no word can pass for the end of another.
                digest.update(f"{len(data)}:".encode() + data)

    for name, item in items_of(file).items():
        add(digests, name)
        if isinstance(item, h5py.Dataset):
            add(digests, item.dtype.str, str(item.shape))
        attributes = item.attrs
        for key in sorted(attributes):
            asked = [digest for digest, wanted in zip(digests, counts, strict=True) if wanted(key)]
            if key not in AXES and asked:
                add(asked, key, *_words(attributes[key]))
    return [digest.hexdigest() for digest in digests]


def _words(value: object) -> tuple[str | bytes, ...]:
    if isinstance(value, str):
        return "text", value
    array = np.asarray(value)
    return array.dtype.str, str(array.shape), array.tobytes()
