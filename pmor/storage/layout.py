"""Layout of a kind of file: each dataset by its name, with type, axes, allowed values, unit and meaning.

One table serves writing, which takes the descriptions from it, and reading, which refuses all that differs: names,
types and shapes before anything is read, values before they are used.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import h5py
import numpy as np

from pmor.storage.structure import Damaged, Items

KINDS = {float: np.dtype(np.float64), int: np.dtype(np.int64), bool: np.dtype(np.bool_)}


# Far above all results in mm, N, MPa and their products; its squares are still finite.
LARGEST = 1e30


@dataclass(frozen=True)
class Field:
    """A dataset.

    Parameters
    ----------
    dims : str
        Names of its axes. Axes of one name have one length: in all of the file where the length is known beforehand,
        else within the group.
    kind : type
        float (64 bits), int (64 bits) or bool.
    finite : bool
        Whether NaN and infinity are refused.
    increasing : bool
        Along the last axis.
    least, most : float
        Bounds of the values, which belong to them.
    optional : bool
        Whether the file may be without it.
    """

    unit: str
    dims: str
    description: str
    kind: type = float
    finite: bool = True
    increasing: bool = False
    least: float = -LARGEST
    most: float = LARGEST
    optional: bool = False


Layout = Mapping[str, Field]


def check_layout(items: Items, layout: Layout, sizes: Mapping[str, int]) -> None:
    """Compare names, types and shapes of a file's datasets with a layout; no data are read; Damaged where one differs.

    Parameters
    ----------
    items : dict
        All groups and datasets (`pmor.storage.structure.items_of`).
    layout : mapping of str to Field
        By the path in the file.
    sizes : mapping of str to int
        Lengths of axes that are known beforehand.
    """
    datasets = {path: item for path, item in items.items() if isinstance(item, h5py.Dataset)}
    for path in datasets:
        if path not in layout:
            raise Damaged(f"is of no use: it has the dataset {path}, which does not belong there")
    lengths: dict[tuple[str, str], int] = {}
    for path, field in layout.items():
        if path not in datasets:
            if not field.optional:
                raise Damaged(f"is incomplete or outdated: the dataset {path} is missing")
            continue
        dataset, names = datasets[path], field.dims.split(", ")
        if dataset.dtype != KINDS[field.kind]:
            raise Damaged(f"is of no use: {path} holds values of the type {dataset.dtype}, not {KINDS[field.kind]}")
        group = path.rpartition("/")[0]
        expected = [
            sizes.get(name, lengths.get((group, name), length))
            for name, length in zip(names, dataset.shape, strict=False)
        ]
        if len(dataset.shape) != len(names) or list(dataset.shape) != expected:
            raise Damaged(f"is of no use: {path} has the shape {dataset.shape}; it should be {field.dims}: {expected}")
        lengths |= {(group, name): length for name, length in zip(names, dataset.shape, strict=True)}


def check_values(path: str, array: np.ndarray, field: Field) -> None:
    """Compare the values of a dataset with the bounds of its field; Damaged where one is beyond."""
    known = np.isfinite(array)
    if field.finite and not known.all():
        raise Damaged(f"is of no use: {path} holds values that are not finite")
    if np.isinf(array).any() or (array[known] < field.least).any() or (array[known] > field.most).any():
        raise Damaged(f"is of no use: {path} holds values beyond {field.least:g} to {field.most:g} {field.unit}")
    if field.increasing and not (np.diff(array) > 0).all():
        raise Damaged(f"is of no use: the values of {path} do not increase")


def require(holds: Any, what: str) -> None:
    """Raise Damaged with a reason unless a condition holds."""
    if not holds:
        raise Damaged(f"is of no use: {what}")
