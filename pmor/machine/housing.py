"""The stiffness of the housing at the seats of its bearings: from a CSV file, or a matrix that a REXS file has."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

import numpy as np

from pmor.body.beam import NODE
from pmor.case.reader import Reader, read_text
from pmor.core.arrays import FloatArray

# Difference of the halves of the matrix, and its least eigenvalue, over the largest.
SYMMETRIC, HELD = 1e-6, 1e-12


def read_housing(reader: Reader, name: Path, seats: int) -> FloatArray:
    """Read the stiffness of some seats from a CSV file beside the gearbox file.

    Raises
    ------
    CaseError
    """
    assert reader.folder is not None
    where = f'[housing] stiffness = "{name}"'
    text = read_text(reader.folder / name, "CSV file beside the gearbox file", f"{reader.where}: {where}")
    try:
        matrix = np.array([[float(cell) for cell in row] for row in csv.reader(io.StringIO(text)) if row])
    except ValueError as error:
        reader.refuse(where, f"must hold numbers, as many in each line ({error}): correct it")
    return checked_stiffness(matrix, seats, lambda rule: reader.refuse(where, rule))


def checked_stiffness(matrix: FloatArray, seats: int, refuse: Callable[[str], NoReturn]) -> FloatArray:
    """Return the stiffness matrix of some seats, its halves made equal; refused where it is none."""
    size = NODE * seats
    if matrix.shape != (size, size):
        shape = " x ".join(map(str, matrix.shape))
        refuse(f"is {shape}, and must be {size} x {size}: six rows for each bearing to the housing")
    largest = np.abs(matrix).max(initial=0.0)
    if not np.isfinite(largest) or np.abs(matrix - matrix.T).max() > SYMMETRIC * largest:
        refuse("must be symmetric and finite: a stiffness matrix is")
    scale = 1.0 / np.sqrt(np.maximum(np.diagonal(matrix), np.finfo(float).tiny))
    if np.diagonal(matrix).min() <= 0.0 or np.linalg.eigvalsh(scale[:, None] * matrix * scale).min() < HELD:
        refuse("must be positive definite: hold the housing at its feet")
    return np.asarray(0.5 * (matrix + matrix.T))
