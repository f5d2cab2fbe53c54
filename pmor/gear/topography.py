"""Measured or designed flanks as amounts on a grid of roll angles and places over the width."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass

from pmor.core.errors import CaseError
from pmor.core.shown import brief

# Points beyond which a grid is a slip: no machine measures so many, and they are kept with every result.
MOST_POINTS = 250_000
LARGEST_UM = 1000.0
# Range of a bicubic over that of its points: a quarter of a step on either side, along both directions.
SWING = 1.5**2


@brief
@dataclass(frozen=True, repr=False)
class Topography:
    """Amounts on a grid; equal where all numbers are.

    Parameters
    ----------
    roll_deg : tuple of float
        Roll angles of its rows, ascending, deg.
    z_mm : tuple of float
        Places of its columns from the gear's own mid width, ascending, mm.
    amount_um : tuple of tuple of float
        One row for each roll angle, um along the transverse line of action, positive removes material.

    Raises
    ------
    CaseError
        One line: which number breaks which rule, and the remedy.
    """

    roll_deg: tuple[float, ...]
    z_mm: tuple[float, ...]
    amount_um: tuple[tuple[float, ...], ...]

    def __post_init__(self) -> None:
        """Refuse a grid that is none."""
        _check_axis(self.roll_deg, "roll angle", "deg", "the first column")
        _check_axis(self.z_mm, "z", "mm", "the first row")
        if len(self.roll_deg) * len(self.z_mm) > MOST_POINTS:
            raise CaseError(
                f"{len(self.roll_deg)} x {len(self.z_mm)} points, more than {MOST_POINTS}: thin the grid out"
            )
        if len(self.amount_um) != len(self.roll_deg):
            raise CaseError(
                f"{len(self.amount_um)} rows of amounts for {len(self.roll_deg)} roll angles: give one for each"
            )
        for roll, row in zip(self.roll_deg, self.amount_um, strict=True):
            if len(row) != len(self.z_mm):
                raise CaseError(
                    f"{len(row)} amounts at the roll angle {roll:g} deg for {len(self.z_mm)} places z: give one each"
                )
            for z, amount in zip(self.z_mm, row, strict=True):
                if not abs(amount) <= LARGEST_UM:  # nan too
                    raise CaseError(
                        f"amount {amount:g} um at roll angle {roll:g} deg, z = {z:g} mm: must be between "
                        f"{-LARGEST_UM:g} and {LARGEST_UM:g} (um): correct it"
                    )

    def __repr__(self) -> str:
        return (
            f"<Topography: {len(self.roll_deg)} x {len(self.z_mm)} points, {self.roll_deg[0]:g} to "
            f"{self.roll_deg[-1]:g} deg, {self.z_mm[0]:g} to {self.z_mm[-1]:g} mm>"
        )

    @property
    def mirrored(self) -> bool:
        """Whether both halves of the face are alike, to the last digits that a file may round."""
        places = all(math.isclose(z, -other, abs_tol=1e-9) for z, other in zip(self.z_mm, self.z_mm[::-1], strict=True))
        return places and all(row == row[::-1] for row in self.amount_um)

    @property
    def even(self) -> bool:
        """Whether all sections over the width are alike."""
        return all(amount == row[0] for row in self.amount_um for amount in row)

    @property
    def largest_um(self) -> float:
        """Most that it can deviate between any two places, um: a bicubic swings beyond its points."""
        amounts = [amount for row in self.amount_um for amount in row]
        return SWING * (max(*amounts, 0.0) - min(*amounts, 0.0))


def read_topography(text: str) -> Topography:
    """Read a topography from CSV text: places z (mm) in the first row, roll angles (deg) in the first column.

    The corner's cell may hold anything. Commas, semicolons or tabs part the cells.

    Raises
    ------
    CaseError
        One line: cell, allowed values, remedy.
    """
    lines = [line for line in text.splitlines() if line.strip(" \t,;")]
    if not lines:
        raise CaseError("is empty: give places z in the first row, roll angles in the first column, amounts in um")
    rows = list(csv.reader(lines, delimiter=_delimiter(lines[0])))
    if len(rows) < 3 or len(rows[0]) < 3:
        raise CaseError(
            f"{max(len(rows) - 1, 0)} x {max(len(rows[0]) - 1, 0)} points: at least 2 x 2 are needed: give places z in "
            "the first row, roll angles in the first column"
        )
    numbers = [[_number(cell, i, k) for k, cell in enumerate(row) if i or k] for i, row in enumerate(rows)]
    return Topography(
        roll_deg=tuple(row[0] for row in numbers[1:]),
        z_mm=tuple(numbers[0]),
        amount_um=tuple(tuple(row[1:]) for row in numbers[1:]),
    )


def _delimiter(line: str) -> str:
    return next((mark for mark in (";", "\t") if mark in line), ",")


def _number(cell: str, row: int, column: int) -> float:
    try:
        return float(cell)
    except ValueError:
        what = "a place z in mm" if row == 0 else "a roll angle in deg" if column == 0 else "an amount in um"
        shown = f'"{cell.strip()}"' if cell.strip() else "an empty cell"
        raise CaseError(
            f"row {row + 1}, column {column + 1}: {shown} is not a number: write {what}, with a decimal point"
        ) from None


def _check_axis(values: tuple[float, ...], name: str, unit: str, place: str) -> None:
    if len(values) < 2:
        raise CaseError(f"{len(values)} value of {name} in {place}: at least 2 x 2 points are needed")
    for value in values:
        if not math.isfinite(value):
            raise CaseError(f"{name} = {value} in {place}: must be a finite number ({unit}): correct it")
    for before, after in zip(values[:-1], values[1:], strict=True):
        if after <= before:
            raise CaseError(
                f"{name} = {after:g} {unit} follows {before:g} in {place}: must ascend: sort them, and leave none twice"
            )
