"""Stiffness or mass of what has several seats, as a housing or a planet carrier: from a CSV file, or a matrix."""

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
# Least eigenvalue of the matrix with a diagonal of 1.
HELD = 1e-12
# Difference of entries that mirror each other, over the root of both entries of the diagonal: seven digits in files.
SYMMETRIC = 1e-6


def read_seats(
    reader: Reader, section: str, name: Path, seats: int, each: str, key: str = "stiffness", size: int | None = None
) -> FloatArray:
    """Read the matrix of some seats from a CSV file beside a file that names it with a key of a section.

    Parameters
    ----------
    each : str
        What has a seat, for messages: "bearing to the housing".
    key : str
        "stiffness", "mass" or "surface".
    size : int, optional
        Of the matrix, where it has more coordinates than those of the seats; 0 is any.

    Raises
    ------
    CaseError
    """
    where = f'[{section}] {key} = "{name}"'
    text = read_text(reader.beside(name, where), "CSV file beside the file that names it", f"{reader.where}: {where}")
    try:
        matrix = np.array([[float(cell) for cell in row] for row in csv.reader(io.StringIO(text)) if row])
    except ValueError as error:
        reader.refuse(where, f"must hold numbers, as many in each line ({error}): correct it")
    return checked_matrix(matrix, seats, each, key, lambda rule: reader.refuse(where, rule), size)


def checked_matrix(
    matrix: FloatArray, seats: int, each: str, key: str, refuse: Callable[[str], NoReturn], size: int | None = None
) -> FloatArray:
    """Return a matrix of some seats as `read_seats` does, its halves made equal; refused where it is none."""
    least = SEAT * seats
    wanted = max(len(matrix), least) if size == 0 else size or least
    if matrix.shape != (wanted, wanted):
        shape = " x ".join(map(str, matrix.shape))
        rows = f"six rows for each {each}" + (", and then those of further coordinates" if wanted > least else "")
        refuse(f"is {shape}, and must be {wanted} x {wanted}: {rows}")
    if not np.isfinite(matrix).all():
        refuse(f"must be finite: a {key} matrix is")
    refuse_half(matrix, refuse)
    sizes = np.abs(np.diagonal(matrix))
    scale = 1.0 / np.sqrt(np.where(sizes > 0.0, sizes, 1.0))
    least_value = np.linalg.eigvalsh(scale[:, None] * matrix * scale).min()
    if key == "stiffness" and (np.diagonal(matrix).min() <= 0.0 or least_value < HELD):
        refuse("must be positive definite: what carries the seats must be held")
    if np.diagonal(matrix).min() < 0.0 or least_value < -SYMMETRIC:
        refuse("must not be negative: a motion of the seats has some energy, or none")
    return np.asarray(0.5 * (matrix + matrix.T))


def refuse_half(matrix: FloatArray, refuse: Callable[[str], NoReturn]) -> None:
    """Refuse a stiffness matrix whose halves differ, whatever the units of its rows."""
    scale = np.sqrt(np.maximum(np.abs(np.diagonal(matrix)), np.finfo(float).tiny))
    apart = np.abs(matrix - matrix.T) / scale / scale[:, None]
    row, column = (int(n) for n in np.unravel_index(apart.argmax(), apart.shape))
    if apart[row, column] > SYMMETRIC:
        one, other = matrix[row, column], matrix[column, row]
        place = f"row {row + 1} has {one:g} in column {column + 1}, row {column + 1} has {other:g} in column {row + 1}"
        refuse(f"must be symmetric, and {place}: write both halves")
