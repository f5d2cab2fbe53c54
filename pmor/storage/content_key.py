"""Digests of contents, by which kept pieces of work are found again."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from pmor.core.version import __version__


def key_of(*parts: Any) -> str:
    """Return the SHA-256, in hex, of arrays, numbers, text and dataclasses of them, and of the program's version."""
    digest = hashlib.sha256()
    for data in _bytes_of((__version__, *parts)):
        digest.update(f"{len(data)}:".encode())
        digest.update(data)
    return digest.hexdigest()


def _bytes_of(value: Any) -> Iterable[bytes]:
    if isinstance(value, np.ndarray):
        yield f"{value.dtype.str} {value.shape}".encode()
        yield np.ascontiguousarray(value).tobytes()
    elif is_dataclass(value):
        yield type(value).__name__.encode()
        for item in fields(value):
            yield item.name.encode()
            yield from _bytes_of(getattr(value, item.name))
    elif isinstance(value, tuple):
        yield f"{len(value)} items".encode()
        for item in value:
            yield from _bytes_of(item)
    else:
        yield repr(value).encode()
