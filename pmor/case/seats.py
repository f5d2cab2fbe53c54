"""The stiffness of what has several seats, as a housing or a planet carrier: from a CSV file, or a matrix."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

import numpy as np

from pmor.case.reader import Reader, read_text
from pmor.core.arrays import FloatArray

# Displacements along and rotations about x, y, z.
SEAT = 6
# Difference of the halves of the matrix, and its least eigenvalue, over the largest.
SYMMETRIC, HELD = 1e-6, 1e-12


def read_seats(reader: Reader, section: str, name: Path, seats: int, each: str) -> FloatArray:
    """Read the stiffness of some seats from a CSV file beside a file with `stiffness = "..."` in a section.

    Parameters
    ----------
    each : str
        What has a seat, for messages: "bearing to the housing".

    Raises
    ------
    CaseError
    """
    assert reader.folder is not None
    where = f'[{section}] stiffness = "{name}"'
    text = read_text(reader.folder / name, "CSV file beside the file that names it", f"{reader.where}: {where}")
    try:
        matrix = np.array([[float(cell) for cell in row] for row in csv.reader(io.StringIO(text)) if row])
    except ValueError as error:
        reader.refuse(where, f"must hold numbers, as many in each line ({error}): correct it")
    return checked_stiffness(matrix, seats, each, lambda rule: reader.refuse(where, rule))


def checked_stiffness(matrix: FloatArray, seats: int, each: str, refuse: Callable[[str], NoReturn]) -> FloatArray:
    """Return the stiffness matrix of some seats, its halves made equal; refused where it is none."""
    size = SEAT * seats
    if matrix.shape != (size, size):
        shape = " x ".join(map(str, matrix.shape))
        refuse(f"is {shape}, and must be {size} x {size}: six rows for each {each}")
    largest = np.abs(matrix).max(initial=0.0)
    if not np.isfinite(largest) or np.abs(matrix - matrix.T).max() > SYMMETRIC * largest:
        refuse("must be symmetric and finite: a stiffness matrix is")
    scale = 1.0 / np.sqrt(np.maximum(np.diagonal(matrix), np.finfo(float).tiny))
    if np.diagonal(matrix).min() <= 0.0 or np.linalg.eigvalsh(scale[:, None] * matrix * scale).min() < HELD:
        refuse("must be positive definite: what carries the seats must be held")
    return np.asarray(0.5 * (matrix + matrix.T))
